// One integration step of motor and shaft, as functions of numbers alone.
//
// A single drive (induction_motor.cpp, load.cpp) and drives side by side (plant_lanes.cpp) call the
// same functions, so both give the same bits. No branch in here depends on a number: the compiler
// can do several drives at once.
#ifndef ZH_MOTOR_STEP_HPP
#define ZH_MOTOR_STEP_HPP

#include <cmath>

#include "space_vector.hpp"

namespace zh {

struct MotorState {
    Vec psi_s_Wb;
    Vec psi_r_Wb;
    double omega_m_rad_s = 0.0;
};

// What turns the shaft besides the motor, constant during one integration step.
struct ShaftDrive {
    double torque_Nm = 0.0;     // external, positive accelerates
    double viscous_Nms = 0.0;   // speed-proportional drag
    double inv_J_per_kg_m2 = 0; // 0: the shaft is held
};

// The motor with linear magnetics and no iron loss. Inverse inductances: i_s = y_ss psi_s - y_sr
// psi_r, i_r = y_rr psi_r - y_sr psi_s.
struct LinearMotor {
    double Rs_ohm, Rr_ohm, pole_pairs;
    double y_ss, y_sr, y_rr;

    Vec stator_current(const MotorState &x) const
    {
        return y_ss * x.psi_s_Wb - y_sr * x.psi_r_Wb;
    }
    double torque_Nm(const MotorState &x, Vec i_s_A) const
    {
        return pole_pairs * cross(x.psi_s_Wb, i_s_A);
    }
};

// h times the derivative of the linear motor. The currents are eliminated and h is in the
// coefficients, which shortens the chain of dependent operations: this is the plant's inner loop.
struct LinearIncrement {
    Vec h_u;
    double h_p;
    double ss, sr, rs, rr; // h R times inverse inductance
    double torque_per_cross, torque, viscous;

    LinearIncrement(const LinearMotor &m, Vec u_s_V, const ShaftDrive &shaft, double h_s)
        : h_u(h_s * u_s_V), h_p(h_s * m.pole_pairs)
    {
        const double h_Rs = h_s * m.Rs_ohm;
        const double h_Rr = h_s * m.Rr_ohm;
        const double h_inv_J = h_s * shaft.inv_J_per_kg_m2;
        ss = h_Rs * m.y_ss;
        sr = h_Rs * m.y_sr;
        rs = h_Rr * m.y_sr;
        rr = h_Rr * m.y_rr;
        torque_per_cross = h_inv_J * m.pole_pairs * m.y_sr;
        torque = h_inv_J * shaft.torque_Nm;
        viscous = h_inv_J * shaft.viscous_Nms;
    }
    MotorState operator()(const MotorState &x) const
    {
        const Vec rotation = (h_p * x.omega_m_rad_s) * turned_90(x.psi_r_Wb);
        const double drag = torque - viscous * x.omega_m_rad_s;
        // p Im(conj(psi_s) i_s) = p y_sr Im(conj(psi_r) psi_s)
        return {(h_u - ss * x.psi_s_Wb) + sr * x.psi_r_Wb,
                (rs * x.psi_s_Wb - rr * x.psi_r_Wb) + rotation,
                torque_per_cross * cross(x.psi_r_Wb, x.psi_s_Wb) + drag};
    }
};

constexpr MotorState along(const MotorState &y, double share, const MotorState &k)
{
    return {y.psi_s_Wb + share * k.psi_s_Wb, y.psi_r_Wb + share * k.psi_r_Wb,
            y.omega_m_rad_s + share * k.omega_m_rad_s};
}

// Classical Runge-Kutta, order 4; increment(x) is h times the derivative at x, k1 that at y.
template <class Increment>
MotorState runge_kutta(const MotorState &y, const MotorState &k1, const Increment &increment)
{
    const MotorState k2 = increment(along(y, 0.5, k1));
    const MotorState k3 = increment(along(y, 0.5, k2));
    const MotorState k4 = increment(along(y, 1.0, k3));
    constexpr double w = 1.0 / 6.0;
    return {y.psi_s_Wb + w * (k1.psi_s_Wb + 2.0 * (k2.psi_s_Wb + k3.psi_s_Wb) + k4.psi_s_Wb),
            y.psi_r_Wb + w * (k1.psi_r_Wb + 2.0 * (k2.psi_r_Wb + k3.psi_r_Wb) + k4.psi_r_Wb),
            y.omega_m_rad_s + w * (k1.omega_m_rad_s + 2.0 * (k2.omega_m_rad_s + k3.omega_m_rad_s) +
                                   k4.omega_m_rad_s)};
}

template <class Increment> MotorState runge_kutta(const MotorState &y, const Increment &increment)
{
    return runge_kutta(y, increment(y), increment);
}

// The shaft's friction, see load.hpp.
struct Friction {
    double coulomb_Nm, static_Nm, viscous_Nms, inv_J_per_kg_m2;
};

// How the shaft goes through a step.
struct ShaftMotion {
    double direction; // of rotation: +1, -1; 0: friction holds it
    ShaftDrive drive;
};

inline bool friction_holds(const Friction &f, double net_Nm)
{
    return std::abs(net_Nm) <= f.static_Nm;
}

// Before the step. At standstill the net torque sets the direction in which it starts, if it does.
inline ShaftMotion begin_motion(const Friction &f, double omega_m_rad_s, double motor_torque_Nm,
                                double load_torque_Nm)
{
    const double net_Nm = motor_torque_Nm - load_torque_Nm;
    const double pushed = net_Nm > 0.0 ? 1.0 : -1.0;
    const double starts = friction_holds(f, net_Nm) ? 0.0 : pushed;
    const double turns = omega_m_rad_s > 0.0 ? 1.0 : -1.0;
    const double direction = std::abs(omega_m_rad_s) > 0.0 ? turns : starts;
    const bool moves = std::abs(direction) > 0.0;
    const double torque_Nm = -load_torque_Nm - direction * f.coulomb_Nm;
    return {direction, ShaftDrive{moves ? torque_Nm : 0.0, moves ? f.viscous_Nms : 0.0,
                                  moves ? f.inv_J_per_kg_m2 : 0.0}};
}

// After a step in which the speed passed through zero: the speed the shaft really has.
inline double passed_zero(const Friction &f, double direction, double omega_before_rad_s,
                          double omega_after_rad_s, double net_Nm, double h_s)
{
    // It passes: behind zero the sliding friction points the other way.
    const double after = std::abs(omega_after_rad_s);
    const double share = after / (after + std::abs(omega_before_rad_s));
    const double omega =
        omega_after_rad_s + direction * 2.0 * f.coulomb_Nm * f.inv_J_per_kg_m2 * h_s * share;
    const double passes = direction * omega < 0.0 ? omega : 0.0;
    // It stops if friction holds it, or if it broke away and was pushed back at once.
    const double not_back = direction * net_Nm > 0.0 ? 0.0 : passes;
    return friction_holds(f, net_Nm) ? 0.0 : not_back;
}

} // namespace zh

#endif
