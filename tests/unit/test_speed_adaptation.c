#include "speed_adaptation.h"

#include "exact.h"
#include "reference_machine.h"

#define PERIOD_S  2e-4f
#define KP        51.9f /* (rad/s)/(Wb A) */
#define KI        45.3f /* (rad/s^2)/(Wb A) */
#define LEAK      7.31f /* 1/(s Wb A) */
#define OMEGA_MAX 500.0f

static const speed_adaptation_params_t plain = {
    .kp_rad_per_s_Wb_A = KP,
    .ki_rad_per_s2_Wb_A = KI,
    .leak_per_s_Wb_A = LEAK,
    .eps1_mode = SPEED_ADAPTATION_EPS1_OFF,
    .accel_share = 0.0f,
    .near_zero_on_rad_s = 16.0f,
    .near_zero_off_rad_s = 20.0f,
    .omega_max_rad_s = OMEGA_MAX,
    .phi_factor = 0.0f,
    .phi_ramp_rad_s = 2.76f,
};

void setUp(void)
{
}

void tearDown(void)
{
}

static double complex complex_of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static ab_t ab_of(double complex x)
{
    return (ab_t){(float)creal(x), (float)cimag(x)};
}

static speed_adaptation_config_t config_of(int machine, const speed_adaptation_params_t *params)
{
    speed_adaptation_config_t cfg = {0};
    const motor_model_t motor = reference_derived(machine);
    TEST_ASSERT_TRUE(speed_adaptation_init(&cfg, params, &motor, PERIOD_S));
    return cfg;
}

static speed_adaptation_config_t leaking(void)
{
    speed_adaptation_params_t params = plain;
    params.eps1_mode = SPEED_ADAPTATION_EPS1_ALWAYS;
    return config_of(0, &params);
}

/* lambda real and e1 imaginary: z is their product. */
static speed_adaptation_in_t in_with_z(float z_Wb_A)
{
    return (speed_adaptation_in_t){.lambda_r_hat_Wb = {1.0f, 0.0f}, .e1_A = {0.3f, z_Wb_A}};
}

static speed_adaptation_in_t random_in(uint32_t *seed)
{
    return (speed_adaptation_in_t){.lambda_r_hat_Wb = {0.6f * noise(seed), 0.6f * noise(seed)},
                                   .e1_A = {5.0f * noise(seed), 5.0f * noise(seed)},
                                   .omega_s_hat_rad_s = 60.0f * noise(seed),
                                   .omega_e_hat_rad_s = 60.0f * noise(seed),
                                   .expected_step_rad_s = 0.5f * noise(seed),
                                   .gain = {500.0f * noise(seed) - 400.0f, 60.0f * noise(seed),
                                            3.0f * noise(seed), 2.0f * noise(seed)}};
}

static void test_current_ahead_of_the_flux_raises_the_speed(void)
{
    const speed_adaptation_config_t cfg = config_of(0, &plain);
    speed_adaptation_state_t st = {0};
    const speed_adaptation_in_t in = {.lambda_r_hat_Wb = {0.0f, 0.5f}, .e1_A = {-2.0f, 1.0f}};
    const speed_adaptation_out_t out = speed_adaptation_step(&cfg, &st, &in);
    ASSERT_SAME_FLOAT(1.0f, out.z_Wb_A);
    ASSERT_NEAR(1e-5, KP + PERIOD_S * KI, out.omega_e_hat_rad_s);
    ASSERT_NEAR(1e-8, PERIOD_S * KI, st.x_rad_s);
}

static void test_no_error_holds_the_speed(void)
{
    for (int mode = 0; mode < 3; mode++) {
        speed_adaptation_params_t params = plain;
        params.eps1_mode = (speed_adaptation_eps1_mode_t)mode;
        params.phi_factor = 0.5f;
        const speed_adaptation_config_t cfg = config_of(0, &params);
        speed_adaptation_state_t st = {.x_rad_s = 123.0f};
        const speed_adaptation_in_t in = {.lambda_r_hat_Wb = {0.4f, 0.3f},
                                          .omega_s_hat_rad_s = 3.0f,
                                          .expected_step_rad_s = 50.0f};
        for (int k = 0; k < 100; k++) {
            const speed_adaptation_out_t out = speed_adaptation_step(&cfg, &st, &in);
            ASSERT_SAME_FLOAT(123.0f, out.omega_e_hat_rad_s);
        }
        ASSERT_SAME_FLOAT(123.0f, st.x_rad_s);
    }
}

/* e of C1 (sI - A - L C1) e = -Bw dw j lambda at s = j w_s, by elimination: the current error that
 * a constant speed error leaves (THEORY 1). */
