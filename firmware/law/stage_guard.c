#include "stages.h"

/* A current of this share of its limit is all there is (square of .95). */
#define SPEED_AT_LIMIT_PU2 0.9f

static speed_basis_t speed_basis(mode_id_t mode)
{
    static const speed_basis_t of_mode[(uint32_t)MODE_DC_BRAKE + 1u] = {
        [MODE_OFF] = SPEED_BASIS_NONE,
        [MODE_PREMAGNETISE] = SPEED_BASIS_STANDING,
        [MODE_COMMISSIONING] = SPEED_BASIS_STANDING,
        [MODE_FLYING_START] = SPEED_BASIS_NOBODY,
        [MODE_REMAGNETISE] = SPEED_BASIS_ESTIMATE,
        [MODE_VECTOR] = SPEED_BASIS_ESTIMATE,
        [MODE_TAKE_OVER] = SPEED_BASIS_TAKEN_OVER,
        [MODE_I_F] = SPEED_BASIS_CURRENT,
        [MODE_VOLTS_PER_HERTZ] = SPEED_BASIS_VOLTAGE,
        [MODE_DC_BRAKE] = SPEED_BASIS_NOBODY};
    return ((uint32_t)mode <= (uint32_t)MODE_DC_BRAKE) ? of_mode[mode] : SPEED_BASIS_NOBODY;
}

/* Torque mode has two speeds it may not pass for a reference. */
static float vector_reference_rad_s(const vector_config_t *cfg, const vector_state_t *st,
                                    drive_aim_t aim, float omega_rad_s)
{
    return (aim == DRIVE_AIM_TORQUE)
               ? clampf(omega_rad_s, cfg->speed.torque_min_rad_s, cfg->speed.torque_max_rad_s)
               : st->speed.omega_ref_rad_s;
}

/* Where the speed comes from, and what it is compared with. */
static void set_speeds(const drive_config_t *cfg, const drive_state_t *st, const drive_in_t *asked,
                       ab_t i_s_A, speed_guard_in_t *in)
{
    const estimate_t *e = &st->estimator.estimate;
    in->basis = speed_basis(st->mode);
    if (in->basis == SPEED_BASIS_ESTIMATE) {
        in->omega_rad_s = e->omega_e_rad_s;
        in->omega_ref_rad_s = vector_reference_rad_s(&cfg->modes.vector, &st->modes.vector,
                                                     asked->aim, in->omega_rad_s);
        in->omega_s_rad_s = e->omega_s_rad_s;
        in->at_limit = speed_control_at_limit(&st->modes.vector.speed);
        /* An estimate in doubt that leaves its reference shows no speed either. */
        in->in_doubt = supervisor_speed_unknown(&st->supervisor) ||
                       ((st->supervisor.confidence != SUPERVISOR_CLOSED) &&
                        (st->guard.speed.deviation_s > 0.0f));
    } else if ((in->basis >= SPEED_BASIS_TAKEN_OVER) && (in->basis <= SPEED_BASIS_VOLTAGE)) {
        in->omega_rad_s = (in->basis == SPEED_BASIS_VOLTAGE) ? st->modes.volts.omega_rad_s
                                                             : st->modes.i_f.omega_rad_s;
        in->omega_ref_rad_s =
            (asked->aim == DRIVE_AIM_TORQUE) ? in->omega_rad_s : asked->omega_e_ref_rad_s;
        in->omega_s_rad_s = in->omega_rad_s;
        in->at_limit = ab_norm2(i_s_A) >= (SPEED_AT_LIMIT_PU2 * cfg->guard.i_max2_A2);
        /* The rotor may be locked (i_f.h). */
        in->in_doubt = st->modes.i_f.tries > I_F_TRIES;
    } else {
        /* 0, or nobody knows */
    }
}

static uint32_t look_at_speed(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                              const drive_out_t *out)
{
    speed_guard_in_t in = {.premagnetising = st->mode == MODE_PREMAGNETISE,
                           .rotor = {.voltage = st->mode == MODE_VOLTS_PER_HERTZ,
                                     .u_V = st->acting.ended_V,
                                     .i_A = out->meas.i_s_A,
                                     .Rs_ohm = drive_rs_ohm(cfg, st)}};
    set_speeds(cfg, st, asked, out->meas.i_s_A, &in);
    in.rotor.omega_s_rad_s = in.omega_s_rad_s;
    return speed_guard_look(&cfg->guard.speed, &st->guard.speed, &in);
}

uint32_t stage_guard_look(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                          const drive_out_t *out)
{
    if (st->mode == MODE_OFF) {
        return 0u;
    }
    if (st->slot == SLOT_GUARD_SPEED) {
        return look_at_speed(cfg, st, asked, out);
    }
    const premagnetise_state_t *found = &st->modes.premagnetise;
    const vector_config_t *vector = &cfg->modes.vector;
    const guard_look_t in = {
        .meas = &out->meas,
        .estimate = &st->estimator.estimate,
        .slot = st->slot,
        .controlled = (st->mode == MODE_VECTOR) || (st->mode == MODE_TAKE_OVER),
        .oriented = st->mode == MODE_VECTOR,
        .brake_on = st->limits.link.brake_on,
        /* After a flying start nobody knows what the legs lose, if that was to be found. */
        .sensed = (cfg->acting.source != ACTING_VOLTAGE_DUTY) &&
                  (found->leg_loss_found || !cfg->modes.premagnetise.identify_leg_loss),
        .u_duty_V = st->acting.ended_V,
        .u_s_V = out->u_s_V,
        .axis = out->axis,
        .i_ref_A = out->i_ref_A,
        .omega_ref_rad_s = asked->omega_e_ref_rad_s,
        .lambda_ref_Wb = vector->flux.lambda_ref_Wb - st->modes.vector.flux_reduction_Wb,
        .Rs_ohm = drive_rs_ohm(cfg, st)};
    return guard_look(&cfg->guard, &st->guard, &in);
}
