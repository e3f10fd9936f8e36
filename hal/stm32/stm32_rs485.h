/* Serial line of a fieldbus: RS-485, 8 bits with even parity, by interrupt.
 *
 * The driver-enable pin is high from before the first bit sent until behind the last. What comes
 * meanwhile is our own echo and is dropped. So is a byte that ends less than a character after the
 * line was switched to hearing. It began before: the last echo, or a frame that was on the line
 * when the port started. Each byte received keeps its time: where a frame ends is for who reads it.
 */
#ifndef STM32_RS485_H
#define STM32_RS485_H

#include <stdbool.h>
#include <stdint.h>

#include "stm32_gpio.h"
#include "stm32_timebase.h"
#include "stm32_usart.h"

#define STM32_RS485_BYTES 256u /* the longest frame; a power of two */

/* Zeroed but for the devices: idle. */
typedef struct {
    stm32_usart_t *usart;
    stm32_gpio_t *port; /* of the driver-enable pin, an output */
    uint32_t pin;
    const stm32_tim_t *timebase;
    uint8_t heard[STM32_RS485_BYTES];
    uint32_t heard_at_us[STM32_RS485_BYTES];
    volatile uint32_t in;
    volatile uint32_t out;
    uint8_t said[STM32_RS485_BYTES];
    uint32_t said_n;
    volatile uint32_t said_at;
    volatile bool says;
    uint32_t character_us;   /* the shortest that a whole byte takes */
    uint32_t hears_since_us; /* when it was switched to hearing */
    bool early;              /* no whole byte can have come since */
} stm32_rs485_t;

/* False when the bus clock does not allow the rate. */
bool stm32_rs485_start(stm32_rs485_t *line, uint32_t bus_Hz, uint32_t baud);

/* In the interrupt of the serial port. */
void stm32_rs485_interrupt(stm32_rs485_t *line);

/* Operations of hal_serial_t; context: stm32_rs485_t. */
bool stm32_rs485_read(void *context, uint8_t *byte, uint32_t *at_us);
uint32_t stm32_rs485_write(void *context, const uint8_t *data, uint32_t n);
uint32_t stm32_rs485_clock_us(void *context);

#endif
