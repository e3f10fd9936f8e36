/* Request -> duty: current control, delay compensation, inverter error, SVPWM.
 *
 * The duties act later, so voltage and current are rotated to the future angle of the frame. A
 * voltage request is realised as it is, and the current controllers follow it, so that they take
 * over without a step.
 */
#ifndef VOLTAGE_H
#define VOLTAGE_H

#include "current_control.h"
#include "inverter_error.h"
#include "svpwm.h"
#include "trig.h"

typedef struct {
    current_control_config_t current;
    inverter_error_config_t error;
    svpwm_config_t svpwm;
    float delay_comp_s; /* the reference voltage is rotated ahead by w_s times this */
} voltage_config_t;

typedef struct {
    current_control_state_t current;
    ab_t ahead; /* the delay's angle as a unit vector, less (1, 0) */
} voltage_state_t;

typedef struct {
    bool follow; /* u_ref_V acts; else i_ref_A is controlled */
    ab_t axis;
    ab_t u_ref_V; /* stationary */
    dq_t i_ref_A;
    dq_t i_A;
    ab_t i_s_A;
    float omega_s_rad_s;
    float omega_e_rad_s;
    float lambda_Wb;
    leg_loss_t leg_loss; /* in dead time and devices; whole_V 0: no compensation */
    float u_dc_V;
} voltage_in_t;

typedef struct {
    uvw_t duty;
    ab_t u_V;      /* at the motor, by these duties */
    ab_t u_legs_V; /* of the duties themselves: u_V and what the inverter loses */
} voltage_out_t;

/* Angle of the delay at this speed of the frame; need not be called every period. */
static inline void voltage_angle(const voltage_config_t *cfg, voltage_state_t *st,
                                 float omega_s_rad_s)
{
    const ab_t unit = trig_ahead(omega_s_rad_s, cfg->delay_comp_s);
    st->ahead = (ab_t){unit.alpha - 1.0f, unit.beta};
}

voltage_out_t voltage_step(const voltage_config_t *cfg, voltage_state_t *st,
                           const voltage_in_t *in);

#endif
