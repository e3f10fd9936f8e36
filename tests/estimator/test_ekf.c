/* The extended Kalman filter against the motor's equations, and against full matrices in double. */
#include "estimator_fixture.h"

static const tolerance_t within = {
    .flux_pu = 2e-3, .speed_rad_s = 0.25, .held_rad_s = 0.1, .extra_slip_rad_s = 0.1};

#include "estimator_contract.h"

#define N 5

typedef struct {
    double at[N][N];
} full_t;

/* Where an entry of the covariance is kept. */
static float *entry(covariance_t *P, int r, int c)
{
    const int row = (r < c) ? r : c;
    const int column = (r < c) ? c : r;
    if (column == 4) {
        float *const of_speed[N] = {&P->iw.alpha, &P->iw.beta, &P->lw.alpha, &P->lw.beta, &P->ww};
        return of_speed[row];
    }
    if (row < 2 && column >= 2) {
        ab_t *const of_current = (row == 0) ? &P->li.alpha : &P->li.beta;
        return (column == 2) ? &of_current->alpha : &of_current->beta;
    }
    block_t *const own = (row < 2) ? &P->ii : &P->ll;
    ab_t *const at = (column % 2 == 0) ? &own->alpha : &own->beta;
    return (row % 2 == 0) ? &at->alpha : &at->beta;
}

static void test_off_forgets_its_own_states(void)
{
    check_off_forgets_the_flux();
    TEST_ASSERT_EQUAL_FLOAT(12.0f, st.omega_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, st.i_s_hat_A.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, covariance_sum(&st.P));
}

static void test_bad_parameters_of_the_covariances_are_refused(void)
{
    float *const parameter[] = {&list.speed_J_kg_m2, &list.i_q_max_A, &list.current_full_scale_A,
                                &list.line_voltage_full_scale_V};
    check_refuses(parameter, sizeof parameter / sizeof parameter[0]);
    list.period_s = 1.0f / motor.a11_per_s;
    TEST_ASSERT_FALSE(estimator_init(&cfg, &list, &motor, NULL));
}

static void test_the_sum_tells_no_number(void)
{
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    float *word[9 + N * (N + 1) / 2] = {&st.i_s_hat_A.alpha,       &st.i_s_hat_A.beta,
                                        &st.lambda_Wb.alpha,       &st.lambda_Wb.beta,
                                        &st.omega_rad_s,           &st.estimate.omega_e_rad_s,
                                        &st.estimate.omega_s_rad_s};
    size_t count = 7u;
    for (int r = 0; r < N; r++) {
        for (int c = r; c < N; c++) {
            word[count++] = entry(&st.P, r, c);
        }
    }
    check_sum(word, count);
}

/* The rules behind the covariances, on Table 1's motor with 25 A and 400 V of full scale. */
static void test_covariances_follow_their_rules(void)
{
    const motor_t *m = &reference_machine[0];
    const double sigma_Ls = (double)m->Ls_H - (double)m->M_H * (double)m->M_H / (double)m->Lr_H;
    const double torque_Nm = 2.0 * (double)m->M_H * 5.0 * (double)list.i_q_max_A;
    const double step = 2.0 * torque_Nm / (double)list.speed_J_kg_m2 * PERIOD_S;
    ASSERT_NEAR(1e-9, 0.025 * 0.025, cfg.R_A2);
    ASSERT_NEAR(1e-8, pow(PERIOD_S * 1.0 / sigma_Ls, 2.0), cfg.Q.current);
    ASSERT_NEAR(1e-13, pow(PERIOD_S * 1.0, 2.0), cfg.Q.flux);
    ASSERT_NEAR(1e-6, step * step, cfg.Q.speed);
}

static full_t product(const full_t *a, const full_t *b)
{
    full_t c = {0};
    for (int r = 0; r < N; r++) {
        for (int k = 0; k < N; k++) {
            for (int n = 0; n < N; n++) {
                c.at[r][k] += a->at[r][n] * b->at[n][k];
            }
        }
    }
    return c;
}