static double complex e1_of_speed_error(int machine, const speed_adaptation_in_t *in, double dw)
{
    const double w = (double)in->omega_e_hat_rad_s;
    const reference_model_t m = reference_model(&reference_machine[machine], w);
    const double complex s = I * (double)in->omega_s_hat_rad_s;
    const double complex l1 = (double)in->gain.l1_re_per_s + I * (double)in->gain.l1_im_per_s;
    const double complex l2 = (double)in->gain.l2_re_ohm + I * (double)in->gain.l2_im_ohm;
    const double complex drive = dw * I * complex_of(in->lambda_r_hat_Wb);
    /* (s - a11 - l1) e1 - a12 e2 = -drive/eps;  -(a21 + l2) e1 + (s - a22) e2 = drive */
    const double complex p = s - m.a11 - l1;
    const double complex q = s - m.a22;
    return (-drive / m.eps * q + m.a12 * drive) / (p * q - m.a12 * (m.a21 + l2));
}

/* arg G1 from that response: e1 = -G1 j lambda dw. */
static double g1_angle(int machine, const speed_adaptation_in_t *in)
{
    const double complex e1 = e1_of_speed_error(machine, in, 1.0);
    return carg(-e1 / (I * complex_of(in->lambda_r_hat_Wb)));
}

/* Of K_I, beside phi. */
static double growth_at(double omega_s_rad_s)
{
    return fmax(0.0, 1.0 - 20.0 / fabs(omega_s_rad_s));
}

/* The whole law in double precision. */
static void assert_step_is_eq_19(speed_adaptation_eps1_mode_t mode, float accel_share,
                                 float phi_factor)
{
    uint32_t seed = 17u;
    speed_adaptation_params_t params = plain;
    params.eps1_mode = mode;
    params.accel_share = accel_share;
    params.phi_factor = phi_factor;
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        const speed_adaptation_config_t cfg = config_of(machine, &params);
        for (int k = 0; k < 500; k++) {
            const speed_adaptation_in_t in = random_in(&seed);
            speed_adaptation_state_t st = {.x_rad_s = 200.0f * noise(&seed)};
            const double x = (double)st.x_rad_s;
            const double ramp = fmin(1.0, fabs((double)in.omega_s_hat_rad_s) / 2.76);
            const double phi = (double)phi_factor * ramp * g1_angle(machine, &in);
            const double z =
                cimag(conj(complex_of(in.lambda_r_hat_Wb)) * complex_of(in.e1_A) * cexp(-I * phi));
            const double step = (double)accel_share * (double)in.expected_step_rad_s;
            const double c = (mode == SPEED_ADAPTATION_EPS1_OFF) ? 0.0 : (double)LEAK;
            const double T = (double)PERIOD_S;
            const double growth =
                (phi_factor > 0.0f) ? growth_at((double)in.omega_s_hat_rad_s) : 0.0;
            const double x_next =
                x + T * ((1.0 + growth) * (double)KI * z - c * fabs(z) * x) + step;
            const speed_adaptation_out_t out = speed_adaptation_step(&cfg, &st, &in);
            /* A micro-radian in phi, times |lambda| |e1| < 6; the sum of speeds below 500 rad/s. */
            ASSERT_NEAR(2e-5, z, out.z_Wb_A);
            ASSERT_NEAR(5e-5, x_next, st.x_rad_s);
            ASSERT_NEAR(1e-3, x_next + (double)KP * z, out.omega_e_hat_rad_s);
        }
    }
}

static void test_step_without_leak_is_a_pi_law(void)
{
    assert_step_is_eq_19(SPEED_ADAPTATION_EPS1_OFF, 0.0f, 0.0f);
    assert_step_is_eq_19(SPEED_ADAPTATION_EPS1_OFF, 0.7f, 0.0f);
}

static void test_step_leaks_to_zero(void)
{
    assert_step_is_eq_19(SPEED_ADAPTATION_EPS1_ALWAYS, 0.0f, 0.0f);
}

static void test_step_takes_its_share_of_the_expected_acceleration(void)
{
    assert_step_is_eq_19(SPEED_ADAPTATION_EPS1_ALWAYS, 0.7f, 0.0f);
}

static void test_step_turns_the_projection_by_phi(void)
{
    assert_step_is_eq_19(SPEED_ADAPTATION_EPS1_OFF, 0.0f, 0.576f);
    assert_step_is_eq_19(SPEED_ADAPTATION_EPS1_ALWAYS, 0.7f, 1.0f);
}

