#include "unit_link_requests.h"

#include "unit_link_params.h"
#include "unit_link_records.h"
#include "unit_signal.h"
#include "unit_store_background.h"
#include "crc32c.h"
#include "handover.h"

#include <stddef.h>

#define KNOWN_COMMANDS                                                                             \
    (SEQUENCE_CMD_RUN | SEQUENCE_CMD_FAULT_RESET | SEQUENCE_CMD_TORQUE_OFF |                       \
     SEQUENCE_CMD_COMMISSION | SEQUENCE_CMD_TORQUE_MODE)

/* A consistent sample is one that no control period fell into; the second look nearly always is. */
#define SAMPLE_TRIES 4u

static unit_link_status_t do_hello(const unit_t *unit, const hal_devices_t *devices,
                                   command_writer_t *w)
{
    const gain_table_t *table = unit_config(unit)->drive.estimator.table;
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

static unit_link_status_t signal_info(command_reader_t *body, command_writer_t *w)
{
    const uint32_t number = command_take_u8(body);
    if (number >= (uint32_t)UNIT_SIGNALS) {
        return UNIT_LINK_NO_SUCH;
    }
    command_put_u8(w, (uint8_t)(unit_signal_is_float(number) ? PARAM_FLOAT : PARAM_UINT));
    command_put_text(w, unit_signal_name(number));
    return UNIT_LINK_OK;
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

static unit_link_status_t do_unlock(unit_t *unit, command_reader_t *body)
{
    const uint64_t low = command_take_u32(body);
    const uint64_t response = low | ((uint64_t)command_take_u32(body) << 32u);
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

static unit_link_status_t do_command(unit_t *unit, command_reader_t *body)
{
    const uint32_t bits = command_take_u32(body);
    const float omega_m_ref_rad_s = command_take_float(body);
    const uint32_t valid_ms = command_take_u16(body);
    const float torque_ref_Nm = (body->left > 0u) ? command_take_float(body) : 0.0f;
    if ((bits & ~KNOWN_COMMANDS) != 0u) {
        return UNIT_LINK_OUT_OF_RANGE;
    }
    if (!is_finite(omega_m_ref_rad_s) || !is_finite(torque_ref_Nm)) {
        return UNIT_LINK_NOT_FINITE;
    }
    unit_link_t *link = &unit->link;
    link->command = bits;
    link->omega_m_ref_rad_s = omega_m_ref_rad_s;
    link->torque_ref_Nm = torque_ref_Nm;
    link->commands++;
    link->reset = (bits & SEQUENCE_CMD_FAULT_RESET) != 0u;
    link->expired = false;
    link->commanded_at = unit->period_count;
    link->valid_periods = 0u;
    if (valid_ms != 0u) {
        link->valid_periods = 1u + (uint32_t)((float)valid_ms * 1e-3f / unit->params.period_s);
    }
    return UNIT_LINK_OK;
}

static unit_link_status_t do_status(const unit_t *unit, command_writer_t *w)
{
    unit_telemetry_t t;
    unit_telemetry(unit, &t);
    const unit_link_t *link = &unit->link;
    const uint32_t words[] = {t.state,
                              t.faults,
                              link->command,
                              unit->period_count,
                              link->expired ? 1u : 0u,
                              link->parser.good,
                              link->parser.bad,
                              t.confidence,
                              t.supervisor_reasons};
    const float values[] = {link->omega_m_ref_rad_s,
                            t.omega_m_hat_rad_s,
                            t.omega_m_bound_rad_s,
                            t.lambda_hat_Wb,
                            t.i_d_A,
                            t.i_q_A,
                            t.i_q_ref_A,
                            unit->last.meas.u_dc_V,
                            t.stator_frequency_Hz,
                            t.Rs_hat_ohm};
    for (size_t k = 0u; k < sizeof words / sizeof words[0]; k++) {
        command_put_u32(w, words[k]);
    }
    for (size_t k = 0u; k < sizeof values / sizeof values[0]; k++) {
        command_put_float(w, values[k]);
    }
    return UNIT_LINK_OK;
}

/* Some signals of one and the same period. */
static unit_link_status_t do_sample(const unit_t *unit, command_reader_t *body, command_writer_t *w)
{
    uint32_t value[TRACE_SIGNALS_MAX];
    uint8_t number[TRACE_SIGNALS_MAX];
    const uint32_t n = body->left;
    if (n > TRACE_SIGNALS_MAX) {
        return UNIT_LINK_OUT_OF_RANGE;
    }
    for (uint32_t k = 0u; k < n; k++) {
        number[k] = command_take_u8(body);
        if (number[k] >= (uint32_t)UNIT_SIGNALS) {
            return UNIT_LINK_NO_SUCH;
        }
    }
    uint32_t period = 0u;
    for (uint32_t tries = 0u; tries < SAMPLE_TRIES; tries++) {
        period = unit->period_count;
        handover();
        for (uint32_t k = 0u; k < n; k++) {
            value[k] = unit_signal(unit, &unit->output, number[k]);
        }
        handover();
        if (period == unit->period_count) {
            break;
        }
    }
    command_put_u32(w, period);
    for (uint32_t k = 0u; k < n; k++) {
        command_put_u32(w, value[k]);
    }
    return UNIT_LINK_OK;
}

/* Bytes of a body, before anything is done: a request with more or less is of another protocol. */
static bool length_good(uint8_t op, uint32_t n)
{
    switch (op) {
    case UNIT_LINK_PARAM_INFO:
    case UNIT_LINK_STORE_ENTRY:
        return n == 2u;
    case UNIT_LINK_SIGNAL_INFO:
        return n == 1u;
    case UNIT_LINK_GET:
        return (n % 2u) == 0u;
    case UNIT_LINK_SET:
        return n == 10u;
    case UNIT_LINK_COMMAND:
        return (n == 14u) || (n == 18u);
    case UNIT_LINK_SAMPLE:
        return n <= TRACE_SIGNALS_MAX;
    case UNIT_LINK_TRACE_ARM:
        return n >= 4u; /* the rest when its signals were counted */
    case UNIT_LINK_UNLOCK:
        return n == 12u;
    case UNIT_LINK_SAVE:
    case UNIT_LINK_CHALLENGE:
    case UNIT_LINK_TRACE_READ:
    case UNIT_LINK_TRACE_STOP:
    case UNIT_LINK_FAULT_READ:
    case UNIT_LINK_FAULT_CLEAR:
        return n == 4u;
    default:
        return n == 0u;
    }
}

static bool acts(uint8_t op)
{
    switch (op) {
    case UNIT_LINK_SET:
    case UNIT_LINK_SAVE:
    case UNIT_LINK_CHALLENGE:
    case UNIT_LINK_UNLOCK:
    case UNIT_LINK_COMMAND:
    case UNIT_LINK_TRACE_ARM:
    case UNIT_LINK_TRACE_STOP:
    case UNIT_LINK_FAULT_CLEAR:
        return true;
    default:
        return false;
    }
}

static unit_link_status_t act(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                              command_reader_t *body, command_writer_t *w)
{
    if (!in_session(unit, body)) {
        return UNIT_LINK_NO_SESSION;
    }
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
        return do_command(unit, body);
    case UNIT_LINK_TRACE_ARM:
        return unit_link_trace_setup(unit, body, w);
    case UNIT_LINK_TRACE_STOP:
        trace_stop(&unit->trace);
        return UNIT_LINK_OK;
    default: /* UNIT_LINK_FAULT_CLEAR */
        fault_record_clear(&unit->fault_recorder);
        return UNIT_LINK_OK;
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
        return signal_info(body, w);
    case UNIT_LINK_GET:
        return unit_link_get(unit, body, w);
    case UNIT_LINK_STORE:
        return unit_link_store(unit, w);
    case UNIT_LINK_STORE_ENTRY:
        return unit_link_store_entry(unit, devices, body, w);
    case UNIT_LINK_STATUS:
        return do_status(unit, w);
    case UNIT_LINK_SAMPLE:
        return do_sample(unit, body, w);
    case UNIT_LINK_COMMISSIONING:
        return unit_link_commissioning(unit, w);
    case UNIT_LINK_TRACE_STATE:
        return unit_link_trace_status(unit, w);
    case UNIT_LINK_TRACE_READ:
        return unit_link_trace_read(unit, body, w);
    case UNIT_LINK_FAULT_LOG:
        return unit_link_fault_log(unit, w);
    case UNIT_LINK_FAULT_RECORD:
        return unit_link_fault_record(unit, w);
    case UNIT_LINK_FAULT_READ:
        return unit_link_fault_read(unit, body, w);
    default:
        return UNIT_LINK_NO_SUCH_OP;
    }
}

unit_link_status_t unit_link_request(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                                     command_reader_t *body)
{
    if (!length_good(op, body->left)) {
        return UNIT_LINK_BAD_LENGTH;
    }
    command_writer_t *w = &unit->link.answer;
    command_put_u8(w, (uint8_t)UNIT_LINK_OK);
    const unit_link_status_t done =
        acts(op) ? act(unit, devices, op, body, w) : tell(unit, devices, op, body, w);
    return w->full ? UNIT_LINK_BAD_LENGTH : done;
}
