/* Main inductance while running: m = M/M_parameter from the flux that the voltage shows.
 *
 * Fast enough the observer's flux is the voltage's, whatever M it was told, and in the end it is
 * m M i_d: m' = (lambda_hat/(M i_d) - m)/2 s, above a stator frequency and at nominal flux only,
 * since M depends on the flux. Low down the flux follows from the current alone: there what was
 * found holds. In the observer only Rr/Lr depends on it (M Rr/Lr is Rr, but for leakage):
 * tau_extra = tau (1/m - 1).
 */
#ifndef M_TRACKING_H
#define M_TRACKING_H

#include <stdbool.h>

#include "motor.h"

typedef struct {
    bool on;
    float min_rad_s; /* least |w_s| */
} m_tracking_params_t;

typedef struct {
    float gain; /* per step; 0: off */
    float min_rad_s;
    float inv_M_per_H;
    float tau_per_s;
} m_tracking_config_t;

typedef struct {
    float extra_pu; /* m - 1 */
    float tau_extra_per_s;
} m_tracking_state_t;

typedef struct {
    float lambda_hat_Wb;
    float i_d_A;
    float omega_s_hat_rad_s;
} m_tracking_in_t;

/* False for a frequency that is not positive; nothing is looked at when off. */
CHECKED bool m_tracking_init(m_tracking_config_t *cfg, const m_tracking_params_t *params,
                             const motor_model_t *motor, float step_s);

static inline bool m_tracking_on(const m_tracking_config_t *cfg)
{
    return cfg->gain > 0.0f;
}

void m_tracking_step(const m_tracking_config_t *cfg, m_tracking_state_t *st,
                     const m_tracking_in_t *in);

#endif
