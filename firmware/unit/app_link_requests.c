#include "app_link_requests.h"

#include "app_link_records.h"
#include "app_signal.h"
#include "app_store_background.h"
#include "crc32c.h"
#include "handover.h"

#include <stddef.h>

#define KNOWN_COMMANDS                                                                             \
    (DRIVE_STATE_CMD_RUN | DRIVE_STATE_CMD_FAULT_RESET | DRIVE_STATE_CMD_TORQUE_OFF |              \
     DRIVE_STATE_CMD_COMMISSION | DRIVE_STATE_CMD_TORQUE_MODE)

/* A consistent sample is one that no control period fell into; the second look nearly always is. */
#define SAMPLE_TRIES 4u

static app_link_status_t do_hello(const app_t *app, const hal_devices_t *devices,
                                  command_writer_t *w)
{
    const gain_table_t *table = app->config.drive.table;
    command_put_u16(w, (uint16_t)APP_LINK_PROTOCOL);
    command_put_u16(w, (uint16_t)params_count());
    command_put_u16(w, (uint16_t)APP_SIGNALS);
    command_put_u32(w, app->trace.words);
    command_put_u32(w, (table != NULL) ? table->motor_id : 0u);
    command_put_u32(w, (table != NULL) ? table->crc32c : 0u);
    command_put_float(w, app->params.period_s);
    command_put_float(w, app->params.pole_pairs);
    command_put_text(w, (devices->identity != NULL) ? devices->identity : "");
    return APP_LINK_OK;
}

/* Who acts on the drive has to know a number that it alone was told, and since the drive's last
 * start: a host that goes on talking to a drive that was reset does not start it again. */
static app_link_status_t do_session(app_t *app, const hal_devices_t *devices, command_writer_t *w)
{
    const uint32_t clock_us =
        (devices->clock_us != NULL) ? devices->clock_us(devices->context) : 0u;
    const uint32_t seed[] = {app->link.session, app->period_count, clock_us, app->link.parser.good};
    const uint32_t number = crc32c(seed, sizeof seed);
    app->link.session = (number != 0u) ? number : 1u;
    command_put_u32(w, app->link.session);
    access_lock(&app->store.access); /* who unlocked it was somebody else */
    return APP_LINK_OK;
}

static bool in_session(const app_t *app, command_reader_t *body)
{
    const uint32_t number = command_take_u32(body);
    return (app->link.session != 0u) && (number == app->link.session);
}

static app_link_status_t param_info(const app_t *app, command_reader_t *body, command_writer_t *w)
{
    const uint16_t index = command_take_u16(body);
    const param_info_t *info = params_info(index);
    if (info == NULL) {
        return APP_LINK_NO_SUCH;
    }
    command_put_u8(w, (uint8_t)info->type);
    command_put_u8(w, (uint8_t)info->access);
    command_put_float(w, info->minimum);
    command_put_float(w, info->maximum);
    command_put_float(w, params_get((app->image != NULL) ? app->image : &app->params, index));
    command_put_text(w, info->name);
    command_put_text(w, info->unit);
    return APP_LINK_OK;
}

static app_link_status_t signal_info(command_reader_t *body, command_writer_t *w)
{
    const uint32_t number = command_take_u8(body);
    if (number >= (uint32_t)APP_SIGNALS) {
        return APP_LINK_NO_SUCH;
    }
    command_put_u8(w, (uint8_t)(app_signal_is_float(number) ? PARAM_FLOAT : PARAM_UINT));
    command_put_text(w, app_signal_name(number));
    return APP_LINK_OK;
}

static app_link_status_t do_get(const app_t *app, command_reader_t *body, command_writer_t *w)
{
    while (body->left >= 2u) {
        const uint16_t index = command_take_u16(body);
        if (params_info(index) == NULL) {
            return APP_LINK_NO_SUCH;
        }
        command_put_float(w, params_get(&app->params, index));
    }
    return APP_LINK_OK;
}

static app_link_status_t of_params(params_status_t status)
{
    switch (status) {
    case PARAMS_GATES_ON:
        return APP_LINK_NOT_NOW;
    case PARAMS_LOCKED:
        return APP_LINK_PROTECTED;
    case PARAMS_OK:
    case PARAMS_NOT_FINITE:
    case PARAMS_OUT_OF_RANGE:
    case PARAMS_NOT_WHOLE:
    case PARAMS_NO_SUCH:
    default:
        return (app_link_status_t)status; /* the same numbers */
    }
}

static app_link_status_t do_set(app_t *app, command_reader_t *body)
{
    const uint16_t index = command_take_u16(body);
    const float value = command_take_float(body);
    params_t changed = app->params;
    const params_status_t status =
        access_write(&app->store.access, &changed, index, value, !app_at_rest(app));
    if (status != PARAMS_OK) {
        return of_params(status);
    }
    /* The period is the timer's: it comes with the image. */
    if (float_bits(changed.period_s) != float_bits(app->params.period_s)) {
        return APP_LINK_REFUSED;
    }
    return app_reconfigure(app, &changed) ? APP_LINK_OK : APP_LINK_REFUSED;
}

