/* Where the blocks lie, and interrupt numbers; used by main.c alone. */
#ifndef STM32_MAP_H
#define STM32_MAP_H

#define STM32_TIM5_BASE       0x40000C00u
#define STM32_TIM7_BASE       0x40001400u
#define STM32_IWDG_BASE       0x40003000u
#define STM32_USART3_BASE     0x40004800u
#define STM32_UART4_BASE      0x40004C00u
#define STM32_CAN1_BASE       0x40006400u
#define STM32_PWR_BASE        0x40007000u
#define STM32_TIM1_BASE       0x40010000u
#define STM32_ADC1_BASE       0x40012000u
#define STM32_ADC2_BASE       0x40012100u
#define STM32_ADC3_BASE       0x40012200u
#define STM32_ADC_COMMON_BASE 0x40012300u
#define STM32_GPIOA_BASE      0x40020000u
#define STM32_GPIOB_BASE      0x40020400u
#define STM32_GPIOC_BASE      0x40020800u
#define STM32_RCC_BASE        0x40023800u
#define STM32_DBG_BASE        0xE0042000u
#define STM32_RNG_BASE        0x50060800u
#define STM32_FLASH_BASE      0x40023C00u

#define STM32_IRQ_ADC    18u
#define STM32_IRQ_CAN    20u /* CAN1, first FIFO */
#define STM32_IRQ_USART3 39u
#define STM32_IRQ_UART4  52u
#define STM32_IRQ_TIM7   55u

#endif
