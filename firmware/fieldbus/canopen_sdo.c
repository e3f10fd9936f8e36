#include "canopen_sdo.h"

#include <stddef.h>

#define TOGGLE_WRONG   0x05030000u
#define COMMAND_WRONG  0x05040001u
#define TOO_LONG       0x06070012u
#define SEGMENT_BYTES  7u
#define TOGGLE         0x10u
#define EXPEDITED      0x02u
#define SIZE_INDICATED 0x01u
#define LAST_SEGMENT   0x01u

static const char device_name[] = "ZeroHertz induction-motor drive";
#define NAME_BYTES ((uint32_t)sizeof device_name - 1u)

enum {
    DOWNLOAD_SEGMENT = 0,
    DOWNLOAD = 1,
    UPLOAD = 2,
    UPLOAD_SEGMENT = 3,
    ABORT = 4
};

static void put_u32(uint8_t *at, uint32_t value)
{
    for (uint32_t k = 0u; k < 4u; k++) {
        at[k] = (uint8_t)((value >> (8u * k)) & 0xFFu);
    }
}

static uint32_t take_u32(const uint8_t *at, uint32_t n)
{
    uint32_t value = 0u;
    for (uint32_t k = 0u; k < n; k++) {
        value |= (uint32_t)at[k] << (8u * k);
    }
    return value;
}

static void put_key(hal_can_frame_t *answer, canopen_key_t key)
{
    answer->data[1] = (uint8_t)(key.index & 0xFFu);
    answer->data[2] = (uint8_t)(key.index >> 8);
    answer->data[3] = key.sub;
}

static canopen_key_t key_of(const hal_can_frame_t *request)
{
    return (canopen_key_t){(uint16_t)(request->data[1] | ((uint32_t)request->data[2] << 8)),
                           request->data[3]};
}

/* Abort code, or CANOPEN_DONE; each fills in the answer behind its first four bytes. */
static uint32_t upload(canopen_sdo_t *sdo, canopen_od_t *od, const canopen_drive_t *drive,
                       hal_can_frame_t *answer)
{
    if ((sdo->key.index == CANOPEN_DEVICE_NAME) && (sdo->key.sub == 0u)) {
        sdo->phase = CANOPEN_SDO_UPLOAD;
        answer->data[0] = 0x40u | SIZE_INDICATED;
        put_u32(&answer->data[4], NAME_BYTES);
        return CANOPEN_DONE;
    }
    canopen_value_t value;
    const uint32_t bad = canopen_od_read(od, drive, sdo->key, &value);
    if (bad == CANOPEN_DONE) {
        answer->data[0] = (uint8_t)(0x40u | EXPEDITED | SIZE_INDICATED | ((4u - value.bytes) << 2));
        put_u32(&answer->data[4], (value.bytes == 4u)
                                      ? value.bits
                                      : (value.bits & ((1u << (8u * value.bytes)) - 1u)));
    }
    return bad;
}

static uint32_t upload_segment(canopen_sdo_t *sdo, uint8_t command, hal_can_frame_t *answer)
{
    if (sdo->phase != CANOPEN_SDO_UPLOAD) {
        return COMMAND_WRONG;
    }
    if ((command & TOGGLE) != sdo->toggle) {
        return TOGGLE_WRONG;
    }
    uint32_t n = 0u;
    while ((n < SEGMENT_BYTES) && (sdo->at + n < NAME_BYTES)) {
        answer->data[1u + n] = (uint8_t)device_name[sdo->at + n];
        n++;
    }
    const bool last = sdo->at + n >= NAME_BYTES;
    answer->data[0] =
        (uint8_t)(sdo->toggle | ((SEGMENT_BYTES - n) << 1) | (last ? LAST_SEGMENT : 0u));
    sdo->at += n;
    sdo->toggle ^= TOGGLE;
    sdo->phase = last ? CANOPEN_SDO_IDLE : CANOPEN_SDO_UPLOAD;
    return CANOPEN_DONE;
}

static uint32_t download(canopen_sdo_t *sdo, canopen_od_t *od, const canopen_drive_t *drive,
                         const hal_can_frame_t *request, hal_can_frame_t *answer)
{
    const uint32_t command = request->data[0];
    answer->data[0] = 0x60u;
    if ((command & EXPEDITED) == 0u) {
        sdo->phase = CANOPEN_SDO_DOWNLOAD;
        return CANOPEN_DONE;
    }
    canopen_value_t value = {.bytes = 4u};
    if ((command & SIZE_INDICATED) != 0u) {
        value.bytes = 4u - ((command >> 2) & 3u);
    }
    value.bits = take_u32(&request->data[4], value.bytes);
    return canopen_od_write(od, drive, sdo->key, &value);
}

static uint32_t download_segment(canopen_sdo_t *sdo, canopen_od_t *od, const canopen_drive_t *drive,
                                 const hal_can_frame_t *request, hal_can_frame_t *answer)
{
    const uint32_t command = request->data[0];
    const uint32_t n = SEGMENT_BYTES - ((command >> 1) & 7u);
    if (sdo->phase != CANOPEN_SDO_DOWNLOAD) {
        return COMMAND_WRONG;
    }
    if ((command & TOGGLE) != sdo->toggle) {
        return TOGGLE_WRONG;
    }
    if (sdo->at + n > sizeof sdo->byte) {
        return TOO_LONG;
    }
    for (uint32_t k = 0u; k < n; k++) {
        sdo->byte[sdo->at + k] = request->data[1u + k];
    }
    sdo->at += n;
    answer->data[0] = (uint8_t)(0x20u | sdo->toggle);
    sdo->toggle ^= TOGGLE;
    if ((command & LAST_SEGMENT) == 0u) {
        return CANOPEN_DONE;
    }
    sdo->phase = CANOPEN_SDO_IDLE;
    const canopen_value_t value = {.bits = take_u32(sdo->byte, sdo->at), .bytes = sdo->at};
    return canopen_od_write(od, drive, sdo->key, &value);
}

bool canopen_sdo(canopen_sdo_t *sdo, canopen_od_t *od, const canopen_drive_t *drive,
                 const hal_can_frame_t *request, hal_can_frame_t *answer)
{
    const uint32_t command = (uint32_t)request->data[0] >> 5;
    const bool begins = (command == (uint32_t)DOWNLOAD) || (command == (uint32_t)UPLOAD);
    if (command == (uint32_t)ABORT) {
        *sdo = (canopen_sdo_t){0};
        return false;
    }
    *answer = (hal_can_frame_t){.length = HAL_CAN_BYTES};
    if (begins) {
        *sdo = (canopen_sdo_t){.key = key_of(request)};
        put_key(answer, sdo->key);
    }
    uint32_t bad = COMMAND_WRONG;
    if (command == (uint32_t)DOWNLOAD) {
        bad = download(sdo, od, drive, request, answer);
    } else if (command == (uint32_t)UPLOAD) {
        bad = upload(sdo, od, drive, answer);
    } else if (command == (uint32_t)DOWNLOAD_SEGMENT) {
        bad = download_segment(sdo, od, drive, request, answer);
    } else if (command == (uint32_t)UPLOAD_SEGMENT) {
        bad = upload_segment(sdo, request->data[0], answer);
    } else {
        /* block transfer and others: not known */
    }
    if (bad != CANOPEN_DONE) {
        sdo->phase = CANOPEN_SDO_IDLE;
        answer->data[0] = 0x80u;
        put_key(answer, sdo->key);
        put_u32(&answer->data[4], bad);
    }
    return true;
}