static void test_error_does_not_depend_on_the_frames_angle(void)
{
    const double complex turn = cexp(2.3 * I);
    uint32_t seed = 19u;
    speed_adaptation_params_t params = plain;
    params.phi_factor = 0.7f;
    const speed_adaptation_config_t cfg = config_of(1, &params);
    speed_adaptation_state_t st = {0};
    const speed_adaptation_in_t in = random_in(&seed);
    speed_adaptation_in_t turned = in;
    turned.lambda_r_hat_Wb = ab_of(turn * complex_of(in.lambda_r_hat_Wb));
    turned.e1_A = ab_of(turn * complex_of(in.e1_A));
    const float z_Wb_A = speed_adaptation_step(&cfg, &st, &in).z_Wb_A;
    ASSERT_NEAR(1e-6, z_Wb_A, speed_adaptation_step(&cfg, &st, &turned).z_Wb_A);
}

/* phi follows the operating point in the first of four periods, and stays in the other three. */
static void test_phi_is_taken_anew_in_every_fourth_period(void)
{
    uint32_t seed = 37u;
    speed_adaptation_params_t params = plain;
    params.phi_factor = 0.7f;
    const speed_adaptation_config_t cfg = config_of(1, &params);
    speed_adaptation_state_t st = {0};
    for (int k = 0; k < 40; k++) {
        const speed_adaptation_in_t in = random_in(&seed);
        const ab_t before = st.phi;
        const float z_Wb_A = speed_adaptation_step(&cfg, &st, &in).z_Wb_A;
        if ((k % 4) == 0) {
            speed_adaptation_state_t fresh = {0};
            ASSERT_SAME_FLOAT(speed_adaptation_step(&cfg, &fresh, &in).z_Wb_A, z_Wb_A);
        } else {
            TEST_ASSERT_EQUAL_MEMORY(&before, &st.phi, sizeof before);
            ASSERT_NEAR(1e-6, ab_cross(ab_mul(before, in.lambda_r_hat_Wb), in.e1_A), z_Wb_A);
        }
    }
}

static void test_step_mirrors_bit_for_bit(void)
{
    uint32_t seed = 23u;
    speed_adaptation_params_t params = plain;
    params.eps1_mode = SPEED_ADAPTATION_EPS1_ALWAYS;
    params.accel_share = 0.7f;
    params.phi_factor = 0.576f;
    const speed_adaptation_config_t cfg = config_of(1, &params);
    speed_adaptation_state_t st = {.x_rad_s = 40.0f};
    speed_adaptation_state_t mirror = {.x_rad_s = -40.0f};
    for (int k = 0; k < 100; k++) {
        const speed_adaptation_in_t in = random_in(&seed);
        speed_adaptation_in_t other = {.lambda_r_hat_Wb = ab_conj(in.lambda_r_hat_Wb),
                                       .e1_A = ab_conj(in.e1_A),
                                       .omega_s_hat_rad_s = -in.omega_s_hat_rad_s,
                                       .omega_e_hat_rad_s = -in.omega_e_hat_rad_s,
                                       .expected_step_rad_s = -in.expected_step_rad_s,
                                       .gain = in.gain};
        other.gain.l1_im_per_s = -in.gain.l1_im_per_s;
        other.gain.l2_im_ohm = -in.gain.l2_im_ohm;
        const speed_adaptation_out_t out = speed_adaptation_step(&cfg, &st, &in);
        const speed_adaptation_out_t out_mirror = speed_adaptation_step(&cfg, &mirror, &other);
        ASSERT_SAME_FLOAT(-out.z_Wb_A, out_mirror.z_Wb_A);
        ASSERT_SAME_FLOAT(-out.omega_e_hat_rad_s, out_mirror.omega_e_hat_rad_s);
        ASSERT_SAME_FLOAT(-st.x_rad_s, mirror.x_rad_s);
    }
}

static void test_error_grows_with_flux_and_current(void)
{
    uint32_t seed = 29u;
    const speed_adaptation_config_t cfg = config_of(0, &plain);
    speed_adaptation_state_t st = {0};
    speed_adaptation_in_t in = random_in(&seed);
    const float z_Wb_A = speed_adaptation_step(&cfg, &st, &in).z_Wb_A;
    in.lambda_r_hat_Wb = ab_scale(in.lambda_r_hat_Wb, 2.0f);
    in.e1_A = ab_scale(in.e1_A, 4.0f);
    ASSERT_SAME_FLOAT(8.0f * z_Wb_A, speed_adaptation_step(&cfg, &st, &in).z_Wb_A);
}

