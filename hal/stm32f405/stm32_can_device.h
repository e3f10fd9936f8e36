/* What stm32_can.h drives on this part: bxCAN. */
#ifndef STM32_CAN_DEVICE_H
#define STM32_CAN_DEVICE_H

#include "stm32_registers.h"

typedef struct {
    stm32_can_t *can;
} stm32_can_device_t;

#endif
