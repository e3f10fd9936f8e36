#include "unit_link_drive.h"

#include "unit_signal.h"
#include "handover.h"

#include <stddef.h>

#define KNOWN_COMMANDS                                                                             \
    (SEQUENCE_CMD_RUN | SEQUENCE_CMD_FAULT_RESET | SEQUENCE_CMD_TORQUE_OFF |                       \
     SEQUENCE_CMD_COMMISSION | SEQUENCE_CMD_TORQUE_MODE)

/* A consistent sample is one that no control period fell into; the second look nearly always is. */
#define SAMPLE_TRIES 4u

unit_link_status_t unit_link_signal_info(command_reader_t *body, command_writer_t *w)
{
    const uint32_t number = command_take_u8(body);
    if (number >= (uint32_t)UNIT_SIGNALS) {
        return UNIT_LINK_NO_SUCH;
    }
    command_put_u8(w, (uint8_t)(unit_signal_is_float(number) ? PARAM_FLOAT : PARAM_UINT));
    command_put_text(w, unit_signal_name(number));
    return UNIT_LINK_OK;
}

unit_link_status_t unit_link_drive_command(unit_t *unit, command_reader_t *body)
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

unit_link_status_t unit_link_status(const unit_t *unit, command_writer_t *w)
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
    command_put_u32(w, t.speed_unknown);
    command_put_u32(w, link->terminal_faults);
    return UNIT_LINK_OK;
}

/* Some signals of one and the same period. */
unit_link_status_t unit_link_sample(const unit_t *unit, command_reader_t *body, command_writer_t *w)
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
    /* Whether a period fell into the reading no unit test decides. */
    for (uint32_t tries = 0u; tries < SAMPLE_TRIES; tries++) { /* GCOVR_EXCL_BR_LINE */
        period = unit->period_count;
        handover();
        for (uint32_t k = 0u; k < n; k++) {
            value[k] = unit_signal(unit, number[k]);
        }
        handover();
        if (period == unit->period_count) { /* GCOVR_EXCL_BR_LINE */
            break;
        }
    }
    command_put_u32(w, period);
    for (uint32_t k = 0u; k < n; k++) {
        command_put_u32(w, value[k]);
    }
    return UNIT_LINK_OK;
}