static void test_three_readings_of_eps1_give_their_difference_equations(void)
{
    const double T = (double)PERIOD_S;
    const double eps1 = 0.008;
    const float c[3] = {speed_adaptation_leak_from_literal(0.008f),
                        speed_adaptation_leak_from_adaptive(0.008f, KI),
                        speed_adaptation_leak_per_sample(0.008f, PERIOD_S)};
    for (int reading = 0; reading < 3; reading++) {
        speed_adaptation_params_t params = plain;
        params.eps1_mode = SPEED_ADAPTATION_EPS1_ALWAYS;
        params.leak_per_s_Wb_A = c[reading];
        const speed_adaptation_config_t cfg = config_of(0, &params);
        const float z = -3.0f;
        const double x = 100.0;
        speed_adaptation_state_t st = {.x_rad_s = 100.0f};
        const speed_adaptation_in_t in = in_with_z(z);
        (void)speed_adaptation_step(&cfg, &st, &in);
        const double integral = x + T * (double)KI * -3.0;
        const double expected[3] = {integral - T * eps1 * 3.0 * x,
                                    integral - T * (double)KI * eps1 * 3.0 * x,
                                    integral - eps1 * 3.0 * x};
        ASSERT_NEAR(2e-5, expected[reading], st.x_rad_s);
    }
}

static void test_readings_of_eps1_are_different_numbers(void)
{
    ASSERT_SAME_FLOAT(0.008f, speed_adaptation_leak_from_literal(0.008f));
    ASSERT_NEAR(1e-6, 16.0, speed_adaptation_leak_from_adaptive(0.008f, 2000.0f));
    ASSERT_NEAR(1e-5, 40.0, speed_adaptation_leak_per_sample(0.008f, PERIOD_S));
}

/* The leak's bound: |x| <= K_I/c, reached under a constant error. */
static void test_constant_error_ends_at_the_bound_of_the_leak(void)
{
    const speed_adaptation_config_t cfg = leaking();
    speed_adaptation_state_t st = {0};
    const speed_adaptation_in_t in = in_with_z(4.0f);
    for (int k = 0; k < 10000; k++) {
        (void)speed_adaptation_step(&cfg, &st, &in);
    }
    ASSERT_NEAR(1e-3, KI / LEAK, st.x_rad_s);
}

static void test_leak_of_a_whole_sample_lands_on_zero(void)
{
    speed_adaptation_params_t params = plain;
    params.eps1_mode = SPEED_ADAPTATION_EPS1_ALWAYS;
    params.ki_rad_per_s2_Wb_A = 0.0f;
    params.leak_per_s_Wb_A = 1e5f; /* 20 per sample and Wb A */
    const speed_adaptation_config_t cfg = config_of(0, &params);
    const float z[2] = {3.0f, -0.06f};
    for (int k = 0; k < 2; k++) {
        speed_adaptation_state_t st = {.x_rad_s = 100.0f};
        const speed_adaptation_in_t in = in_with_z(z[k]);
        (void)speed_adaptation_step(&cfg, &st, &in);
        ASSERT_SAME_FLOAT(0.0f, st.x_rad_s);
    }
}

static bool leaks(const speed_adaptation_config_t *cfg, speed_adaptation_state_t *st,
                  float omega_s_rad_s)
{
    speed_adaptation_in_t in = in_with_z(1.0f);
    in.omega_s_hat_rad_s = omega_s_rad_s;
    st->x_rad_s = 100.0f;
    (void)speed_adaptation_step(cfg, st, &in);
    const float without = 100.0f + cfg->ki_T_rad_per_s_Wb_A;
    return st->x_rad_s < without - 0.01f;
}

static void test_leak_near_zero_frequency_has_hysteresis(void)
{
    speed_adaptation_params_t params = plain;
    params.eps1_mode = SPEED_ADAPTATION_EPS1_NEAR_ZERO;
    const speed_adaptation_config_t cfg = config_of(0, &params);
    for (int sign = -1; sign <= 1; sign += 2) {
        const float s = (float)sign;
        speed_adaptation_state_t st = {0};
        TEST_ASSERT_FALSE(leaks(&cfg, &st, s * 18.0f));
        TEST_ASSERT_FALSE(leaks(&cfg, &st, s * 16.0f)); /* on is below, not at */
        TEST_ASSERT_TRUE(leaks(&cfg, &st, s * 15.9f));
        TEST_ASSERT_TRUE(leaks(&cfg, &st, s * 18.0f));
        TEST_ASSERT_TRUE(leaks(&cfg, &st, s * 20.0f)); /* off is above, not at */
        TEST_ASSERT_TRUE(leaks(&cfg, &st, NAN));
        TEST_ASSERT_FALSE(leaks(&cfg, &st, s * 20.1f));
        TEST_ASSERT_FALSE(leaks(&cfg, &st, s * 18.0f));
        TEST_ASSERT_FALSE(leaks(&cfg, &st, NAN));
    }
}

