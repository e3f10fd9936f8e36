#include "tone.h"

#include "trig.h"

#define TONE_TURN_PERIODS_MIN 8.0f
#define TONE_PERIODS_MAX      1000000.0f

bool tone_init(tone_config_t *cfg, float frequency_Hz, uint32_t quiet, uint32_t turns,
               float period_s)
{
    const float turn_periods = 1.0f / (frequency_Hz * period_s);
    const float all = turn_periods * (float)(quiet + turns);
    if (!positivef(frequency_Hz) || !positivef(period_s) || (turns == 0u) ||
        !(turn_periods >= TONE_TURN_PERIODS_MIN) || !(all <= TONE_PERIODS_MAX)) {
        return false;
    }
    const uint32_t n = (uint32_t)(turn_periods + 0.5f);
    const ab_t half = trig_unit_small(NUM_PI / (float)n);
    *cfg = (tone_config_t){.turn_periods = n,
                           .quiet_periods = quiet * n,
                           .periods = (quiet + turns) * n,
                           .turn = ab_mul(half, half),
                           .omega_rad_s = 2.0f * half.beta / (half.alpha * period_s)};
    return true;
}

bool tone_step(const tone_config_t *cfg, tone_state_t *st, float i_A, float u_V)
{
    if (st->in_turn == 0u) {
        st->unit = (ab_t){1.0f, 0.0f}; /* rounding does not add up over the turns */
    }
    if (st->periods >= cfg->quiet_periods) {
        const ab_t back = ab_conj(st->unit);
        st->i_A = ab_add(st->i_A, ab_scale(back, i_A));
        st->u_V = ab_add(st->u_V, ab_scale(back, u_V));
    }
    st->unit = ab_mul(st->unit, cfg->turn);
    st->in_turn++;
    if (st->in_turn >= cfg->turn_periods) {
        st->in_turn = 0u;
    }
    st->periods++;
    return st->periods >= cfg->periods;
}

ab_t tone_impedance_ohm(const tone_state_t *st)
{
    const float i2 = ab_norm2(st->i_A);
    if (!positivef(i2)) {
        return (ab_t){0.0f, 0.0f};
    }
    return ab_scale(ab_mul(ab_conj(st->i_A), st->u_V), 1.0f / i2);
}
