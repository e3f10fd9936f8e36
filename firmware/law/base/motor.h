/* Machine data: T-equivalent circuit, per phase, referred to the stator.
 *
 * motor_t holds the data of nameplate and identification; motor_model_t holds what equations
 * (1)-(5) need. The tests use two machines, because M = Lr hides a wrong factor M/Lr.
 */
#ifndef MOTOR_H
#define MOTOR_H

#include <stdbool.h>

#include "num.h"

typedef struct {
    float Rs_ohm;
    float Rr_ohm;
    float Ls_H;
    float Lr_H;
    float M_H;
    float pole_pairs;
} motor_t;

typedef struct {
    float Rs_ohm;
    float M_H;
    float sigma_Ls_H; /* Ls - M^2/Lr */
    float eps_H;      /* epsilon of eq. (1): sigma Ls Lr / M */
    float tau_per_s;  /* Rr/Lr */
    float kr;         /* M/Lr: rotor flux to its share in the stator flux */
    float a11_per_s;  /* (Rs + M^2 Rr/Lr^2)/(sigma Ls) */
    float pole_pairs;
} motor_model_t;

/* False, and *model untouched, unless every value is finite and positive and there is leakage
 * (M^2 < Ls Lr). */
CHECKED bool motor_derive(motor_model_t *model, const motor_t *motor);

/* Current decay of eq. (3), (Rs + M^2 Rr/Lr^2)/(sigma Ls), for the present stator resistance. */
static inline float motor_a11_per_s(const motor_model_t *m, float Rs_ohm)
{
    return (Rs_ohm + m->kr * m->M_H * m->tau_per_s) / m->sigma_Ls_H;
}

/* Torque p (M/Lr) Im(conj(lambda_r) i_s) for field-oriented current. */
static inline float motor_torque_Nm(const motor_model_t *m, float lambda_r_Wb, float i_q_A)
{
    return m->pole_pairs * m->kr * lambda_r_Wb * i_q_A;
}

#endif