static void test_leak_of_the_other_modes_does_not_look_at_the_frequency(void)
{
    speed_adaptation_state_t st = {.near_zero = true};
    const speed_adaptation_config_t off = config_of(0, &plain);
    TEST_ASSERT_FALSE(leaks(&off, &st, 0.0f));
    st.near_zero = false;
    const speed_adaptation_config_t always = leaking();
    TEST_ASSERT_TRUE(leaks(&always, &st, 300.0f));
}

static float z_of_speed_error(int machine, float phi_factor, speed_adaptation_in_t *in, double dw)
{
    speed_adaptation_params_t params = plain;
    params.phi_factor = phi_factor;
    const speed_adaptation_config_t cfg = config_of(machine, &params);
    speed_adaptation_state_t st = {0};
    in->e1_A = ab_of(e1_of_speed_error(machine, in, dw));
    return speed_adaptation_step(&cfg, &st, in).z_Wb_A;
}

static const float grid_speed[5] = {-90.0f, -12.0f, 0.0f, 6.0f, 190.0f};
static const float grid_frequency[6] = {-100.0f, -20.0f, -4.0f, 3.0f, 15.0f, 120.0f};
static const observer_gain_t grid_gain[3] = {
    {0.0f, 0.0f, 0.0f, 0.0f}, {-720.0f, 0.0f, -5.0f, 0.0f}, {-300.0f, 40.0f, 2.0f, -1.5f}};

#define GRID_POINTS (REFERENCE_MACHINES * 5 * 6 * 3)

static speed_adaptation_in_t grid_point(int k)
{
    return (speed_adaptation_in_t){.lambda_r_hat_Wb = {0.3f, -0.4f},
                                   .omega_s_hat_rad_s = grid_frequency[(k / 2) % 6],
                                   .omega_e_hat_rad_s = grid_speed[(k / 12) % 5],
                                   .gain = grid_gain[(k / 60) % 3]};
}

/* A speed estimate that is too high has to be pulled down, z < 0, in motoring and regenerating. */
static void test_phi_makes_the_adaptation_gain_positive_everywhere(void)
{
    for (int k = 0; k < GRID_POINTS; k++) {
        speed_adaptation_in_t in = grid_point(k);
        TEST_ASSERT_TRUE(z_of_speed_error(k % 2, 0.576f, &in, 1.0) < 0.0f);
        TEST_ASSERT_TRUE(z_of_speed_error(k % 2, 0.576f, &in, -1.0) > 0.0f);
    }
}

static void test_full_phi_uses_the_whole_current_error(void)
{
    for (int k = 0; k < GRID_POINTS; k++) {
        speed_adaptation_in_t in = grid_point(k);
        const float z_Wb_A = z_of_speed_error(k % 2, 1.0f, &in, 1.0);
        const double all = cabs(complex_of(in.lambda_r_hat_Wb)) * cabs(complex_of(in.e1_A));
        ASSERT_NEAR(1e-5 * all, -all, z_Wb_A);
    }
}

/* THEORY 2: L = 0 has the wrong sign for 0 < w_s < .633 w, the regenerating wedge. */
static void test_without_phi_the_gain_is_negative_in_the_regenerating_wedge(void)
{
    speed_adaptation_in_t in = {.lambda_r_hat_Wb = {0.5f, 0.0f},
                                .omega_s_hat_rad_s = 0.6f * 30.0f,
                                .omega_e_hat_rad_s = 30.0f};
    TEST_ASSERT_TRUE(z_of_speed_error(0, 0.0f, &in, 1.0) > 0.0f);
    TEST_ASSERT_TRUE(z_of_speed_error(0, 0.576f, &in, 1.0) < 0.0f);
    in.omega_s_hat_rad_s = 0.67f * 30.0f;
    TEST_ASSERT_TRUE(z_of_speed_error(0, 0.0f, &in, 1.0) < 0.0f);
}

static void test_phi_is_absent_at_zero_frequency(void)
{
    speed_adaptation_params_t params = plain;
    params.phi_factor = 1.0f;
    const speed_adaptation_config_t with_phi = config_of(0, &params);
    const speed_adaptation_config_t without = config_of(0, &plain);
    uint32_t seed = 31u;
    for (int k = 0; k < 20; k++) {
        speed_adaptation_in_t in = random_in(&seed);
        in.omega_s_hat_rad_s = (k % 2 == 0) ? 0.0f : -0.0f;
        speed_adaptation_state_t st = {0};
        const float expected = speed_adaptation_step(&without, &st, &in).z_Wb_A;
        ASSERT_SAME_FLOAT(expected, speed_adaptation_step(&with_phi, &st, &in).z_Wb_A);
    }
}

