#include "i_f.h"

#include "trig.h"

/* Share of the dc link that the rotor flux M I may induce: half of what svpwm can give. */
#define I_F_VOLTAGE_SHARE 0.35f

/* Below this there is no current whose direction says anything. */
#define I_F_I_MIN_A 1e-3f

#define I_F_MAX_PERIODS 1e9f

/* Twice the supervisor's time for CLOSED, and six of the mean. */
#define I_F_LOOK_S  0.6f
#define I_F_MEAN_S  0.1f
#define I_F_FLUX_PU 0.5f

bool i_f_init(i_f_config_t *cfg, const i_f_params_t *params, const motor_model_t *motor,
              float period_s)
{
    *cfg = (i_f_config_t){0};
    if (is_zero(params->current_A)) {
        return true; /* off */
    }
    const float periods = params->timeout_s / period_s;
    if (!ALL_POSITIVE(params->current_A, params->slew_A_per_s, params->slew_rad_s2,
                      params->return_rad_s, period_s, motor->M_H, motor->kr) ||
        !nonnegativef(params->timeout_s) || !(periods < I_F_MAX_PERIODS)) {
        return false;
    }
    *cfg = (i_f_config_t){
        .current_A = params->current_A,
        .step_A = params->slew_A_per_s * period_s,
        .step_rad_s = params->slew_rad_s2 * period_s,
        .return_rad_s = params->return_rad_s,
        .timeout_periods = (uint32_t)periods,
        .A_rad_s_per_V = I_F_VOLTAGE_SHARE / (motor->kr * motor->M_H),
        .look_periods = (uint32_t)(I_F_LOOK_S / period_s),
        .period_s = period_s,
        .mean_share = period_s / (period_s + I_F_MEAN_S),
        .Rs_ohm = motor->Rs_ohm,
        .sigma_Ls_H = motor->sigma_Ls_H,
        .inv_kr = 1.0f / motor->kr,
        .slip_ohm = motor->tau_per_s * motor->M_H,
    };
    return true;
}

void i_f_start(i_f_state_t *st, ab_t i_s_A, float omega_rad_s)
{
    const float length_A = sqrtf(ab_norm2(i_s_A));
    const bool current = length_A > I_F_I_MIN_A;
    *st = (i_f_state_t){
        .tries = st->tries,
        .active = true,
        .axis = current ? ab_scale(i_s_A, 1.0f / length_A) : (ab_t){1.0f, 0.0f},
        .current_A = current ? length_A : 0.0f,
        .omega_rad_s = is_finite(omega_rad_s) ? omega_rad_s : 0.0f,
    };
}

/* The vector turned by the angle of one period; its length is put right to first order. */
static ab_t turned(ab_t axis, float angle_rad)
{
    const ab_t next = ab_mul(trig_unit(limitf(angle_rad, TRIG_SMALL_MAX_RAD)), axis);
    return ab_scale(next, 1.5f - 0.5f * ab_norm2(next));
}

bool i_f_step(const i_f_config_t *cfg, i_f_state_t *st, const i_f_in_t *in)
{
    const float behind_rad_s = in->omega_ref_rad_s - st->omega_rad_s;
    if (is_finite(behind_rad_s)) {
        st->omega_rad_s += limitf(behind_rad_s, cfg->step_rad_s);
    }
    st->axis = turned(st->axis, st->omega_rad_s * cfg->period_s);

    const float room_A = cfg->A_rad_s_per_V * maxf(in->u_dc_V, 0.0f);
    float length_A = cfg->current_A;
    if (length_A * absf(st->omega_rad_s) > room_A) {
        length_A = room_A / absf(st->omega_rad_s);
    }
    st->current_A += limitf(length_A - st->current_A, cfg->step_A);

    const bool hopeless = in->lost && i_f_observable(cfg, st);
    if (!hopeless) {
        st->lost_periods = 0u;
    } else if (st->lost_periods < cfg->timeout_periods) {
        st->lost_periods++;
    } else {
        return true;
    }
    return false;
}

void i_f_see_flux(const i_f_config_t *cfg, i_f_state_t *st, ab_t u_s_V, ab_t i_s_A)
{
    const float inv_rad_s = 1.0f / st->omega_rad_s;
    const dq_t e_V = dq_from_ab(ab_sub(u_s_V, ab_scale(i_s_A, cfg->Rs_ohm)), st->axis);
    const dq_t i_A = dq_from_ab(i_s_A, st->axis);
    const ab_t flux_Wb = {
        cfg->inv_kr * (inv_rad_s * e_V.q - cfg->sigma_Ls_H * i_A.d),
        cfg->inv_kr * (-(inv_rad_s * e_V.d) - cfg->sigma_Ls_H * i_A.q),
    };
    const ab_t moved_Wb = ab_scale(ab_sub(flux_Wb, st->flux_Wb), cfg->mean_share);
    if (is_finite(moved_Wb.alpha + moved_Wb.beta)) {
        st->flux_Wb = ab_add(st->flux_Wb, moved_Wb);
    }
}

bool i_f_found(const i_f_config_t *cfg, const i_f_state_t *st, float nominal_Wb, ab_t *flux_Wb,
               float *omega_e_rad_s)
{
    const float flux2_Wb2 = ab_norm2(st->flux_Wb);
    const float least_Wb = I_F_FLUX_PU * nominal_Wb;
    const bool follows =
        (flux2_Wb2 >= least_Wb * least_Wb) && (absf(st->flux_Wb.beta) <= st->flux_Wb.alpha);
    if ((st->lost_periods < cfg->look_periods) || (st->tries >= I_F_LOOKS) || !follows) {
        return false;
    }
    /* The current across the flux: i_q = -|i| sin of the flux's angle. */
    const float slip_rad_s = -cfg->slip_ohm * st->current_A * st->flux_Wb.beta / flux2_Wb2;
    *flux_Wb = ab_mul(st->flux_Wb, st->axis);
    *omega_e_rad_s = st->omega_rad_s - slip_rad_s;
    return true;
}
