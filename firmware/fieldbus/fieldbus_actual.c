#include "fieldbus_actual.h"

#include <math.h>

#define RPM_PER_RAD_S (30.0f / NUM_PI)

float fieldbus_rad_s_from_rpm(float speed_rpm)
{
    return speed_rpm / RPM_PER_RAD_S;
}

float fieldbus_rpm_from_rad_s(float omega_rad_s)
{
    return omega_rad_s * RPM_PER_RAD_S;
}

static uint32_t bit(bool set, uint32_t mask)
{
    return set ? mask : 0u;
}

static uint32_t status_of(const fieldbus_t *fb, const unit_t *unit, const unit_telemetry_t *t)
{
    const bool fault = t->state == (uint32_t)SEQUENCE_FAULT;
    return bit(t->state == (uint32_t)SEQUENCE_READY, FIELDBUS_READY) |
           bit(unit->asked.mode != DRIVE_OFF, FIELDBUS_GATES) |
           bit(t->state == (uint32_t)SEQUENCE_RUN, FIELDBUS_RUNS) | bit(fault, FIELDBUS_FAULT) |
           bit(!fault && (t->faults != 0u), FIELDBUS_WARNING) |
           bit(fieldbus_allowed(unit) == FIELDBUS_OK, FIELDBUS_REMOTE) |
           bit(fb->armed, FIELDBUS_ARMED) | bit(fb->expired, FIELDBUS_EXPIRED) |
           bit(t->speed_unknown != 0u, FIELDBUS_UNKNOWN);
}

void fieldbus_actual(const fieldbus_t *fb, const unit_t *unit, fieldbus_actual_t *actual)
{
    unit_telemetry_t t;
    unit_telemetry(unit, &t);
    const params_t *p = &unit->params;
    const ab_t lambda_Wb = unit->drive.estimator.estimate.lambda_r_hat_Wb;
    const ab_t i_s_A = unit->last.meas.i_s_A;
    *actual = (fieldbus_actual_t){.status = status_of(fb, unit, &t),
                                  .state = t.state,
                                  .faults = t.faults,
                                  .speed_rpm = fieldbus_rpm_from_rad_s(t.omega_m_hat_rad_s),
                                  .torque_Nm = p->pole_pairs * (p->M_H / p->Lr_H) *
                                               ab_cross(lambda_Wb, i_s_A),
                                  .current_A = sqrtf(ab_norm2(i_s_A) / 3.0f), /* power invariant */
                                  .u_dc_V = unit->last.meas.u_dc_V};
}
