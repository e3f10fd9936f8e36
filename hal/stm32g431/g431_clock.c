#include "g431_clock.h"

#include <stdbool.h>

#include "num.h"

#define HSI_MHZ    16u
#define VCO_IN_MHZ 4u
#define PLL_N      85u /* 340 MHz; R is 2: 170 MHz, field 0 */
#define CORE_MHZ   170u
#define SOURCE_HSI 2u
#define SOURCE_HSE 3u

#define WAIT_STATES 4u /* 170 MHz in boost mode: RM0440, table of wait states */
#define RANGE_1     1u
#define DIVIDE_BY_2 8u
#define SW_PLL      3u
#define SW_HSI      1u
#define SWS_PLL     (3u << 2)
#define SWS_HSI     (1u << 2)
#define HALF_READS                                                                                 \
    64u /* 1 us and more at half speed: a read takes two clocks of 85 MHz or more                  \
         */

COLD static bool wait_for(const stm32_reg_t *reg, uint32_t mask, uint32_t value, uint32_t polls)
{
    for (uint32_t n = 0u; n < polls; n++) {
        if ((*reg & mask) == value) {
            return true;
        }
    }
    return false;
}

/* Half speed for a microsecond before the full one: RM0440, "range 1 boost mode". */
COLD static bool switch_to_pll(stm32_rcc_t *rcc, stm32_pwr_t *pwr, uint32_t polls)
{
    const uint32_t other = rcc->CFGR & ~(RCC_CFGR_HPRE_Msk | RCC_CFGR_SW_Msk);
    const uint32_t half = other | (DIVIDE_BY_2 << RCC_CFGR_HPRE_Pos);
    pwr->CR5 &= ~PWR_CR5_R1MODE;
    rcc->CFGR = half | SW_HSI;
    rcc->CFGR = half | SW_PLL;
    if (!wait_for(&rcc->CFGR, RCC_CFGR_SWS_Msk, SWS_PLL, polls)) {
        return false;
    }
    for (uint32_t n = 0u; n < HALF_READS; n++) {
        (void)rcc->CFGR;
    }
    rcc->CFGR = other | SW_PLL;
    return true;
}

/* The PLL from either source, and the core on it. */
COLD static bool run_on_pll(stm32_rcc_t *rcc, stm32_flash_t *flash, uint32_t source_MHz,
                            uint32_t source, uint32_t polls)
{
    if ((rcc->CR & RCC_CR_PLLON) != 0u) {
        rcc->CR &= ~RCC_CR_PLLON; /* its divider cannot be changed while it runs */
        if (!wait_for(&rcc->CR, RCC_CR_PLLRDY, 0u, polls)) {
            return false;
        }
    }
    rcc->PLLCFGR = (source << RCC_PLLCFGR_PLLSRC_Pos) |
                   ((source_MHz / VCO_IN_MHZ - 1u) << RCC_PLLCFGR_PLLM_Pos) |
                   (PLL_N << RCC_PLLCFGR_PLLN_Pos) | RCC_PLLCFGR_PLLREN;
    rcc->CR |= RCC_CR_PLLON;
    if (!wait_for(&rcc->CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY, polls)) {
        return false;
    }
    /* Slower flash before the core is faster. */
    flash->ACR = WAIT_STATES | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    return wait_for(&flash->ACR, FLASH_ACR_LATENCY_Msk, WAIT_STATES, polls);
}

/* Back to what the core woke up with. */
COLD static void run_on_internal(stm32_rcc_t *rcc, uint32_t polls)
{
    rcc->CR |= RCC_CR_HSION;
    (void)wait_for(&rcc->CR, RCC_CR_HSIRDY, RCC_CR_HSIRDY, polls);
    rcc->CFGR = (rcc->CFGR & ~(RCC_CFGR_HPRE_Msk | RCC_CFGR_SW_Msk)) | SW_HSI;
    (void)wait_for(&rcc->CFGR, RCC_CFGR_SWS_Msk, SWS_HSI, polls);
    rcc->CR &= ~(RCC_CR_PLLON | RCC_CR_HSEON);
}

COLD g431_clock_t g431_clock_start(stm32_rcc_t *rcc, stm32_flash_t *flash, stm32_pwr_t *pwr,
                                   uint32_t crystal_MHz, uint32_t polls)
{
    rcc->APB1ENR1 |= RCC_APB1ENR1_PWREN;
    (void)rcc->APB1ENR1; /* a device answers some clocks after it got one */
    pwr->CR1 = (pwr->CR1 & ~PWR_CR1_VOS_Msk) | (RANGE_1 << PWR_CR1_VOS_Pos);
    pwr->CR3 |= PWR_CR3_UCPD1_DBDIS; /* else PB4, a serial input, is pulled down for USB-C */
    rcc->CRRCR |= RCC_CRRCR_HSI48ON; /* of the random number generator */
    rcc->CR |= RCC_CR_HSEON;
    const bool crystal = wait_for(&rcc->CR, RCC_CR_HSERDY, RCC_CR_HSERDY, polls);
    const uint32_t source_MHz = crystal ? crystal_MHz : HSI_MHZ;
    if (run_on_pll(rcc, flash, source_MHz, crystal ? SOURCE_HSE : SOURCE_HSI, polls) &&
        switch_to_pll(rcc, pwr, polls)) {
        if (crystal) {
            rcc->CR |= RCC_CR_CSSON;
            return G431_CLOCK_CRYSTAL;
        }
        return G431_CLOCK_INTERNAL_PLL;
    }
    run_on_internal(rcc, polls);
    return G431_CLOCK_INTERNAL;
}

COLD uint32_t g431_clock_Hz(g431_clock_t clock)
{
    return ((clock == G431_CLOCK_INTERNAL) ? HSI_MHZ : CORE_MHZ) * 1000000u;
}
