/* Saving parameters on a part whose core stalls meanwhile: what both watchdogs, the hang timer and
 * the interrupts are while the flash works. The core's interrupt mask is a fake (fake_core). */
#include "g431_store.h"

#include "cm_registers.h"
#include "g431_window.h"
#include "stm32_hang.h"
#include "stm32_watchdog.h"

#include "unity.h"

#define CLOCK_HZ    170000000u
#define PERIOD_US   200.0
#define PAGE_US     25000.0 /* the longest that a page takes: data sheet, 24.5 ms */
#define WATCHDOG_MS 100u
#define CELLS       (2u * G431_SLOTS_BYTES / 4u)

static stm32_flash_t flash;
static stm32_tim_t tim1;
static stm32_tim_t tim7;
static stm32_iwdg_t iwdg;
static stm32_wwdg_t wwdg;
static stm32_adc_t adc1;
static stm32_adc_t adc2;
static stm32_adc_common_t common;
static const g431_channels_t channels;
static const g431_adcs_t adcs = {&adc1, &adc2, &common, &channels};
static uint32_t cells[CELLS];
static bool behind_late;
static g431_store_t store;

static bool masked;
static uint32_t stalls;
static double window_us; /* until the window watchdog fires, from its last service in the stall */
static bool open;        /* it may be served at any time then */

void cm_irq_off(void)
{
    masked = true;
    iwdg.KR = 0u;
}

/* Behind the work of the flash, before anything is set back. */
void cm_nvic_forget(uint32_t irq)
{
    TEST_ASSERT_EQUAL_UINT32(18u, irq);
    TEST_ASSERT_TRUE(masked);
    TEST_ASSERT_EQUAL_HEX32(0u, tim7.CR1 & TIM_CR1_CEN);
    TEST_ASSERT_EQUAL_HEX32(0xAAAAu, iwdg.KR); /* served in front of the stall */
    TEST_ASSERT_EQUAL_HEX32(FLASH_CR_LOCK, flash.CR);
    const uint32_t divider = (wwdg.CFR >> WWDG_CFR_WDGTB_Pos) & 7u;
    const double counts = (double)((wwdg.CR & 0x7Fu) - 0x3Fu);
    window_us = counts * 4096.0 * (double)(1u << divider) / (CLOCK_HZ * 1e-6);
    open = (wwdg.CFR & WWDG_CFR_W_Msk) == 0x7Fu;
    flash.CR = 0u; /* memory does not open by the keys */
    stalls++;
}

void cm_irq_on(void)
{
    masked = false;
}

void setUp(void)
{
    flash = (stm32_flash_t){0};
    tim1 = (stm32_tim_t){0};
    tim7 = (stm32_tim_t){0};
    iwdg = (stm32_iwdg_t){0};
    wwdg = (stm32_wwdg_t){.CR = WWDG_CR_RESET, .CFR = WWDG_CFR_RESET};
    behind_late = false;
    masked = false;
    stalls = 0u;
    for (uint32_t n = 0u; n < CELLS; n++) {
        cells[n] = UINT32_MAX;
    }
    store = (g431_store_t){.slots = {&flash, cells, 10u},
                           .pwm = &tim1,
                           .adcs = &adcs,
                           .hang = &tim7,
                           .iwdg = &iwdg,
                           .wwdg = &wwdg,
                           .behind_late = &behind_late};
    stm32_hang_start(&tim7, CLOCK_HZ, 500u);
    TEST_ASSERT_TRUE(stm32_watchdog_start(&iwdg, WATCHDOG_MS));
    TEST_ASSERT_TRUE(g431_window_start(&wwdg, CLOCK_HZ, (float)PERIOD_US * 1e-6f));
}

void tearDown(void)
{
}

static void assert_as_before(uint32_t window)
{
    TEST_ASSERT_FALSE(masked);
    TEST_ASSERT_TRUE(behind_late); /* the next control interrupt comes early: it serves nothing */
    TEST_ASSERT_EQUAL_HEX32(TIM_CR1_CEN, tim7.CR1 & TIM_CR1_CEN);
    TEST_ASSERT_EQUAL_UINT32(0u, tim7.CNT);
    TEST_ASSERT_EQUAL_HEX32(window, wwdg.CFR);
    TEST_ASSERT_EQUAL_HEX32(0xFFu, wwdg.CR); /* on, and served */
    TEST_ASSERT_EQUAL_HEX32(0xAAAAu, iwdg.KR);
}

static void test_no_watchdog_fires_while_a_slot_is_erased(void)
{
    const uint32_t window = wwdg.CFR;
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, g431_store_erase(&store, 1u));
    TEST_ASSERT_EQUAL_UINT32(1u, stalls);
    TEST_ASSERT_TRUE(window_us > 2.0 * PAGE_US);
    TEST_ASSERT_TRUE(open);
    assert_as_before(window);
}

/* The independent watchdog's own oscillator may be half as fast again: 2/3 of the nominal time. */
static void test_the_independent_watchdog_outlasts_two_pages(void)
{
    TEST_ASSERT_TRUE(2.0 / 3.0 * 1000.0 * (double)(iwdg.RLR + 1u) > 2.0 * PAGE_US);
}

static void test_no_watchdog_fires_while_words_are_programmed(void)
{
    const uint32_t window = wwdg.CFR;
    const uint32_t words[2] = {1u, 2u};
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, g431_store_program(&store, 1u, 16u, words));
    TEST_ASSERT_TRUE(window_us > 2.0 * PAGE_US);
    assert_as_before(window);
    TEST_ASSERT_EQUAL_UINT32(1u, g431_store_read(&store, 1u, 16u));
    TEST_ASSERT_EQUAL_UINT32(2u, g431_store_read(&store, 1u, 20u));
}

/* A drive that stalls with its gates on is out of control. */
static void test_with_the_gates_on_nothing_is_changed(void)
{
    const uint32_t words[2] = {1u, 2u};
    tim1.BDTR = TIM_BDTR_MOE;
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_store_erase(&store, 0u));
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_store_program(&store, 0u, 0u, words));
    TEST_ASSERT_EQUAL_UINT32(0u, stalls);
    TEST_ASSERT_EQUAL_HEX32(0u, flash.KEYR);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, cells[0]);
}

/* Before the drive runs (a store that is repaired at start) there is no window watchdog yet. */
static void test_a_window_watchdog_that_does_not_run_is_not_started(void)
{
    wwdg = (stm32_wwdg_t){.CR = WWDG_CR_RESET, .CFR = WWDG_CFR_RESET};
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, g431_store_erase(&store, 0u));
    TEST_ASSERT_EQUAL_HEX32(WWDG_CR_RESET, wwdg.CR);
    TEST_ASSERT_EQUAL_HEX32(WWDG_CFR_RESET, wwdg.CFR);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_watchdog_fires_while_a_slot_is_erased);
    RUN_TEST(test_the_independent_watchdog_outlasts_two_pages);
    RUN_TEST(test_no_watchdog_fires_while_words_are_programmed);
    RUN_TEST(test_with_the_gates_on_nothing_is_changed);
    RUN_TEST(test_a_window_watchdog_that_does_not_run_is_not_started);
    return UNITY_END();
}
