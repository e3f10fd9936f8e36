#include "flying_start.h"

#include "trig.h"

/* The current stands when it is this close to what is asked for. */
#define FLYING_I_TOLERANCE_PU 0.3f

/* Share of the covariance in the variance below which nothing turns but noise; residual flux, which
 * nothing has to be built up for, is not doubtful. */
#define FLYING_COHERENCE_MIN      0.3f
#define FLYING_COHERENCE_RESIDUAL 0.8f

/* Residual flux is this share of nominal, at the slowest speed that is not standing. */
#define FLYING_RESIDUAL_PU 0.1f

/* Low-pass of the rough speed, per block. */
#define FLYING_ROUGH_GAIN 0.3f

#define FLYING_MAX_PERIODS 1e6f
#define FLYING_MIN_BLOCKS  4.0f

/* The ramp takes this share of the settling time. */
#define FLYING_RAMP_SHARE 0.4f

static bool params_valid(const flying_start_params_t *p)
{
    return ALL_POSITIVE(p->current_A, p->settle_s, p->window_s, p->stand_rad_s,
                        p->omega_max_rad_s) &&
           (p->omega_max_rad_s > p->stand_rad_s);
}

bool flying_start_init(flying_start_config_t *cfg, const flying_start_params_t *params,
                       const motor_model_t *motor, float period_s)
{
    *cfg = (flying_start_config_t){0};
    if (!params->enable) {
        return true;
    }
    if (!params_valid(params) || !ALL_POSITIVE(period_s, motor->kr)) {
        return false;
    }
    const float block = (float)FLYING_START_BLOCK_PERIODS;
    const float settle = params->settle_s / period_s;
    const float window = params->window_s / period_s;
    const float residual_V =
        FLYING_RESIDUAL_PU * motor->kr * motor->M_H * params->current_A * params->stand_rad_s;
    const float lag_s = block * (float)FLYING_START_LAG_BLOCKS * period_s;
    if (!(settle < FLYING_MAX_PERIODS) || !(window < FLYING_MAX_PERIODS) ||
        !(window >= FLYING_MIN_BLOCKS * block) || !(params->omega_max_rad_s * lag_s < NUM_PI)) {
        return false;
    }
    *cfg = (flying_start_config_t){
        .enable = true,
        .current_A = params->current_A,
        .step_A = params->current_A / maxf(FLYING_RAMP_SHARE * settle, 1.0f),
        .settle_periods = (uint32_t)settle,
        .end_periods = (uint32_t)settle + (uint32_t)window,
        .residual_V2 = residual_V * residual_V,
        .stand_rad_s = params->stand_rad_s,
        .omega_max_rad_s = params->omega_max_rad_s,
        .per_lag_per_s = 1.0f / lag_s,
        .per_turn_s = 0.5f * block * period_s,
        .inv_kr = 1.0f / motor->kr,
        .tau_per_s = motor->tau_per_s,
        .m_tau_ohm = motor->M_H * motor->tau_per_s,
    };
    return true;
}

/* A block has ended: its mean joins the sums. */
static void add_block(const flying_start_config_t *cfg, flying_start_state_t *st)
{
    st->e_V[2] = st->e_V[1];
    st->e_V[1] = st->e_V[0];
    st->e_V[0] = ab_scale(st->block_V, 1.0f / (float)FLYING_START_BLOCK_PERIODS);
    st->block_V = (ab_t){0.0f, 0.0f};
    const ab_t before_V = st->e_V[FLYING_START_LAG_BLOCKS];
    const ab_t product_V2 = ab_mul(ab_conj(before_V), st->e_V[0]);
    const float rough_rad_s = trig_angle(product_V2) * cfg->per_lag_per_s;
    st->rough_rad_s += FLYING_ROUGH_GAIN * (rough_rad_s - st->rough_rad_s);
    if (st->periods > cfg->settle_periods) {
        st->count += 1.0f;
        st->sum_before_V = ab_add(st->sum_before_V, before_V);
        st->sum_V = ab_add(st->sum_V, st->e_V[0]);
        st->product_V2 = ab_add(st->product_V2, product_V2);
        st->square_V2 += ab_norm2(before_V);
    }
}

/* lambda' = e/kr = (-tau + j w) lambda + M tau i, solved for lambda, and turned from the middle of
 * the last block to now. */
