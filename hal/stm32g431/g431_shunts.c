#include "g431_shunts.h"

#include "num.h"

COLD static bool near(uint32_t level, uint32_t nominal)
{
    return (level + G431_SHUNTS_OFF_MAX >= nominal) && (level <= nominal + G431_SHUNTS_OFF_MAX);
}

COLD bool g431_shunts_measure(g431_shunts_t *shunts, const g431_adcs_t *adcs, uint16_t nominal,
                              uint32_t polls)
{
    uint32_t sum[3] = {0u};
    bool good = true;
    for (uint32_t n = 0u; n < G431_SHUNTS_AVERAGED; n++) {
        g431_words_t words;
        good = g431_adc_convert(adcs, &words, polls) && good;
        sum[0] += words.u;
        sum[1] += words.v;
        sum[2] += words.w;
    }
    for (uint32_t leg = 0u; leg < 3u; leg++) {
        const uint32_t level = sum[leg] / G431_SHUNTS_AVERAGED;
        const bool here = good && near(level, nominal);
        shunts->idle[leg] = here ? (uint16_t)level : nominal;
        good = good && here;
    }
    return good;
}

/* Counts around mid scale; a word at either end of the converter stays there, out of range. */
static int32_t current(uint16_t idle, uint16_t word)
{
    if ((word == 0u) || (word >= G431_SHUNTS_MAX)) {
        return (word == 0u) ? (int32_t)G431_SHUNTS_MID : -(int32_t)G431_SHUNTS_MID;
    }
    return (int32_t)idle - (int32_t)word;
}

static uint16_t clamped(int32_t counts)
{
    const int32_t word = counts + (int32_t)G431_SHUNTS_MID;
    if (word < 0) {
        return 0u;
    }
    return (word > (int32_t)G431_SHUNTS_MAX) ? (uint16_t)G431_SHUNTS_MAX : (uint16_t)word;
}

static bool readable(const g431_shunts_t *shunts, uint32_t leg, uint32_t arr)
{
    return (shunts->before[leg] + shunts->settle_counts <= arr) &&
           (shunts->behind[leg] + shunts->hold_counts <= arr);
}

/* The leg whose lower switch conducts for the shortest time, if that is too short; else 3. */
static uint32_t hidden(const g431_shunts_t *shunts, uint32_t arr)
{
    uint32_t found = 3u;
    uint32_t longest = 0u;
    for (uint32_t leg = 0u; leg < 3u; leg++) {
        const uint32_t on = shunts->before[leg] + shunts->behind[leg];
        if (!readable(shunts, leg, arr) && ((found == 3u) || (on > longest))) {
            found = leg;
            longest = on;
        }
    }
    return found;
}

void g431_shunts_words(const g431_shunts_t *shunts, uint32_t arr, const g431_words_t *words,
                       hal_sample_t *sample)
{
    int32_t i[3] = {current(shunts->idle[0], words->u), current(shunts->idle[1], words->v),
                    current(shunts->idle[2], words->w)};
    const uint32_t leg = hidden(shunts, arr);
    if (leg < 3u) {
        i[leg] = -(i[(leg + 1u) % 3u] + i[(leg + 2u) % 3u]);
    }
    sample->i_u_counts = clamped(i[0]);
    sample->i_v_counts = clamped(i[1]);
    sample->i_w_counts = clamped(i[2]);
    sample->u_uv_counts = G431_SHUNTS_MID; /* no sensors: voltage_source is the duty */
    sample->u_vw_counts = G431_SHUNTS_MID;
    sample->u_dc_counts = words->dc;
}

void g431_shunts_written(g431_shunts_t *shunts, const stm32_tim_t *tim)
{
    for (uint32_t leg = 0u; leg < 3u; leg++) {
        shunts->before[leg] = shunts->behind[leg];
    }
    shunts->behind[0] = tim->CCR1;
    shunts->behind[1] = tim->CCR2;
    shunts->behind[2] = tim->CCR3;
}
