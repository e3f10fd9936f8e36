/* What the background needs of the part: host link, clock, watchdog, entropy. */
#ifndef STM32_SERVICES_H
#define STM32_SERVICES_H

#include <stdbool.h>
#include <stdint.h>

#include "stm32_inbox.h"
#include "stm32_registers.h"

typedef struct {
    stm32_usart_t *usart; /* of the host link */
    const stm32_tim_t *timebase;
    stm32_iwdg_t *iwdg;
    stm32_rng_t *rng;
    stm32_inbox_t *inbox;
} stm32_services_t;

/* In the interrupt of the serial port: as urgent as the control interrupt, which waits a byte's
 * handling at most, its samples taken. */
void stm32_services_received(const stm32_services_t *services);

/* Operations of hal_devices_t; context: stm32_services_t, which none of them changes. */
bool stm32_services_link_read(void *context, uint8_t *byte);
uint32_t stm32_services_link_write(void *context, const uint8_t *data, uint32_t n);
void stm32_services_watchdog(void *context);
uint32_t stm32_services_clock_us(void *context);
bool stm32_services_entropy(void *context, uint64_t *bits);

/* Until the last bit to the host has left, some bytes' time at most. */
void stm32_services_drain(const stm32_services_t *services);

#endif
