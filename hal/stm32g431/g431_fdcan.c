#include "num.h"
#include "stm32_can.h"

#define BYTES_MOST     8u
#define ID_POS         18u /* of a frame's first word */
#define LENGTH_POS     16u /* of its second */
#define REJECT         2u  /* of RXGFC's ANFE; ANFS 0 accepts into the first queue */
#define QUEUE_ELEMENTS 3u

/* Whether the controller has come to its initialization. */
static bool initializes(const stm32_fdcan_t *can, uint32_t polls)
{
    for (uint32_t n = 0u; n < polls; n++) {
        if ((can->CCCR & FDCAN_CCCR_INIT) != 0u) {
            return true;
        }
    }
    return false;
}

COLD bool stm32_can_start(const stm32_can_device_t *device, const stm32_can_timing_t *timing,
                          uint32_t polls)
{
    stm32_fdcan_t *const can = device->can;
    can->CCCR = FDCAN_CCCR_INIT;
    if (!initializes(can, polls)) {
        return false;
    }
    can->CCCR = FDCAN_CCCR_INIT | FDCAN_CCCR_CCE;
    can->NBTP = ((timing->divider - 1u) << FDCAN_NBTP_NBRP_Pos) |
                ((timing->before - 1u) << FDCAN_NBTP_NTSEG1_Pos) |
                ((timing->behind - 1u) << FDCAN_NBTP_NTSEG2_Pos);
    can->RXGFC = FDCAN_RXGFC_RRFE | FDCAN_RXGFC_RRFS | (REJECT << FDCAN_RXGFC_ANFE_Pos);
    can->IE = FDCAN_IE_RF0NE;
    can->ILE = FDCAN_ILE_EINT0;
    can->CCCR = 0u; /* on the bus once that is quiet */
    return true;
}

bool stm32_can_receive(const stm32_can_device_t *device, hal_can_frame_t *frame)
{
    stm32_fdcan_t *const can = device->can;
    can->IR = FDCAN_IR_RF0N; /* before the look: one that comes behind it raises it anew */
    const uint32_t status = can->RXF0S;
    const uint32_t at = (status & FDCAN_RXF0S_F0GI_Msk) >> FDCAN_RXF0S_F0GI_Pos;
    if (((status & FDCAN_RXF0S_F0FL_Msk) == 0u) || (at >= QUEUE_ELEMENTS)) {
        return false;
    }
    const stm32_reg_t *const word = &device->ram[STM32_CAN_RAM_RECEIVED + STM32_CAN_RAM_FRAME * at];
    const uint32_t length = (word[1] >> LENGTH_POS) & 15u;
    *frame = (hal_can_frame_t){.id = (uint16_t)((word[0] >> ID_POS) & 0x7FFu),
                               .length = (uint8_t)((length < BYTES_MOST) ? length : BYTES_MOST)};
    for (uint32_t k = 0u; k < frame->length; k++) {
        frame->data[k] = (uint8_t)((word[2u + k / 4u] >> (8u * (k % 4u))) & 0xFFu);
    }
    can->RXF0A = at;
    return true;
}

bool stm32_can_send(const stm32_can_device_t *device, const hal_can_frame_t *frame)
{
    stm32_fdcan_t *const can = device->can;
    const uint32_t status = can->TXFQS;
    const uint32_t at = (status & FDCAN_TXFQS_TFQPI_Msk) >> FDCAN_TXFQS_TFQPI_Pos;
    if (((status & FDCAN_TXFQS_TFQF) != 0u) || (at >= QUEUE_ELEMENTS)) {
        return false;
    }
    stm32_reg_t *const word = &device->ram[STM32_CAN_RAM_SENT + STM32_CAN_RAM_FRAME * at];
    uint32_t data[2] = {0u, 0u};
    for (uint32_t k = 0u; k < frame->length; k++) {
        data[k / 4u] |= (uint32_t)frame->data[k] << (8u * (k % 4u));
    }
    word[0] = (uint32_t)frame->id << ID_POS;
    word[1] = (uint32_t)frame->length << LENGTH_POS;
    word[2] = data[0];
    word[3] = data[1];
    can->TXBAR = 1u << at;
    return true;
}

/* Bus-off ends in the initialization, and stays there. */
void stm32_can_return(const stm32_can_device_t *device)
{
    if ((device->can->CCCR & FDCAN_CCCR_INIT) != 0u) {
        device->can->CCCR = 0u;
    }
}
