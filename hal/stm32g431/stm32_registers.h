/* Register blocks of the STM32G431, as far as this port uses them (reference manual RM0440).
 *
 * Drivers get pointers to blocks, so that unit tests run them on blocks in RAM. Every offset, base,
 * bit and reset value below is compared with the crate stm32g4, which is made from ST's description
 * (tests/tools/test_stm32g4_crate.py); it reads this file. Names are ST's.
 */
#ifndef STM32_REGISTERS_H
#define STM32_REGISTERS_H

#include <stdint.h>

typedef volatile uint32_t stm32_reg_t;

typedef struct {
    stm32_reg_t CR, reserved_04, CFGR, PLLCFGR, reserved_10[4], CICR, reserved_24[10], AHB2ENR,
        reserved_50[2], APB1ENR1, reserved_5C, APB2ENR, reserved_64[9], CCIPR, reserved_8C[2], CSR,
        CRRCR;
} stm32_rcc_t;

typedef struct {
    stm32_reg_t ACR, reserved_04, KEYR, reserved_0C, SR, CR, ECCR;
} stm32_flash_t;

typedef struct {
    stm32_reg_t CR1, reserved_04, CR3;
    stm32_reg_t reserved_0C[29];
    stm32_reg_t CR5;
} stm32_pwr_t;

typedef struct {
    stm32_reg_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFRL, AFRH;
} stm32_gpio_t;

typedef struct {
    stm32_reg_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR1_Output, CCMR2_Output, CCER, CNT, PSC, ARR, RCR;
    stm32_reg_t CCR1, CCR2, CCR3, CCR4, BDTR;
    stm32_reg_t reserved_48[6];
    stm32_reg_t AF1;
} stm32_tim_t;

typedef struct {
    stm32_reg_t ISR, IER, CR, CFGR, reserved_10, SMPR1, SMPR2, reserved_1C[12], JSQR,
        reserved_50[12], JDR1, JDR2;
} stm32_adc_t;

typedef struct {
    stm32_reg_t CSR, reserved_04, CCR;
} stm32_adc_common_t;

typedef struct {
    stm32_reg_t CR, reserved_04, DHR12R1, reserved_0C, reserved_10, DHR12R2;
    stm32_reg_t reserved_18[9];
    stm32_reg_t MCR;
} stm32_dac_t;

typedef struct {
    stm32_reg_t C1CSR, C2CSR, C3CSR, C4CSR;
} stm32_comp_t;

typedef struct {
    stm32_reg_t OPAMP1_CSR, OPAMP2_CSR, OPAMP3_CSR;
} stm32_opamp_t;

typedef struct {
    stm32_reg_t reserved_00[6];
    stm32_reg_t SCSR, CFGR2;
} stm32_syscfg_t;

typedef struct {
    stm32_reg_t CR1, CR2, CR3, BRR;
    stm32_reg_t reserved_10[3];
    stm32_reg_t ISR, ICR, RDR, TDR;
} stm32_usart_t;

typedef struct {
    stm32_reg_t reserved_00[6], CCCR, NBTP, reserved_20[12], IR, IE, reserved_58, ILE,
        reserved_60[8], RXGFC, reserved_84[3], RXF0S, RXF0A, reserved_98[11], TXFQS, reserved_C8,
        TXBAR;
} stm32_fdcan_t;

typedef struct {
    stm32_reg_t IDCODE, CR, APB1L_FZ, APB1H_FZ, APB2_FZ;
} stm32_dbg_t;

typedef struct {
    stm32_reg_t KR, PR, RLR, SR;
} stm32_iwdg_t;

typedef struct {
    stm32_reg_t CR, CFR;
} stm32_wwdg_t;

typedef struct {
    stm32_reg_t CR, SR, DR;
} stm32_rng_t;

