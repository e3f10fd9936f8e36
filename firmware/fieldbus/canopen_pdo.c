#include "canopen_pdo.h"

#include <stddef.h>

#define INVALID   (1u << 31)
#define US_PER_MS 1000u
#define SYNC_MOST 240u
#define EVENT     254u

/* Rows of each PDO's communication and mapping. */
static const struct {
    uint8_t id;
    uint8_t mapping;
} received[CANOPEN_PDOS] = {{CANOPEN_AT_0x1400_1, CANOPEN_AT_0x1600_0},
                            {CANOPEN_AT_0x1401_1, CANOPEN_AT_0x1601_0}};
static const struct {
    uint8_t id;
    uint8_t type;
    uint8_t timer;
    uint8_t mapping;
} sent[CANOPEN_PDOS] = {
    {CANOPEN_AT_0x1800_1, CANOPEN_AT_0x1800_2, CANOPEN_AT_0x1800_5, CANOPEN_AT_0x1A00_0},
    {CANOPEN_AT_0x1801_1, CANOPEN_AT_0x1801_2, CANOPEN_AT_0x1801_5, CANOPEN_AT_0x1A01_0}};

static canopen_key_t mapped(uint32_t word)
{
    return (canopen_key_t){(uint16_t)(word >> 16), (uint8_t)((word >> 8) & 0xFFu)};
}

/* Object by object, the last first: the control word, customarily the first, finds its target. */
static void write_objects(canopen_t *co, const canopen_drive_t *drive, size_t mapping,
                          const hal_can_frame_t *frame)
{
    uint32_t end = 0u;
    for (uint32_t k = 1u; k <= co->od.word[mapping]; k++) {
        end += (co->od.word[mapping + k] & 0xFFu) / 8u;
    }
    if (end > frame->length) {
        return;
    }
    for (uint32_t k = co->od.word[mapping]; k > 0u; k--) {
        const uint32_t word = co->od.word[mapping + k];
        canopen_value_t value = {.bytes = (word & 0xFFu) / 8u};
        end -= value.bytes;
        for (uint32_t n = 0u; n < value.bytes; n++) {
            value.bits |= (uint32_t)frame->data[end + n] << (8u * n);
        }
        /* Nobody is told of a refusal; the status word shows it. */
        (void)!canopen_od_write(&co->od, drive, mapped(word), &value);
    }
}

bool canopen_pdo_received(canopen_t *co, const canopen_drive_t *drive, const hal_can_frame_t *frame)
{
    for (size_t k = 0u; k < CANOPEN_PDOS; k++) {
        if (co->od.word[received[k].id] == frame->id) {
            write_objects(co, drive, received[k].mapping, frame);
            return true;
        }
    }
    return false;
}

static hal_can_frame_t frame_of(const canopen_t *co, const canopen_drive_t *drive, size_t k)
{
    const size_t mapping = sent[k].mapping;
    hal_can_frame_t frame = {.id = (uint16_t)co->od.word[sent[k].id]};
    for (uint32_t m = 1u; m <= co->od.word[mapping]; m++) {
        canopen_value_t value = {0};
        /* What is mapped exists: it was checked when it was mapped. */
        (void)!canopen_od_read(&co->od, drive, mapped(co->od.word[mapping + m]), &value);
        for (uint32_t n = 0u; n < value.bytes; n++) {
            frame.data[frame.length] = (uint8_t)((value.bits >> (8u * n)) & 0xFFu);
            frame.length++;
        }
    }
    return frame;
}

static bool due(canopen_t *co, size_t k, uint32_t now_us, bool sync)
{
    const uint32_t type = co->od.word[sent[k].type];
    const uint32_t timer_us = US_PER_MS * co->od.word[sent[k].timer];
    if ((co->od.word[sent[k].id] & INVALID) != 0u) {
        return false;
    }
    if (type <= SYNC_MOST) {
        co->syncs[k] += sync ? 1u : 0u;
        return sync && (co->syncs[k] >= type);
    }
    return (type >= EVENT) && (timer_us != 0u) && (now_us - co->sent_us[k] >= timer_us);
}

void canopen_pdo_send(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can,
                      uint32_t now_us, bool sync)
{
    for (size_t k = 0u; k < CANOPEN_PDOS; k++) {
        if (due(co, k, now_us, sync)) {
            const hal_can_frame_t frame = frame_of(co, drive, k);
            (void)can->write(can->context, &frame);
            co->sent_us[k] = now_us;
            co->syncs[k] = 0u;
        }
    }
}
