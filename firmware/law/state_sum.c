#include "state_sum.h"

static float of_control(const vector_state_t *v)
{
    return v->speed.omega_filtered_rad_s + v->speed.omega_ref_rad_s + v->speed.i_q_A +
           v->speed.slow_A + v->ramp.steps + v->flux.pi.x + v->flux_reduction_Wb +
           v->i_d_reduction_A + v->torque_gain_extra_pu + v->steering.torque_Nm +
           v->steering.reduction_Wb + v->steer.reduction_Wb + v->steer.rate_Wb_per_s +
           v->reference.weakened_Wb + v->reference.economy_Wb + v->reference.reduction_Wb +
           v->reference.rate_Wb_per_s + v->reference.i_q_reduction_A + v->mains.i_q_A +
           v->speed.low_A + v->speed.high_A + v->plan.omega_ref_rad_s + v->plan.i_d_ref_A +
           v->plan.flux_pu + v->plan.inv_flux_pu + v->plan.torque_ref_Nm +
           v->modulation.speed_rad_s + v->modulation.flux_pu + v->modulation.rate_pu_per_s;
}

static float of_dwell(const dwell_state_t *d)
{
    return d->omega_s_rad_s + d->i_q_A + d->reference_rad_s + d->share + d->gain + d->turns +
           d->speed_rad_s + d->reduction_pu + d->rate_pu_per_s + d->swing_rad_s;
}

static float of_resistance(const drive_state_t *st)
{
    const premagnetise_state_t *found = &st->modes.premagnetise;
    const rs_measurement_sums_t *high = &found->measurement.level[RS_LEVEL_HIGH];
    const rs_measurement_sums_t *low = &found->measurement.level[RS_LEVEL_LOW];
    return high->i_A + high->u_V + high->u_duty_V + low->i_A + low->u_V + low->u_duty_V +
           st->rs_tracking.delta_ohm + st->omega_ref_before_rad_s + found->Rs_delta_ohm +
           found->leg_loss_pu + found->leg_threshold_A + found->leg_tail_A +
           st->heating.Rs_cold_ohm + st->heating.winding_pu + st->m_tracking.extra_pu +
           st->m_tracking.tau_extra_per_s + st->heating.rotor_pu + st->heating.slip_rad_s +
           of_dwell(&st->dwell);
}

static float of_protection(const drive_state_t *st)
{
    const supervisor_state_t *s = &st->supervisor;
    const torque_limits_state_t *l = &st->limits;
    return l->link.braking_pu + l->overload.heat_pu[OVERLOAD_MOTOR] +
           l->overload.heat_pu[OVERLOAD_INVERTER] + l->overload.i_max_A + ab_sum(s->s_Wb) +
           s->found.residual_pu + s->found.lambda_Wb + s->found.i_s_A + s->found.excess_pu +
           s->omega_s_rad_s + ab_sum(s->emf_sum_V) + ab_sum(s->d_Wb) + s->flux_error_bound_pu +
           s->omega_bound_rad_s + st->guard.plausibility.omega_before_rad_s +
           ab_sum(st->guard.current_fit.psi_Wb) + st->guard.current_fit.b_Wb +
           ab_sum(st->guard.current_fit.emf_V);
}

/* What the search for a turning motor gathers is not here: its result goes into the estimate. */
static float of_modes(const modes_state_t *m)
{
    return ab_sum(m->i_f.axis) + m->i_f.current_A + m->i_f.omega_rad_s + ab_sum(m->i_f.flux_Wb) +
           ab_sum(m->flying_current.i_before_A) + ab_sum(m->flying_current.e_V) +
           ab_sum(m->brake.current.i_before_A) + ab_sum(m->brake.current.e_V) +
           ab_sum(m->brake.i_ref_A) + m->brake.omega_rad_s + ab_sum(m->volts.off_axis) +
           m->volts.omega_rad_s + m->volts.boost_V;
}

float state_sum_slow(const drive_state_t *st)
{
    switch (st->slot) {
    case SLOT_STATE_RESISTANCE:
        return of_resistance(st);
    case SLOT_STATE_MODES:
        return of_modes(&st->modes);
    case SLOT_STATE_PROTECTION:
        return of_protection(st);
    case SLOT_STATE_CONTROL:
        return of_control(&st->modes.vector);
    default:
        return 0.0f;
    }
}

float state_sum_of_slot(const drive_state_t *st)
{
    const float slow = state_sum_slow(st);
    return slot_is_quarter(st->slot, SLOT_QUARTER_STATE) ? (slow + state_sum_fast(st)) : slow;
}