static void put_u64(command_writer_t *w, uint64_t value)
{
    command_put_u32(w, (uint32_t)value);
    command_put_u32(w, (uint32_t)(value >> 32u));
}

static app_link_status_t do_challenge(app_t *app, const hal_devices_t *devices, command_writer_t *w)
{
    uint64_t entropy = 0u;
    uint64_t nonce = 0u;
    const bool drawn = (devices->entropy != NULL) && devices->entropy(devices->context, &entropy);
    app_store_t *s = &app->store;
    if (!access_challenge(&s->access_cfg, &s->access, drawn ? &entropy : NULL, &nonce)) {
        return APP_LINK_NOT_NOW;
    }
    put_u64(w, nonce);
    return APP_LINK_OK;
}

static app_link_status_t do_unlock(app_t *app, command_reader_t *body)
{
    const uint64_t low = command_take_u32(body);
    const uint64_t response = low | ((uint64_t)command_take_u32(body) << 32u);
    app_store_t *s = &app->store;
    return access_answer(&s->access_cfg, &s->access, response) ? APP_LINK_OK : APP_LINK_PROTECTED;
}

/* A drive that refused what it found in its store gets a new set only from who may change limits.
 */
static app_link_status_t do_save(app_t *app, const hal_devices_t *devices)
{
    if (!app_at_rest(app)) {
        return APP_LINK_NOT_NOW;
    }
    if (!app->configured && !app->store.access.unlocked) {
        return APP_LINK_PROTECTED;
    }
    return app_store_save(app, devices) ? APP_LINK_OK : APP_LINK_REFUSED;
}

static app_link_status_t do_store(const app_t *app, command_writer_t *w)
{
    const app_store_t *s = &app->store;
    const uint32_t words[] = {(uint32_t)s->found,        s->store.wanted ? 1u : 0u,
                              s->store.failed ? 1u : 0u, s->access.unlocked ? 1u : 0u,
                              s->report.taken,           s->report.missing,
                              s->report.unknown,         s->report.refused};
    for (size_t k = 0u; k < sizeof words / sizeof words[0]; k++) {
        command_put_u32(w, words[k]);
    }
    return APP_LINK_OK;
}

static app_link_status_t do_command(app_t *app, command_reader_t *body)
{
    const uint32_t bits = command_take_u32(body);
    const float omega_m_ref_rad_s = command_take_float(body);
    const uint32_t valid_ms = command_take_u16(body);
    const float torque_ref_Nm = (body->left > 0u) ? command_take_float(body) : 0.0f;
    if ((bits & ~KNOWN_COMMANDS) != 0u) {
        return APP_LINK_OUT_OF_RANGE;
    }
    if (!is_finite(omega_m_ref_rad_s) || !is_finite(torque_ref_Nm)) {
        return APP_LINK_NOT_FINITE;
    }
    app_link_t *link = &app->link;
    link->command = bits;
    link->omega_m_ref_rad_s = omega_m_ref_rad_s;
    link->torque_ref_Nm = torque_ref_Nm;
    link->commands++;
    link->reset = (bits & DRIVE_STATE_CMD_FAULT_RESET) != 0u;
    link->expired = false;
    link->commanded_at = app->period_count;
    link->valid_periods = 0u;
    if (valid_ms != 0u) {
        link->valid_periods = 1u + (uint32_t)((float)valid_ms * 1e-3f / app->params.period_s);
    }
    return APP_LINK_OK;
}

static app_link_status_t do_status(const app_t *app, command_writer_t *w)
{
    app_telemetry_t t;
    app_telemetry(app, &t);
    const app_link_t *link = &app->link;
    const uint32_t words[] = {t.state,
                              t.faults,
                              link->command,
                              app->period_count,
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
                            app->last.meas.u_dc_V,
                            t.stator_frequency_Hz,
                            t.Rs_hat_ohm};
    for (size_t k = 0u; k < sizeof words / sizeof words[0]; k++) {
        command_put_u32(w, words[k]);
    }
    for (size_t k = 0u; k < sizeof values / sizeof values[0]; k++) {
        command_put_float(w, values[k]);
    }
    return APP_LINK_OK;
}

/* Some signals of one and the same period. */
static app_link_status_t do_sample(const app_t *app, command_reader_t *body, command_writer_t *w)
{
    uint32_t value[TRACE_SIGNALS_MAX];
    uint8_t number[TRACE_SIGNALS_MAX];
    const uint32_t n = body->left;
    if (n > TRACE_SIGNALS_MAX) {
        return APP_LINK_OUT_OF_RANGE;
    }
    for (uint32_t k = 0u; k < n; k++) {
        number[k] = command_take_u8(body);
        if (number[k] >= (uint32_t)APP_SIGNALS) {
            return APP_LINK_NO_SUCH;
        }
    }
    uint32_t period = 0u;
    for (uint32_t tries = 0u; tries < SAMPLE_TRIES; tries++) {
        period = app->period_count;
        handover();
        for (uint32_t k = 0u; k < n; k++) {
            value[k] = app_signal(app, &app->output, number[k]);
        }
        handover();
        if (period == app->period_count) {
            break;
        }
    }
    command_put_u32(w, period);
    for (uint32_t k = 0u; k < n; k++) {
        command_put_u32(w, value[k]);
    }
    return APP_LINK_OK;
}