static ab_t flux_of(const flying_start_config_t *cfg, const flying_start_state_t *st, ab_t i_A)
{
    const float omega_rad_s = st->omega_rad_s;
    const ab_t turn = trig_unit(limitf(omega_rad_s * cfg->per_turn_s, TRIG_SMALL_MAX_RAD));
    const ab_t rate_V = ab_scale(ab_mul(turn, st->e_V[0]), cfg->inv_kr);
    const ab_t from_flux_V = ab_sub(rate_V, ab_scale(i_A, cfg->m_tau_ohm));
    const float size2 = cfg->tau_per_s * cfg->tau_per_s + omega_rad_s * omega_rad_s;
    return ab_scale(ab_mul((ab_t){-cfg->tau_per_s, -omega_rad_s}, from_flux_V), 1.0f / size2);
}

/* Speed by the regression, and how much of the variance it explains; the variance is per block. */
typedef struct {
    float omega_rad_s;
    float coherence2;
    float variance_V2;
} finding_t;

static finding_t find(const flying_start_config_t *cfg, const flying_start_state_t *st)
{
    const float per_count = 1.0f / st->count;
    const ab_t means_V2 = ab_mul(ab_conj(st->sum_before_V), st->sum_V);
    const ab_t covariance_V2 = ab_sub(st->product_V2, ab_scale(means_V2, per_count));
    const float variance_V2 = st->square_V2 - ab_norm2(st->sum_before_V) * per_count;
    return (finding_t){.omega_rad_s = trig_angle(covariance_V2) * cfg->per_lag_per_s,
                       .coherence2 = ab_norm2(covariance_V2) / (variance_V2 * variance_V2),
                       .variance_V2 = variance_V2 * per_count};
}

static flying_start_phase_t caught(const flying_start_config_t *cfg, flying_start_state_t *st,
                                   float omega_rad_s, ab_t i_A)
{
    if (!(absf(omega_rad_s) <= cfg->omega_max_rad_s)) {
        return FLYING_START_REFUSED;
    }
    st->omega_rad_s = omega_rad_s;
    st->lambda_Wb = flux_of(cfg, st, i_A);
    return FLYING_START_CAUGHT;
}

/* Without current: either residual flux has told, or the look with current begins. */
static flying_start_phase_t judge_residual(const flying_start_config_t *cfg,
                                           flying_start_state_t *st, ab_t i_A)
{
    const finding_t found = find(cfg, st);
    const float least2 = FLYING_COHERENCE_RESIDUAL * FLYING_COHERENCE_RESIDUAL;
    if ((found.variance_V2 > cfg->residual_V2) && (found.coherence2 > least2)) {
        return caught(cfg, st, found.omega_rad_s, i_A);
    }
    *st = (flying_start_state_t){.current_on = true, .rough_rad_s = st->rough_rad_s};
    return FLYING_START_SEARCH;
}

static flying_start_phase_t judge_current(const flying_start_config_t *cfg,
                                          flying_start_state_t *st, ab_t i_A)
{
    const float off_A = sqrtf(ab_norm2(ab_sub(i_A, (ab_t){cfg->current_A, 0.0f})));
    if (!(off_A <= FLYING_I_TOLERANCE_PU * cfg->current_A)) {
        return FLYING_START_REFUSED;
    }
    const finding_t found = find(cfg, st);
    const bool turns = (found.coherence2 > FLYING_COHERENCE_MIN * FLYING_COHERENCE_MIN) &&
                       (absf(found.omega_rad_s) >= cfg->stand_rad_s);
    return turns ? caught(cfg, st, found.omega_rad_s, i_A) : FLYING_START_STANDS;
}

void flying_start_step(const flying_start_config_t *cfg, flying_start_state_t *st, ab_t e_V,
                       ab_t i_A)
{
    st->periods++;
    if (st->current_on) {
        st->current_A = minf(st->current_A + cfg->step_A, cfg->current_A);
    }
    st->block_V = ab_add(st->block_V, e_V);
    if ((st->periods % FLYING_START_BLOCK_PERIODS) == 0u) {
        add_block(cfg, st);
        if (st->periods >= cfg->end_periods) {
            st->phase = st->current_on ? judge_current(cfg, st, i_A) : judge_residual(cfg, st, i_A);
        }
    }
}
