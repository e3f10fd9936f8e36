#include "estimator.h"

#include <math.h>
#include <stddef.h>

#include "python_bridge.h"

static const python_bridge_t *other;

void python_bridge_register(const python_bridge_t *table)
{
    other = table;
}

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)motor;
    (void)table;
    const float values[] = {
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text) params->name,
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text) (float)params->name,
#define PARAM_E(group, name, choices, initial, access, text)                (float)params->name,
#include "param_list.def"
    };
    const uint32_t count = (uint32_t)(sizeof values / sizeof values[0]);
    cfg->numbers = (other != NULL) ? other->init(values, count) : 0u;
    return cfg->numbers != 0u;
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}

/* A state of zeros is a motor at rest: an object that has seen nothing. */
static uint32_t object_of(const estimator_config_t *cfg, estimator_state_t *st)
{
    if (st->object == 0u) {
        st->object = other->begin(cfg->numbers);
    }
    return st->object;
}

static void take(estimator_state_t *st, const float out[PYTHON_BRIDGE_OUT])
{
    estimate_t *e = &st->estimate;
    e->lambda_r_hat_Wb = (ab_t){out[0], out[1]};
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
    e->i_residual_A = (ab_t){out[2], out[3]};
    e->flux_correction_V = (ab_t){out[4], out[5]};
    e->omega_e_rad_s = out[6];
    e->omega_s_rad_s = out[7];
}

static void ask(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                const float *imposed_rad_s)
{
    const float given[PYTHON_BRIDGE_IN] = {in->u_s_V.alpha,
                                           in->u_s_V.beta,
                                           in->i_s_A.alpha,
                                           in->i_s_A.beta,
                                           in->expected_step_rad_s,
                                           in->frame_imposed ? 1.0f : 0.0f,
                                           in->omega_frame_rad_s,
                                           in->dwell,
                                           in->slip_extra_rad_s,
                                           in->tau_extra_per_s,
                                           (imposed_rad_s != NULL) ? *imposed_rad_s : 0.0f};
    float out[PYTHON_BRIDGE_OUT] = {0};
    const uint32_t object = object_of(cfg, st);
    if (imposed_rad_s != NULL) {
        other->hold(object, cfg->numbers, given, out);
    } else {
        other->step(object, cfg->numbers, given, out);
    }
    take(st, out);
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    ask(cfg, st, in, NULL);
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    ask(cfg, st, in, &omega_e_rad_s);
}

/* The object is forgotten: the next one begins at rest. */
void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    (void)i_s_A;
    *st = (estimator_state_t){
        .estimate = {.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s}};
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    const float given[PYTHON_BRIDGE_SEED] = {seed->i_s_A.alpha, seed->i_s_A.beta,
                                             seed->lambda_r_Wb.alpha, seed->lambda_r_Wb.beta,
                                             seed->omega_e_rad_s};
    float out[PYTHON_BRIDGE_OUT] = {0};
    other->seed(object_of(cfg, st), given, out);
    take(st, out);
}
