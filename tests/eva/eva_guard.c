/* The guard from its zeroed state on, period after period, with any input in any slot: the machine
 * and the limits of configuration `recommended`. `zh test --only eva`.
 */
#include "any.h"
#include "guard.h"

void eva_main(void);

static const monitor_config_t limits = {.i_trip_A = 20.0f,
                                        .u_dc_max_V = 390.0f,
                                        .u_dc_min_V = 100.0f,
                                        .omega_max_rad_s = 700.0f,
                                        .plausibility_periods = 50u};

static bool configured(guard_config_t *cfg)
{
    static const motor_t plate = {0.93f, 0.50f, 0.110f, 0.102f, 0.102f, 2.0f};
    static const plausibility_params_t looks = {.u_V = 3.0f,
                                                .open_A = 1.2f,
                                                .e1_A = 12.0f,
                                                .rate_rad_s2 = 16000.0f,
                                                .power_W = 750.0f,
                                                .stall_s = 2.0f,
                                                .mains_V = 200.0f};
    static const guard_sensor_params_t sensors = {.period_s = 200e-6f,
                                                  .Rs_ohm = 0.93f,
                                                  .sigma_Ls_H = 0.008f,
                                                  .flux_Wb = 0.52f,
                                                  .M_H = 0.102f,
                                                  .A_per_count = 0.00305f};
    static const speed_guard_params_t speed = {.deviation_rad_s = 18.0f,
                                               .deviation_s = 2.0f,
                                               .unknown_s = 60.0f,
                                               .over_speed_rad_s = 700.0f,
                                               .lambda_nominal_Wb = 0.52f};
    motor_model_t motor;
    *cfg = (guard_config_t){.i_q_max2_A2 = 225.0f, .i_max2_A2 = 250.0f, .kr = 1.0f};
    return motor_derive(&motor, &plate) && guard_init(cfg, &limits, &looks, &sensors) &&
           speed_guard_init(&cfg->speed, &speed, &motor, (float)SLOT_COUNT * sensors.period_s);
}

static measured_t any_sample(void)
{
    measured_t meas = {.i_s_A = any_ab(), .u_line_V = any_ab()};
    meas.i_A.u = any_float();
    meas.i_A.v = any_float();
    meas.i_A.w = any_float();
    meas.u_dc_V = any_float();
    meas.flags = any_word();
    return meas;
}

static estimate_t any_estimate(void)
{
    estimate_t e = {.lambda_r_hat_Wb = any_ab(), .i_residual_A = any_ab()};
    e.lambda_Wb = any_float();
    e.omega_e_rad_s = any_float();
    e.omega_s_rad_s = any_float();
    return e;
}

static uint32_t look(const guard_config_t *cfg, guard_state_t *st, const measured_t *meas,
                     const estimate_t *estimate, uint32_t slot)
{
    guard_look_t in = {.meas = meas,
                       .estimate = estimate,
                       .slot = slot,
                       .controlled = any_bool(),
                       .sensed = any_bool(),
                       .oriented = any_bool(),
                       .u_duty_V = any_ab(),
                       .u_s_V = any_ab(),
                       .axis = any_ab()};
    in.i_ref_A.d = any_float();
    in.i_ref_A.q = any_float();
    in.omega_ref_rad_s = any_float();
    in.lambda_ref_Wb = any_float();
    in.Rs_ohm = any_float();
    return guard_look(cfg, st, &in);
}

static uint32_t look_at_speed(const guard_config_t *cfg, guard_state_t *st)
{
    speed_guard_in_t in = {.basis = (speed_basis_t)(any_word() % 6u),
                           .at_limit = any_bool(),
                           .in_doubt = any_bool(),
                           .premagnetising = any_bool()};
    in.omega_rad_s = any_float();
    in.omega_ref_rad_s = any_float();
    in.omega_s_rad_s = any_float();
    in.rotor.voltage = any_bool();
    in.rotor.omega_s_rad_s = any_float();
    in.rotor.u_V = any_ab();
    in.rotor.i_A = any_ab();
    in.rotor.Rs_ohm = any_float();
    return speed_guard_look(&cfg->speed, &st->speed, &in);
}

/* As drive.c asks it. */
static uint32_t period(const guard_config_t *cfg, guard_state_t *st, uint32_t slot)
{
    const measured_t meas = any_sample();
    const estimate_t estimate = any_estimate();
    const guard_in_t in = {
        .meas = &meas, .state_sum = any_float(), .omega_e_hat_rad_s = estimate.omega_e_rad_s};
    uint32_t faults = guard_step(cfg, st, &in);
    if (any_bool()) {
        const guard_sensors_t sensors = {.meas = &meas,
                                         .u_V = any_ab(),
                                         .window_ended = slot == SLOT_GUARD_CURRENT,
                                         .motor_known = any_bool()};
        faults |= guard_sensors(cfg, st, &sensors);
    } else {
        guard_look_at_noise(cfg, st, &meas);
    }
    if (slot == SLOT_GUARD_SPEED) {
        faults |= look_at_speed(cfg, st);
    } else if (guard_look_is_due(slot)) {
        faults |= look(cfg, st, &meas, &estimate, slot);
    } else if (any_bool()) {
        faults |= guard_standing(cfg, st, meas.i_s_A, any_ab());
    } else {
        /* nothing is looked at twice */
    }
    return faults;
}

void eva_main(void)
{
    guard_config_t cfg;
    if (!configured(&cfg)) {
        return;
    }
    guard_state_t st = {0};
    while (any_bool()) {
        for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
            (void)period(&cfg, &st, slot);
        }
        if (any_bool()) {
            const guard_kept_t kept = guard_kept(&st);
            st = (guard_state_t){0};
            guard_restore(&st, &kept);
        }
    }
}
