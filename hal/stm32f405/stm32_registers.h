/* Register blocks of the STM32F405, as far as this port uses them (reference manual RM0090).
 *
 * Drivers get pointers to blocks, so that unit tests run them on blocks in RAM. Every offset, base
 * and bit below is compared with ST's own description (tests/tools/test_stm32_svd.py), which reads
 * this file. Names are ST's.
 */
#ifndef STM32_REGISTERS_H
#define STM32_REGISTERS_H

#include <stdint.h>

typedef volatile uint32_t stm32_reg_t;

typedef struct {
    stm32_reg_t CR, PLLCFGR, CFGR, CIR;
    stm32_reg_t reserved_10[8];
    stm32_reg_t AHB1ENR, AHB2ENR;
    stm32_reg_t reserved_38[2];
    stm32_reg_t APB1ENR, APB2ENR;
    stm32_reg_t reserved_48[11];
    stm32_reg_t CSR;
} stm32_rcc_t;

typedef struct {
    stm32_reg_t ACR, KEYR, reserved_08, SR, CR;
} stm32_flash_t;

typedef struct {
    stm32_reg_t CR, CSR;
} stm32_pwr_t;

typedef struct {
    stm32_reg_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFRL, AFRH;
} stm32_gpio_t;

typedef struct {
    stm32_reg_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR1_Output, CCMR2_Output, CCER, CNT, PSC, ARR, RCR;
    stm32_reg_t CCR1, CCR2, CCR3, CCR4, BDTR;
} stm32_tim_t;

typedef struct {
    stm32_reg_t SR, CR1, CR2, SMPR1, SMPR2;
    stm32_reg_t reserved_14[9];
    stm32_reg_t JSQR, JDR1, JDR2;
} stm32_adc_t;

typedef struct {
    stm32_reg_t CSR, CCR;
} stm32_adc_common_t;

typedef struct {
    stm32_reg_t SR, DR, BRR, CR1;
} stm32_usart_t;

/* Of the mailboxes and filters the first. */
typedef struct {
    stm32_reg_t MCR, MSR, TSR, RF0R, RF1R, IER, ESR, BTR;
    stm32_reg_t reserved_20[88];
    stm32_reg_t TI0R, TDT0R, TDL0R, TDH0R;
    stm32_reg_t reserved_190[8];
    stm32_reg_t RI0R, RDT0R, RDL0R, RDH0R;
    stm32_reg_t reserved_1C0[16];
    stm32_reg_t FMR, FM1R, reserved_208, FS1R, reserved_210, FFA1R, reserved_218, FA1R;
    stm32_reg_t reserved_220[8];
    stm32_reg_t F0R1, F0R2;
} stm32_can_t;

typedef struct {
    stm32_reg_t DBGMCU_IDCODE, DBGMCU_CR, DBGMCU_APB1_FZ, DBGMCU_APB2_FZ;
} stm32_dbg_t;

typedef struct {
    stm32_reg_t KR, PR, RLR, SR;
} stm32_iwdg_t;

typedef struct {
    stm32_reg_t CR, SR, DR;
} stm32_rng_t;