static void test_phi_grows_with_the_frequency_up_to_its_ramp(void)
{
    const float frequency[4] = {0.69f, 1.38f, -1.38f, 2.76f};
    const double share[4] = {0.25, 0.5, 0.5, 1.0};
    for (int k = 0; k < 4; k++) {
        speed_adaptation_in_t in = {.lambda_r_hat_Wb = {1.0f, 0.0f},
                                    .omega_s_hat_rad_s = frequency[k],
                                    .omega_e_hat_rad_s = copysignf(20.0f, frequency[k])};
        const double angle = g1_angle(0, &in);
        TEST_ASSERT_TRUE(fabs(angle) > 0.5); /* or the test would see nothing */
        const float z_Wb_A = z_of_speed_error(0, 1.0f, &in, 1.0);
        const double all = cabs(complex_of(in.e1_A));
        ASSERT_NEAR(1e-5 * all, -all * cos(angle * (1.0 - share[k])), z_Wb_A);
    }
}

/* Towards twice itself, from 20 rad/s on; without phi it is the paper's constant. */
static void test_integral_gain_grows_with_the_frequency(void)
{
    const float frequency[5] = {0.0f, -20.0f, 40.0f, -80.0f, 400.0f};
    const double growth[5] = {0.0, 0.0, 0.5, 0.75, 0.95};
    for (int with_phi = 0; with_phi < 2; with_phi++) {
        speed_adaptation_params_t params = plain;
        params.phi_factor = 0.5f * (float)with_phi;
        const speed_adaptation_config_t cfg = config_of(0, &params);
        for (int k = 0; k < 5; k++) {
            speed_adaptation_in_t in = in_with_z(2.0f);
            in.omega_s_hat_rad_s = frequency[k];
            speed_adaptation_state_t st = {0};
            const double z = (double)speed_adaptation_step(&cfg, &st, &in).z_Wb_A;
            TEST_ASSERT_TRUE(fabs(z) > 0.1); /* or the test would see nothing */
            const double ki = (double)KI * (1.0 + with_phi * growth[k]);
            ASSERT_NEAR(1e-7, (double)PERIOD_S * ki * z, st.x_rad_s);
        }
    }
}

/* phi_factor is set to 0 in RUN: what the growth was does not stay. */
static void test_integral_gain_is_the_constant_again_once_phi_is_off(void)
{
    speed_adaptation_params_t params = plain;
    params.phi_factor = 0.5f;
    const speed_adaptation_config_t with_phi = config_of(0, &params);
    const speed_adaptation_config_t without = config_of(0, &plain);
    speed_adaptation_in_t in = in_with_z(2.0f);
    in.omega_s_hat_rad_s = 400.0f;
    speed_adaptation_state_t st = {0};
    (void)speed_adaptation_step(&with_phi, &st, &in);
    st.x_rad_s = 0.0f;
    (void)speed_adaptation_step(&without, &st, &in);
    ASSERT_NEAR(1e-8, PERIOD_S * KI * 2.0f, st.x_rad_s);
}

static void test_integrator_is_limited(void)
{
    const speed_adaptation_config_t cfg = config_of(0, &plain);
    for (int sign = -1; sign <= 1; sign += 2) {
        const float s = (float)sign;
        speed_adaptation_state_t st = {.x_rad_s = s * OMEGA_MAX};
        speed_adaptation_in_t in = in_with_z(s * 2.0f);
        ASSERT_SAME_FLOAT(s * OMEGA_MAX, speed_adaptation_step(&cfg, &st, &in).omega_e_hat_rad_s);
        ASSERT_SAME_FLOAT(s * OMEGA_MAX, st.x_rad_s);
    }
}

static void test_speed_is_limited_and_the_integrator_free(void)
{
    const speed_adaptation_config_t cfg = config_of(0, &plain);
    for (int sign = -1; sign <= 1; sign += 2) {
        const float s = (float)sign;
        speed_adaptation_state_t st = {.x_rad_s = s * 490.0f};
        speed_adaptation_in_t in = in_with_z(s * 1.0f);
        ASSERT_SAME_FLOAT(s * OMEGA_MAX, speed_adaptation_step(&cfg, &st, &in).omega_e_hat_rad_s);
        ASSERT_NEAR(1e-4, s * (490.0f + PERIOD_S * KI), st.x_rad_s);
    }
}

