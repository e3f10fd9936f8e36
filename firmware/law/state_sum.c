#include "state_sum.h"

static float of_control(const drive_state_t *st)
{
    return st->speed.omega_filtered_rad_s + st->speed.omega_ref_rad_s + st->speed.more +
           st->speed.i_q_A + st->ramp.steps + st->flux.pi.x + st->flux_below_Wb + st->i_d_less_A +
           st->torque_more_pu + st->steering.torque_Nm + st->steering.below_Wb +
           st->steer.below_Wb + st->steer.rate_Wb_per_s + state_sum_ab(st->impressed.axis) +
           st->impressed.current_A + st->impressed.omega_rad_s;
}

static float of_resistance(const drive_state_t *st)
{
    const rs_measurement_sums_t *high = &st->rs_measurement.high;
    const rs_measurement_sums_t *low = &st->rs_measurement.low;
    return high->i_A + high->u_V + high->u_duty_V + low->i_A + low->u_V + low->u_duty_V +
           st->rs_tracking.delta_ohm + st->omega_ref_before_rad_s + st->rs_start_delta_ohm +
           st->dead_time_pu;
}

static float of_protection(const drive_state_t *st)
{
    const supervisor_state_t *s = &st->supervisor;
    return st->link.braking_pu + st->link.motoring_pu + st->overload.image_pu[OVERLOAD_MOTOR] +
           st->overload.image_pu[OVERLOAD_INVERTER] + st->overload.i_max_A + state_sum_ab(s->s_Wb) +
           s->found.residual_pu + s->found.lambda_Wb + s->found.i_s_A + s->found.excess_pu +
           s->omega_s_rad_s + s->flux_error_bound_pu + s->omega_bound_rad_s +
           st->plausibility.omega_before_rad_s;
}

/* What the search for a turning motor gathers is not here: its result goes into the estimate. */
static float of_modes(const drive_modes_state_t *m)
{
    return state_sum_ab(m->u_V) + m->level.weakened_Wb + m->level.economy_Wb + m->level.below_Wb +
           m->level.rate_Wb_per_s + m->level.i_q_less_A + state_sum_ab(m->standing.i_before_A) +
           state_sum_ab(m->standing.e_V) + state_sum_ab(m->volts.off_axis) + m->volts.omega_rad_s +
           m->volts.boost_V + m->mains.i_q_A + state_sum_ab(m->brake_i_ref_A) +
           m->brake_omega_rad_s;
}

float state_sum_slow(const drive_state_t *st)
{
    return of_control(st) + of_resistance(st) + of_protection(st) + of_modes(&st->modes);
}
