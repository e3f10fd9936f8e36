// What is linear for a while has a closed form, the matrix exponential: Eigen's against the motor's
// Runge-Kutta steps and against the filter's transition.
#include "check.hpp"
#include "induction_motor.hpp"
#include "machines.hpp"
#include "sensors.hpp"

#include <numbers>

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

using namespace machines;

namespace {

// psi' = (W - R L^-1) psi + (u, 0) in the stationary frame, psi = (psi_s, psi_r).
Eigen::Matrix2cd motor_matrix(const zh::MotorParameters &m, double omega_e_rad_s)
{
    Eigen::Matrix2cd inductance;
    inductance << m.Ls_H, m.M_H, m.M_H, m.Lr_H;
    const Eigen::Vector2cd resistance(m.Rs_ohm, m.Rr_ohm);
    Eigen::Matrix2cd a = -(resistance.asDiagonal() * inductance.inverse());
    a(1, 1) += Complex(0.0, omega_e_rad_s);
    return a;
}

void a_held_motor_on_constant_voltage_follows_the_exponential()
{
    constexpr double h_s = 10e-6;
    constexpr int steps = 20000; // 0.2 s: two rotor time constants
    for (const auto &m : {table1(), four_kw()}) {
        for (const double omega_m_rad_s : {0.0, 12.0, -90.0, 180.0}) {
            zh::MotorState x;
            x.omega_m_rad_s = omega_m_rad_s;
            x.psi_s_Wb = {0.3, -0.1};
            x.psi_r_Wb = {0.2, 0.15};
            const Eigen::Matrix2cd a = motor_matrix(m, m.pole_pairs * omega_m_rad_s);
            const Eigen::Vector2cd x0(Complex(0.3, -0.1), Complex(0.2, 0.15));
            const Eigen::Vector2cd rest = -a.inverse() * Eigen::Vector2cd(Complex(8.0, -3.0), 0.0);
            const Eigen::Matrix2cd decay = (a * (h_s * steps)).exp();
            const Eigen::Vector2cd truth = rest + decay * (x0 - rest);
            const zh::InductionMotor motor(m);
            for (int k = 0; k < steps; ++k) {
                motor.step(x, {8.0, -3.0}, {0.0, 0.0, 0.0}, h_s);
                x.omega_m_rad_s = omega_m_rad_s;
            }
            CHECK_NEAR(x.psi_s_Wb.alpha, truth(0).real(), 1e-9);
            CHECK_NEAR(x.psi_s_Wb.beta, truth(0).imag(), 1e-9);
            CHECK_NEAR(x.psi_r_Wb.alpha, truth(1).real(), 1e-9);
            CHECK_NEAR(x.psi_r_Wb.beta, truth(1).imag(), 1e-9);
        }
    }
}

void the_filter_s_transition_is_the_exponential()
{
    for (const double damping : {0.2, 0.70710678118654752, 3.0}) {
        Eigen::Matrix2d a;
        a << 0.0, 1.0, -1.0, -2.0 * damping;
        for (const double wc_h : {1e-4, 0.03, 0.6, 1.0}) {
            const double omega_c_rad_s = 2.0 * std::numbers::pi * 800.0;
            const zh::LineVoltageFilter filter(800.0, damping, 200e-6);
            // Complex as the motor's: one instance of Eigen's function instead of two.
            const Eigen::Matrix2d truth = (a.cast<Complex>() * wc_h).exp().real();
            const auto e = filter.part_of_period(wc_h / omega_c_rad_s);
            CHECK_NEAR(e.p, truth(0, 0), 1e-12);
            CHECK_NEAR(e.q, truth(0, 1), 1e-12);
            CHECK_NEAR(e.r, truth(1, 1), 1e-12);
        }
    }
}

} // namespace

int main()
{
    return check::run({
        {"a held motor on constant voltage follows the exponential",
         a_held_motor_on_constant_voltage_follows_the_exponential},
        {"the filter's transition is the exponential", the_filter_s_transition_is_the_exponential},
    });
}
