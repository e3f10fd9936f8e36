/* The law alone, and what it claims: the field keeps away from zero and crosses it in one go. */
#include "flux_steering.h"

#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0002f

static const flux_steering_params_t good = {.min_rad_s = 4.23f,
                                            .hysteresis_rad_s = 1.25f,
                                            .lambda_nominal_Wb = 0.52f,
                                            .lambda_min_Wb = 0.203f,
                                            .torque_min_Nm = 0.8f,
                                            .torque_filter_s = 0.032f,
                                            .slew_Wb_per_s = 0.37f,
                                            .i_q_max_A = 15.0f};

/* Slip = T/(4 lambda^2); at nominal flux T/4. Flux for the torque T/64. No filter. */
static const flux_steering_config_t simple = {.min_rad_s = 4.0f,
                                              .leave_rad_s = 5.0f,
                                              .lambda_nominal_Wb = 1.0f,
                                              .lambda_min_Wb = 0.25f,
                                              .torque_min_Nm = 1.0f,
                                              .slip_Wb2_per_Nm_s = 0.25f,
                                              .nominal_slip_per_Nm_s = 0.25f,
                                              .flux_per_torque_Wb_per_Nm = 0.015625f,
                                              .step_Wb = 8.0f,
                                              .filter_gain = 1.0f,
                                              .follow = 1.0f,
                                              .inv_period_per_s = 4096.0f};

static flux_steering_config_t cfg;
static flux_steering_state_t st;
static motor_model_t table1;

void setUp(void)
{
    cfg = simple;
    st = (flux_steering_state_t){0};
    table1 = reference_derived(0);
}

void tearDown(void)
{
}

/* Flux reference after a step. */
static float flux_Wb(float omega_ref_rad_s, float torque_Nm)
{
    const flux_steering_out_t out =
        flux_steering_step(&cfg, &st, omega_ref_rad_s, omega_ref_rad_s, torque_Nm);
    return cfg.lambda_nominal_Wb - out.reduction_Wb;
}

/* The same from rest. */
static float fresh_flux_Wb(float omega_ref_rad_s, float torque_Nm)
{
    st = (flux_steering_state_t){0};
    return flux_Wb(omega_ref_rad_s, torque_Nm);
}

static void test_init_derives_slip_and_flux_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_t *motor = &reference_machine[m];
        const motor_model_t model = reference_derived(m);
        const double Rr = (double)motor->Rr_ohm;
        const double kr = (double)motor->M_H / (double)motor->Lr_H;
        const double pairs = (double)motor->pole_pairs;
        TEST_ASSERT_TRUE(flux_steering_init(&cfg, &good, &model, PERIOD_S));
        /* Slip Rr T/(p lambda^2); torque p (M/Lr) lambda i_q with .95 of the largest i_q. */
        ASSERT_NEAR(1e-6, Rr / pairs, cfg.slip_Wb2_per_Nm_s);
        ASSERT_NEAR(1e-6, Rr / (pairs * 0.52 * 0.52), cfg.nominal_slip_per_Nm_s);
        ASSERT_NEAR(1e-8, 1.0 / (pairs * kr * 0.95 * 15.0), cfg.flux_per_torque_Wb_per_Nm);
        ASSERT_SAME_FLOAT(4.23f, cfg.min_rad_s);
        ASSERT_NEAR(1e-6, 5.48, cfg.leave_rad_s);
        ASSERT_SAME_FLOAT(0.52f, cfg.lambda_nominal_Wb);
        ASSERT_SAME_FLOAT(0.203f, cfg.lambda_min_Wb);
        ASSERT_SAME_FLOAT(0.8f, cfg.torque_min_Nm);
        ASSERT_NEAR(1e-10, 0.37 * 2e-4, cfg.step_Wb);
        ASSERT_NEAR(1e-9, 0.2 / 32.2, cfg.filter_gain);
        ASSERT_NEAR(1e-8, 0.8 / 32.2, cfg.follow);
        ASSERT_NEAR(1e-3, 5000.0, cfg.inv_period_per_s);
    }
}

