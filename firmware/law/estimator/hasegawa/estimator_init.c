#include "estimator.h"

#include <stddef.h>

/* The states' bound, over the board's full scale. */
#define ESTIMATOR_I_MAX_PU 2.0f

/* Adaptation angle: grows up to this share of the rotor's 1/Tr. */
#define ESTIMATOR_PHI_RAMP_TAU 1.7760728f

/* Corner of the slow part of e1 while dwelling, over the rotor's 1/Tr: far below the modulation. */
#define ESTIMATOR_RESIDUAL_TAU 0.16f

/* The paper gives eps1 = .008 without a unit; the law wants c in 1/(s Wb A). */
static float leak(const params_t *p)
{
    if (p->eps1_unit == 0u) {
        return speed_adaptation_leak_from_literal(p->eps1);
    }
    if (p->eps1_unit == 1u) {
        return speed_adaptation_leak_from_adaptive(p->eps1, p->adapt_ki);
    }
    return speed_adaptation_leak_per_sample(p->eps1, p->period_s);
}

static speed_adaptation_params_t adaptation_params(const params_t *p)
{
    return (speed_adaptation_params_t){.kp_rad_per_s_Wb_A = p->adapt_kp,
                                       .ki_rad_per_s2_Wb_A = p->adapt_ki,
                                       .leak_per_s_Wb_A = leak(p),
                                       .eps1_mode = (speed_adaptation_eps1_mode_t)p->eps1_mode,
                                       .accel_share = p->adapt_accel_share,
                                       .near_zero_on_rad_s = NUM_TWO_PI * p->eps1_on_Hz,
                                       .near_zero_off_rad_s = NUM_TWO_PI * p->eps1_off_Hz,
                                       .omega_max_rad_s = p->omega_max_rad_s,
                                       .phi_factor = p->phi_factor,
                                       .phi_ramp_rad_s =
                                           p->Rr_ohm / p->Lr_H / ESTIMATOR_PHI_RAMP_TAU};
}

/* With field weakening L goes on growing with the speed beyond the table's end. */
static bool init_table(estimator_config_t *cfg, const params_t *p, const gain_table_t *table)
{
    if (p->observer_gain_enable == 0u) {
        return true; /* L = 0 */
    }
    if (!gain_table_valid(table)) {
        return false;
    }
    cfg->table = table;
    cfg->table_last = gain_table_last(table);
    if (p->weaken_share > 0.0f) {
        cfg->table_end_rad_s = table->step_rad_s * (float)(table->entry_count - 1u);
    }
    return true;
}

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    *cfg = (estimator_config_t){
        .lambda_min_Wb = ESTIMATE_LAMBDA_MIN_PU * params->M_H * params->i_d_A,
        .table_end_rad_s = FLT_MAX,
        .residual_slow_gain = ESTIMATOR_RESIDUAL_TAU * motor->tau_per_s * params->period_s};
    const observer_params_t observer = {.i_max_A =
                                            ESTIMATOR_I_MAX_PU * params->current_full_scale_A,
                                        .lambda_max_Wb = params->lambda_max_Wb,
                                        .method = (observer_method_t)params->observer_method};
    const speed_adaptation_params_t adaptation = adaptation_params(params);
    return init_table(cfg, params, table) &&
           observer_init(&cfg->observer, &observer, motor, params->period_s) &&
           speed_adaptation_init(&cfg->adaptation, &adaptation, motor, params->period_s);
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    return cfg->table;
}
