#include "dwell.h"

#include <math.h>

#include "trig.h"

/* Frequency of the modulation over the rotor's 1/Tr: `zh special zero_hertz`, 1 to 2 Hz on Table
 * 1's motor. */
#define DWELL_OMEGA_TAU 1.67f

/* The modulation of the speed begins so many times as large: while Rs is being found. */
#define DWELL_FIRST 1.8f

/* Of the modulation, per step: more would be no sine. */
#define DWELL_TURNS_MAX 0.1f

/* More would take most of the flux. */
#define DWELL_AMPLITUDE_MAX 0.3f

/* Dwelling ends outside so many windows. */
#define DWELL_LEAVE 2.0f

/* Load is no load any more below this share. */
#define DWELL_UNLOADED_PU 0.5f

/* Longest wait in steps that a counter takes with room to spare. */
#define DWELL_MAX_STEPS 1e6f

bool dwell_init(dwell_config_t *cfg, const dwell_params_t *p, const motor_model_t *motor,
                float period_s)
{
    *cfg = (dwell_config_t){0};
    if (p->kind == DWELL_OFF) {
        return true;
    }
    if (((p->kind != DWELL_SPEED) && (p->kind != DWELL_FLUX)) ||
        !ALL_POSITIVE(p->amplitude_pu, p->window_rad_s, p->wait_s, p->filter_s, p->fade_s,
                      p->settle_s, p->slew_rad_s2, p->load_A, motor->tau_per_s, period_s) ||
        !(p->amplitude_pu < DWELL_AMPLITUDE_MAX) || !(p->wait_s < DWELL_MAX_STEPS * period_s)) {
        return false;
    }
    const float turns =
        minf(DWELL_OMEGA_TAU * motor->tau_per_s * period_s / NUM_TWO_PI, DWELL_TURNS_MAX);
    *cfg = (dwell_config_t){
        .kind = p->kind,
        .amplitude_pu = p->amplitude_pu,
        .window_rad_s = p->window_rad_s,
        .load_A = p->load_A,
        .tau_per_s = motor->tau_per_s,
        .settle_gain = period_s / (period_s + p->settle_s),
        .omega_rad_s = turns * NUM_TWO_PI / period_s,
        .turns = turns,
        .filter_gain = period_s / (period_s + p->filter_s),
        .share_step = period_s / p->fade_s,
        .moved_rad_s = p->slew_rad_s2 * period_s,
        .wait_steps = (uint32_t)(p->wait_s / period_s + 0.5f),
    };
    return true;
}

/* What is not a number stays out of the filters, and is outside. */
static void follow(const dwell_config_t *cfg, dwell_state_t *st, const dwell_in_t *in)
{
    const float omega_s_rad_s = in->omega_s_hat_rad_s - st->speed_rad_s - st->omega_s_rad_s;
    const float i_q_A = in->i_q_A - st->i_q_A;
    if (is_finite(omega_s_rad_s + i_q_A)) {
        st->omega_s_rad_s += cfg->filter_gain * omega_s_rad_s;
        st->i_q_A += cfg->filter_gain * i_q_A;
    }
}

static void decide(const dwell_config_t *cfg, dwell_state_t *st, const dwell_in_t *in)
{
    const float moved_rad_s = in->omega_ref_rad_s - st->reference_rad_s;
    st->reference_rad_s = in->omega_ref_rad_s;
    const float window_rad_s = st->standing ? (DWELL_LEAVE * cfg->window_rad_s) : cfg->window_rad_s;
    if (in->steered || !(absf(st->omega_s_rad_s) < window_rad_s) ||
        !(absf(moved_rad_s) < cfg->moved_rad_s)) {
        st->inside_steps = 0u;
        st->standing = false;
    } else if (st->inside_steps < cfg->wait_steps) {
        st->inside_steps++;
    } else {
        st->standing = true;
    }
    const float load_A = st->active ? (DWELL_UNLOADED_PU * cfg->load_A) : cfg->load_A;
    st->active = st->standing && (absf(st->i_q_A) > load_A);
}

/* Speed or flux; the one that is on fades out before the other comes. */
static void fade(const dwell_config_t *cfg, dwell_state_t *st, bool speed_free)
{
    const bool flux = speed_free || (cfg->kind == DWELL_FLUX);
    if (!(st->share > 0.0f)) {
        st->flux = flux;
        st->gain = flux ? 1.0f : DWELL_FIRST;
        st->turns = 0.0f;
    }
    const bool on = st->active && (st->flux == flux);
    st->gain += cfg->settle_gain * (1.0f - st->gain);
    st->share = clampf(st->share + (on ? cfg->share_step : -cfg->share_step), 0.0f, 1.0f);
}

/* Begins at its phase 0, where speed and flux are what they were. */
static void modulate(const dwell_config_t *cfg, dwell_state_t *st, float omega_ref_rad_s)
{
    const float turns = st->turns + cfg->turns;
    st->turns = (turns < 1.0f) ? turns : (turns - 1.0f);
    const ab_t unit = trig_unit(NUM_TWO_PI * st->turns);
    const float swing_pu = st->share * st->gain * cfg->amplitude_pu;
    st->speed_rad_s = 0.0f;
    st->reduction_pu = 0.0f;
    st->rate_pu_per_s = 0.0f;
    if (st->flux) {
        st->reduction_pu = swing_pu * (1.0f - unit.alpha);
        st->rate_pu_per_s = swing_pu * cfg->omega_rad_s * unit.beta;
        st->swing_rad_s = swing_pu * cfg->omega_rad_s;
    } else {
        st->swing_rad_s = swing_pu * maxf(absf(omega_ref_rad_s), cfg->tau_per_s);
        st->speed_rad_s = st->swing_rad_s * unit.beta;
    }
}

void dwell_step(const dwell_config_t *cfg, dwell_state_t *st, const dwell_in_t *in)
{
    follow(cfg, st, in);
    decide(cfg, st, in);
    if (!dwell_idle(st)) {
        fade(cfg, st, in->speed_free);
        modulate(cfg, st, in->omega_ref_rad_s);
    }
}