static void test_init_takes_the_pole_pairs(void)
{
    table1.pole_pairs = 3.0f;
    TEST_ASSERT_TRUE(flux_steering_init(&cfg, &good, &table1, PERIOD_S));
    ASSERT_NEAR(1e-6, 0.5 / 3.0, cfg.slip_Wb2_per_Nm_s);
    ASSERT_NEAR(1e-8, 1.0 / (3.0 * 0.95 * 15.0), cfg.flux_per_torque_Wb_per_Nm);
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        flux_steering_params_t bad = good;                                                         \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(flux_steering_init(&cfg, &bad, &table1, PERIOD_S), #field);      \
    } while (0)

#define ASSERT_MOTOR_REFUSED(field, value)                                                         \
    do {                                                                                           \
        motor_model_t bad = table1;                                                                \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(flux_steering_init(&cfg, &good, &bad, PERIOD_S), #field);        \
    } while (0)

static void test_init_refuses_every_bad_number(void)
{
    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        const float x = not_positive(i);
        ASSERT_REFUSED(lambda_nominal_Wb, x);
        ASSERT_REFUSED(lambda_min_Wb, x);
        ASSERT_REFUSED(slew_Wb_per_s, x);
        ASSERT_REFUSED(i_q_max_A, x);
        ASSERT_MOTOR_REFUSED(pole_pairs, x);
        ASSERT_MOTOR_REFUSED(kr, x);
        ASSERT_MOTOR_REFUSED(tau_per_s, x);
        ASSERT_MOTOR_REFUSED(M_H, x);
        TEST_ASSERT_FALSE(flux_steering_init(&cfg, &good, &table1, x));
    }
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        ASSERT_REFUSED(min_rad_s, not_finite(i));
        ASSERT_REFUSED(hysteresis_rad_s, not_finite(i));
        ASSERT_REFUSED(torque_min_Nm, not_finite(i));
        ASSERT_REFUSED(torque_filter_s, not_finite(i));
    }
    ASSERT_REFUSED(min_rad_s, -4.0f);
    ASSERT_REFUSED(hysteresis_rad_s, -0.1f);
    ASSERT_REFUSED(torque_min_Nm, -0.1f);
    ASSERT_REFUSED(torque_filter_s, -0.0001f);
    ASSERT_REFUSED(lambda_min_Wb, 0.521f);
    ASSERT_REFUSED(i_q_max_A, 3e38f); /* the flux it needs is zero */
    table1.kr = -table1.kr;           /* wrong signs that cancel in the slip */
    ASSERT_MOTOR_REFUSED(tau_per_s, -4.9f);
}

static void test_init_accepts_the_ends_of_the_ranges(void)
{
    flux_steering_params_t p = good;
    p.hysteresis_rad_s = 0.0f;
    p.torque_min_Nm = 0.0f;
    p.torque_filter_s = 0.0f;
    p.lambda_min_Wb = p.lambda_nominal_Wb;
    TEST_ASSERT_TRUE(flux_steering_init(&cfg, &p, &table1, PERIOD_S));
    ASSERT_SAME_FLOAT(1.0f, cfg.filter_gain);
    ASSERT_SAME_FLOAT(1.0f, cfg.follow);
    ASSERT_SAME_FLOAT(4.23f, cfg.leave_rad_s);
    p.min_rad_s = 1e-3f;
    TEST_ASSERT_TRUE(flux_steering_init(&cfg, &p, &table1, PERIOD_S));
    ASSERT_SAME_FLOAT(1e-3f, cfg.min_rad_s);
    cfg = simple;
    cfg.min_rad_s = 0.5f;
    /* Field -.75 with nominal slip: not slow enough; -.25: .5 + 1.25 x .75 of slip, T/(4 lambda^2).
     */
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(-1.25f, 2.0f));
    ASSERT_NEAR(1e-6, sqrt(0.5 / 1.4375), fresh_flux_Wb(-0.75f, 2.0f));
}

static void test_switched_off_nothing_is_looked_at_and_nothing_moves(void)
{
    const flux_steering_params_t off = {.min_rad_s = 0.0f, .lambda_nominal_Wb = NAN};
    const motor_model_t none = {0};
    TEST_ASSERT_TRUE(flux_steering_init(&cfg, &off, &none, NAN));
    st = (flux_steering_state_t){0};
    const flux_steering_state_t before = st;
    const flux_steering_out_t out = flux_steering_step(&cfg, &st, 0.0f, 0.0f, 10.0f);
    ASSERT_SAME_FLOAT(0.0f, out.reduction_Wb);
    ASSERT_SAME_FLOAT(0.0f, out.rate_Wb_per_s);
    TEST_ASSERT_FALSE(out.moving);
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
}

