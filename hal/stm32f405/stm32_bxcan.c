#include "stm32_can.h"

#define BYTES_MOST 8u

/* Whether the controller has come to its initialization. */
static bool initializes(const stm32_can_t *can, uint32_t polls)
{
    for (uint32_t n = 0u; n < polls; n++) {
        if ((can->MSR & CAN_MSR_INAK) != 0u) {
            return true;
        }
    }
    return false;
}

bool stm32_can_start(const stm32_can_device_t *device, const stm32_can_timing_t *timing,
                     uint32_t polls)
{
    stm32_can_t *const can = device->can;
    can->MCR = CAN_MCR_INRQ | CAN_MCR_ABOM; /* awake; back on the bus by itself */
    if (!initializes(can, polls)) {
        return false;
    }
    can->BTR = ((timing->divider - 1u) << CAN_BTR_BRP_Pos) |
               ((timing->before - 1u) << CAN_BTR_TS1_Pos) |
               ((timing->behind - 1u) << CAN_BTR_TS2_Pos);
    /* One filter of 32 bits: whatever identifier, but no extended and no remote frame. */
    can->FMR |= CAN_FMR_FINIT;
    can->FM1R = 0u;
    can->FS1R = CAN_FS1R_FSC0;
    can->FFA1R = 0u;
    can->F0R1 = 0u;
    can->F0R2 = CAN_RI0R_IDE | CAN_RI0R_RTR;
    can->FA1R = CAN_FA1R_FACT0;
    can->FMR &= ~CAN_FMR_FINIT;
    can->IER = CAN_IER_FMPIE0;
    can->MCR = CAN_MCR_ABOM; /* on the bus once that is quiet */
    return true;
}

bool stm32_can_receive(const stm32_can_device_t *device, hal_can_frame_t *frame)
{
    stm32_can_t *const can = device->can;
    const uint32_t waiting = can->RF0R;
    /* Until the last one is released the next does not show. */
    if (((waiting & CAN_RF0R_FMP0_Msk) == 0u) || ((waiting & CAN_RF0R_RFOM0) != 0u)) {
        return false;
    }
    const uint32_t length = can->RDT0R & CAN_RDT0R_DLC_Msk;
    const uint64_t data = ((uint64_t)can->RDH0R << 32) | can->RDL0R;
    *frame = (hal_can_frame_t){.id = (uint16_t)(can->RI0R >> CAN_RI0R_STID_Pos),
                               .length = (uint8_t)((length < BYTES_MOST) ? length : BYTES_MOST)};
    for (uint32_t k = 0u; k < frame->length; k++) {
        frame->data[k] = (uint8_t)((data >> (8u * k)) & 0xFFu);
    }
    can->RF0R = CAN_RF0R_RFOM0;
    return true;
}

/* One mailbox: frames leave in their order. */
bool stm32_can_send(const stm32_can_device_t *device, const hal_can_frame_t *frame)
{
    stm32_can_t *const can = device->can;
    if ((can->TSR & CAN_TSR_TME0) == 0u) {
        return false;
    }
    uint64_t data = 0u;
    for (uint32_t k = 0u; k < frame->length; k++) {
        data |= (uint64_t)frame->data[k] << (8u * k);
    }
    can->TDT0R = frame->length;
    can->TDL0R = (uint32_t)(data & UINT32_MAX);
    can->TDH0R = (uint32_t)(data >> 32);
    can->TI0R = ((uint32_t)frame->id << CAN_TI0R_STID_Pos) | CAN_TI0R_TXRQ;
    return true;
}

void stm32_can_return(const stm32_can_device_t *device)
{
    (void)device; /* by itself */
}
