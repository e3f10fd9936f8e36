#include "speed_adaptation.h"

#include "trig.h"

static bool is_share(float x)
{
    return (x >= 0.0f) && (x <= 1.0f);
}

static bool params_valid(const speed_adaptation_params_t *p)
{
    const bool gains =
        ALL_NONNEGATIVE(p->kp_rad_per_s_Wb_A, p->ki_rad_per_s2_Wb_A, p->leak_per_s_Wb_A) &&
        positivef(p->omega_max_rad_s) && is_share(p->accel_share);
    const bool near_zero = ALL_NONNEGATIVE(p->near_zero_on_rad_s, p->near_zero_off_rad_s) &&
                           (p->near_zero_off_rad_s >= p->near_zero_on_rad_s);
    const bool phi = is_share(p->phi_factor) && positivef(p->phi_ramp_rad_s);
    const bool mode = (p->eps1_mode == SPEED_ADAPTATION_EPS1_OFF) ||
                      (p->eps1_mode == SPEED_ADAPTATION_EPS1_ALWAYS) ||
                      (p->eps1_mode == SPEED_ADAPTATION_EPS1_NEAR_ZERO);
    return gains && near_zero && phi && mode;
}

bool speed_adaptation_init(speed_adaptation_config_t *cfg, const speed_adaptation_params_t *params,
                           const motor_model_t *motor, float period_s)
{
    if (!params_valid(params) ||
        !ALL_POSITIVE(motor->a11_per_s, motor->tau_per_s, motor->eps_H, motor->M_H, period_s)) {
        return false;
    }
    *cfg = (speed_adaptation_config_t){
        .p = *params,
        .ki_T_rad_per_s_Wb_A = params->ki_rad_per_s2_Wb_A * period_s,
        .leak_T_per_Wb_A = params->leak_per_s_Wb_A * period_s,
        .inv_phi_ramp_s = 1.0f / params->phi_ramp_rad_s,
        .a11_per_s = motor->a11_per_s,
        .tau_per_s = motor->tau_per_s,
        .inv_eps_per_H = 1.0f / motor->eps_H,
        .m_tau_ohm = motor->M_H * motor->tau_per_s,
    };
    return true;
}

/* A vector at the angle of G1(j w_s) = (j w_s/eps)/D(j w_s): j w_s conj(D), with
 * D(s) = det(sI - A - L C1). */
static ab_t g1_direction(const speed_adaptation_config_t *cfg, float omega_s_rad_s,
                         float omega_e_rad_s, observer_gain_t gain)
{
    const ab_t g = {cfg->tau_per_s, -omega_e_rad_s};
    const ab_t first = {cfg->a11_per_s - gain.l1_re_per_s, omega_s_rad_s - gain.l1_im_per_s};
    const ab_t second = {g.alpha, omega_s_rad_s + g.beta};
    const ab_t lower = {cfg->m_tau_ohm + gain.l2_re_ohm, gain.l2_im_ohm};
    const ab_t D = ab_sub(ab_mul(first, second), ab_scale(ab_mul(g, lower), cfg->inv_eps_per_H));
    return (ab_t){omega_s_rad_s * D.beta, omega_s_rad_s * D.alpha};
}

/* What phi and K_I follow: by value, as numbers in registers. */
typedef struct {
    float omega_s_rad_s;
    float omega_e_rad_s;
    float dwell;
} point_t;

/* phi = kappa arg G1(j w_s) min(1, |w_s|/ramp).
 * Constant dw = w_hat - w gives e1 = -G1(j w_s) j lambda dw, G1(s) = (s/eps)/D(s) (THEORY 1, 2).
 * So z = Im(conj(lambda) e1 e^{-j phi}) = -|lambda|^2 |G1| cos(arg G1 - phi) dw, which pulls w_hat
 * back as long as |arg G1 - phi| < 90 deg: phi has the sign of arg G1 = sign(w_s) 90 deg - arg D.
 * Sets the growth of K_I as well.
 */