static void test_a_field_that_is_fast_enough_keeps_nominal_flux(void)
{
    /* Slip 2: motoring with 6 rad/s, and braking with -6. */
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(4.0f, 8.0f));
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(-8.0f, 8.0f));
    TEST_ASSERT_FALSE(st.steering);
}

static void test_a_slow_field_is_given_the_slip_it_lacks(void)
{
    /* Standstill: slip 4 = 8/(4 lambda^2). */
    ASSERT_NEAR(1e-7, sqrt(0.5), fresh_flux_Wb(0.0f, 8.0f));
    /* Braking from 4 rad/s: slip 4 + 1.25 x 4. */
    ASSERT_NEAR(1e-7, sqrt(2.0 / 9.0), fresh_flux_Wb(-4.0f, 8.0f));
    TEST_ASSERT_TRUE(st.steering);
}

/* Slip 4 + 1.25 w braking, flux sqrt(8/(4 slip)). The estimate counts .4 x 4 rad/s beyond the
 * reference. */
static void test_the_speed_further_against_the_torque_counts(void)
{
    const struct {
        float ref_rad_s, hat_rad_s, torque_Nm;
        double slip_rad_s;
    } of[] = {{-2.0f, -5.6f, 8.0f, 9.0}, {-4.0f, -5.0f, 8.0f, 9.0}, {-2.0f, -3.5f, 8.0f, 6.5},
              {-2.0f, 1.0f, 8.0f, 6.5},  {2.0f, 5.6f, -8.0f, 9.0},  {4.0f, 5.0f, -8.0f, 9.0},
              {2.0f, 3.5f, -8.0f, 6.5},  {2.0f, -1.0f, -8.0f, 6.5}, {9.0f, -2.6f, 8.0f, 5.25},
              {0.0f, -5.6f, 8.0f, 9.0},  {1.0f, 0.5f, 8.0f, 3.0}};
    for (unsigned k = 0; k < sizeof of / sizeof of[0]; k++) {
        st = (flux_steering_state_t){0};
        const flux_steering_out_t out =
            flux_steering_step(&cfg, &st, of[k].ref_rad_s, of[k].hat_rad_s, of[k].torque_Nm);
        ASSERT_NEAR(1e-6, sqrt(2.0 / of[k].slip_rad_s), 1.0 - (double)out.reduction_Wb);
        TEST_ASSERT_TRUE(st.steering);
    }
}

static void test_one_step_agrees_with_double_arithmetic_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        flux_steering_params_t p = good;
        p.slew_Wb_per_s = 10.0f; /* not limited in this step */
        TEST_ASSERT_TRUE(flux_steering_init(&cfg, &p, &model, PERIOD_S));
        st = (flux_steering_state_t){.torque_Nm = -6.0f, .reduction_Wb = 0.2f, .steering = true};
        const double torque = -6.0 + 0.2 / 32.2 * (-7.0 + 6.0);
        /* 1 rad/s against the torque. */
        const double slip = 4.23 + 1.25;
        const double pairs = (double)reference_machine[m].pole_pairs;
        const double lambda = sqrt((double)reference_machine[m].Rr_ohm * -torque / (pairs * slip));
        const double below = 0.52 - fmin(lambda, 0.52);
        const double step = fmax(-2e-3, fmin(2e-3, 0.8 / 32.2 * (below - 0.2)));
        const flux_steering_out_t out = flux_steering_step(&cfg, &st, 1.0f, 1.0f, -7.0f);
        ASSERT_NEAR(1e-6, torque, st.torque_Nm);
        ASSERT_NEAR(1e-7, 0.2 + step, out.reduction_Wb);
        ASSERT_NEAR(1e-3, -step / 2e-4, out.rate_Wb_per_s);
        ASSERT_SAME_FLOAT(out.reduction_Wb, st.reduction_Wb);
    }
}

