#include "terminals_adapt.h"

#define CUT_STEP_PU   0.05f
#define RS_STEP_PU    0.01f
#define COPPER_ZERO_K 234.5f /* copper: R proportional to T + 234.5 degC */

/* Of the torque current, in whole steps upwards. */
static float cut_pu(const terminals_config_t *cfg, const terminals_state_t *st)
{
    if (cfg->brake.on) {
        return 0.0f;
    }
    const float share_pu = minf(temperature_share_pu(&cfg->sink, &st->sink),
                                temperature_share_pu(&cfg->motor, &st->motor));
    const float steps = (1.0f - share_pu) / CUT_STEP_PU;
    const float whole = (float)(uint32_t)steps;
    return CUT_STEP_PU * ((steps > whole) ? (whole + 1.0f) : whole);
}

/* Of Rs; while the gates are on the drive tracks it itself. */
static float rise_pu(const terminals_config_t *cfg, const terminals_state_t *st, const unit_t *unit)
{
    if (!st->motor.known || (unit->asked.mode != DRIVE_OFF)) {
        return st->adapted_rise_pu;
    }
    const float now_pu =
        (st->motor.degC - cfg->motor_Rs_degC) / (COPPER_ZERO_K + cfg->motor_Rs_degC);
    const bool moved = absf(now_pu - st->adapted_rise_pu) > RS_STEP_PU;
    return moved ? now_pu : st->adapted_rise_pu;
}

/* Somebody else has made the configuration in force since. */
static bool replaced(const terminals_state_t *st, const unit_t *unit)
{
    const bool adapted = (st->adapted_cut_pu > 0.0f) || (absf(st->adapted_rise_pu) > 0.0f);
    return adapted && (unit->config_crc[unit->in_force] != st->adapted_crc);
}

void terminals_adapt(const terminals_config_t *cfg, terminals_state_t *st, unit_t *unit)
{
    if (unit->change_ready) {
        return; /* the next period takes one first */
    }
    const float cut = cut_pu(cfg, st);
    const float rise = rise_pu(cfg, st, unit);
    const bool moved =
        (absf(cut - st->adapted_cut_pu) > 0.0f) || (absf(rise - st->adapted_rise_pu) > 0.0f);
    if (!moved && !replaced(st, unit)) {
        return;
    }
    const float i_q_max_A = unit->params.i_q_max_A;
    const float Rs_ohm = unit->params.Rs_ohm;
    params_t params = unit->params;
    params.i_q_max_A = i_q_max_A * (1.0f - cut);
    params.Rs_ohm = Rs_ohm * (1.0f + rise);
    const uint32_t made = 1u - unit->in_force;
    /* Refused, the owner's own is made again; it is not tried before something moves. */
    (void)!unit_reconfigure(unit, &params);
    unit->params.i_q_max_A = i_q_max_A;
    unit->params.Rs_ohm = Rs_ohm;
    st->adapted_cut_pu = cut;
    st->adapted_rise_pu = rise;
    st->adapted_crc = unit->config_crc[made];
}
