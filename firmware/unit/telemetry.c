#include "unit.h"

#include <math.h>

#include "trig.h"

COLD void unit_telemetry(const unit_t *unit, unit_telemetry_t *t)
{
    const unit_config_t *cfg = unit_config(unit);
    const drive_out_t *o = &unit->last;
    const drive_state_t *d = &unit->drive;
    const estimate_t *e = &d->estimator.estimate;
    const bool unknown = d->guard.speed.speed_unknown;
    const float p = unit->configured ? cfg->drive.motor.pole_pairs : 1.0f;
    *t = (unit_telemetry_t){.state = (uint32_t)unit->machine.id,
                            .faults = unit->machine.faults,
                            .omega_m_hat_rad_s = unknown ? NAN : (e->omega_e_rad_s / p),
                            .lambda_hat_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb)),
                            .lambda_angle_rad = trig_angle(e->lambda_r_hat_Wb),
                            .i_d_A = o->i_A.d,
                            .i_q_A = o->i_A.q,
                            .i_q_ref_A = o->i_ref_A.q,
                            .e1_alpha_A = e->i_residual_A.alpha,
                            .e1_beta_A = e->i_residual_A.beta,
                            .stator_frequency_Hz = e->omega_s_rad_s / NUM_TWO_PI,
                            .Rs_hat_ohm = unit->configured ? drive_rs_ohm(&cfg->drive, d) : 0.0f,
                            .confidence = (uint32_t)d->supervisor.confidence,
                            .supervisor_reasons = d->supervisor.reasons,
                            .omega_m_bound_rad_s = d->supervisor.omega_bound_rad_s / p,
                            .speed_unknown = unknown ? 1u : 0u};
}
