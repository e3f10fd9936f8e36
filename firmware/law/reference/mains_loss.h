/* Mains loss: the shaft's energy keeps the dc link up until the motor stands still.
 *
 * Power P = gain (u_hold - u_dc) is taken from the shaft, torque -P/w: just enough for losses and
 * electronics. It ends when the mains returns, and below the speed that can still cover the losses.
 * A motor that was slower from the start continues on the energy of the capacitors, so that a short
 * dip has no effect.
 */
#ifndef MAINS_LOSS_H
#define MAINS_LOSS_H

#include <stdbool.h>
#include <stdint.h>

#include "motor.h"

typedef struct {
    float u_lost_V; /* dc link below: mains lost; 0: off */
    float u_hold_V; /* kept there */
    float u_back_V; /* above: the mains is back */
    float back_s;   /* for so long */
    float gain_W_per_V;
    float stop_rad_s; /* electrical speed below which nothing is regained */
    float lambda_Wb;
    float i_q_max_A;
} mains_loss_params_t;

typedef struct {
    float u_lost_V;
    float u_hold_V;
    float u_back_V;
    uint32_t back_periods;
    float A_rad_s_per_V; /* electrical, at nominal flux: i_q = this (u_hold - u_dc)/w */
    float stop_rad_s;
    float i_q_max_A;
} mains_loss_config_t;

typedef struct {
    bool active;
    bool over; /* too slow to go on: stays until the state is zeroed */
    uint32_t back_periods;
    float i_q_A; /* torque current at nominal flux, while active */
} mains_loss_state_t;

/* False for a number that is not finite or of the wrong sign, or unless u_lost < u_hold < u_back.
 * With u_lost 0 nothing else is checked. */
CHECKED bool mains_loss_init(mains_loss_config_t *cfg, const mains_loss_params_t *params,
                             const motor_model_t *motor, float period_s);

/* True if there is nothing to do in this period: the only check on a healthy dc link. */
static inline bool mains_loss_idle(const mains_loss_config_t *cfg, const mains_loss_state_t *st,
                                   float u_dc_V)
{
    return (u_dc_V >= cfg->u_lost_V) && !st->active;
}

/* One period in which it is not idle. */
COLD void mains_loss_step(const mains_loss_config_t *cfg, mains_loss_state_t *st, float u_dc_V,
                          float omega_e_rad_s);

#endif