static void test_the_mirror_image_has_the_same_flux(void)
{
    for (int k = -24; k <= 24; k++) {
        const float w_rad_s = 0.5f * (float)k;
        for (int n = 1; n <= 12; n++) {
            const float plus_Wb = fresh_flux_Wb(w_rad_s, (float)n);
            const flux_steering_state_t plus = st;
            ASSERT_SAME_FLOAT(plus_Wb, fresh_flux_Wb(-w_rad_s, (float)-n));
            ASSERT_SAME_FLOAT(-plus.torque_Nm, st.torque_Nm);
            TEST_ASSERT_EQUAL(plus.steering, st.steering);
        }
    }
}

static void test_the_flux_stays_between_its_floor_and_nominal(void)
{
    /* 2 Nm braking at 4: slip 9 would take .236 Wb. */
    ASSERT_SAME_FLOAT(0.25f, fresh_flux_Wb(-4.0f, 2.0f));
    /* 12 Nm braking at 6.9: the field of -3.9 needs slip 12.625, .487 Wb. */
    ASSERT_NEAR(1e-6, sqrt(3.0 / 12.625), fresh_flux_Wb(-6.9f, 12.0f));
    /* The torque itself: 40 Nm take .625 Wb, the slip of 20.25 takes .703. */
    ASSERT_NEAR(1e-6, sqrt(10.0 / 20.25), fresh_flux_Wb(-13.0f, 40.0f));
    cfg.flux_per_torque_Wb_per_Nm = 0.019f;
    ASSERT_NEAR(1e-6, 0.76, fresh_flux_Wb(-13.0f, 40.0f));
    cfg.flux_per_torque_Wb_per_Nm = 0.0625f; /* more than nominal: as much as there is */
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(-13.0f, 40.0f));
}

/* Braking at 4 with .25 Wb, the least, the slip is 4 T: the field turns with 4 T - 4. Steering
 * takes .99 of w_min to begin, and half of it to go on. */
static void test_a_torque_that_cannot_turn_the_field_keeps_nominal_flux(void)
{
    const struct {
        float torque_Nm;
        bool from_rest, once_begun;
    } of[] = {{1.98f, false, true},  {2.0f, true, true},    {1.51f, false, true},
              {1.49f, false, false}, {1.0f, false, false},  {-1.98f, false, true},
              {-2.0f, true, true},   {-1.51f, false, true}, {-1.49f, false, false}};
    for (unsigned k = 0; k < sizeof of / sizeof of[0]; k++) {
        const float torque_Nm = of[k].torque_Nm, w_rad_s = (torque_Nm < 0.0f) ? 4.0f : -4.0f;
        ASSERT_SAME_FLOAT(of[k].from_rest ? 0.25f : 1.0f, fresh_flux_Wb(w_rad_s, torque_Nm));
        TEST_ASSERT_EQUAL(of[k].from_rest, st.steering);
        st = (flux_steering_state_t){.steering = true};
        ASSERT_SAME_FLOAT(of[k].once_begun ? 0.25f : 1.0f, flux_Wb(w_rad_s, torque_Nm));
        TEST_ASSERT_EQUAL(of[k].once_begun, st.steering);
    }
}

static void test_a_torque_below_its_threshold_keeps_nominal_flux(void)
{
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(2.0f, 0.98f));
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(2.0f, 0.0f));
    ASSERT_NEAR(1e-6, sqrt(0.125), fresh_flux_Wb(2.0f, 1.0f));
    TEST_ASSERT_TRUE(st.steering);
    /* Once begun, half of it will do. */
    ASSERT_NEAR(1e-6, sqrt(0.06375), flux_Wb(2.0f, 0.51f));
    TEST_ASSERT_TRUE(st.steering);
    ASSERT_SAME_FLOAT(1.0f, flux_Wb(2.0f, 0.49f));
    TEST_ASSERT_FALSE(st.steering);
    ASSERT_SAME_FLOAT(1.0f, flux_Wb(2.0f, 0.51f));
    /* Asked to stand, half of it will do to begin as well; and the field may turn with half of
     * w_min. */
    cfg.torque_min_Nm = 1.1f;
    ASSERT_SAME_FLOAT(0.25f, fresh_flux_Wb(0.0f, 0.56f));
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(0.0f, 0.54f));
    cfg.torque_min_Nm = 0.9f;
    ASSERT_SAME_FLOAT(0.25f, fresh_flux_Wb(0.0f, 0.51f));
    ASSERT_SAME_FLOAT(1.0f, fresh_flux_Wb(0.0f, 0.49f));
}

