#include "rotor_check.h"

#include <math.h>

#define ROTOR_MEAN_S 0.1f

/* |x| of 1.36 leaves .35 of M i along the current. A long current vector saturates the motor, M is
 * then down to a third of the parameter, and half the flux of V/f is enough if the rotor lags by no
 * more than that. In V/f itself half the flux is beyond the pull-out. */
#define ROTOR_LAG_PU   1.36f
#define ROTOR_ALONG_PU 0.35f
#define ROTOR_FLUX_PU  0.5f

/* Over Rs/(kr M), where EMF and resistance are alike. Only V/f and the lag ask for Rs. */
#define ROTOR_CURRENT_PU 0.25f
#define ROTOR_VOLTAGE_PU 2.0f

/* Over the EMF kr lambda Rr/Lr with which flux begins to build up; looks of either sign. */
#define ROTOR_START_PU    0.1f
#define ROTOR_START_LOOKS 3u
/* A 10 bit ADC moves the voltage of a 75 kW motor by .25 V per count; its EMF is 1.6 V at most. */
#define ROTOR_START_COUNTS 1.5f
/* Direct current brakes the flux with the rotor's time constant: what moves later is a load's work.
 */
#define ROTOR_START_S 0.5f

void rotor_check_init(rotor_check_config_t *cfg, const motor_model_t *motor, float lambda_Wb,
                      float count_V, float step_s)
{
    const float build_up_V = motor->kr * lambda_Wb * motor->tau_per_s;
    const float even_rad_s = motor->Rs_ohm / (motor->kr * motor->M_H);
    *cfg = (rotor_check_config_t){
        .sigma_Ls_H = motor->sigma_Ls_H,
        .kr_M_H = motor->kr * motor->M_H,
        .kr_lambda_Wb = motor->kr * lambda_Wb,
        .current_rad_s = ROTOR_CURRENT_PU * even_rad_s,
        .voltage_rad_s = ROTOR_VOLTAGE_PU * even_rad_s,
        .start_looks = (uint32_t)(ROTOR_START_S / step_s),
        .start_V = maxf(ROTOR_START_PU * build_up_V, ROTOR_START_COUNTS * count_V),
        .share = step_s / (step_s + ROTOR_MEAN_S)};
}

/* Written as enough >= needed, so that a NaN is lost. */
static bool follows(const rotor_check_config_t *cfg, const rotor_check_state_t *st,
                    const rotor_check_in_t *in)
{
    const float omega_rad_s = absf(in->omega_s_rad_s);
    if (in->voltage) {
        const float least_V = ROTOR_FLUX_PU * omega_rad_s * cfg->kr_lambda_Wb;
        return ab_norm2(st->power_VA) >= (least_V * least_V * st->i2_A2);
    }
    const float along_VA = (in->omega_s_rad_s < 0.0f) ? -st->power_VA.beta : st->power_VA.beta;
    const bool near = absf(st->power_VA.alpha) <= (ROTOR_LAG_PU * along_VA);
    const float linear_VA = ROTOR_ALONG_PU * omega_rad_s * cfg->kr_M_H * st->i2_A2;
    const float least_VA = ROTOR_FLUX_PU * omega_rad_s * cfg->kr_lambda_Wb * sqrtf(st->i2_A2);
    return (along_VA >= linear_VA) || (near && (along_VA >= least_VA));
}

rotor_check_t rotor_check_step(const rotor_check_config_t *cfg, rotor_check_state_t *st,
                               const rotor_check_in_t *in)
{
    const float i2_A2 = ab_norm2(in->i_A);
    const ab_t e_V = ab_sub(in->u_V, ab_scale(in->i_A, in->Rs_ohm));
    ab_t power_VA = ab_mul(e_V, ab_conj(in->i_A));
    power_VA.beta -= in->omega_s_rad_s * cfg->sigma_Ls_H * i2_A2;
    const ab_t mean_VA = ab_add(st->power_VA, ab_scale(ab_sub(power_VA, st->power_VA), cfg->share));
    const float mean_A2 = st->i2_A2 + cfg->share * (i2_A2 - st->i2_A2);
    const bool number = is_finite(mean_VA.alpha + mean_VA.beta + mean_A2);
    st->power_VA = number ? mean_VA : (ab_t){0.0f, 0.0f};
    st->i2_A2 = number ? mean_A2 : i2_A2;
    const float least_rad_s = in->voltage ? cfg->voltage_rad_s : cfg->current_rad_s;
    if (!(absf(in->omega_s_rad_s) >= least_rad_s)) {
        return ROTOR_NOT_SEEN;
    }
    return follows(cfg, st, in) ? ROTOR_FOLLOWS : ROTOR_LOST;
}

bool rotor_turns(const rotor_check_config_t *cfg, rotor_check_state_t *st,
                 const rotor_check_in_t *in)
{
    if (st->looks >= cfg->start_looks) {
        return false;
    }
    st->looks++;
    const float e_V = in->u_V.beta - in->Rs_ohm * in->i_A.beta;
    /* Twice in a row: the steps of a coarse ADC change their sign from look to look. */
    const float before_V = st->e_V;
    st->e_V = e_V;
    st->positive += (minf(e_V, before_V) > cfg->start_V) ? 1u : 0u;
    st->negative += (maxf(e_V, before_V) < -cfg->start_V) ? 1u : 0u;
    return (st->positive >= ROTOR_START_LOOKS) && (st->negative >= ROTOR_START_LOOKS);
}
