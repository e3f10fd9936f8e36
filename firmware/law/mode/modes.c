#include "modes.h"

#include "fault.h"

static mode_id_t selected_in_run(const modes_config_t *cfg, const modes_state_t *st,
                                 mode_id_t before, const mode_in_t *in)
{
    if (cfg->control == MODES_CONTROL_VOLTS_PER_HERTZ) {
        return MODE_VOLTS_PER_HERTZ;
    }
    if (cfg->control == MODES_CONTROL_I_F) {
        return MODE_I_F;
    }
    if (st->i_f.active) {
        return MODE_TAKE_OVER;
    }
    return dc_brake_wanted(&cfg->brake, &st->brake, before == MODE_DC_BRAKE, in) ? MODE_DC_BRAKE
                                                                                 : MODE_VECTOR;
}

mode_id_t modes_selected(const modes_config_t *cfg, const modes_state_t *st, mode_id_t before,
                         const mode_in_t *in)
{
    if (mode_running(in)) {
        return selected_in_run(cfg, st, before, in);
    }
    if (in->asked->mode == DRIVE_COMMISSION) {
        return MODE_COMMISSIONING;
    }
    if (cfg->flying.enable && (st->flying.phase == FLYING_START_SEARCH)) {
        return MODE_FLYING_START;
    }
    return (st->flying.phase == FLYING_START_CAUGHT) ? MODE_REMAGNETISE : MODE_PREMAGNETISE;
}

static request_t current_along_u(float i_d_A)
{
    return (request_t){.kind = REQUEST_CURRENT, .axis = {1.0f, 0.0f}, .i_ref_A = {i_d_A, 0.0f}};
}

/* Called by three modes; inlining it costs 32 B. */
APART static request_t voltage(ab_t u_ref_V)
{
    return (request_t){.kind = REQUEST_VOLTAGE, .axis = {1.0f, 0.0f}, .u_ref_V = u_ref_V};
}

static request_t i_f(const i_f_state_t *st)
{
    return (request_t){.kind = REQUEST_CURRENT,
                       .axis = st->axis,
                       .i_ref_A = {st->current_A, 0.0f},
                       .omega_e_rad_s = st->omega_rad_s};
}

static request_t premagnetise(const modes_config_t *cfg, modes_state_t *st, const mode_in_t *in,
                              uint32_t *faults)
{
    float i_d_A;
    const bool busy =
        premagnetise_measure(&cfg->premagnetise, &st->premagnetise, in, &i_d_A, faults);
    if (!busy) {
        i_d_A = cfg->vector.flux.i_d_A;
    }
    request_t request = current_along_u(i_d_A);
    request.busy = busy;
    return request;
}

static request_t commissioning(const mode_in_t *in)
{
    request_t request = current_along_u(in->asked->i_d_ref_A);
    request.busy = true;
    return request;
}

static request_t search(const modes_config_t *cfg, modes_state_t *st, const mode_in_t *in,
                        uint32_t *faults)
{
    const dc_current_in_t current_in = {.i_ref_A = {st->flying.current_A, 0.0f},
                                        .i_A = in->meas->i_s_A,
                                        .u_V = in->acting->ended_V,
                                        .Rs_ohm = in->Rs_ohm,
                                        .omega_rad_s = st->flying.rough_rad_s};
    request_t request =
        voltage(dc_current_step(&cfg->dc_current, &st->flying_current, &current_in));
    flying_start_step(&cfg->flying, &st->flying, st->flying_current.e_V, in->meas->i_s_A);
    request.busy = st->flying.phase == FLYING_START_SEARCH;
    if (st->flying.phase == FLYING_START_REFUSED) {
        *faults |= FAULT_FLYING_START;
    }
    return request;
}

static request_t volts_per_hertz(const modes_config_t *cfg, modes_state_t *st, const mode_in_t *in)
{
    request_t request =
        voltage(volts_per_hertz_step(&cfg->volts, &st->volts, modes_open_reference_rad_s(in),
                                     in->meas->i_s_A, in->meas->u_dc_V));
    request.omega_e_rad_s = st->volts.omega_rad_s;
    return request;
}

request_t modes_step(const modes_config_t *cfg, modes_state_t *st, mode_id_t mode,
                     const mode_in_t *in, uint32_t *faults)
{
    if (mode == MODE_COMMISSIONING) {
        return commissioning(in);
    }
    if (mode == MODE_FLYING_START) {
        return search(cfg, st, in, faults);
    }
    if ((mode == MODE_TAKE_OVER) || (mode == MODE_I_F)) {
        return i_f(&st->i_f);
    }
    if (mode == MODE_VOLTS_PER_HERTZ) {
        return volts_per_hertz(cfg, st, in);
    }
    if (mode == MODE_DC_BRAKE) {
        return voltage(dc_brake_step(&cfg->brake, &cfg->dc_current, &st->brake, in));
    }
    if (mode == MODE_PREMAGNETISE) {
        return premagnetise(cfg, st, in, faults);
    }
    return (request_t){.kind = REQUEST_CURRENT}; /* not here: no current */
}
