#include "unit_link_requests.h"

#include "unit_link_drive.h"
#include "unit_link_params.h"
#include "unit_link_records.h"
#include "unit_signal.h"
#include "unit_store_background.h"
#include "crc32c.h"

#include <stddef.h>

#define MAC_BYTES  8u
#define SEAL_BYTES (4u + MAC_BYTES) /* of a sealed request: counter, MAC */

static unit_link_status_t do_hello(const unit_t *unit, const hal_devices_t *devices,
                                   command_writer_t *w)
{
    const gain_table_t *table = estimator_table(&unit_config(unit)->drive.estimator);
    command_put_u16(w, (uint16_t)UNIT_LINK_PROTOCOL);
    command_put_u16(w, (uint16_t)params_count());
    command_put_u16(w, (uint16_t)UNIT_SIGNALS);
    command_put_u32(w, unit->trace.words);
    command_put_u32(w, (table != NULL) ? table->motor_id : 0u);
    command_put_u32(w, (table != NULL) ? table->crc32c : 0u);
    command_put_float(w, unit->params.period_s);
    command_put_float(w, unit->params.pole_pairs);
    command_put_text(w, (devices->identity != NULL) ? devices->identity : "");
    return UNIT_LINK_OK;
}

/* Who acts on the drive has to know a number that it alone was told, and since the drive's last
 * start: a host that goes on talking to a drive that was reset does not start it again. */
static unit_link_status_t do_session(unit_t *unit, const hal_devices_t *devices,
                                     command_writer_t *w)
{
    const uint32_t clock_us =
        (devices->clock_us != NULL) ? devices->clock_us(devices->context) : 0u;
    const uint32_t seed[] = {unit->link.session, unit->period_count, clock_us,
                             unit->link.parser.good};
    const uint32_t number = crc32c(seed, sizeof seed);
    unit->link.session = (number != 0u) ? number : 1u;
    command_put_u32(w, unit->link.session);
    access_lock(&unit->store.access); /* who unlocked it was somebody else */
    return UNIT_LINK_OK;
}

static bool in_session(const unit_t *unit, command_reader_t *body)
{
    const uint32_t number = command_take_u32(body);
    return (unit->link.session != 0u) && (number == unit->link.session);
}

static void put_u64(command_writer_t *w, uint64_t value)
{
    command_put_u32(w, (uint32_t)value);
    command_put_u32(w, (uint32_t)(value >> 32u));
}

static unit_link_status_t do_challenge(unit_t *unit, const hal_devices_t *devices,
                                       command_writer_t *w)
{
    uint64_t entropy = 0u;
    uint64_t nonce = 0u;
    const bool drawn = (devices->entropy != NULL) && devices->entropy(devices->context, &entropy);
    unit_store_t *s = &unit->store;
    if (!access_challenge(&s->access_cfg, &s->access, drawn ? &entropy : NULL, &nonce)) {
        return UNIT_LINK_NOT_NOW;
    }
    put_u64(w, nonce);
    return UNIT_LINK_OK;
}

static uint64_t take_u64(command_reader_t *body)
{
    const uint64_t low = command_take_u32(body);
    return low | ((uint64_t)command_take_u32(body) << 32u);
}

static unit_link_status_t do_unlock(unit_t *unit, command_reader_t *body)
{
    const uint64_t response = take_u64(body);
    unit_store_t *s = &unit->store;
    return access_answer(&s->access_cfg, &s->access, response) ? UNIT_LINK_OK : UNIT_LINK_PROTECTED;
}

/* A drive that refused what it found in its store gets a new set only from who may change limits.
 */
static unit_link_status_t do_save(unit_t *unit, const hal_devices_t *devices)
{
    if (!unit_at_rest(unit)) {
        return UNIT_LINK_NOT_NOW;
    }
    if (!unit->configured && !unit->store.access.unlocked) {
        return UNIT_LINK_PROTECTED;
    }
    return unit_store_save(unit, devices) ? UNIT_LINK_OK : UNIT_LINK_REFUSED;
}

