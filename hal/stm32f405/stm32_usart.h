/* Serial port, 8 bits, no parity. Text is sent polled, at start and end. Bytes of the host link are
 * sent one at a time when there is room, and received by interrupt.
 */
#ifndef STM32_USART_H
#define STM32_USART_H

#include <stdbool.h>
#include <stdint.h>

#include "stm32_registers.h"

/* Polls of "transmit register empty": some bytes' time at 115200 baud and 168 MHz. */
#define STM32_USART_POLLS 20000u

/* False when the bus clock does not allow the rate. */
bool stm32_usart_start(stm32_usart_t *usart, uint32_t bus_Hz, uint32_t baud);

/* False when the transmitter did not take all of it; the rest is dropped. */
bool stm32_usart_send(stm32_usart_t *usart, const char *text);

/* False when the transmitter has no room now. */
bool stm32_usart_put(stm32_usart_t *usart, uint8_t byte);

/* A received byte, if any; one with noise or without its stop bit is dropped. Clears every request
 * for the interrupt, including an overrun without a byte. */
bool stm32_usart_receive(stm32_usart_t *usart, uint8_t *byte);

/* From here on a received byte raises the port's interrupt. */
void stm32_usart_interrupt(stm32_usart_t *usart);

#endif
