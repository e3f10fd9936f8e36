#include "stages.h"

#include "fault.h"
#include "transition.h"

/* Period of the supervisor's sixteen in which the temperatures are stepped. */
#define STAGE_HEAT_PERIOD 10u

void stage_heat(const drive_config_t *cfg, drive_state_t *st, drive_mode_t asked, drive_out_t *out)
{
    if (overload_step(&cfg->limits.overload, &st->limits.overload, ab_norm2(out->meas.i_s_A)) &&
        (asked != DRIVE_OFF)) {
        out->faults |= FAULT_OVERLOAD;
    }
}

static void judge_estimate(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in,
                           drive_out_t *out)
{
    const estimate_t *e = in->estimate;
    const observer_gain_t *gain = &st->estimator.gain;
    const supervisor_in_t supervisor_in = {.u_s_V = in->u_s_V,
                                           .i_s_A = in->meas->i_s_A,
                                           .lambda_r_hat_Wb = e->lambda_r_hat_Wb,
                                           .e1_A = e->i_residual_A,
                                           .l2_ohm = {gain->l2_re_ohm, gain->l2_im_ohm},
                                           .Rs_ohm = drive_rs_ohm(cfg, st),
                                           .omega_e_hat_rad_s = e->omega_e_rad_s,
                                           .omega_s_hat_rad_s = e->omega_s_rad_s};
    supervisor_step(&cfg->supervisor, &st->supervisor, &supervisor_in);
    if (st->supervisor.periods == STAGE_HEAT_PERIOD) {
        stage_heat(cfg, st, DRIVE_RUN, out);
    }
    transition_by_confidence(cfg, st, in, &out->faults);
}

void stage_judge(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in,
                 drive_out_t *out)
{
    if (!mode_running(in)) {
        st->supervisor = (supervisor_state_t){0};
        st->modes.i_f = (i_f_state_t){0};
    } else if (modes_open_loop(st->mode)) {
        st->supervisor = (supervisor_state_t){0};
        st->modes.vector.slow_period = (st->modes.vector.slow_period + 1u) % DRIVE_SLOW_PERIODS;
        if (st->modes.vector.slow_period == 0u) {
            stage_heat(cfg, st, DRIVE_RUN, out);
        }
    } else {
        judge_estimate(cfg, st, in, out);
    }
}