static full_t transposed(const full_t *a)
{
    full_t b;
    for (int r = 0; r < N; r++) {
        for (int c = 0; c < N; c++) {
            b.at[r][c] = a->at[c][r];
        }
    }
    return b;
}

/* A complex factor on (alpha, beta), as a block of a matrix. */
static void block(full_t *a, int row, int column, double complex factor)
{
    a->at[row][column] = creal(factor);
    a->at[row][column + 1] = -cimag(factor);
    a->at[row + 1][column] = cimag(factor);
    a->at[row + 1][column + 1] = creal(factor);
}

/* The filter with full matrices: x as (i, lambda, w). */
typedef struct {
    double complex i;
    double complex lambda;
    double omega;
    full_t P;
} filter_t;

static void full_predict(filter_t *f, const reference_model_t *m, double complex u)
{
    const double T = PERIOD_S;
    const double complex w = I * f->omega;
    const double complex a12 = (m->tau - w) / m->eps;
    const double complex a22 = -m->tau + w;
    full_t F = {0};
    block(&F, 0, 0, 1.0 + T * m->a11);
    block(&F, 0, 2, T * a12);
    block(&F, 2, 0, T * m->a21);
    block(&F, 2, 2, 1.0 + T * a22);
    const double complex by_speed = I * T * f->lambda;
    F.at[0][4] = creal(-by_speed / m->eps);
    F.at[1][4] = cimag(-by_speed / m->eps);
    F.at[2][4] = creal(by_speed);
    F.at[3][4] = cimag(by_speed);
    F.at[4][4] = 1.0;
    const full_t Ft = transposed(&F);
    const full_t FP = product(&F, &f->P);
    f->P = product(&FP, &Ft);
    const double Q[N] = {cfg.Q.current, cfg.Q.current, cfg.Q.flux, cfg.Q.flux, cfg.Q.speed};
    for (int r = 0; r < N; r++) {
        f->P.at[r][r] += Q[r];
    }
    const double complex i1 = m->a11 * f->i + a12 * f->lambda + m->b * u;
    const double complex l1 = m->a21 * f->i + a22 * f->lambda;
    const double complex i2 = m->a11 * i1 + a12 * l1;
    const double complex l2 = m->a21 * i1 + a22 * l1;
    f->i += T * i1 + 0.5 * T * T * i2;
    f->lambda += T * l1 + 0.5 * T * T * l2;
}

static void full_update(filter_t *f, double complex i_A)
{
    const double R = cfg.R_A2;
    const double S[2][2] = {{f->P.at[0][0] + R, f->P.at[0][1]}, {f->P.at[1][0], f->P.at[1][1] + R}};
    const double det = S[0][0] * S[1][1] - S[0][1] * S[1][0];
    const double inverse[2][2] = {{S[1][1] / det, -S[0][1] / det}, {-S[1][0] / det, S[0][0] / det}};
    full_t I_KH = {0};
    double x[N] = {creal(f->i), cimag(f->i), creal(f->lambda), cimag(f->lambda), f->omega};
    const double complex e = i_A - f->i;
    for (int r = 0; r < N; r++) {
        I_KH.at[r][r] = 1.0;
        double K[2];
        for (int c = 0; c < 2; c++) {
            K[c] = f->P.at[r][0] * inverse[0][c] + f->P.at[r][1] * inverse[1][c];
        }
        I_KH.at[r][0] -= K[0];
        I_KH.at[r][1] -= K[1];
        x[r] += K[0] * creal(e) + K[1] * cimag(e);
    }
    f->P = product(&I_KH, &f->P);
    f->i = x[0] + I * x[1];
    f->lambda = x[2] + I * x[3];
    f->omega = x[4];
}

static filter_t full_of(estimator_state_t *s)
{
    filter_t f = {.i = of(s->i_s_hat_A), .lambda = of(s->lambda_Wb), .omega = s->omega_rad_s};
    for (int r = 0; r < N; r++) {
        for (int c = 0; c < N; c++) {
            f.P.at[r][c] = *entry(&s->P, r, c);
        }
    }
    return f;
}