static void test_no_input_makes_the_speed_non_finite(void)
{
    speed_adaptation_params_t params = plain;
    params.eps1_mode = SPEED_ADAPTATION_EPS1_ALWAYS;
    params.accel_share = 0.7f;
    params.phi_factor = 0.576f;
    const speed_adaptation_config_t cfg = config_of(1, &params);
    for (int bad = 0; bad < NOT_FINITE_COUNT; bad++) {
        for (int field = 0; field < 11; field++) {
            uint32_t seed = 37u;
            speed_adaptation_in_t in = random_in(&seed);
            float *const fields[11] = {&in.lambda_r_hat_Wb.alpha,
                                       &in.lambda_r_hat_Wb.beta,
                                       &in.e1_A.alpha,
                                       &in.e1_A.beta,
                                       &in.omega_s_hat_rad_s,
                                       &in.omega_e_hat_rad_s,
                                       &in.expected_step_rad_s,
                                       &in.gain.l1_re_per_s,
                                       &in.gain.l1_im_per_s,
                                       &in.gain.l2_re_ohm,
                                       &in.gain.l2_im_ohm};
            *fields[field] = not_finite(bad);
            speed_adaptation_state_t st = {.x_rad_s = 10.0f};
            const speed_adaptation_out_t out = speed_adaptation_step(&cfg, &st, &in);
            TEST_ASSERT_TRUE(fabsf(out.omega_e_hat_rad_s) <= OMEGA_MAX);
            TEST_ASSERT_TRUE(fabsf(st.x_rad_s) <= OMEGA_MAX);
        }
    }
}

/* z itself stays as it came out, so that the monitor can see it. */
static void test_nan_current_error_is_visible_in_z(void)
{
    const speed_adaptation_config_t cfg = config_of(0, &plain);
    speed_adaptation_state_t st = {0};
    const speed_adaptation_in_t in = in_with_z(NAN);
    const speed_adaptation_out_t out = speed_adaptation_step(&cfg, &st, &in);
    TEST_ASSERT_TRUE(isnan(out.z_Wb_A));
    ASSERT_SAME_FLOAT(-OMEGA_MAX, out.omega_e_hat_rad_s);
}

static bool accepted(const speed_adaptation_params_t *params)
{
    speed_adaptation_config_t cfg;
    const motor_model_t motor = reference_derived(0);
    return speed_adaptation_init(&cfg, params, &motor, PERIOD_S);
}

#define FLOAT_PARAMS 8
static float *float_param(speed_adaptation_params_t *p, int k)
{
    float *const fields[FLOAT_PARAMS] = {
        &p->kp_rad_per_s_Wb_A, &p->ki_rad_per_s2_Wb_A,  &p->leak_per_s_Wb_A, &p->near_zero_on_rad_s,
        &p->phi_factor,        &p->near_zero_off_rad_s, &p->omega_max_rad_s, &p->phi_ramp_rad_s};
    return fields[k];
}

static void test_init_refuses_what_is_not_finite_or_negative(void)
{
    for (int field = 0; field < FLOAT_PARAMS; field++) {
        for (int k = 0; k < NOT_POSITIVE_COUNT - 1; k++) {
            speed_adaptation_params_t params = plain;
            params.near_zero_on_rad_s = 0.0f;
            *float_param(&params, field) = not_positive(k);
            TEST_ASSERT_FALSE(accepted(&params));
        }
    }
}

static void test_init_takes_zero_gains_but_no_zero_limits(void)
{
    for (int field = 0; field < FLOAT_PARAMS; field++) {
        speed_adaptation_params_t params = plain;
        params.near_zero_on_rad_s = 0.0f;
        *float_param(&params, field) = 0.0f;
        TEST_ASSERT_EQUAL(field < 6, accepted(&params));
    }
}

static void test_init_refuses_crossed_thresholds(void)
{
    speed_adaptation_params_t params = plain;
    params.near_zero_off_rad_s = params.near_zero_on_rad_s;
    TEST_ASSERT_TRUE(accepted(&params));
    params.near_zero_off_rad_s = 15.9f;
    TEST_ASSERT_FALSE(accepted(&params));
}

static void test_init_refuses_more_than_the_whole_angle(void)
{
    speed_adaptation_params_t params = plain;
    params.phi_factor = 1.0f;
    TEST_ASSERT_TRUE(accepted(&params));
    params.phi_factor = 1.001f;
    TEST_ASSERT_FALSE(accepted(&params));
}

static void test_init_refuses_more_than_the_whole_acceleration(void)
{
    const float taken[2] = {0.0f, 1.0f};
    const float refused[3] = {-0.001f, 1.001f, NAN};
    speed_adaptation_params_t params = plain;
    for (int k = 0; k < 2; k++) {
        params.accel_share = taken[k];
        TEST_ASSERT_TRUE(accepted(&params));
    }
    for (int k = 0; k < 3; k++) {
        params.accel_share = refused[k];
        TEST_ASSERT_FALSE(accepted(&params));
    }
}