#define RCC_CR_HSION                  (1u << 8)
#define RCC_CR_HSIRDY                 (1u << 10)
#define RCC_CR_HSEON                  (1u << 16)
#define RCC_CR_HSERDY                 (1u << 17)
#define RCC_CR_CSSON                  (1u << 19)
#define RCC_CR_PLLON                  (1u << 24)
#define RCC_CR_PLLRDY                 (1u << 25)
#define RCC_PLLCFGR_PLLSRC_Pos        0u
#define RCC_PLLCFGR_PLLM_Pos          4u
#define RCC_PLLCFGR_PLLN_Pos          8u
#define RCC_PLLCFGR_PLLREN            (1u << 24)
#define RCC_CFGR_SW_Msk               (3u << 0)
#define RCC_CFGR_SWS_Msk              (3u << 2)
#define RCC_CFGR_HPRE_Pos             4u
#define RCC_CFGR_HPRE_Msk             (15u << 4)
#define RCC_CICR_CSSC                 (1u << 8)
#define RCC_AHB2ENR_GPIOAEN           (1u << 0)
#define RCC_AHB2ENR_GPIOBEN           (1u << 1)
#define RCC_AHB2ENR_GPIOCEN           (1u << 2)
#define RCC_AHB2ENR_GPIOFEN           (1u << 5)
#define RCC_AHB2ENR_ADC12EN           (1u << 13)
#define RCC_AHB2ENR_DAC3EN            (1u << 18)
#define RCC_AHB2ENR_RNGEN             (1u << 26)
#define RCC_APB1ENR1_TIM2EN           (1u << 0)
#define RCC_APB1ENR1_TIM7EN           (1u << 5)
#define RCC_APB1ENR1_WWDGEN           (1u << 11)
#define RCC_APB1ENR1_USART2EN         (1u << 17)
#define RCC_APB1ENR1_FDCANEN          (1u << 25)
#define RCC_APB1ENR1_PWREN            (1u << 28)
#define RCC_APB2ENR_SYSCFGEN          (1u << 0)
#define RCC_APB2ENR_TIM1EN            (1u << 11)
#define RCC_APB2ENR_USART1EN          (1u << 14)
#define RCC_CCIPR_FDCANSEL_Pos        24u
#define RCC_CCIPR_FDCANSEL_Msk        (3u << 24)
#define RCC_CSR_RMVF                  (1u << 23)
#define RCC_CSR_IWDGRSTF              (1u << 29)
#define RCC_CSR_WWDGRSTF              (1u << 30)
#define RCC_CRRCR_HSI48ON             (1u << 0)
#define FLASH_ACR_LATENCY_Msk         (15u << 0)
#define FLASH_ACR_PRFTEN              (1u << 8)
#define FLASH_ACR_ICEN                (1u << 9)
#define FLASH_ACR_DCEN                (1u << 10)
#define FLASH_ACR_DCRST               (1u << 12)
#define FLASH_SR_EOP                  (1u << 0)
#define FLASH_SR_OPERR                (1u << 1)
#define FLASH_SR_PROGERR              (1u << 3)
#define FLASH_SR_WRPERR               (1u << 4)
#define FLASH_SR_PGAERR               (1u << 5)
#define FLASH_SR_SIZERR               (1u << 6)
#define FLASH_SR_PGSERR               (1u << 7)
#define FLASH_SR_MISERR               (1u << 8)
#define FLASH_SR_FASTERR              (1u << 9)
#define FLASH_SR_BSY                  (1u << 16)
#define FLASH_CR_PG                   (1u << 0)
#define FLASH_CR_PER                  (1u << 1)
#define FLASH_CR_PNB_Pos              3u
#define FLASH_CR_STRT                 (1u << 16)
#define FLASH_CR_LOCK                 (1u << 31)
#define FLASH_ECCR_ADDR_ECC_Msk       (0x7FFFFu << 0)
#define FLASH_ECCR_ECCD               (1u << 31)
#define PWR_CR1_VOS_Pos               9u
#define PWR_CR1_VOS_Msk               (3u << 9)
#define PWR_CR3_UCPD1_DBDIS           (1u << 14)
#define PWR_CR5_R1MODE                (1u << 8)
#define SYSCFG_CFGR2_CLL              (1u << 0)
#define SYSCFG_CFGR2_ECCL             (1u << 3)
#define TIM_CR1_CEN                   (1u << 0)
#define TIM_CR1_URS                   (1u << 2)
#define TIM_CR1_DIR                   (1u << 4)
#define TIM_CR1_CMS_Pos               5u
#define TIM_CR1_ARPE                  (1u << 7)
#define TIM_CR2_MMS_Pos               4u
#define TIM_CR2_OIS1N                 (1u << 9)
#define TIM_CR2_OIS2N                 (1u << 11)
#define TIM_CR2_OIS3N                 (1u << 13)
#define TIM_DIER_UIE                  (1u << 0)
#define TIM_SR_UIF                    (1u << 0)
#define TIM_SR_BIF                    (1u << 7)
#define TIM_EGR_UG                    (1u << 0)
#define TIM_EGR_BG                    (1u << 7)
#define TIM_CCMR1_OC1PE               (1u << 3)
#define TIM_CCMR1_OC1M_Pos            4u
#define TIM_CCMR1_OC2PE               (1u << 11)
#define TIM_CCMR1_OC2M_Pos            12u
#define TIM_CCMR2_OC3PE               (1u << 3)
#define TIM_CCMR2_OC3M_Pos            4u
#define TIM_CCER_CC1E                 (1u << 0)
#define TIM_CCER_CC1NE                (1u << 2)
#define TIM_CCER_CC1NP                (1u << 3)
#define TIM_CCER_CC2E                 (1u << 4)
#define TIM_CCER_CC2NE                (1u << 6)
#define TIM_CCER_CC2NP                (1u << 7)
#define TIM_CCER_CC3E                 (1u << 8)
#define TIM_CCER_CC3NE                (1u << 10)
#define TIM_CCER_CC3NP                (1u << 11)
#define TIM_BDTR_DTG_Msk              (0xFFu << 0)
#define TIM_BDTR_LOCK_Pos             8u
#define TIM_BDTR_OSSI                 (1u << 10)
#define TIM_BDTR_OSSR                 (1u << 11)
#define TIM_BDTR_BKE                  (1u << 12)
#define TIM_BDTR_BKP                  (1u << 13)
#define TIM_BDTR_MOE                  (1u << 15)
#define TIM_BDTR_BKF_Pos              16u
#define TIM_AF1_BKINE                 (1u << 0)
#define TIM_AF1_BKCMP1E               (1u << 1)
#define TIM_AF1_BKCMP2E               (1u << 2)
#define TIM_AF1_BKCMP4E               (1u << 4)
#define TIM_AF1_BKINP                 (1u << 9)
#define ADC_ISR_ADRDY                 (1u << 0)
#define ADC_ISR_JEOC                  (1u << 5)
#define ADC_ISR_JEOS                  (1u << 6)
#define ADC_IER_JEOSIE                (1u << 6)
#define ADC_CR_ADEN                   (1u << 0)
#define ADC_CR_JADSTART               (1u << 3)
#define ADC_CR_ADVREGEN               (1u << 28)
#define ADC_CR_DEEPPWD                (1u << 29)
#define ADC_CR_ADCAL                  (1u << 31)
#define ADC_CFGR_JQDIS                (1u << 31)
#define ADC_JSQR_JL_Pos               0u
#define ADC_JSQR_JEXTSEL_Pos          2u
#define ADC_JSQR_JEXTEN_Pos           7u
#define ADC_JSQR_JSQ1_Pos             9u
#define ADC_JSQR_JSQ2_Pos             15u
#define ADC_CCR_DUAL_Pos              0u
#define ADC_CCR_CKMODE_Pos            16u
#define DAC_CR_EN1                    (1u << 0)
#define DAC_CR_EN2                    (1u << 16)
#define DAC_MCR_MODE1_Pos             0u
#define DAC_MCR_MODE2_Pos             16u
#define DAC_MCR_HFSEL_Pos             14u
#define COMP_C1CSR_EN                 (1u << 0)
#define COMP_C1CSR_INMSEL_Pos         4u
#define COMP_C1CSR_HYST_Pos           16u
#define COMP_C1CSR_LOCK               (1u << 31)
#define OPAMP_OPAMP1_CSR_OPAEN        (1u << 0)
#define OPAMP_OPAMP1_CSR_VM_SEL_Pos   5u
#define OPAMP_OPAMP1_CSR_OPAHSM       (1u << 7)
#define OPAMP_OPAMP1_CSR_PGA_GAIN_Pos 14u
#define USART_ISR_PE                  (1u << 0)
#define USART_ISR_FE                  (1u << 1)
#define USART_ISR_NF                  (1u << 2)
#define USART_ISR_ORE                 (1u << 3)
#define USART_ISR_RXNE                (1u << 5)
#define USART_ISR_TC                  (1u << 6)
#define USART_ISR_TXE                 (1u << 7)
#define USART_ICR_PECF                (1u << 0)
#define USART_ICR_FECF                (1u << 1)
#define USART_ICR_NCF                 (1u << 2)
#define USART_ICR_ORECF               (1u << 3)
#define USART_CR1_UE                  (1u << 0)
#define USART_CR1_RE                  (1u << 2)
#define USART_CR1_TE                  (1u << 3)
#define USART_CR1_RXNEIE              (1u << 5)
#define USART_CR1_TCIE                (1u << 6)
#define USART_CR1_TXEIE               (1u << 7)
#define USART_CR1_PCE                 (1u << 10)
#define USART_CR1_M0                  (1u << 12)
#define FDCAN_CCCR_INIT               (1u << 0)
#define FDCAN_CCCR_CCE                (1u << 1)
#define FDCAN_NBTP_NTSEG2_Pos         0u
#define FDCAN_NBTP_NTSEG1_Pos         8u
#define FDCAN_NBTP_NBRP_Pos           16u
#define FDCAN_IR_RF0N                 (1u << 0)
#define FDCAN_IE_RF0NE                (1u << 0)
#define FDCAN_ILE_EINT0               (1u << 0)
#define FDCAN_RXGFC_RRFE              (1u << 0)
#define FDCAN_RXGFC_RRFS              (1u << 1)
#define FDCAN_RXGFC_ANFE_Pos          2u
#define FDCAN_RXF0S_F0FL_Msk          (15u << 0)
#define FDCAN_RXF0S_F0GI_Pos          8u
#define FDCAN_RXF0S_F0GI_Msk          (3u << 8)
#define FDCAN_TXFQS_TFQPI_Pos         16u
#define FDCAN_TXFQS_TFQPI_Msk         (3u << 16)
#define FDCAN_TXFQS_TFQF              (1u << 21)
#define DBG_APB2FZ_DBG_TIM1_STOP      (1u << 11)
#define IWDG_SR_PVU                   (1u << 0)
#define IWDG_SR_RVU                   (1u << 1)
#define WWDG_CR_T_Msk                 (0x7Fu << 0)
#define WWDG_CR_WDGA                  (1u << 7)
#define WWDG_CFR_W_Msk                (0x7Fu << 0)
#define WWDG_CFR_WDGTB_Pos            11u
#define RNG_CR_RNGEN                  (1u << 2)
#define RNG_SR_DRDY                   (1u << 0)
#define RNG_SR_CECS                   (1u << 1)
#define RNG_SR_SECS                   (1u << 2)
#define RNG_SR_CEIS                   (1u << 5)
#define RNG_SR_SEIS                   (1u << 6)

/* What the part wakes up with, where the port builds on it. */
#define GPIOA_MODER_RESET 0xABFFFFFFu
#define GPIOB_MODER_RESET 0xFFFFFEBFu
#define GPIOC_MODER_RESET 0xFFFFFFFFu
#define PWR_CR5_RESET     0x00000100u
#define FLASH_CR_RESET    0xC0000000u
#define ADC_CR_RESET      0x20000000u
#define ADC_CFGR_RESET    0x80000000u
#define WWDG_CR_RESET     0x0000007Fu
#define WWDG_CFR_RESET    0x0000007Fu
#define TIM_AF1_RESET     0x00000000u
#define IWDG_RLR_RESET    0x00000FFFu

#endif
