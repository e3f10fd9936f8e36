/* Received bytes, from the interrupt that stores them to the background that takes them. */
#ifndef STM32_INBOX_H
#define STM32_INBOX_H

#include <stdbool.h>
#include <stdint.h>

#define STM32_INBOX_BYTES 256u /* a power of two, more than one request */

/* Each counter has one writer. Zeroed: empty. */
typedef struct {
    uint8_t byte[STM32_INBOX_BYTES];
    volatile uint32_t in;
    volatile uint32_t out;
} stm32_inbox_t;

/* A full inbox drops the byte; the frame's CRC tells. */
void stm32_inbox_put(stm32_inbox_t *inbox, uint8_t byte);

/* False when it is empty. */
bool stm32_inbox_take(stm32_inbox_t *inbox, uint8_t *byte);

#endif