COLD static ab_t projection(const speed_adaptation_config_t *cfg, speed_adaptation_state_t *st,
                            observer_gain_t gain, point_t point)
{
    const float magnitude_rad_s = absf(point.omega_s_rad_s);
    st->ki_growth = 1.0f - minf(SPEED_ADAPTATION_KI_FROM_RAD_S / magnitude_rad_s, 1.0f);
    const float ramp = minf(magnitude_rad_s * cfg->inv_phi_ramp_s, 1.0f);
    const ab_t g1 = g1_direction(cfg, point.omega_s_rad_s, point.omega_e_rad_s, gain);
    const float factor = cfg->p.phi_factor + point.dwell * (1.0f - cfg->p.phi_factor);
    return trig_unit(factor * ramp * trig_angle(g1));
}

/* phi and K_I follow the operating point, not the flux: every fourth period is often enough.
 * Without phi ki_growth stays as it is. */
static float adaptation_error(const speed_adaptation_config_t *cfg, speed_adaptation_state_t *st,
                              const speed_adaptation_in_t *in, float *ki_growth)
{
    ab_t lambda_Wb = in->lambda_r_hat_Wb;
    if (above_zerof(cfg->p.phi_factor)) {
        if (st->steps == 0u) {
            /* Number by number: taken as a whole, `in` would be written to memory every period. */
            const observer_gain_t *g = &in->gain;
            const observer_gain_t gain = {g->l1_re_per_s, g->l1_im_per_s, g->l2_re_ohm,
                                          g->l2_im_ohm};
            const point_t point = {in->omega_s_hat_rad_s, in->omega_e_hat_rad_s, in->dwell};
            st->phi = projection(cfg, st, gain, point);
        }
        st->steps = (st->steps + 1u) % SPEED_ADAPTATION_PHI_STEPS;
        lambda_Wb = ab_mul(st->phi, lambda_Wb);
        *ki_growth = st->ki_growth;
    }
    return ab_cross(lambda_Wb, in->e1_A);
}

/* The leak acts in this period; moves the hysteresis. */
static bool leak_on(const speed_adaptation_config_t *cfg, speed_adaptation_state_t *st,
                    float omega_s_hat_rad_s)
{
    if (cfg->p.eps1_mode == SPEED_ADAPTATION_EPS1_OFF) {
        return false;
    }
    if (cfg->p.eps1_mode == SPEED_ADAPTATION_EPS1_ALWAYS) {
        return true;
    }
    const float magnitude = absf(omega_s_hat_rad_s);
    if (magnitude < cfg->p.near_zero_on_rad_s) {
        st->near_zero = true;
    } else if (magnitude > cfg->p.near_zero_off_rad_s) {
        st->near_zero = false;
    } else {
        /* Between the two thresholds it stays as it was. */
    }
    return st->near_zero;
}

speed_adaptation_out_t speed_adaptation_step(const speed_adaptation_config_t *cfg,
                                             speed_adaptation_state_t *st,
                                             const speed_adaptation_in_t *in)
{
    const float limit = cfg->p.omega_max_rad_s;
    float ki_growth = 0.0f;
    const float z_Wb_A = adaptation_error(cfg, st, in, &ki_growth);
    const float step_rad_s = cfg->ki_T_rad_per_s_Wb_A * z_Wb_A;
    float x_rad_s = st->x_rad_s + step_rad_s + ki_growth * step_rad_s +
                    cfg->p.accel_share * in->expected_step_rad_s;
    if (leak_on(cfg, st, in->omega_s_hat_rad_s)) {
        /* eq. (19); a share above 1 would overshoot zero. */
        const float share = minf(cfg->leak_T_per_Wb_A * absf(z_Wb_A), 1.0f);
        x_rad_s -= share * st->x_rad_s;
    }
    st->x_rad_s = limitf(x_rad_s, limit);
    const float omega_rad_s = cfg->p.kp_rad_per_s_Wb_A * z_Wb_A + st->x_rad_s;
    return (speed_adaptation_out_t){.z_Wb_A = z_Wb_A,
                                    .omega_e_hat_rad_s = limitf(omega_rad_s, limit)};
}

float speed_adaptation_leak_from_literal(float eps1_per_s_Wb_A)
{
    return eps1_per_s_Wb_A;
}

float speed_adaptation_leak_from_adaptive(float eps1_s_per_rad, float ki_rad_per_s2_Wb_A)
{
    return eps1_s_per_rad * ki_rad_per_s2_Wb_A;
}

float speed_adaptation_leak_per_sample(float eps1_per_Wb_A, float period_s)
{
    return eps1_per_Wb_A / period_s;
}