#define RCC_CR_HSION             (1u << 0)
#define RCC_CR_HSIRDY            (1u << 1)
#define RCC_CR_HSEON             (1u << 16)
#define RCC_CR_HSERDY            (1u << 17)
#define RCC_CR_CSSON             (1u << 19)
#define RCC_CR_PLLON             (1u << 24)
#define RCC_CR_PLLRDY            (1u << 25)
#define RCC_PLLCFGR_PLLM_Pos     0u
#define RCC_PLLCFGR_PLLN_Pos     6u
#define RCC_PLLCFGR_PLLSRC       (1u << 22)
#define RCC_PLLCFGR_PLLQ_Pos     24u
#define RCC_CFGR_SW_Msk          (3u << 0)
#define RCC_CFGR_SWS_Msk         (3u << 2)
#define RCC_CFGR_PPRE1_Pos       10u
#define RCC_CFGR_PPRE1_Msk       (7u << 10)
#define RCC_CFGR_PPRE2_Pos       13u
#define RCC_CFGR_PPRE2_Msk       (7u << 13)
#define RCC_AHB2ENR_RNGEN        (1u << 6)
#define RCC_AHB1ENR_GPIOAEN      (1u << 0)
#define RCC_AHB1ENR_GPIOBEN      (1u << 1)
#define RCC_AHB1ENR_GPIOCEN      (1u << 2)
#define RCC_APB1ENR_TIM5EN       (1u << 3)
#define RCC_APB1ENR_TIM7EN       (1u << 5)
#define RCC_APB1ENR_USART3EN     (1u << 18)
#define RCC_APB1ENR_UART4EN      (1u << 19)
#define RCC_APB1ENR_CAN1EN       (1u << 25)
#define RCC_APB1ENR_PWREN        (1u << 28)
#define RCC_APB2ENR_TIM1EN       (1u << 0)
#define RCC_APB2ENR_ADC1EN       (1u << 8)
#define RCC_APB2ENR_ADC2EN       (1u << 9)
#define RCC_APB2ENR_ADC3EN       (1u << 10)
#define RCC_CIR_CSSC             (1u << 23)
#define RCC_CSR_RMVF             (1u << 24)
#define RCC_CSR_WDGRSTF          (1u << 29)
#define FLASH_ACR_LATENCY_Msk    (7u << 0)
#define FLASH_ACR_PRFTEN         (1u << 8)
#define FLASH_ACR_ICEN           (1u << 9)
#define FLASH_ACR_DCEN           (1u << 10)
#define FLASH_ACR_DCRST          (1u << 12)
#define FLASH_SR_WRPERR          (1u << 4)
#define FLASH_SR_PGAERR          (1u << 5)
#define FLASH_SR_PGPERR          (1u << 6)
#define FLASH_SR_PGSERR          (1u << 7)
#define FLASH_SR_BSY             (1u << 16)
#define FLASH_CR_PG              (1u << 0)
#define FLASH_CR_SER             (1u << 1)
#define FLASH_CR_SNB_Pos         3u
#define FLASH_CR_PSIZE_Pos       8u
#define FLASH_CR_STRT            (1u << 16)
#define FLASH_CR_LOCK            (1u << 31)
#define PWR_CR_VOS_Pos           14u
#define TIM_CR1_CEN              (1u << 0)
#define TIM_CR1_URS              (1u << 2)
#define TIM_CR1_DIR              (1u << 4)
#define TIM_CR1_CMS_Pos          5u
#define TIM_CR1_ARPE             (1u << 7)
#define TIM_CR2_MMS_Pos          4u
#define TIM_CR2_OIS1N            (1u << 9)
#define TIM_CR2_OIS2N            (1u << 11)
#define TIM_CR2_OIS3N            (1u << 13)
#define TIM_DIER_UIE             (1u << 0)
#define TIM_SR_UIF               (1u << 0)
#define TIM_SR_BIF               (1u << 7)
#define TIM_EGR_UG               (1u << 0)
#define TIM_EGR_BG               (1u << 7)
#define TIM_CCMR1_OC1PE          (1u << 3)
#define TIM_CCMR1_OC1M_Pos       4u
#define TIM_CCMR1_OC2PE          (1u << 11)
#define TIM_CCMR1_OC2M_Pos       12u
#define TIM_CCMR2_OC3PE          (1u << 3)
#define TIM_CCMR2_OC3M_Pos       4u
#define TIM_CCMR2_OC4PE          (1u << 11)
#define TIM_CCMR2_OC4M_Pos       12u
#define TIM_CCER_CC1E            (1u << 0)
#define TIM_CCER_CC1NP           (1u << 3)
#define TIM_CCER_CC1NE           (1u << 2)
#define TIM_CCER_CC2E            (1u << 4)
#define TIM_CCER_CC2NP           (1u << 7)
#define TIM_CCER_CC2NE           (1u << 6)
#define TIM_CCER_CC3E            (1u << 8)
#define TIM_CCER_CC3NP           (1u << 11)
#define TIM_CCER_CC3NE           (1u << 10)
#define TIM_CCER_CC4E            (1u << 12)
#define TIM_BDTR_DTG_Msk         (0xFFu << 0)
#define TIM_BDTR_LOCK_Pos        8u
#define TIM_BDTR_OSSI            (1u << 10)
#define TIM_BDTR_OSSR            (1u << 11)
#define TIM_BDTR_BKE             (1u << 12)
#define TIM_BDTR_BKP             (1u << 13)
#define TIM_BDTR_MOE             (1u << 15)
#define ADC_SR_JEOC              (1u << 2)
#define ADC_CR1_JEOCIE           (1u << 7)
#define ADC_CR1_SCAN             (1u << 8)
#define ADC_CR2_ADON             (1u << 0)
#define ADC_CR2_JEXTSEL_Pos      16u
#define ADC_CR2_JEXTEN_Pos       20u
#define ADC_SMPR1_SMP10_Pos      0u
#define ADC_SMPR1_SMP11_Pos      3u
#define ADC_SMPR1_SMP12_Pos      6u
#define ADC_SMPR2_SMP0_Pos       0u
#define ADC_SMPR2_SMP1_Pos       3u
#define ADC_SMPR2_SMP2_Pos       6u
#define ADC_JSQR_JSQ3_Pos        10u
#define ADC_JSQR_JSQ4_Pos        15u
#define ADC_JSQR_JL_Pos          20u
#define ADC_CCR_MULT_Pos         0u
#define ADC_CCR_ADCPRE_Pos       16u
#define USART_SR_PE              (1u << 0)
#define USART_SR_FE              (1u << 1)
#define USART_SR_NF              (1u << 2)
#define USART_SR_ORE             (1u << 3)
#define DBG_APB2FZ_DBG_TIM1_STOP (1u << 0)
#define USART_SR_RXNE            (1u << 5)
#define USART_SR_TC              (1u << 6)
#define USART_SR_TXE             (1u << 7)
#define USART_CR1_RXNEIE         (1u << 5)
#define USART_CR1_RE             (1u << 2)
#define USART_CR1_TE             (1u << 3)
#define USART_CR1_TCIE           (1u << 6)
#define USART_CR1_TXEIE          (1u << 7)
#define USART_CR1_PCE            (1u << 10)
#define USART_CR1_M              (1u << 12)
#define USART_CR1_UE             (1u << 13)
#define CAN_MCR_INRQ             (1u << 0)
#define CAN_MCR_ABOM             (1u << 6)
#define CAN_MSR_INAK             (1u << 0)
#define CAN_TSR_TME0             (1u << 26)
#define CAN_RF0R_FMP0_Msk        (3u << 0)
#define CAN_RF0R_RFOM0           (1u << 5)
#define CAN_IER_FMPIE0           (1u << 1)
#define CAN_BTR_BRP_Pos          0u
#define CAN_BTR_TS1_Pos          16u
#define CAN_BTR_TS2_Pos          20u
#define CAN_TI0R_TXRQ            (1u << 0)
#define CAN_TI0R_STID_Pos        21u
#define CAN_RI0R_RTR             (1u << 1)
#define CAN_RI0R_IDE             (1u << 2)
#define CAN_RI0R_STID_Pos        21u
#define CAN_RDT0R_DLC_Msk        (15u << 0)
#define CAN_FMR_FINIT            (1u << 0)
#define CAN_FS1R_FSC0            (1u << 0)
#define CAN_FA1R_FACT0           (1u << 0)
#define IWDG_SR_PVU              (1u << 0)
#define IWDG_SR_RVU              (1u << 1)
#define RNG_CR_RNGEN             (1u << 2)
#define RNG_SR_DRDY              (1u << 0)
#define RNG_SR_CECS              (1u << 1)
#define RNG_SR_SECS              (1u << 2)
#define RNG_SR_CEIS              (1u << 5)
#define RNG_SR_SEIS              (1u << 6)

#endif
