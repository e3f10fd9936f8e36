// The machines of the validation: Table 1, where M = Lr hides every factor M/Lr, and a 4 kW machine
// with M/Lr = .967; and variants of each with main-flux saturation and iron loss.
#ifndef ZH_TEST_MACHINES_HPP
#define ZH_TEST_MACHINES_HPP

#include <array>
#include <complex>

#include "induction_motor.hpp"

namespace machines {

using Complex = std::complex<double>;

inline zh::MotorParameters table1()
{
    return {0.93, 0.50, 0.110, 0.102, 0.102, 2, {}, 0.0};
}
inline zh::MotorParameters four_kw()
{
    return {1.405, 1.395, 0.178039, 0.178039, 0.1722, 2, {}, 0.0};
}
inline zh::MotorParameters saturated(zh::MotorParameters m, double knee_Wb, int exponent)
{
    m.saturation = {knee_Wb, exponent};
    return m;
}
inline zh::MotorParameters softly(zh::MotorParameters m)
{
    m.saturation.soft = true;
    return m;
}
// Some ten times the loss of a real machine, so that a mistake in it shows.
inline zh::MotorParameters with_iron(zh::MotorParameters m)
{
    m.iron_loss_ohm = 50.0;
    return m;
}
inline const std::array<zh::MotorParameters, 9> &all()
{
    static const std::array<zh::MotorParameters, 9> list{table1(),
                                                         four_kw(),
                                                         saturated(table1(), 0.7, 6),
                                                         saturated(four_kw(), 1.2, 4),
                                                         saturated(four_kw(), 0.9, 8),
                                                         softly(saturated(four_kw(), 0.9, 4)),
                                                         with_iron(table1()),
                                                         with_iron(four_kw()),
                                                         with_iron(saturated(four_kw(), 0.9, 4))};
    return list;
}

inline Complex as_complex(zh::Vec a)
{
    return {a.alpha, a.beta};
}
inline zh::Vec as_vec(Complex a)
{
    return {a.real(), a.imag()};
}

// Steady state of the T-equivalent circuit for power-invariant vectors (no factor 3), by Kirchhoff:
// stator branch in series with jwM parallel to jw(Lr - M) + (Rr/s parallel to the iron loss).
struct Circuit {
    Complex i_s, i_r, psi_m;
    double torque_Nm;
};
inline Circuit circuit(const zh::MotorParameters &m, double M_H, Complex u_s, double omega_s,
                       double slip)
{
    const Complex j{0.0, 1.0};
    const double leak_s = m.Ls_H - m.M_H;
    const double leak_r = m.Lr_H - m.M_H;
    const Complex z_m = j * omega_s * M_H;
    // Admittances, so that neither no load (slip 0) nor no iron loss is a special case.
    const double iron_S = m.iron_loss_ohm > 0.0 ? 1.0 / m.iron_loss_ohm : 0.0;
    const Complex behind_leakage = 1.0 + j * omega_s * leak_r * (slip / m.Rr_ohm + iron_S);
    const Complex y_r = (slip / m.Rr_ohm + iron_S) / behind_leakage;
    const Complex z_parallel = 1.0 / (1.0 / z_m + y_r);
    const Complex i_s = u_s / (m.Rs_ohm + j * omega_s * leak_s + z_parallel);
    const Complex u_m = i_s * z_parallel;
    const Complex i_r = -u_m * y_r;
    // What the rotor takes, over synchronous mechanical speed.
    const double rotor_W = std::norm(u_m / behind_leakage) * slip / m.Rr_ohm;
    const double torque = rotor_W * m.pole_pairs / omega_s;
    return {i_s, i_r, u_m / (j * omega_s), torque};
}

} // namespace machines

#endif