/* Slip 2 at nominal flux: the field is w + 2. */
static void test_thresholds_on_either_side_of_zero(void)
{
    const struct {
        float w_rad_s;
        bool from_rest;  /* steering afterwards, when it was off ... */
        bool once_begun; /* ... and when it was on */
    } point[] = {{2.0f, true, true},    {2.01f, false, true},  {3.0f, false, true},
                 {3.01f, false, false}, {-6.0f, true, true},   {-6.01f, false, true},
                 {-7.0f, false, true},  {-7.01f, false, false}};
    for (unsigned k = 0; k < sizeof point / sizeof point[0]; k++) {
        (void)fresh_flux_Wb(point[k].w_rad_s, 8.0f);
        TEST_ASSERT_EQUAL(point[k].from_rest, st.steering);
        st = (flux_steering_state_t){.steering = true};
        (void)flux_Wb(point[k].w_rad_s, 8.0f);
        TEST_ASSERT_EQUAL(point[k].once_begun, st.steering);
    }
}

/* In the hysteresis, motoring: w_min - w is no slip to divide by. */
static void test_motoring_faster_than_the_minimum_needs_no_slip(void)
{
    const float w_rad_s[] = {4.0f, 4.5f};
    for (int k = 0; k < 2; k++) {
        for (int n = 0; n < 2; n++) {
            cfg.torque_min_Nm = (n == 0) ? 1.0f : 0.0f;
            st.steering = true;
            ASSERT_SAME_FLOAT(1.0f, flux_Wb(w_rad_s[k], (n == 0) ? 1.0f : 0.0f));
            TEST_ASSERT_FALSE(st.steering);
        }
    }
    /* Just below, the flux is nominal as well: nothing jumps. */
    st.steering = true;
    ASSERT_SAME_FLOAT(1.0f, flux_Wb(nextafterf(4.0f, 0.0f), 1.0f));
    TEST_ASSERT_TRUE(st.steering);
}

static void test_the_flux_moves_by_the_slew_step_and_says_so(void)
{
    cfg.step_Wb = 0.125f;
    const float reduction_Wb[] = {0.125f, 0.25f, 0.375f, 0.5f, 0.5f};
    for (unsigned k = 0; k < 5u; k++) {
        const flux_steering_out_t out = flux_steering_step(&cfg, &st, -3.2f, -3.2f, 8.0f);
        ASSERT_SAME_FLOAT(reduction_Wb[k], out.reduction_Wb);
        ASSERT_NEAR(0.0, (k < 4u) ? -512.0 : 0.0, out.rate_Wb_per_s);
        TEST_ASSERT_EQUAL(k < 4u, out.moving);
    }
    /* And back, the last bit of the way slower than the limit. */
    st.reduction_Wb = 0.1875f;
    flux_steering_out_t out = flux_steering_step(&cfg, &st, 20.0f, 20.0f, 8.0f);
    ASSERT_SAME_FLOAT(0.0625f, out.reduction_Wb);
    ASSERT_SAME_FLOAT(512.0f, out.rate_Wb_per_s);
    TEST_ASSERT_TRUE(out.moving);
    out = flux_steering_step(&cfg, &st, 20.0f, 20.0f, 8.0f);
    ASSERT_SAME_FLOAT(0.0f, out.reduction_Wb);
    ASSERT_SAME_FLOAT(256.0f, out.rate_Wb_per_s);
    TEST_ASSERT_FALSE(out.moving);
}

/* Less than a step of the slew limit away the flux comes nearer by a share of the way, so that the
 * noise of the estimate does not move it. */
static void test_the_flux_follows_its_target(void)
{
    cfg.follow = 0.25f;
    st = (flux_steering_state_t){.torque_Nm = 8.0f, .steering = true};
    const float reduction_Wb[] = {0.125f, 0.21875f, 0.2890625f};
    for (unsigned k = 0; k < 3u; k++) {
        const flux_steering_out_t out = flux_steering_step(&cfg, &st, -3.2f, -3.2f, 8.0f);
        ASSERT_SAME_FLOAT(reduction_Wb[k], out.reduction_Wb);
        TEST_ASSERT_FALSE(out.moving);
    }
    cfg.step_Wb = 0.03125f;
    TEST_ASSERT_TRUE(flux_steering_step(&cfg, &st, -3.2f, -3.2f, 8.0f).moving);
    ASSERT_SAME_FLOAT(0.3203125f, st.reduction_Wb);
}

