/* Flux reference by operating point: limited by the dc link, reduced to what the torque needs.
 *
 * Weakening: reduction' = bw (|u| - u_max)/(kr w), u_max = share u_dc/sqrt(2): the voltage vector
 * keeps that distance from the hexagon at any speed, dc link and load.
 *
 * A full dc link: what it does not take, the motor has to. Where it takes x less of the braking
 * current than there may be, the voltage counts 1 - x, at least half. With less flux the same
 * torque needs more current, and the copper's losses grow. x comes at once and goes slowly:
 * a flux that came back as soon as the link had room filled it again, once a second (zh envelope:
 * run 146 of 724531672).
 *
 * Economy: the copper loss Rs (i_d^2 + i_q^2) + kr^2 Rr i_q^2 of a torque is least at lambda^2 = M
 * |T|/(p kr) sqrt(1 + kr^2 Rr/Rs). The lower of the two fluxes counts.
 *
 * At the voltage limit the torque has its maximum at sigma Ls i_q = Ls i_d (pull-out); i_q stays a
 * share below that. i_d is that of the reference, or of the estimated flux where that is larger, up
 * to half of what the voltage allows: where the leakage is less than known, weakening asks for half
 * of the flux that is there.
 */
#ifndef FLUX_REFERENCE_H
#define FLUX_REFERENCE_H

#include <stdbool.h>

#include "motor.h"
#include "num.h"

typedef struct {
    float voltage_share;         /* of u_dc/sqrt(2) that may be used; 0: no weakening */
    float bandwidth_rad_s;       /* of the voltage controller */
    float pull_out_share;        /* share of the i_q of largest torque */
    float economy_min_pu;        /* economy: lowest flux over nominal; 0: no economy */
    float economy_from_rad_s;    /* |w_s| from which economy acts: far from zero frequency */
    float economy_filter_s;      /* time constant of taking flux away */
    float economy_slew_Wb_per_s; /* rate of giving flux back */
    float lambda_nominal_Wb;
    float lambda_min_Wb; /* of either */
    float i_q_max_A;
} flux_reference_params_t;

typedef struct {
    float voltage_share; /* of u_dc; 0: no weakening */
    float economy_min_Wb;
    float economy_Wb2_per_Nm; /* 0: no economy */
    float economy_from_rad_s;
    float economy_gain;
    float economy_step_Wb;
    float gain_Wb_rad_s_per_V; /* of the voltage controller, per step */
    float lambda_nominal_Wb;
    float reduction_max_Wb; /* of nominal flux */
    float i_q_per_Wb_A;
    float i_q_max_A;
    float inv_period_per_s;
    float full_keep; /* of a link that was full, per step */
} flux_reference_config_t;

typedef struct {
    float weakened_Wb;     /* nominal flux minus what the voltage allows */
    float economy_Wb;      /* nominal flux minus what the torque needs */
    float reduction_Wb;    /* the larger of the two, in force */
    float rate_Wb_per_s;   /* of the flux, in the last step */
    float i_q_reduction_A; /* largest torque current minus what pull-out allows */
    float full_pu;         /* the same after it has been larger: it goes slowly */
} flux_reference_state_t;

typedef struct {
    float u_V; /* length of the voltage vector at the motor */
    float u_dc_V;
    float omega_s_rad_s;
    float torque_Nm; /* wanted */
    float lambda_Wb; /* estimated */
    float full_pu;   /* share of the braking current that the link does not take */
} flux_reference_in_t;

/* False for a number that is not finite or of the wrong sign, or a share or flux above its maximum.
 * With both off nothing else is checked. */
CHECKED bool flux_reference_init(flux_reference_config_t *cfg,
                                 const flux_reference_params_t *params, const motor_model_t *motor,
                                 float period_s);

static inline bool flux_reference_on(const flux_reference_config_t *cfg)
{
    return (cfg->voltage_share > 0.0f) || (cfg->economy_Wb2_per_Nm > 0.0f);
}

/* Once per schedule. A number that is not finite changes nothing. */
COLD void flux_reference_step(const flux_reference_config_t *cfg, flux_reference_state_t *st,
                              const flux_reference_in_t *in);

/* Weakens at once to what the voltage allows at this speed: a start at speed. */
COLD void flux_reference_start(const flux_reference_config_t *cfg, flux_reference_state_t *st,
                               float omega_s_rad_s, float u_dc_V);

#endif