/* Bytes of a body, before anything is done: a request with more or less is of another protocol. */
static bool length_good(uint8_t op, uint32_t n)
{
    switch (op) {
    case APP_LINK_PARAM_INFO:
        return n == 2u;
    case APP_LINK_SIGNAL_INFO:
        return n == 1u;
    case APP_LINK_GET:
        return (n % 2u) == 0u;
    case APP_LINK_SET:
        return n == 10u;
    case APP_LINK_COMMAND:
        return (n == 14u) || (n == 18u);
    case APP_LINK_SAMPLE:
        return n <= TRACE_SIGNALS_MAX;
    case APP_LINK_TRACE_ARM:
        return n >= 4u; /* the rest when its signals were counted */
    case APP_LINK_UNLOCK:
        return n == 12u;
    case APP_LINK_SAVE:
    case APP_LINK_CHALLENGE:
    case APP_LINK_TRACE_READ:
    case APP_LINK_TRACE_STOP:
    case APP_LINK_FAULT_READ:
    case APP_LINK_FAULT_CLEAR:
        return n == 4u;
    default:
        return n == 0u;
    }
}

static bool acts(uint8_t op)
{
    switch (op) {
    case APP_LINK_SET:
    case APP_LINK_SAVE:
    case APP_LINK_CHALLENGE:
    case APP_LINK_UNLOCK:
    case APP_LINK_COMMAND:
    case APP_LINK_TRACE_ARM:
    case APP_LINK_TRACE_STOP:
    case APP_LINK_FAULT_CLEAR:
        return true;
    default:
        return false;
    }
}

static app_link_status_t act(app_t *app, const hal_devices_t *devices, uint8_t op,
                             command_reader_t *body, command_writer_t *w)
{
    if (!in_session(app, body)) {
        return APP_LINK_NO_SESSION;
    }
    switch (op) {
    case APP_LINK_SET:
        return do_set(app, body);
    case APP_LINK_SAVE:
        return do_save(app, devices);
    case APP_LINK_CHALLENGE:
        return do_challenge(app, devices, w);
    case APP_LINK_UNLOCK:
        return do_unlock(app, body);
    case APP_LINK_COMMAND:
        return do_command(app, body);
    case APP_LINK_TRACE_ARM:
        return app_link_trace_setup(app, body, w);
    case APP_LINK_TRACE_STOP:
        trace_stop(&app->trace);
        return APP_LINK_OK;
    default: /* APP_LINK_FAULT_CLEAR */
        fault_record_clear(&app->fault_recorder);
        return APP_LINK_OK;
    }
}

static app_link_status_t tell(app_t *app, const hal_devices_t *devices, uint8_t op,
                              command_reader_t *body, command_writer_t *w)
{
    switch (op) {
    case APP_LINK_HELLO:
        return do_hello(app, devices, w);
    case APP_LINK_SESSION:
        return do_session(app, devices, w);
    case APP_LINK_PARAM_INFO:
        return param_info(app, body, w);
    case APP_LINK_SIGNAL_INFO:
        return signal_info(body, w);
    case APP_LINK_GET:
        return do_get(app, body, w);
    case APP_LINK_STORE:
        return do_store(app, w);
    case APP_LINK_STATUS:
        return do_status(app, w);
    case APP_LINK_SAMPLE:
        return do_sample(app, body, w);
    case APP_LINK_COMMISSIONING:
        return app_link_commissioning(app, w);
    case APP_LINK_TRACE_STATE:
        return app_link_trace_status(app, w);
    case APP_LINK_TRACE_READ:
        return app_link_trace_read(app, body, w);
    case APP_LINK_FAULT_LOG:
        return app_link_fault_log(app, w);
    case APP_LINK_FAULT_RECORD:
        return app_link_fault_record(app, w);
    case APP_LINK_FAULT_READ:
        return app_link_fault_read(app, body, w);
    default:
        return APP_LINK_NO_SUCH_OP;
    }
}

app_link_status_t app_link_request(app_t *app, const hal_devices_t *devices, uint8_t op,
                                   command_reader_t *body)
{
    if (!length_good(op, body->left)) {
        return APP_LINK_BAD_LENGTH;
    }
    command_writer_t *w = &app->link.answer;
    command_put_u8(w, (uint8_t)APP_LINK_OK);
    const app_link_status_t done =
        acts(op) ? act(app, devices, op, body, w) : tell(app, devices, op, body, w);
    return w->full ? APP_LINK_BAD_LENGTH : done;
}
