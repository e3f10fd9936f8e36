#include "heating.h"

/* The rotor of a motor with fan ends some 25 % warmer than its winding, and lags behind it by two
 * thirds of the winding's time constant: zh special hot_motor. */
#define HEATING_ROTOR_PU    0.25f
#define HEATING_ROTOR_QUICK 1.5f

/* A load step moves the slip within milliseconds, heat within minutes: between them, so that the
 * speed loop does not see its own current in the speed. */
#define HEATING_SLIP_S 0.3f

bool heating_init(heating_config_t *cfg, const heating_params_t *p, float step_s)
{
    *cfg = (heating_config_t){0};
    if (is_zero(p->winding_pu)) {
        cfg->slip_gain = step_s / (step_s + HEATING_SLIP_S);
        return true; /* off */
    }
    const float rated_A2 = p->rated_A * p->rated_A;
    const float rated_q_A2 = rated_A2 - p->i_d_A * p->i_d_A;
    if (!ALL_POSITIVE(p->winding_pu, rated_A2, rated_q_A2, p->tau_s, step_s) ||
        !(HEATING_ROTOR_QUICK * step_s < p->tau_s)) {
        return false;
    }
    *cfg = (heating_config_t){
        .fade = step_s / p->tau_s,
        .winding_per_A2 = p->winding_pu / rated_A2,
        .rotor_per_A2 = HEATING_ROTOR_PU * p->winding_pu / rated_q_A2,
        .slip_gain = step_s / (step_s + HEATING_SLIP_S),
    };
    return ALL_POSITIVE(cfg->fade, cfg->winding_per_A2, cfg->rotor_per_A2, cfg->slip_gain);
}

float heating_step(const heating_config_t *cfg, heating_state_t *st, const heating_in_t *in)
{
    if (in->Rs_ohm > 0.0f) {
        if (!(st->Rs_cold_ohm > 0.0f)) {
            st->Rs_cold_ohm = in->Rs_ohm;
        }
        st->winding_pu = in->Rs_ohm / st->Rs_cold_ohm - 1.0f;
    }
    const float rise_pu = cfg->fade * (cfg->winding_per_A2 * in->i2_A2 - st->winding_pu);
    const float rotor_pu = st->winding_pu + cfg->rotor_per_A2 * (in->i_q_A * in->i_q_A);
    st->winding_pu += rise_pu;
    st->rotor_pu += HEATING_ROTOR_QUICK * cfg->fade * (rotor_pu - st->rotor_pu);
    st->slip_rad_s +=
        cfg->slip_gain * ((st->rotor_pu + in->Rr_extra_pu) * in->slip_rad_s - st->slip_rad_s);
    return rise_pu * st->Rs_cold_ohm;
}
