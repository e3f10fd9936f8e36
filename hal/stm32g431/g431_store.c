#include "g431_store.h"

#include "cm_registers.h"
#include "g431_window.h"
#include "num.h"
#include "stm32_hang.h"
#include "stm32_map.h"
#include "stm32_watchdog.h"

/* The caller ensures it; a drive that stalls with its gates on would be out of control. */
static bool gates_on(const g431_store_t *store)
{
    return (store->pwm->BDTR & TIM_BDTR_MOE) != 0u;
}

COLD static uint32_t begin_silence(const g431_store_t *store)
{
    cm_irq_off();
    stm32_hang_pause(store->hang);
    stm32_watchdog_serve(store->iwdg);
    return g431_window_open(store->wwdg);
}

COLD static void end_of_silence(const g431_store_t *store, uint32_t window)
{
    g431_words_t forgotten;
    g431_adc_read(store->adcs, &forgotten);
    cm_nvic_forget(STM32_IRQ_ADC);
    *store->behind_late = true;
    stm32_watchdog_serve(store->iwdg);
    g431_window_close(store->wwdg, window);
    stm32_hang_resume(store->hang);
    cm_irq_on();
}

COLD hal_flash_status_t g431_store_erase(void *context, uint32_t slot)
{
    g431_store_t *const store = (g431_store_t *)context;
    if (gates_on(store)) {
        return HAL_FLASH_FAILED;
    }
    const uint32_t window = begin_silence(store);
    const hal_flash_status_t status = g431_slots_erase(&store->slots, slot);
    end_of_silence(store, window);
    return status;
}

COLD hal_flash_status_t g431_store_program(void *context, uint32_t slot, uint32_t offset,
                                           const uint32_t *words)
{
    const g431_store_t *const store = (const g431_store_t *)context;
    if (gates_on(store)) {
        return HAL_FLASH_FAILED;
    }
    const uint32_t window = begin_silence(store);
    const hal_flash_status_t status = g431_slots_program(&store->slots, slot, offset, words);
    end_of_silence(store, window);
    return status;
}

uint32_t g431_store_read(void *context, uint32_t slot, uint32_t offset)
{
    return g431_slots_read(&((const g431_store_t *)context)->slots, slot, offset);
}
