#include "canopen.h"

#include "canopen_402.h"
#include "canopen_pdo.h"

#include <stddef.h>

#define ID_NMT       0x000u
#define ID_SYNC      0x080u
#define ID_SDO       0x600u
#define ID_SDO_SAID  0x580u
#define ID_HEARTBEAT 0x700u
#define US_PER_MS    1000u
#define HEARTBEAT    0x8130u /* error code: the consumer's heartbeat is lost */
#define COMMUNICATES 0x10u   /* of the error register */

enum {
    START = 1,
    STOP = 2,
    PREPARE = 128,
    RESET_NODE = 129,
    RESET_COMMUNICATION = 130
};

static void say_state(const canopen_t *co, const hal_can_t *can)
{
    const hal_can_frame_t frame = {
        .id = (uint16_t)(ID_HEARTBEAT + co->node), .length = 1u, .data = {(uint8_t)co->nmt}};
    (void)can->write(can->context, &frame);
}

static void boot(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can)
{
    const cia402_state_t machine = co->od.machine;
    canopen_od_stop(&co->od, drive);
    *co = (canopen_t){.node = drive->unit->params.fieldbus_address};
    canopen_od_init(&co->od, co->node);
    co->od.machine = machine;
    say_state(co, can);
    co->nmt = CANOPEN_PRE_OPERATIONAL;
}

/* As it was for a command that does not exist. */
static canopen_nmt_t commanded(canopen_nmt_t before, uint8_t command)
{
    switch (command) {
    case START:
        return CANOPEN_OPERATIONAL;
    case STOP:
        return CANOPEN_STOPPED;
    case PREPARE:
        return CANOPEN_PRE_OPERATIONAL;
    case RESET_NODE:
    case RESET_COMMUNICATION:
        return CANOPEN_BOOT_UP;
    default:
        return before;
    }
}

static void manage(canopen_t *co, const canopen_drive_t *drive, const hal_can_frame_t *frame)
{
    if ((frame->length < 2u) || ((frame->data[1] != 0u) && (frame->data[1] != co->node))) {
        return;
    }
    const canopen_nmt_t before = co->nmt;
    co->nmt = commanded(before, frame->data[0]);
    if ((before == CANOPEN_OPERATIONAL) && (co->nmt != CANOPEN_OPERATIONAL)) {
        canopen_od_stop(&co->od, drive);
    }
}

/* The consumer's node, and its time in us; 0: none is watched. */
static uint32_t watched_us(const canopen_t *co)
{
    return US_PER_MS * (co->od.word[CANOPEN_AT_0x1016_1] & 0xFFFFu);
}

static bool is_watched(const canopen_t *co, uint16_t id)
{
    const uint32_t node = (co->od.word[CANOPEN_AT_0x1016_1] >> 16) & 0x7Fu;
    return (watched_us(co) != 0u) && (id == ID_HEARTBEAT + node);
}

static void hear(canopen_t *co, const canopen_drive_t *drive, uint32_t now_us)
{
    co->hears = true;
    co->lost = false;
    co->told_lost = false;
    co->heard_us = now_us;
    if (co->nmt == CANOPEN_OPERATIONAL) {
        canopen_od_renew(&co->od, drive);
    }
}

static void receive(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can,
                    const hal_can_frame_t *frame)
{
    const uint32_t now_us = can->clock_us(can->context);
    if (frame->id == ID_NMT) {
        manage(co, drive, frame);
    } else if (is_watched(co, frame->id)) {
        hear(co, drive, now_us);
    } else if ((co->nmt != CANOPEN_STOPPED) && (frame->id == ID_SDO + co->node) &&
               (frame->length == HAL_CAN_BYTES)) {
        hal_can_frame_t answer;
        if (canopen_sdo(&co->sdo, &co->od, drive, frame, &answer)) {
            answer.id = (uint16_t)(ID_SDO_SAID + co->node);
            (void)can->write(can->context, &answer);
        }
    } else if (co->nmt == CANOPEN_OPERATIONAL) {
        const bool taken = canopen_pdo_received(co, drive, frame);
        if (!taken && (frame->id == ID_SYNC)) {
            canopen_pdo_send(co, drive, can, now_us, true);
        }
    } else {
        /* not for us; a stopped node hears NMT and heartbeats alone */
    }
}

/* The heartbeat that we hear, and the one that we send. */
static void beat(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can, uint32_t now_us)
{
    const uint32_t every_us = US_PER_MS * co->od.word[CANOPEN_AT_0x1017_0];
    if ((every_us != 0u) && (now_us - co->beat_us >= every_us)) {
        co->beat_us = now_us;
        say_state(co, can);
    }
    const uint32_t within_us = watched_us(co);
    co->hears = co->hears && (within_us != 0u);
    if (co->hears && (now_us - co->heard_us >= within_us)) {
        co->hears = false;
        co->lost = true;
        canopen_od_stop(&co->od, drive);
    }
}

static void tell_errors(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can)
{
    const uint32_t faults = drive->unit->machine.faults;
    const bool lost = co->lost && !co->told_lost;
    if ((faults == co->told) && !lost) {
        return;
    }
    const uint32_t code = lost ? HEARTBEAT : canopen_od_error_code(faults);
    const uint32_t reg =
        canopen_402_live(&co->od, drive, CANOPEN_LIVE_ERROR_REGISTER) | (lost ? COMMUNICATES : 0u);
    const hal_can_frame_t frame = {
        .id = (uint16_t)co->od.word[CANOPEN_AT_0x1014_0],
        .length = HAL_CAN_BYTES,
        .data = {(uint8_t)(code & 0xFFu), (uint8_t)(code >> 8), (uint8_t)reg,
                 (uint8_t)(faults & 0xFFu), (uint8_t)((faults >> 8) & 0xFFu),
                 (uint8_t)((faults >> 16) & 0xFFu), (uint8_t)(faults >> 24), 0u}};
    if (can->write(can->context, &frame)) {
        co->told = faults;
        co->told_lost = co->lost;
    }
}

void canopen_background(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can)
{
    if (co->nmt == CANOPEN_BOOT_UP) {
        boot(co, drive, can);
    }
    hal_can_frame_t frame;
    if (can->read(can->context, &frame)) {
        receive(co, drive, can, &frame);
    }
    canopen_od_follow(&co->od, drive);
    const uint32_t now_us = can->clock_us(can->context);
    beat(co, drive, can, now_us);
    if (co->nmt != CANOPEN_STOPPED) {
        tell_errors(co, drive, can);
    }
    if (co->nmt == CANOPEN_OPERATIONAL) {
        canopen_pdo_send(co, drive, can, now_us, false);
    }
}
