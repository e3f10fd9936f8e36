#include "stm32_clock.h"

#include <stdbool.h>

#define HSE_MHZ    8u
#define HSI_MHZ    16u
#define VCO_IN_MHZ 1u
#define PLL_N      336u /* 336 MHz */
#define PLL_Q      7u   /* 48 MHz; P is 2: 168 MHz, field 0 */

#define WAIT_STATES 5u /* 168 MHz at 2.7..3.6 V */
#define DIVIDE_BY_2 4u
#define DIVIDE_BY_4 5u
#define SW_PLL      2u
#define SWS_PLL     (2u << 2)

static bool wait_for(const stm32_reg_t *reg, uint32_t mask, uint32_t value, uint32_t polls)
{
    for (uint32_t n = 0u; n < polls; n++) {
        if ((*reg & mask) == value) {
            return true;
        }
    }
    return false;
}

/* The PLL from either source, and the core on it. */
static bool run_on_pll(stm32_rcc_t *rcc, stm32_flash_t *flash, bool crystal, uint32_t polls)
{
    const uint32_t m = (crystal ? HSE_MHZ : HSI_MHZ) / VCO_IN_MHZ;
    if ((rcc->CR & RCC_CR_PLLON) != 0u) {
        rcc->CR &= ~RCC_CR_PLLON; /* its divider cannot be changed while it runs */
        if (!wait_for(&rcc->CR, RCC_CR_PLLRDY, 0u, polls)) {
            return false;
        }
    }
    rcc->PLLCFGR = (m << RCC_PLLCFGR_PLLM_Pos) | (PLL_N << RCC_PLLCFGR_PLLN_Pos) |
                   (PLL_Q << RCC_PLLCFGR_PLLQ_Pos) | (crystal ? RCC_PLLCFGR_PLLSRC : 0u);
    rcc->CR |= RCC_CR_PLLON;
    if (!wait_for(&rcc->CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY, polls)) {
        return false;
    }
    /* Slower flash and buses before the core is faster. */
    flash->ACR = WAIT_STATES | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    if (!wait_for(&flash->ACR, FLASH_ACR_LATENCY_Msk, WAIT_STATES, polls)) {
        return false;
    }
    const uint32_t other = rcc->CFGR & ~(RCC_CFGR_PPRE1_Msk | RCC_CFGR_PPRE2_Msk | RCC_CFGR_SW_Msk);
    const uint32_t buses =
        other | (DIVIDE_BY_4 << RCC_CFGR_PPRE1_Pos) | (DIVIDE_BY_2 << RCC_CFGR_PPRE2_Pos);
    rcc->CFGR = buses; /* takes up to 16 clocks to act, so not together with the switch */
    rcc->CFGR = buses | SW_PLL;
    return wait_for(&rcc->CFGR, RCC_CFGR_SWS_Msk, SWS_PLL, polls);
}

/* Back to what the core woke up with. */
static void run_on_internal(stm32_rcc_t *rcc, uint32_t polls)
{
    rcc->CR |= RCC_CR_HSION;
    (void)wait_for(&rcc->CR, RCC_CR_HSIRDY, RCC_CR_HSIRDY, polls);
    rcc->CFGR &= ~(RCC_CFGR_PPRE1_Msk | RCC_CFGR_PPRE2_Msk | RCC_CFGR_SW_Msk);
    (void)wait_for(&rcc->CFGR, RCC_CFGR_SWS_Msk, 0u, polls);
    rcc->CR &= ~(RCC_CR_PLLON | RCC_CR_HSEON);
}

stm32_clock_t stm32_clock_start(stm32_rcc_t *rcc, stm32_flash_t *flash, stm32_pwr_t *pwr,
                                uint32_t polls)
{
    rcc->APB1ENR |= RCC_APB1ENR_PWREN;
    (void)rcc->APB1ENR;              /* a device answers some clocks after it got one */
    pwr->CR |= 1u << PWR_CR_VOS_Pos; /* scale 1: needed above 144 MHz */
    rcc->CR |= RCC_CR_HSEON;
    const bool crystal = wait_for(&rcc->CR, RCC_CR_HSERDY, RCC_CR_HSERDY, polls);
    if (run_on_pll(rcc, flash, crystal, polls)) {
        if (crystal) {
            rcc->CR |= RCC_CR_CSSON;
            return STM32_CLOCK_CRYSTAL;
        }
        return STM32_CLOCK_INTERNAL_PLL;
    }
    run_on_internal(rcc, polls);
    return STM32_CLOCK_INTERNAL;
}

uint32_t stm32_clock_core_Hz(stm32_clock_t clock)
{
    return ((clock == STM32_CLOCK_INTERNAL) ? HSI_MHZ : (PLL_N / 2u)) * 1000000u;
}

uint32_t stm32_clock_apb1_Hz(stm32_clock_t clock)
{
    return (clock == STM32_CLOCK_INTERNAL) ? stm32_clock_core_Hz(clock)
                                           : (stm32_clock_core_Hz(clock) / 4u);
}
