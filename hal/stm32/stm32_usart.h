/* Serial port, 8 bits. Text is sent polled, at start and end. Bytes of the host link are sent one
 * at a time when there is room, and received by interrupt. Each part has its own registers for
 * this: stm32f405/stm32_usart.c, stm32g431/g431_usart.c.
 */
#ifndef STM32_USART_H
#define STM32_USART_H

#include <stdbool.h>
#include <stdint.h>

#include "stm32_registers.h"

/* Polls of "transmit register empty": some bytes' time at 115200 baud and 170 MHz. */
#define STM32_USART_POLLS 20000u

typedef enum {
    STM32_USART_QUIET, /* nothing to send */
    STM32_USART_ROOM,  /* for another byte */
    STM32_USART_DONE   /* the last bit has left */
} stm32_usart_wish_t;

/* Without parity, unless it was asked for before; false when the bus clock does not allow the rate.
 */
bool stm32_usart_start(stm32_usart_t *usart, uint32_t bus_Hz, uint32_t baud);

/* Directly before the start, while the port is off: with even parity. A byte that is on the line
 * when the port begins to listen must not meet another format. */
void stm32_usart_even(stm32_usart_t *usart);

/* False when the transmitter did not take all of it; the rest is dropped. */
bool stm32_usart_send(stm32_usart_t *usart, const char *text);

/* False when the transmitter has no room now. */
bool stm32_usart_put(stm32_usart_t *usart, uint8_t byte);

/* The last bit of what was put has left. */
bool stm32_usart_sent(const stm32_usart_t *usart);

/* A received byte, if any; one with noise or without its stop bit or parity is dropped. Clears
 * every request for the interrupt, including an overrun without a byte. */
bool stm32_usart_receive(stm32_usart_t *usart, uint8_t *byte);

/* From here on a received byte raises the port's interrupt. */
void stm32_usart_interrupt(stm32_usart_t *usart);

/* What of the transmitter raises it as well. */
void stm32_usart_wish(stm32_usart_t *usart, stm32_usart_wish_t wish);

#endif