/* For an update. unit_link_background leaves, once the answer is sent. */
static unit_link_status_t do_loader(unit_t *unit, const hal_devices_t *devices)
{
    if (devices->loader == NULL) {
        return UNIT_LINK_NO_SUCH_OP;
    }
    if (!unit_at_rest(unit) || unit->store.store.wanted) {
        return UNIT_LINK_NOT_NOW;
    }
    unit->link.leaving = true;
    return UNIT_LINK_OK;
}

/* Who may ask: anybody, who is in session, or who also has the key. */
typedef enum {
    TELLS = 0,
    ACTS = 1,
    SEALED = 2
} link_right_t;

/* What a request needs, and the length of its body: least, least + step .. most. */
typedef struct {
    link_right_t right;
    uint8_t op;
    uint8_t least;
    uint8_t most;
    uint8_t step;
} link_request_t;

/* Requests with a body; any other has none and only reads. */
static const link_request_t requests[] = {
    {TELLS, UNIT_LINK_PARAM_INFO, 2u, 2u, 1u},
    {TELLS, UNIT_LINK_SIGNAL_INFO, 1u, 1u, 1u},
    {TELLS, UNIT_LINK_GET, 0u, COMMAND_BODY_MAX, 2u},
    {SEALED, UNIT_LINK_SET, 10u, 10u, 1u},
    {SEALED, UNIT_LINK_SAVE, 4u, 4u, 1u},
    {ACTS, UNIT_LINK_CHALLENGE, 4u, 4u, 1u},
    {ACTS, UNIT_LINK_UNLOCK, 12u, 12u, 1u},
    {TELLS, UNIT_LINK_STORE_ENTRY, 2u, 2u, 1u},
    /* A stop is everybody's who is in session: commands_power(). */
    {ACTS, UNIT_LINK_COMMAND, 14u, 18u, 4u},
    {SEALED, UNIT_LINK_LOADER, 4u, 4u, 1u},
    {TELLS, UNIT_LINK_SAMPLE, 0u, TRACE_SIGNALS_MAX, 1u},
    /* Exact once its signals are counted. */
    {ACTS, UNIT_LINK_TRACE_ARM, 4u, COMMAND_BODY_MAX, 1u},
    {TELLS, UNIT_LINK_TRACE_READ, 4u, 4u, 1u},
    {ACTS, UNIT_LINK_TRACE_STOP, 4u, 4u, 1u},
    {SEALED, UNIT_LINK_FLIGHT_ARM, 5u, 5u, 1u},
    {ACTS, UNIT_LINK_FLIGHT_READ, 8u, 8u, 1u},
    {TELLS, UNIT_LINK_FAULT_READ, 4u, 4u, 1u},
    {SEALED, UNIT_LINK_FAULT_CLEAR, 4u, 4u, 1u},
};

static link_request_t request_of(uint8_t op)
{
    for (size_t k = 0u; k < sizeof requests / sizeof requests[0]; k++) {
        if (requests[k].op == op) {
            return requests[k];
        }
    }
    return (link_request_t){.op = op, .step = 1u};
}

/* Checked before anything is done: a request of another length is of another protocol. */
static bool length_good(const link_request_t *r, uint32_t n)
{
    return (n >= r->least) && (n <= r->most) && (((n - r->least) % r->step) == 0u);
}

/* Anything but a stop. */
static bool commands_power(uint8_t op, command_reader_t body)
{
    return (op == UNIT_LINK_COMMAND) &&
           ((command_take_u32(&body) & ~SEQUENCE_CMD_TORQUE_OFF) != 0u);
}

static unit_link_status_t act_on_records(unit_t *unit, uint8_t op, command_reader_t *body,
                                         command_writer_t *w)
{
    switch (op) {
    case UNIT_LINK_TRACE_ARM:
        return unit_link_trace_setup(unit, body, w);
    case UNIT_LINK_TRACE_STOP:
        trace_stop(&unit->trace);
        return UNIT_LINK_OK;
    case UNIT_LINK_FLIGHT_ARM:
        return unit_link_flight_arm(unit, body);
    case UNIT_LINK_FLIGHT_READ:
        return unit_link_flight_read(unit, body, w);
    default: /* UNIT_LINK_FAULT_CLEAR */
        fault_record_clear(&unit->fault_recorder);
        return UNIT_LINK_OK;
    }
}

