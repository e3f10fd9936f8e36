/* Where the blocks of the STM32G431 lie, and interrupt numbers; used by main.c alone. */
#ifndef STM32_MAP_H
#define STM32_MAP_H

#define STM32_TIM2_BASE       0x40000000u
#define STM32_TIM7_BASE       0x40001400u
#define STM32_WWDG_BASE       0x40002C00u
#define STM32_IWDG_BASE       0x40003000u
#define STM32_USART2_BASE     0x40004400u
#define STM32_FDCAN1_BASE     0x40006400u
#define STM32_PWR_BASE        0x40007000u
#define STM32_SYSCFG_BASE     0x40010000u
#define STM32_COMP_BASE       0x40010200u
#define STM32_OPAMP_BASE      0x40010300u
#define STM32_TIM1_BASE       0x40012C00u
#define STM32_CAN_RAM_BASE    0x4000A400u
#define STM32_USART1_BASE     0x40013800u
#define STM32_RCC_BASE        0x40021000u
#define STM32_FLASH_BASE      0x40022000u
#define STM32_GPIOA_BASE      0x48000000u
#define STM32_GPIOB_BASE      0x48000400u
#define STM32_GPIOC_BASE      0x48000800u
#define STM32_ADC1_BASE       0x50000000u
#define STM32_ADC2_BASE       0x50000100u
#define STM32_ADC_COMMON_BASE 0x50000300u
#define STM32_DAC3_BASE       0x50001000u
#define STM32_RNG_BASE        0x50060800u
#define STM32_DBG_BASE        0xE0042000u

#define STM32_IRQ_ADC    18u
#define STM32_IRQ_CAN    21u /* FDCAN1, first line */
#define STM32_IRQ_USART1 37u
#define STM32_IRQ_USART2 38u
#define STM32_IRQ_TIM7   55u

#endif
