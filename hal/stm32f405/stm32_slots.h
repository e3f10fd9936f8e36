/* The parameters' two flash sectors as the slots of the store. Each operation waits for its end;
 * the caller takes care of interrupts and watchdog.
 */
#ifndef STM32_SLOTS_H
#define STM32_SLOTS_H

#include "hal_devices.h"
#include "stm32_flash.h"

#define STM32_SLOTS_BYTES 0x20000u /* of each */

typedef struct {
    stm32_flash_t *flash;
    volatile uint32_t *cell[2]; /* where the sectors are read and written */
    uint32_t polls;
} stm32_slots_t;

hal_flash_status_t stm32_slots_erase(const stm32_slots_t *slots, uint32_t slot);
hal_flash_status_t stm32_slots_program(const stm32_slots_t *slots, uint32_t slot, uint32_t offset,
                                       uint32_t word);
uint32_t stm32_slots_read(const stm32_slots_t *slots, uint32_t slot, uint32_t offset);

#endif
