/* A motor for tests of the whole control law: double precision, ideal inverter, shaft at constant
 * speed or free. The duties of a step act from the next crest to the one after, as in a timer.
 */
#ifndef PLANT_FIXTURE_H
#define PLANT_FIXTURE_H

#include "drive_fixture.h"

#define PLANT_PARTS 50

typedef struct {
    motor_t motor;
    cplx psi_s_Wb;
    cplx psi_r_Wb;
    double omega_e_rad_s;
    double J_kg_m2; /* 0: constant speed */
    double u_dc_V;
    uvw_t duty; /* acts in the interval to come */
} plant_t;

static inline cplx plant_current(const plant_t *p)
{
    const double kr = (double)p->motor.M_H / (double)p->motor.Lr_H;
    const double sigma_Ls = (double)p->motor.Ls_H - kr * (double)p->motor.M_H;
    return (p->psi_s_Wb - kr * p->psi_r_Wb) / sigma_Ls;
}

/* Turning, with residual rotor flux along alpha and no stator current. */
static inline plant_t plant_of(motor_t motor, double omega_e_rad_s, double psi_r_Wb)
{
    const double kr = (double)motor.M_H / (double)motor.Lr_H;
    return (plant_t){.motor = motor,
                     .psi_s_Wb = kr * psi_r_Wb,
                     .psi_r_Wb = psi_r_Wb,
                     .omega_e_rad_s = omega_e_rad_s,
                     .u_dc_V = 283.0,
                     .duty = {0.5f, 0.5f, 0.5f}};
}

static inline measurement_in_t plant_words(const plant_t *p, const drive_params_t *params)
{
    double i[3];
    phases_of(plant_current(p), i);
    const double u_dc_fs = (double)params->measurement.dc_link_full_scale_V;
    return (measurement_in_t){.i_u_counts = counts(i[0], 25.0),
                              .i_v_counts = counts(i[1], 25.0),
                              .i_w_counts = counts(i[2], 25.0),
                              .u_uv_counts = 8192u,
                              .u_vw_counts = 8192u,
                              .u_dc_counts = (uint16_t)lrint(p->u_dc_V / u_dc_fs * 16384.0)};
}

static inline double plant_torque(const plant_t *p)
{
    const double kr = (double)p->motor.M_H / (double)p->motor.Lr_H;
    return (double)p->motor.pole_pairs * kr * cimag(conj(p->psi_r_Wb) * plant_current(p));
}

/* To the next crest. */
static inline void plant_advance(plant_t *p, uvw_t next, double period_s)
{
    const double kr = (double)p->motor.M_H / (double)p->motor.Lr_H;
    const double tau = (double)p->motor.Rr_ohm / (double)p->motor.Lr_H;
    const double h_s = period_s / PLANT_PARTS;
    const cplx u = p->u_dc_V * sqrt(2.0 / 3.0) *
                   ((double)p->duty.u + (double)p->duty.v * cexp(I * THIRD_TURN) +
                    (double)p->duty.w * cexp(-I * THIRD_TURN));
    for (int n = 0; n < PLANT_PARTS; n++) {
        const cplx i = plant_current(p);
        const cplx rate_r =
            (I * p->omega_e_rad_s - tau) * p->psi_r_Wb + kr * (double)p->motor.Rr_ohm * i;
        if (p->J_kg_m2 > 0.0) {
            p->omega_e_rad_s += h_s * (double)p->motor.pole_pairs * plant_torque(p) / p->J_kg_m2;
        }
        p->psi_s_Wb += h_s * (u - (double)p->motor.Rs_ohm * i);
        p->psi_r_Wb += h_s * rate_r;
    }
    p->duty = next;
}

/* A drive for plant_t: the voltage of its duties, ideal legs, L = 0; every mode has its numbers. */
static inline drive_params_t every_mode(void)
{
    drive_params_t p = both_machines(0);
    p.acting.source = ACTING_VOLTAGE_DUTY;
    estimator_list.observer_method = 1u;
    estimator_list.adapt_kp = 4.0f;
    estimator_list.adapt_ki = 2000.0f;
    estimator_list.eps1_mode = 0u;
    estimator_list.observer_gain_enable = 0u;
    p.dead_time.fraction = 0.0f;
    p.modes = (modes_params_t){
        .dc_bandwidth_rad_s = 400.0f,
        .flying = {.current_A = 4.0f,
                   .settle_s = 0.02f,
                   .window_s = 0.1f,
                   .stand_rad_s = 14.7f,
                   .omega_max_rad_s = 600.0f},
        .volts = {.psi_Wb = 0.44f, .boost_V = 4.0f, .slew_rad_s2 = 200.0f, .i_max_A = 15.0f},
        .brake = {.from_rad_s = 1000.0f, .least_s = 0.3f, .slew_A_per_s = 100.0f}};
    return p;
}

#endif
