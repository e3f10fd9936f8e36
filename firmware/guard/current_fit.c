#include "current_fit.h"

#include "slots.h"

#define CURRENT_FIT_MEMORY_S    0.1f
#define CURRENT_FIT_FLUX        2.5f /* nominal: twice 1.25 */
#define CURRENT_FIT_RS_PU       1.0f /* off by */
#define CURRENT_FIT_SIGMA_LS_PU 0.3f
/* What the inverter may lose of the dc link, as a vector: 2 sqrt(2/3) of a leg's loss, which is a
 * dead time's share of the period and the devices' drop. At 200 us less than the first. */
#define CURRENT_FIT_INVERTER_PU 0.05f
#define CURRENT_FIT_DEAD_S      (2.0f * NUM_SQRT_2_3 * 4e-6f)
#define CURRENT_FIT_DROP_PU     0.01f
/* A motor of which the nameplate is known: the factors that commissioning accepts for Rs and that a
 * flux may be off by. */
#define CURRENT_FIT_UNKNOWN_RS   10.0f
#define CURRENT_FIT_UNKNOWN_FLUX 4.0f

bool current_fit_init(current_fit_config_t *cfg, const current_fit_params_t *params)
{
    if (!ALL_POSITIVE(params->period_s, params->Rs_ohm, params->sigma_Ls_H, params->flux_Wb,
                      params->M_H)) {
        return false;
    }
    const float window_s = (float)SLOT_COUNT * params->period_s;
    *cfg = (current_fit_config_t){
        .p = *params,
        .per_window_s = 1.0f / window_s,
        .keep = 1.0f - window_s / CURRENT_FIT_MEMORY_S,
        .inverter_s = window_s * maxf(CURRENT_FIT_INVERTER_PU,
                                      CURRENT_FIT_DROP_PU + CURRENT_FIT_DEAD_S / params->period_s),
        .limit_Wb = CURRENT_FIT_FLUX * params->flux_Wb};
    return cfg->keep > 0.0f;
}

bool current_fit_holds(const current_fit_config_t *cfg, current_fit_state_t *st, ab_t i_A,
                       float u_dc_V, bool motor_known)
{
    const current_fit_params_t *p = &cfg->p;
    const ab_t rs_Wb = ab_scale(st->i_sum_A, p->Rs_ohm * p->period_s);
    const ab_t leakage_Wb = ab_scale(ab_sub(i_A, st->i_A), p->sigma_Ls_H);
    const ab_t u_Wb = ab_scale(st->u_sum_V, p->period_s);
    const ab_t change_Wb = ab_sub(u_Wb, ab_add(rs_Wb, leakage_Wb));
    const float rs_pu = motor_known ? CURRENT_FIT_RS_PU : CURRENT_FIT_UNKNOWN_RS;
    const float most_Wb = cfg->limit_Wb + p->M_H * sqrtf(ab_norm2(i_A));
    const float limit_Wb = most_Wb * (motor_known ? 1.0f : CURRENT_FIT_UNKNOWN_FLUX);
    const float unknown_Wb = rs_pu * sqrtf(ab_norm2(rs_Wb)) +
                             CURRENT_FIT_SIGMA_LS_PU * sqrtf(ab_norm2(leakage_Wb)) +
                             cfg->inverter_s * u_dc_V;
    const ab_t psi_Wb = ab_add(ab_scale(st->psi_Wb, cfg->keep), change_Wb);
    const float b_Wb = cfg->keep * st->b_Wb + unknown_Wb;
    *st = (current_fit_state_t){.i_A = i_A,
                                .emf_V = ab_scale(change_Wb, cfg->per_window_s),
                                .psi_Wb = psi_Wb,
                                .b_Wb = b_Wb};
    const float allowed_Wb = limit_Wb + b_Wb;
    return ab_norm2(psi_Wb) <= (allowed_Wb * allowed_Wb); /* a NaN does not */
}
