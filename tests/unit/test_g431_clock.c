/* The clock tree on register blocks in RAM: ready bits stand from the start, or never come. */
#include "g431_clock.h"

#include "unity.h"

#define POLLS      10u
#define ON_PLL     (3u << 2) /* the switch's answer */
#define OSCILLATES (RCC_CR_HSIRDY | RCC_CR_HSERDY | RCC_CR_PLLRDY)

static stm32_rcc_t rcc;
static stm32_flash_t flash;
static stm32_pwr_t pwr;

void setUp(void)
{
    rcc = (stm32_rcc_t){.CR = OSCILLATES, .CFGR = ON_PLL | 1u};
    flash = (stm32_flash_t){0};
    pwr = (stm32_pwr_t){.CR5 = PWR_CR5_RESET};
}

void tearDown(void)
{
}

static g431_clock_t start(uint32_t crystal_MHz)
{
    return g431_clock_start(&rcc, &flash, &pwr, crystal_MHz, POLLS);
}

/* M 2, N 85, R 2 from 8 MHz; boost mode, voltage range 1, four wait states and the caches. */
static void test_crystal_and_pll_give_170_MHz(void)
{
    TEST_ASSERT_EQUAL(G431_CLOCK_CRYSTAL, start(8u));
    TEST_ASSERT_EQUAL_HEX32(3u | (1u << 4) | (85u << 8) | (1u << 24), rcc.PLLCFGR);
    TEST_ASSERT_EQUAL_HEX32(3u | ON_PLL, rcc.CFGR); /* no divider any more */
    TEST_ASSERT_EQUAL_HEX32(4u | (7u << 8), flash.ACR);
    TEST_ASSERT_EQUAL_HEX32(RCC_CR_HSEON | RCC_CR_PLLON | RCC_CR_CSSON | OSCILLATES, rcc.CR);
    TEST_ASSERT_EQUAL_HEX32(1u << 9, pwr.CR1);
    TEST_ASSERT_EQUAL_HEX32(0u, pwr.CR5);       /* R1MODE 0: boost */
    TEST_ASSERT_EQUAL_HEX32(1u << 14, pwr.CR3); /* no pull-down of USB-C at PB4 */
    TEST_ASSERT_EQUAL_HEX32(RCC_APB1ENR1_PWREN, rcc.APB1ENR1);
    TEST_ASSERT_EQUAL_HEX32(RCC_CRRCR_HSI48ON, rcc.CRRCR);
}

static void test_another_crystal_gives_the_same(void)
{
    TEST_ASSERT_EQUAL(G431_CLOCK_CRYSTAL, start(24u));
    TEST_ASSERT_EQUAL_HEX32(3u | (5u << 4) | (85u << 8) | (1u << 24), rcc.PLLCFGR);
}

static void test_the_voltage_range_is_set_whatever_it_was(void)
{
    pwr.CR1 = 2u << 9;
    TEST_ASSERT_EQUAL(G431_CLOCK_CRYSTAL, start(8u));
    TEST_ASSERT_EQUAL_HEX32(1u << 9, pwr.CR1);
}

/* The same 4 MHz into the PLL from 16 MHz, and no supervision of a crystal that is not there. */
static void test_without_a_crystal_the_pll_runs_from_the_internal_oscillator(void)
{
    rcc.CR &= ~RCC_CR_HSERDY;
    TEST_ASSERT_EQUAL(G431_CLOCK_INTERNAL_PLL, start(24u));
    TEST_ASSERT_EQUAL_HEX32(2u | (3u << 4) | (85u << 8) | (1u << 24), rcc.PLLCFGR);
    TEST_ASSERT_EQUAL_HEX32(0u, rcc.CR & RCC_CR_CSSON);
}

static void assert_on_internal_oscillator(void)
{
    TEST_ASSERT_EQUAL(G431_CLOCK_INTERNAL, start(8u));
    TEST_ASSERT_EQUAL_HEX32(1u, rcc.CFGR & ~RCC_CFGR_SWS_Msk);
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
    rcc.CFGR = 5u;
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

static void test_frequencies(void)
{
    TEST_ASSERT_EQUAL_UINT32(170000000u, g431_clock_Hz(G431_CLOCK_CRYSTAL));
    TEST_ASSERT_EQUAL_UINT32(170000000u, g431_clock_Hz(G431_CLOCK_INTERNAL_PLL));
    TEST_ASSERT_EQUAL_UINT32(16000000u, g431_clock_Hz(G431_CLOCK_INTERNAL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_crystal_and_pll_give_170_MHz);
    RUN_TEST(test_another_crystal_gives_the_same);
    RUN_TEST(test_the_voltage_range_is_set_whatever_it_was);
    RUN_TEST(test_without_a_crystal_the_pll_runs_from_the_internal_oscillator);
    RUN_TEST(test_a_pll_that_never_gets_ready_is_given_up);
    RUN_TEST(test_a_switch_that_never_answers_is_given_up);
    RUN_TEST(test_a_pll_that_cannot_be_stopped_is_given_up);
    RUN_TEST(test_with_no_ready_bit_at_all_it_ends_too);
    RUN_TEST(test_frequencies);
    return UNITY_END();
}
