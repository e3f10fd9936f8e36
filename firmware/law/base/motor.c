#include "motor.h"

bool motor_derive(motor_model_t *model, const motor_t *motor)
{
    if (!ALL_POSITIVE(motor->Rs_ohm, motor->Rr_ohm, motor->Ls_H, motor->Lr_H, motor->M_H,
                      motor->pole_pairs)) {
        return false;
    }
    motor_model_t m = {.Rs_ohm = motor->Rs_ohm, .M_H = motor->M_H, .pole_pairs = motor->pole_pairs};
    m.kr = motor->M_H / motor->Lr_H;
    m.sigma_Ls_H = motor->Ls_H - m.kr * motor->M_H;
    m.eps_H = m.sigma_Ls_H * motor->Lr_H / motor->M_H;
    m.tau_per_s = motor->Rr_ohm / motor->Lr_H;
    m.a11_per_s = motor_a11_per_s(&m, motor->Rs_ohm);

    /* No leakage makes eps <= 0; absurd but positive data overflow or vanish. */
    const bool usable = ALL_POSITIVE(m.kr, m.eps_H, m.tau_per_s, m.a11_per_s);
    if (usable) {
        *model = m;
    }
    return usable;
}
