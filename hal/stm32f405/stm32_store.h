/* Flash of the parameter store, for the background, while the drive runs on with the gates off.
 *
 * The core stalls while the flash is busy: control periods may be missing, and the next one may
 * begin at any phase. Interrupts wait, and the watchdog gets the time that an erase takes.
 */
#ifndef STM32_STORE_H
#define STM32_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "hal_devices.h"
#include "stm32_adc.h"
#include "stm32_slots.h"

typedef struct {
    stm32_slots_t slots;
    const stm32_adcs_t *adcs; /* the samples of a missed period are dropped */
    stm32_tim_t *hang;        /* waits meanwhile */
    stm32_iwdg_t *iwdg;
    uint32_t watchdog_ms; /* its usual time */
    bool *behind_late;    /* set: the next period may start off its crest */
} stm32_store_t;

/* Operations of hal_flash_t; context: stm32_store_t. */
hal_flash_status_t stm32_store_erase(void *context, uint32_t slot);
hal_flash_status_t stm32_store_program(void *context, uint32_t slot, uint32_t offset,
                                       const uint32_t *words);
uint32_t stm32_store_read(void *context, uint32_t slot, uint32_t offset);

#endif
