#include "unit_link.h"

#include "unit.h"
#include "unit_link_params.h"
#include "unit_link_requests.h"

#include <stddef.h>

/* A slice stays short: the watchdog and the checks wait behind it. */
#define BYTES_PER_SLICE 64u

/* What turns the gates on, and what a host that fell silent must not go on asking for. */
#define STARTS (SEQUENCE_CMD_RUN | SEQUENCE_CMD_COMMISSION)

/* Control periods a reset is held: the mailbox is read once in each. */
#define RESET_PERIODS 2u

unit_command_t unit_link_command(unit_t *unit)
{
    unit_link_t *link = &unit->link;
    const uint32_t now = unit->period_count;
    if (link->reset) {
        link->reset = false;
        link->reset_at = now;
    } else if (now - link->reset_at > RESET_PERIODS) {
        link->command &= ~SEQUENCE_CMD_FAULT_RESET;
    } else {
        /* still to be seen */
    }
    const bool runs = (link->command & STARTS) != 0u;
    if (runs && (link->valid_periods != 0u) && (now - link->commanded_at > link->valid_periods)) {
        link->command &= ~STARTS;
        link->expired = true;
    }
    return (unit_command_t){.command = link->command,
                            .omega_m_ref_rad_s = link->omega_m_ref_rad_s,
                            .torque_ref_Nm = link->torque_ref_Nm,
                            .count = link->commands};
}

/* Whether the line has taken all of the answer. */
static bool answer_sent(unit_link_t *link, const hal_devices_t *devices)
{
    const uint32_t left = link->answer.length - link->sent;
    if (left > 0u) {
        link->sent += devices->link_write(devices->context, &link->answer.byte[link->sent], left);
    }
    return link->sent >= link->answer.length;
}

static void answer_to(unit_t *unit, const hal_devices_t *devices, const command_frame_t *frame)
{
    unit_link_t *link = &unit->link;
    const bool again = link->answered && (frame->sequence == link->last_sequence) &&
                       (frame->crc32c == link->last_crc32c);
    link->sent = 0u;
    if (again) {
        return; /* the answer was lost on its way: once more, but nothing is done twice */
    }
    command_begin(&link->answer, frame->sequence, (uint8_t)(frame->op | UNIT_LINK_ANSWER));
    command_reader_t body = {.at = frame->body, .left = frame->body_bytes};
    const unit_link_status_t status = unit_link_request(unit, devices, frame->op, &body);
    if (status != UNIT_LINK_OK) {
        command_begin(&link->answer, frame->sequence, (uint8_t)(frame->op | UNIT_LINK_ANSWER));
        command_put_u8(&link->answer, (uint8_t)status);
        if ((status == UNIT_LINK_REFUSED) && (frame->op == UNIT_LINK_SEALED) &&
            (frame->body[0] == (uint8_t)UNIT_LINK_SET)) {
            unit_link_put_refused(unit, &link->answer);
        }
    }
    command_end(&link->answer);
    link->answered = true;
    link->last_sequence = frame->sequence;
    link->last_crc32c = frame->crc32c;
}

void unit_link_background(unit_t *unit, const hal_devices_t *devices)
{
    if ((devices->link_read == NULL) || (devices->link_write == NULL)) {
        return;
    }
    unit_link_t *link = &unit->link;
    if (!answer_sent(link, devices)) {
        return; /* the host waits for it before it asks again */
    }
    if ((devices->loader != NULL) && link->leaving) {
        link->leaving = false;
        if (unit_at_rest(unit)) {
            devices->loader(devices->context);
        }
    }
    for (uint32_t n = 0u; n < BYTES_PER_SLICE; n++) {
        uint8_t byte;
        command_frame_t frame;
        if (!devices->link_read(devices->context, &byte)) {
            return;
        }
        if (command_byte(&link->parser, byte, &frame)) {
            answer_to(unit, devices, &frame);
            (void)answer_sent(link, devices);
            return;
        }
    }
}