/* Entries of P over what their diagonal allows: |P_rc| <= sqrt(P_rr P_cc). */
static void assert_covariance(double tolerance, const filter_t *f)
{
    for (int r = 0; r < N; r++) {
        for (int c = r; c < N; c++) {
            const double size = sqrt(f->P.at[r][r] * f->P.at[c][c]);
            ASSERT_NEAR(tolerance * size, f->P.at[r][c], *entry(&st.P, r, c));
        }
    }
}

static void test_it_is_the_filter_of_full_matrices(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        for (int k = 0; k < OPERATIONS; k++) {
            configure(machine);
            const reference_model_t m = reference_model(&reference_machine[machine], 0.0);
            operation_t o = operation(machine, k);
            uint32_t seed = 7u;
            seed_as(&o, 5.0);
            filter_t f = full_of(&st);
            for (int step = 0; step < 5000; step++) {
                estimator_in_t in = sample_of(&o);
                in.u_s_V.alpha += noise(&seed);
                in.i_s_A.beta += 0.02f * noise(&seed);
                estimator_step(&cfg, &st, &in);
                full_predict(&f, &m, of(in.u_s_V));
                full_update(&f, of(in.i_s_A));
            }
            assert_ab(2e-4, f.i, st.i_s_hat_A);
            assert_ab(2e-5, f.lambda, st.lambda_Wb);
            ASSERT_NEAR(0.01, f.omega, st.omega_rad_s);
            assert_covariance(2e-3, &f);
        }
    }
}

/* What it tells of its correction: what it added, and the current it had expected. */
static void test_it_tells_residual_and_correction(void)
{
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    const filter_t before = full_of(&st);
    estimator_in_t in = sample_of(&o);
    in.i_s_A.alpha += 0.3f;
    estimator_step(&cfg, &st, &in);
    const reference_model_t m = reference_model(&reference_machine[0], 0.0);
    filter_t f = before;
    full_predict(&f, &m, of(in.u_s_V));
    assert_ab(1e-5, f.i - of(in.i_s_A), st.estimate.i_residual_A);
    const double complex predicted = f.lambda;
    full_update(&f, of(in.i_s_A));
    assert_ab(2e-3, (f.lambda - predicted) / PERIOD_S, st.estimate.flux_correction_V);
}

/* Hours at standstill, where the speed cannot be seen: its variance stays below the largest speed's
 * square, and none becomes negative. */
static void test_variances_stay_sound_where_nothing_is_seen(void)
{
    const estimator_in_t in = {.i_s_A = {0.0f, 0.0f}};
    list.omega_max_rad_s = 30.0f;
    TEST_ASSERT_TRUE(estimator_init(&cfg, &list, &motor, NULL));
    for (int k = 0; k < 300000; k++) {
        estimator_step(&cfg, &st, &in);
    }
    ASSERT_NEAR(1.0, 900.0, st.P.ww);
    for (int r = 0; r < N; r++) {
        TEST_ASSERT_TRUE(*entry(&st.P, r, r) > 0.0f);
    }
}

/* M was found larger: the flux forgets more slowly. */
static void test_another_rotor_time_constant(void)
{
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    filter_t f = full_of(&st);
    estimator_in_t in = sample_of(&o);
    in.tau_extra_per_s = -0.6f;
    estimator_step(&cfg, &st, &in);
    reference_model_t m = reference_model(&reference_machine[0], 0.0);
    m.tau -= 0.6;
    full_predict(&f, &m, of(in.u_s_V));
    full_update(&f, of(in.i_s_A));
    assert_ab(1e-6, f.lambda, st.lambda_Wb);
}

int main(void)
{
    UNITY_BEGIN();
    run_contract();
    RUN_TEST(test_off_forgets_its_own_states);
    RUN_TEST(test_bad_parameters_of_the_covariances_are_refused);
    RUN_TEST(test_the_sum_tells_no_number);
    RUN_TEST(test_covariances_follow_their_rules);
    RUN_TEST(test_it_is_the_filter_of_full_matrices);
    RUN_TEST(test_it_tells_residual_and_correction);
    RUN_TEST(test_variances_stay_sound_where_nothing_is_seen);
    RUN_TEST(test_another_rotor_time_constant);
    return UNITY_END();
}