static void test_init_refuses_an_unknown_mode(void)
{
    speed_adaptation_params_t params = plain;
    params.eps1_mode = SPEED_ADAPTATION_EPS1_NEAR_ZERO;
    TEST_ASSERT_TRUE(accepted(&params));
    params.eps1_mode = (speed_adaptation_eps1_mode_t)3;
    TEST_ASSERT_FALSE(accepted(&params));
}

static void test_init_refuses_senseless_machine_data_and_period(void)
{
    speed_adaptation_config_t cfg;
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        for (int field = 0; field < 4; field++) {
            motor_model_t m = reference_derived(0);
            float *const fields[4] = {&m.a11_per_s, &m.tau_per_s, &m.eps_H, &m.M_H};
            *fields[field] = not_positive(k);
            TEST_ASSERT_FALSE(speed_adaptation_init(&cfg, &plain, &m, PERIOD_S));
        }
        const motor_model_t motor = reference_derived(0);
        TEST_ASSERT_FALSE(speed_adaptation_init(&cfg, &plain, &motor, not_positive(k)));
    }
}

static void test_dwelling_takes_the_whole_of_phi(void)
{
    uint32_t seed = 41u;
    speed_adaptation_params_t params = plain;
    params.phi_factor = 0.25f;
    const speed_adaptation_config_t part = config_of(1, &params);
    params.phi_factor = 1.0f;
    const speed_adaptation_config_t whole = config_of(1, &params);
    params.phi_factor = 0.625f;
    const speed_adaptation_config_t between = config_of(1, &params);
    speed_adaptation_in_t in = random_in(&seed);
    for (int half = 0; half < 2; half++) {
        speed_adaptation_state_t st = {0};
        speed_adaptation_state_t other = {0};
        in.dwell = 0.0f;
        const float expected =
            speed_adaptation_step((half != 0) ? &between : &whole, &other, &in).z_Wb_A;
        in.dwell = (half != 0) ? 0.5f : 1.0f;
        ASSERT_NEAR(1e-6, expected, speed_adaptation_step(&part, &st, &in).z_Wb_A);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_current_ahead_of_the_flux_raises_the_speed);
    RUN_TEST(test_no_error_holds_the_speed);
    RUN_TEST(test_step_without_leak_is_a_pi_law);
    RUN_TEST(test_step_leaks_to_zero);
    RUN_TEST(test_step_takes_its_share_of_the_expected_acceleration);
    RUN_TEST(test_step_turns_the_projection_by_phi);
    RUN_TEST(test_error_does_not_depend_on_the_frames_angle);
    RUN_TEST(test_phi_is_taken_anew_in_every_fourth_period);
    RUN_TEST(test_step_mirrors_bit_for_bit);
    RUN_TEST(test_error_grows_with_flux_and_current);
    RUN_TEST(test_three_readings_of_eps1_give_their_difference_equations);
    RUN_TEST(test_readings_of_eps1_are_different_numbers);
    RUN_TEST(test_constant_error_ends_at_the_bound_of_the_leak);
    RUN_TEST(test_leak_of_a_whole_sample_lands_on_zero);
    RUN_TEST(test_leak_near_zero_frequency_has_hysteresis);
    RUN_TEST(test_leak_of_the_other_modes_does_not_look_at_the_frequency);
    RUN_TEST(test_phi_makes_the_adaptation_gain_positive_everywhere);
    RUN_TEST(test_full_phi_uses_the_whole_current_error);
    RUN_TEST(test_without_phi_the_gain_is_negative_in_the_regenerating_wedge);
    RUN_TEST(test_phi_is_absent_at_zero_frequency);
    RUN_TEST(test_phi_grows_with_the_frequency_up_to_its_ramp);
    RUN_TEST(test_integral_gain_grows_with_the_frequency);
    RUN_TEST(test_integral_gain_is_the_constant_again_once_phi_is_off);
    RUN_TEST(test_integrator_is_limited);
    RUN_TEST(test_speed_is_limited_and_the_integrator_free);
    RUN_TEST(test_no_input_makes_the_speed_non_finite);
    RUN_TEST(test_nan_current_error_is_visible_in_z);
    RUN_TEST(test_init_refuses_what_is_not_finite_or_negative);
    RUN_TEST(test_init_takes_zero_gains_but_no_zero_limits);
    RUN_TEST(test_init_refuses_crossed_thresholds);
    RUN_TEST(test_init_refuses_more_than_the_whole_angle);
    RUN_TEST(test_init_refuses_more_than_the_whole_acceleration);
    RUN_TEST(test_init_refuses_an_unknown_mode);
    RUN_TEST(test_init_refuses_senseless_machine_data_and_period);
    RUN_TEST(test_dwelling_takes_the_whole_of_phi);
    return UNITY_END();
}