/* In torque mode the reference is the filtered estimate: what goes up and down with each step does
 * not move the flux. Unfiltered the target would, by all the slew there is. */
static void test_the_estimate_is_filtered_as_the_torque(void)
{
    cfg.filter_gain = 0.0625f;
    cfg.follow = 0.25f;
    cfg.step_Wb = 0.0625f;
    st = (flux_steering_state_t){
        .torque_Nm = 8.0f, .omega_rad_s = -3.2f, .reduction_Wb = 0.5f, .steering = true};
    for (int k = 0; k < 200; k++) {
        const float hat_rad_s = ((k % 2) == 0) ? -2.4f : -4.0f;
        const flux_steering_out_t out =
            flux_steering_step(&cfg, &st, st.omega_rad_s, hat_rad_s, 8.0f);
        TEST_ASSERT_FALSE(out.moving);
    }
    ASSERT_NEAR(0.06, -3.2, st.omega_rad_s);
}

static void test_no_number_is_remembered(void)
{
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        const float x = not_finite(i);
        st = (flux_steering_state_t){
            .torque_Nm = 8.0f, .omega_rad_s = -3.2f, .reduction_Wb = 0.5f, .steering = true};
        ASSERT_SAME_FLOAT(0.5f, flux_Wb(-3.2f, x));
        ASSERT_SAME_FLOAT(8.0f, st.torque_Nm);
        (void)flux_steering_step(&cfg, &st, -3.2f, x, 8.0f);
        ASSERT_SAME_FLOAT(-3.2f, st.omega_rad_s);
        ASSERT_SAME_FLOAT(1.0f, flux_Wb(NAN, 8.0f)); /* a reference without sense: nominal flux */
        ASSERT_SAME_FLOAT(0.5f, flux_Wb(-3.2f, 8.0f));
    }
}

/* ---- The claims, on both machines with the parameters of the default configuration ---- */

static flux_steering_params_t of_machine(int machine)
{
    flux_steering_params_t p = good;
    p.lambda_nominal_Wb = 5.1f * reference_machine[machine].M_H;
    p.lambda_min_Wb = 0.4f * p.lambda_nominal_Wb;
    p.torque_min_Nm = 0.4f * reference_machine[machine].pole_pairs;
    return p;
}

/* Slip, from the rotor circuit: i_q = T/(p (M/Lr) lambda), slip = (Rr/Lr) M i_q/lambda. */
static double slip_rad_s(int machine, double torque_Nm, double lambda_Wb)
{
    const motor_t *m = &reference_machine[machine];
    const double i_q_A =
        torque_Nm * (double)m->Lr_H / ((double)m->pole_pairs * (double)m->M_H * lambda_Wb);
    return (double)m->Rr_ohm / (double)m->Lr_H * (double)m->M_H * i_q_A / lambda_Wb;
}

