#include "temperature.h"

#include "hal_terminals.h"
#include "lapse.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

#define KELVIN      273.15f
#define T25_PER_K   (1.0f / 298.15f)
#define LN_2        0.693147180559945f
#define FRACTION    0x007FFFFFu /* of a float's word */
#define EXPONENT_AT 23u
#define BIAS        127.0f

/* R/R0 = 1 + a d + b d^2, d = T - T0 */
typedef struct {
    float a_per_K;
    float b_per_K2;
    float zero_degC;
} curve_t;

#define R0_OHM 1000.0f
static const curve_t kty84 = {6.12e-3f, 1.1e-5f, 100.0f};
static const curve_t pt1000 = {3.9083e-3f, -5.775e-7f, 0.0f};

bool temperature_init(const temperature_config_t *cfg)
{
    if (cfg->kind == (uint32_t)TEMPERATURE_OFF) {
        return true;
    }
    const bool ntc =
        (cfg->kind != (uint32_t)TEMPERATURE_NTC) || ALL_POSITIVE(cfg->ntc_ohm, cfg->ntc_beta_K);
    return (cfg->kind <= (uint32_t)TEMPERATURE_PT1000) && ntc && positivef(cfg->pullup_ohm) &&
           (cfg->derate_degC > TEMPERATURE_LOW_DEGC) && (cfg->trip_degC > cfg->derate_degC) &&
           (cfg->trip_degC < TEMPERATURE_HIGH_DEGC) && (cfg->lost_steps > 0u);
}

/* Natural logarithm of a normal number: exponent, and 2 artanh((m - 1)/(m + 1)) of the fraction.
 * The C library's is not the same on host and target. */
static float natural_log(float x)
{
    const uint32_t bits = float_bits(x);
    const float m = float_of_bits((bits & FRACTION) | float_bits(1.0f));
    const float exponent = (float)(bits >> EXPONENT_AT) - BIAS;
    const float s = (m - 1.0f) / (m + 1.0f);
    const float s2 = s * s;
    const float series = 1.0f + s2 * (1.0f / 3.0f + s2 * (1.0f / 5.0f + s2 * (1.0f / 7.0f)));
    return exponent * LN_2 + 2.0f * s * series;
}

static float of_curve_degC(const curve_t *c, float ohm)
{
    const float excess = 1.0f - ohm / R0_OHM;
    const float square = c->a_per_K * c->a_per_K - 4.0f * c->b_per_K2 * excess;
    return c->zero_degC + (sqrtf(square) - c->a_per_K) / (2.0f * c->b_per_K2);
}

float temperature_degC(const temperature_config_t *cfg, float ohm)
{
    if (cfg->kind == (uint32_t)TEMPERATURE_KTY84) {
        return of_curve_degC(&kty84, ohm);
    }
    if (cfg->kind == (uint32_t)TEMPERATURE_PT1000) {
        return of_curve_degC(&pt1000, ohm);
    }
    return 1.0f / (T25_PER_K + natural_log(ohm / cfg->ntc_ohm) / cfg->ntc_beta_K) - KELVIN;
}

/* Of this word and the two before. */
static uint16_t median(temperature_state_t *st, uint16_t c)
{
    const uint16_t a = st->before[0];
    const uint16_t b = st->before[1];
    st->before[0] = b;
    st->before[1] = c;
    const uint16_t low = (a < b) ? a : b;
    const uint16_t high = (a < b) ? b : a;
    const uint16_t least = (c > low) ? c : low;
    return (least < high) ? least : high;
}

static void filter(const temperature_config_t *cfg, temperature_state_t *st, float degC,
                   uint32_t steps)
{
    const float behind_K = degC - st->degC;
    st->degC += st->known ? (lapse_gain(TEMPERATURE_FILTER_S, steps) * behind_K) : behind_K;
    st->known = true;
    const float limit_degC = cfg->trip_degC - (st->hot ? TEMPERATURE_HYSTERESIS_K : 0.0f);
    st->hot = st->degC >= limit_degC;
}

bool temperature_step(const temperature_config_t *cfg, temperature_state_t *st, uint16_t counts,
                      uint32_t steps)
{
    if (cfg->kind == (uint32_t)TEMPERATURE_OFF) {
        return false;
    }
    const float word = (float)median(st, counts);
    if (st->words < (uint32_t)COUNT(st->before)) {
        st->words++;
        return false;
    }
    const float ohm = cfg->pullup_ohm * word / (HAL_TERMINAL_FULL_SCALE - word);
    const float degC = temperature_degC(cfg, ohm);
    const bool good = (degC >= TEMPERATURE_LOW_DEGC) && (degC <= TEMPERATURE_HIGH_DEGC);
    st->wrong = lapse_debounce(st->wrong, !good, cfg->lost_steps, steps);
    if (good) {
        filter(cfg, st, degC, steps);
    } else {
        const bool ntc = cfg->kind == (uint32_t)TEMPERATURE_NTC;
        st->shorted = ohm < (ntc ? cfg->ntc_ohm : R0_OHM);
    }
    return debounce_elapsed(st->wrong, cfg->lost_steps);
}

float temperature_share_pu(const temperature_config_t *cfg, const temperature_state_t *st)
{
    if (!st->known) {
        return 1.0f;
    }
    const float over_pu = (st->degC - cfg->derate_degC) / (cfg->trip_degC - cfg->derate_degC);
    return clampf(1.0f - (1.0f - TEMPERATURE_SHARE_MIN) * over_pu, TEMPERATURE_SHARE_MIN, 1.0f);
}
