/* What stm32_can.h drives on this part: FDCAN1 and its message memory. */
#ifndef STM32_CAN_DEVICE_H
#define STM32_CAN_DEVICE_H

#include "stm32_registers.h"

/* Its three received frames and three to be sent, 18 words each: RM0440, message RAM. */
#define STM32_CAN_RAM_FRAME    18u
#define STM32_CAN_RAM_RECEIVED 44u
#define STM32_CAN_RAM_SENT     158u
#define STM32_CAN_RAM_WORDS    212u

typedef struct {
    stm32_fdcan_t *can;
    stm32_reg_t *ram; /* STM32_CAN_RAM_WORDS */
} stm32_can_device_t;

#endif
