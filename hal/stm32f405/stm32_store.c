#include "stm32_store.h"

#include "cm_registers.h"
#include "num.h"
#include "stm32_hang.h"
#include "stm32_map.h"
#include "stm32_watchdog.h"

#define ERASE_MS STM32_WATCHDOG_MAX_MS /* 2/3 of it is more than the 2 s of a sector */

COLD static void begin_silence(const stm32_store_t *store)
{
    cm_irq_off();
    stm32_hang_pause(store->hang);
}

COLD static void end_of_silence(const stm32_store_t *store)
{
    hal_sample_t forgotten;
    stm32_adc_read(store->adcs, &forgotten);
    cm_nvic_forget(STM32_IRQ_ADC);
    *store->behind_late = true;
    stm32_hang_resume(store->hang);
    cm_irq_on();
}

COLD hal_flash_status_t stm32_store_erase(void *context, uint32_t slot)
{
    const stm32_store_t *const store = (const stm32_store_t *)context;
    if (!stm32_watchdog_start(store->iwdg, ERASE_MS)) {
        return HAL_FLASH_FAILED;
    }
    begin_silence(store);
    const hal_flash_status_t status = stm32_slots_erase(&store->slots, slot);
    end_of_silence(store);
    return stm32_watchdog_start(store->iwdg, store->watchdog_ms) ? status : HAL_FLASH_FAILED;
}

COLD hal_flash_status_t stm32_store_program(void *context, uint32_t slot, uint32_t offset,
                                            const uint32_t *words)
{
    const stm32_store_t *const store = (const stm32_store_t *)context;
    begin_silence(store);
    const hal_flash_status_t status = stm32_slots_program(&store->slots, slot, offset, *words);
    end_of_silence(store);
    return status;
}

uint32_t stm32_store_read(void *context, uint32_t slot, uint32_t offset)
{
    return stm32_slots_read(&((const stm32_store_t *)context)->slots, slot, offset);
}
