#include "volts_per_hertz.h"

#include <math.h>

#include "trig.h"

/* The boost comes up in this time: the current follows Rs, not the leakage. */
#define VOLTS_PER_HERTZ_BOOST_S 0.2f

bool volts_per_hertz_init(volts_per_hertz_config_t *cfg, const volts_per_hertz_params_t *params,
                          float period_s)
{
    if (!positivef(params->psi_Wb) || !nonnegativef(params->boost_V) ||
        !positivef(params->slew_rad_s2) || !positivef(params->i_max_A) || !positivef(period_s)) {
        return false;
    }
    *cfg = (volts_per_hertz_config_t){
        .psi_Wb = params->psi_Wb,
        .boost_V = params->boost_V,
        .step_rad_s = params->slew_rad_s2 * period_s,
        .boost_step_V = params->boost_V * period_s / VOLTS_PER_HERTZ_BOOST_S,
        .i_max2_A2 = params->i_max_A * params->i_max_A,
        .period_s = period_s,
    };
    return true;
}

void volts_per_hertz_start(const volts_per_hertz_config_t *cfg, volts_per_hertz_state_t *st,
                           ab_t lambda_r_Wb, float omega_rad_s)
{
    const float length_Wb = sqrtf(ab_norm2(lambda_r_Wb));
    *st = (volts_per_hertz_state_t){0};
    if (positivef(length_Wb) && is_finite(omega_rad_s)) {
        const float per_Wb = ((omega_rad_s < 0.0f) ? -1.0f : 1.0f) / length_Wb;
        const ab_t axis = ab_scale((ab_t){-lambda_r_Wb.beta, lambda_r_Wb.alpha}, per_Wb);
        st->off_axis = ab_sub(axis, (ab_t){1.0f, 0.0f});
        st->omega_rad_s = omega_rad_s;
        st->boost_V = cfg->boost_V;
    }
}

ab_t volts_per_hertz_step(const volts_per_hertz_config_t *cfg, volts_per_hertz_state_t *st,
                          float omega_ref_rad_s, ab_t i_s_A, float u_dc_V)
{
    const float step_rad_s = limitf(omega_ref_rad_s - st->omega_rad_s, cfg->step_rad_s);
    const bool faster = (step_rad_s * st->omega_rad_s) > 0.0f;
    if (!faster || (ab_norm2(i_s_A) <= cfg->i_max2_A2)) {
        st->omega_rad_s += is_finite(omega_ref_rad_s) ? step_rad_s : 0.0f;
    }
    st->boost_V = minf(st->boost_V + cfg->boost_step_V, cfg->boost_V);

    const ab_t axis = ab_add(st->off_axis, (ab_t){1.0f, 0.0f});
    const float angle_rad = limitf(st->omega_rad_s * cfg->period_s, TRIG_SMALL_MAX_RAD);
    ab_t next = ab_mul(trig_unit(angle_rad), axis);
    next = ab_scale(next, 1.5f - 0.5f * ab_norm2(next)); /* length put right to first order */
    st->off_axis = ab_sub(next, (ab_t){1.0f, 0.0f});

    const float wanted_V = st->boost_V + cfg->psi_Wb * absf(st->omega_rad_s);
    return ab_scale(next, minf(wanted_V, NUM_SQRT_1_2 * maxf(u_dc_V, 0.0f)));
}
