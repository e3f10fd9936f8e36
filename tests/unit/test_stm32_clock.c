/* The clock tree on register blocks in RAM: ready bits stand from the start, or never come. */
#include "stm32_clock.h"

#include "unity.h"

#define POLLS      10u
#define ON_PLL     (2u << 2) /* the switch's answer */
#define OSCILLATES (RCC_CR_HSIRDY | RCC_CR_HSERDY | RCC_CR_PLLRDY)

static stm32_rcc_t rcc;
static stm32_flash_t flash;
static stm32_pwr_t pwr;

void setUp(void)
{
    rcc = (stm32_rcc_t){.CR = OSCILLATES, .CFGR = ON_PLL};
    flash = (stm32_flash_t){0};
    pwr = (stm32_pwr_t){0};
}

void tearDown(void)
{
}

static stm32_clock_t start(void)
{
    return stm32_clock_start(&rcc, &flash, &pwr, POLLS);
}

/* M 8, N 336, P 2, Q 7 from 8 MHz; APB1 a quarter, APB2 half; five wait states and the caches. */
static void test_crystal_and_pll_give_168_MHz(void)
{
    TEST_ASSERT_EQUAL(STM32_CLOCK_CRYSTAL, start());
    TEST_ASSERT_EQUAL_HEX32(8u | (336u << 6) | (7u << 24) | (1u << 22), rcc.PLLCFGR);
    TEST_ASSERT_EQUAL_HEX32((5u << 10) | (4u << 13) | 2u | ON_PLL, rcc.CFGR);
    TEST_ASSERT_EQUAL_HEX32(5u | (7u << 8), flash.ACR);
    TEST_ASSERT_EQUAL_HEX32(RCC_CR_HSEON | RCC_CR_PLLON | RCC_CR_CSSON | OSCILLATES, rcc.CR);
    TEST_ASSERT_EQUAL_HEX32(1u << 14, pwr.CR);
    TEST_ASSERT_EQUAL_HEX32(RCC_APB1ENR_PWREN, rcc.APB1ENR);
}

/* The same 1 MHz into the PLL from 16 MHz, and no supervision of a crystal that is not there. */
static void test_without_a_crystal_the_pll_runs_from_the_internal_oscillator(void)
{
    rcc.CR &= ~RCC_CR_HSERDY;
    TEST_ASSERT_EQUAL(STM32_CLOCK_INTERNAL_PLL, start());
    TEST_ASSERT_EQUAL_HEX32(16u | (336u << 6) | (7u << 24), rcc.PLLCFGR);
    TEST_ASSERT_EQUAL_HEX32(0u, rcc.CR & RCC_CR_CSSON);
}

static void assert_on_internal_oscillator(void)
{
    TEST_ASSERT_EQUAL(STM32_CLOCK_INTERNAL, start());
    TEST_ASSERT_EQUAL_HEX32(0u, rcc.CFGR & ~ON_PLL);
    TEST_ASSERT_EQUAL_HEX32(0u, rcc.CR & (RCC_CR_PLLON | RCC_CR_HSEON | RCC_CR_CSSON));
    TEST_ASSERT_EQUAL_HEX32(RCC_CR_HSION, rcc.CR & RCC_CR_HSION);
}

static void test_a_pll_that_never_gets_ready_is_given_up(void)
{
    rcc.CR &= ~RCC_CR_PLLRDY;
    assert_on_internal_oscillator();
}

static void test_a_switch_that_never_answers_is_given_up(void)
{
    rcc.CFGR = 0u;
    assert_on_internal_oscillator();
}

/* The PLL of a program before this one: its divider is not touched while it runs. */
static void test_a_pll_that_cannot_be_stopped_is_given_up(void)
{
    rcc.CR |= RCC_CR_PLLON;
    assert_on_internal_oscillator();
    TEST_ASSERT_EQUAL_HEX32(0u, rcc.PLLCFGR);
}

static void test_with_no_ready_bit_at_all_it_ends_too(void)
{
    rcc = (stm32_rcc_t){0};
    assert_on_internal_oscillator();
}

static void test_frequencies_of_core_and_bus(void)
{
    TEST_ASSERT_EQUAL_UINT32(168000000u, stm32_clock_core_Hz(STM32_CLOCK_CRYSTAL));
    TEST_ASSERT_EQUAL_UINT32(168000000u, stm32_clock_core_Hz(STM32_CLOCK_INTERNAL_PLL));
    TEST_ASSERT_EQUAL_UINT32(16000000u, stm32_clock_core_Hz(STM32_CLOCK_INTERNAL));
    TEST_ASSERT_EQUAL_UINT32(42000000u, stm32_clock_apb1_Hz(STM32_CLOCK_CRYSTAL));
    TEST_ASSERT_EQUAL_UINT32(16000000u, stm32_clock_apb1_Hz(STM32_CLOCK_INTERNAL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_crystal_and_pll_give_168_MHz);
    RUN_TEST(test_without_a_crystal_the_pll_runs_from_the_internal_oscillator);
    RUN_TEST(test_a_pll_that_never_gets_ready_is_given_up);
    RUN_TEST(test_a_switch_that_never_answers_is_given_up);
    RUN_TEST(test_a_pll_that_cannot_be_stopped_is_given_up);
    RUN_TEST(test_with_no_ready_bit_at_all_it_ends_too);
    RUN_TEST(test_frequencies_of_core_and_bus);
    return UNITY_END();
}
