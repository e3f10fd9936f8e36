/* Flash of the parameter store, for the background, while the drive runs on with the gates off.
 *
 * The core stalls while the flash is busy, a page or a double word at a time: control periods may
 * be missing, and the next one may begin at any phase. Interrupts wait, and both watchdogs allow
 * for the time that a page takes.
 */
#ifndef G431_STORE_H
#define G431_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "g431_adc.h"
#include "g431_slots.h"
#include "hal_devices.h"

typedef struct {
    g431_slots_t slots;
    const stm32_tim_t *pwm;  /* nothing is changed while its outputs are on */
    const g431_adcs_t *adcs; /* the samples of a missed period are dropped */
    stm32_tim_t *hang;       /* waits meanwhile */
    stm32_iwdg_t *iwdg;      /* its usual time is more than twice what a page takes */
    stm32_wwdg_t *wwdg;
    bool *behind_late; /* set: the next period may start off its crest */
} g431_store_t;

/* Operations of hal_flash_t; context: g431_store_t. */
hal_flash_status_t g431_store_erase(void *context, uint32_t slot);
hal_flash_status_t g431_store_program(void *context, uint32_t slot, uint32_t offset,
                                      const uint32_t *words);
uint32_t g431_store_read(void *context, uint32_t slot, uint32_t offset);

/* A hal_flash_t of it. */
#define G431_STORE_FLASH(store)                                                                    \
    {                                                                                              \
        .context = (store), .slot_bytes = G431_SLOTS_BYTES, .unit_words = 2u,                      \
        .erased_word = UINT32_MAX, .erase = g431_store_erase, .program = g431_store_program,       \
        .read = g431_store_read                                                                    \
    }

#endif