static void test_the_field_keeps_away_from_zero_or_the_flux_stays_nominal(void)
{
    int steered = 0, floored = 0, dwelling = 0, points = 0;
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const flux_steering_params_t p = of_machine(m);
        const motor_model_t model = reference_derived(m);
        const float pairs = reference_machine[m].pole_pairs;
        TEST_ASSERT_TRUE(flux_steering_init(&cfg, &p, &model, PERIOD_S));
        cfg.filter_gain = 1.0f;
        cfg.follow = 1.0f;
        cfg.step_Wb = 1.0f;
        for (int k = -60; k <= 60; k++) {
            for (int n = -30; n <= 30; n++) {
                const float w_rad_s = 0.5f * (float)k, torque_Nm = 0.2f * pairs * (float)n;
                const double flux = (double)fresh_flux_Wb(w_rad_s, torque_Nm);
                const double field = (double)w_rad_s + slip_rad_s(m, (double)torque_Nm, flux);
                const double i_q_A = fabs((double)torque_Nm) * (double)reference_machine[m].Lr_H /
                                     ((double)pairs * (double)reference_machine[m].M_H * flux);
                const bool at_floor =
                    (flux <= (double)p.lambda_min_Wb + 1e-6) || (i_q_A >= 0.95 * 15.0 - 1e-4);
                points++;
                steered += st.steering;
                floored += st.steering && at_floor;
                TEST_ASSERT_TRUE(i_q_A < 15.0);
                const double with_Nm = (torque_Nm < 0.0f) ? -field : field;
                const double braking = fmax((torque_Nm < 0.0f) ? w_rad_s : -w_rad_s, 0.0);
                if (st.steering && (flux < (double)p.lambda_nominal_Wb - 1e-6) && !at_floor) {
                    ASSERT_NEAR(1e-4, 4.23 + 0.25 * braking, with_Nm);
                } else if ((torque_Nm * torque_Nm >= p.torque_min_Nm * p.torque_min_Nm) &&
                           !st.steering && (fabs(field) < 4.23 - 1e-4)) {
                    /* Not even the floor turns the field. */
                    const double floor_Wb =
                        fmax((double)p.lambda_min_Wb, i_q_A * flux / (0.95 * 15.0));
                    const double way = (torque_Nm < 0.0f) ? -1.0 : 1.0;
                    const double low = slip_rad_s(m, fabs((double)torque_Nm), floor_Wb);
                    TEST_ASSERT_TRUE(low + way * (double)w_rad_s < 0.99 * 4.23 + 1e-4);
                    dwelling++;
                } else {
                    /* fast enough, or no torque, or at the floor */
                }
            }
        }
    }
    /* The grid does visit all of it. */
    TEST_ASSERT_TRUE((steered > points / 20) && (floored > 0) && (floored < steered / 2) &&
                     (dwelling > 0));
}

/* A reference that wanders by less than the hysteresis around a threshold, and torque ripple. */
static void test_noise_within_the_hysteresis_switches_once(void)
{
    uint32_t seed = 11u;
    TEST_ASSERT_TRUE(flux_steering_init(&cfg, &good, &table1, PERIOD_S));
    int switches = 0;
    bool before = false;
    for (int k = 0; k < 25000; k++) {
        /* 6 Nm: slip 5.55 at nominal flux; the field wanders around -4.4 rad/s, by 1 rad/s. */
        const float w_rad_s = -4.4f - 5.547f + 0.5f * noise(&seed);
        (void)flux_steering_step(&cfg, &st, w_rad_s, w_rad_s, 6.0f + noise(&seed));
        switches += st.steering != before;
        before = st.steering;
    }
    TEST_ASSERT_EQUAL_INT(1, switches);
    TEST_ASSERT_TRUE(st.steering);
    cfg.leave_rad_s = cfg.min_rad_s; /* without hysteresis it would chatter */
    for (int k = 0; k < 1000; k++) {
        const float w_rad_s = -4.4f - 5.547f + 0.5f * noise(&seed);
        (void)flux_steering_step(&cfg, &st, w_rad_s, w_rad_s, 6.0f + noise(&seed));
        switches += st.steering != before;
        before = st.steering;
    }
    TEST_ASSERT_TRUE(switches > 50);
}

/* Around the torque with which it begins, and around the least that turns the field. */
static void test_a_torque_that_swings_switches_once(void)
{
    const struct {
        float w_rad_s, torque_Nm;
    } of[] = {{2.0f, 0.8f}, {-1.5f, 1.0f}};
    uint32_t seed = 12u;
    for (int n = 0; n < 2; n++) {
        TEST_ASSERT_TRUE(flux_steering_init(&cfg, &good, &table1, PERIOD_S));
        st = (flux_steering_state_t){0};
        int switches = 0;
        bool before = false;
        for (int k = 0; k < 50000; k++) {
            /* A swing of .1 s, by a third. */
            const float swing = 1.0f + 0.33f * sinf(0.0126f * (float)k);
            (void)flux_steering_step(&cfg, &st, of[n].w_rad_s, of[n].w_rad_s,
                                     swing * of[n].torque_Nm + 0.2f * noise(&seed));
            switches += st.steering != before;
            before = st.steering;
        }
        TEST_ASSERT_EQUAL_INT(1, switches);
        TEST_ASSERT_TRUE(st.steering);
    }
}