static unit_link_status_t act(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                              command_reader_t *body, command_writer_t *w)
{
    switch (op) {
    case UNIT_LINK_SET:
        return unit_link_set(unit, body);
    case UNIT_LINK_SAVE:
        return do_save(unit, devices);
    case UNIT_LINK_CHALLENGE:
        return do_challenge(unit, devices, w);
    case UNIT_LINK_UNLOCK:
        return do_unlock(unit, body);
    case UNIT_LINK_COMMAND:
        return unit_link_drive_command(unit, body);
    case UNIT_LINK_LOADER:
        return do_loader(unit, devices);
    default:
        return act_on_records(unit, op, body, w);
    }
}

static unit_link_status_t tell(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                               command_reader_t *body, command_writer_t *w)
{
    switch (op) {
    case UNIT_LINK_HELLO:
        return do_hello(unit, devices, w);
    case UNIT_LINK_SESSION:
        return do_session(unit, devices, w);
    case UNIT_LINK_PARAM_INFO:
        return unit_link_param_info(unit, body, w);
    case UNIT_LINK_SIGNAL_INFO:
        return unit_link_signal_info(body, w);
    case UNIT_LINK_GET:
        return unit_link_get(unit, body, w);
    case UNIT_LINK_STORE:
        return unit_link_store(unit, w);
    case UNIT_LINK_STORE_ENTRY:
        return unit_link_store_entry(unit, devices, body, w);
    case UNIT_LINK_STATUS:
        return unit_link_status(unit, w);
    case UNIT_LINK_SAMPLE:
        return unit_link_sample(unit, body, w);
    default:
        return unit_link_records(unit, op, body, w);
    }
}

static unit_link_status_t carry_out(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                                    command_reader_t *body, bool sealed)
{
    const link_request_t request = request_of(op);
    if (!length_good(&request, body->left)) {
        return UNIT_LINK_BAD_LENGTH;
    }
    command_writer_t *w = &unit->link.answer;
    command_put_u8(w, (uint8_t)UNIT_LINK_OK);
    if (request.right == TELLS) {
        return tell(unit, devices, op, body, w);
    }
    if (!in_session(unit, body)) {
        return UNIT_LINK_NO_SESSION;
    }
    if (!sealed && ((request.right == SEALED) || commands_power(op, *body))) {
        return UNIT_LINK_NOT_SEALED;
    }
    return act(unit, devices, op, body, w);
}

/* Op and body of another request, counter, MAC of all three. */
static unit_link_status_t do_sealed(unit_t *unit, const hal_devices_t *devices,
                                    command_reader_t *body)
{
    if (body->left < 1u + SEAL_BYTES) {
        return UNIT_LINK_BAD_LENGTH;
    }
    command_reader_t inner = {.at = &body->at[1], .left = body->left - 1u - SEAL_BYTES};
    command_reader_t seal = {.at = &inner.at[inner.left], .left = SEAL_BYTES};
    const uint32_t counter = command_take_u32(&seal);
    const uint64_t mac = take_u64(&seal);
    const size_t covered = (size_t)body->left - MAC_BYTES;
    if (!access_sealed(&unit->store.access, body->at, covered, counter, mac)) {
        return in_session(unit, &inner) ? UNIT_LINK_NOT_SEALED : UNIT_LINK_NO_SESSION;
    }
    return carry_out(unit, devices, body->at[0], &inner, true);
}

unit_link_status_t unit_link_request(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                                     command_reader_t *body)
{
    const unit_link_status_t done = (op == UNIT_LINK_SEALED)
                                        ? do_sealed(unit, devices, body)
                                        : carry_out(unit, devices, op, body, false);
    return unit->link.answer.full ? UNIT_LINK_BAD_LENGTH : done;
}