/* Braking at 60 to -60 min^-1 at 5 min^-1/s, full torque: zero frequency is passed once, and fast;
 * with the flux at its reference. */
static void test_zero_frequency_is_crossed_in_one_go(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            const flux_steering_params_t p = of_machine(m);
            const motor_model_t model = reference_derived(m);
            TEST_ASSERT_TRUE(flux_steering_init(&cfg, &p, &model, PERIOD_S));
            const double torque_Nm = -4.2 * (double)reference_machine[m].pole_pairs * sign;
            st = (flux_steering_state_t){.torque_Nm = (float)torque_Nm};
            double w_rad_s = sign * 30.0, before = sign * 99.0, inside_s = 0.0;
            int crossings = 0, back = 0;
            for (int k = 0; k < 300000; k++) {
                w_rad_s -= sign * 1.0472 * 2e-4; /* 5 min^-1/s, two pole pairs */
                const double flux = (double)flux_Wb((float)w_rad_s, (float)torque_Nm);
                const double field = w_rad_s + slip_rad_s(m, torque_Nm, flux);
                crossings += (field * before < 0.0);
                inside_s += (fabs(field) < 4.0) ? 2e-4 : 0.0;
                /* It may come back at the far side, as the flux does; never near zero. */
                back += ((field - before) * sign > 1e-9) && (fabs(field) < 4.0);
                before = field;
            }
            TEST_ASSERT_EQUAL_INT(1, crossings);
            TEST_ASSERT_EQUAL_INT(0, back);
            /* Unsteered it would be 8 rad/s at 1.05 rad/s^2: 7.6 s. */
            TEST_ASSERT_TRUE(inside_s < 1.0);
            ASSERT_NEAR(1e-6, 0.0, st.reduction_Wb);
        }
    }
}

static void test_two_steerings_share_a_config_and_nothing_else(void)
{
    flux_steering_state_t other = {0};
    const float first_Wb = flux_Wb(-4.0f, 8.0f);
    const flux_steering_out_t out = flux_steering_step(&cfg, &other, -4.0f, -4.0f, 8.0f);
    ASSERT_SAME_FLOAT(first_Wb, cfg.lambda_nominal_Wb - out.reduction_Wb);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_slip_and_flux_of_both_machines);
    RUN_TEST(test_init_takes_the_pole_pairs);
    RUN_TEST(test_init_refuses_every_bad_number);
    RUN_TEST(test_init_accepts_the_ends_of_the_ranges);
    RUN_TEST(test_switched_off_nothing_is_looked_at_and_nothing_moves);
    RUN_TEST(test_a_field_that_is_fast_enough_keeps_nominal_flux);
    RUN_TEST(test_a_slow_field_is_given_the_slip_it_lacks);
    RUN_TEST(test_the_speed_further_against_the_torque_counts);
    RUN_TEST(test_one_step_agrees_with_double_arithmetic_on_both_machines);
    RUN_TEST(test_the_mirror_image_has_the_same_flux);
    RUN_TEST(test_the_flux_stays_between_its_floor_and_nominal);
    RUN_TEST(test_a_torque_that_cannot_turn_the_field_keeps_nominal_flux);
    RUN_TEST(test_a_torque_below_its_threshold_keeps_nominal_flux);
    RUN_TEST(test_thresholds_on_either_side_of_zero);
    RUN_TEST(test_motoring_faster_than_the_minimum_needs_no_slip);
    RUN_TEST(test_the_flux_moves_by_the_slew_step_and_says_so);
    RUN_TEST(test_the_flux_follows_its_target);
    RUN_TEST(test_the_estimate_is_filtered_as_the_torque);
    RUN_TEST(test_no_number_is_remembered);
    RUN_TEST(test_the_field_keeps_away_from_zero_or_the_flux_stays_nominal);
    RUN_TEST(test_noise_within_the_hysteresis_switches_once);
    RUN_TEST(test_a_torque_that_swings_switches_once);
    RUN_TEST(test_zero_frequency_is_crossed_in_one_go);
    RUN_TEST(test_two_steerings_share_a_config_and_nothing_else);
    return UNITY_END();
}
