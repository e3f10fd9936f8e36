#include "induction_motor.hpp"

#include <stdexcept>

namespace zh {
namespace {

double checked_leakage(const MotorParameters &m)
{
    const double determinant = m.Ls_H * m.Lr_H - m.M_H * m.M_H;
    const bool positive = m.Rs_ohm > 0.0 && m.Rr_ohm > 0.0 && m.M_H > 0.0 && m.Ls_H > 0.0 &&
                          m.Lr_H > 0.0 && determinant > 0.0 && m.pole_pairs > 0;
    if (!positive) {
        throw std::invalid_argument("motor: resistances, inductances and leakage must be positive");
    }
    const bool saturated = m.saturation.flux_knee_Wb > 0.0;
    if (saturated && (m.Ls_H <= m.M_H || m.Lr_H < m.M_H)) {
        throw std::invalid_argument("motor: saturation needs Ls > M and Lr >= M");
    }
    return determinant;
}

} // namespace

struct InductionMotor::Derivative {
    Vec psi_s_V;
    Vec psi_r_V;
    double omega_m_rad_s2;
};

InductionMotor::InductionMotor(const MotorParameters &parameters)
    : parameters_(parameters), saturated_(parameters.saturation.flux_knee_Wb > 0.0),
      Rs_ohm_(parameters.Rs_ohm), p_(parameters.pole_pairs),
      leak_s_H_(parameters.Ls_H - parameters.M_H), leak_r_H_(parameters.Lr_H - parameters.M_H),
      inv_M_(1.0 / parameters.M_H)
{
    const double determinant = checked_leakage(parameters);
    y_ss_ = parameters.Lr_H / determinant;
    y_sr_ = parameters.M_H / determinant;
    y_rr_ = parameters.Ls_H / determinant;
    const double knee = parameters.saturation.flux_knee_Wb;
    inv_knee2_ = saturated_ ? 1.0 / (knee * knee) : 0.0;
    inv_leak_s_ = saturated_ ? 1.0 / leak_s_H_ : 0.0;
}

void InductionMotor::set_stator_resistance_factor(double factor)
{
    Rs_ohm_ = parameters_.Rs_ohm * factor;
}

double InductionMotor::inverse_M(double flux_squared) const
{
    const double q = flux_squared * inv_knee2_;
    double power = q; // exponent 2
    switch (parameters_.saturation.exponent) {
    case 4:
        power = q * q;
        break;
    case 6:
        power = q * q * q;
        break;
    case 8:
        power = (q * q) * (q * q);
        break;
    default:
        break;
    }
    return inv_M_ * (1.0 + power);
}

// Eliminating i_r leaves psi_m (1 + leakage_ratio + leak_r / M(psi_m)) = weighted flux: a scalar
// equation in the magnitude, convex and increasing, so that Newton from above cannot miss.
Vec InductionMotor::main_flux(Vec weighted_flux_Wb, double leakage_ratio) const
{
    const double base = 1.0 + leakage_ratio;
    if (!(leak_r_H_ > 0.0)) {
        return (1.0 / base) * weighted_flux_Wb;
    }
    const double target = magnitude(weighted_flux_Wb);
    if (!(target > 0.0)) {
        return {};
    }
    const double n = parameters_.saturation.exponent;
    double flux = target / (base + leak_r_H_ * inv_M_);
    for (int iteration = 0; iteration < 30; ++iteration) {
        const double inverse = inverse_M(flux * flux);
        const double excess = flux * (base + leak_r_H_ * inverse) - target;
        const double slope = base + leak_r_H_ * (inverse + n * (inverse - inv_M_));
        flux -= excess / slope;
        if (!(excess > 1e-13 * target)) {
            break;
        }
    }
    return (flux / target) * weighted_flux_Wb;
}

MotorCurrents InductionMotor::currents(const MotorState &x) const
{
    if (!saturated_) {
        const Vec i_s = y_ss_ * x.psi_s_Wb - y_sr_ * x.psi_r_Wb;
        const Vec i_r = y_rr_ * x.psi_r_Wb - y_sr_ * x.psi_s_Wb;
        return {i_s, i_r, parameters_.M_H * (i_s + i_r)};
    }
    const double ratio = leak_r_H_ * inv_leak_s_;
    const Vec psi_m = main_flux(ratio * x.psi_s_Wb + x.psi_r_Wb, ratio);
    const Vec i_s = inv_leak_s_ * (x.psi_s_Wb - psi_m);
    const Vec i_m = inverse_M(dot(psi_m, psi_m)) * psi_m;
    return {i_s, i_m - i_s, psi_m};
}

Vec InductionMotor::stator_current(const MotorState &x) const
{
    return saturated_ ? currents(x).i_s_A : y_ss_ * x.psi_s_Wb - y_sr_ * x.psi_r_Wb;
}

double InductionMotor::torque_Nm(const MotorState &x) const
{
    return p_ * cross(x.psi_s_Wb, stator_current(x));
}

Vec InductionMotor::stator_flux(Vec psi_r_Wb, Vec i_s_A) const
{
    if (!saturated_) {
        const double coupling = parameters_.M_H / parameters_.Lr_H;
        const double transient_H = parameters_.Ls_H - parameters_.M_H * coupling;
        return transient_H * i_s_A + coupling * psi_r_Wb;
    }
    return main_flux(psi_r_Wb + leak_r_H_ * i_s_A, 0.0) + leak_s_H_ * i_s_A;
}

Vec InductionMotor::transient_emf(const MotorState &x) const
{
    const MotorCurrents i = currents(x);
    const Vec psi_r_V =
        (p_ * x.omega_m_rad_s) * turned_90(x.psi_r_Wb) - parameters_.Rr_ohm * i.i_r_A;
    if (!saturated_) {
        return (parameters_.M_H / parameters_.Lr_H) * psi_r_V;
    }
    // Derivative of psi_s along psi_r at constant i_s; the curve is smooth over a microsecond.
    constexpr double dt_s = 1e-6;
    return (1.0 / dt_s) *
           (stator_flux(x.psi_r_Wb + dt_s * psi_r_V, i.i_s_A) - stator_flux(x.psi_r_Wb, i.i_s_A));
}

template <bool saturated>
inline InductionMotor::Derivative InductionMotor::derivative(const MotorState &x, Vec u_s_V,
                                                             const ShaftDrive &shaft) const
{
    Vec i_s;
    Vec i_r;
    if constexpr (saturated) {
        const MotorCurrents i = currents(x);
        i_s = i.i_s_A;
        i_r = i.i_r_A;
    } else {
        i_s = y_ss_ * x.psi_s_Wb - y_sr_ * x.psi_r_Wb;
        i_r = y_rr_ * x.psi_r_Wb - y_sr_ * x.psi_s_Wb;
    }
    const double torque_Nm = p_ * cross(x.psi_s_Wb, i_s);
    return {u_s_V - Rs_ohm_ * i_s,
            (p_ * x.omega_m_rad_s) * turned_90(x.psi_r_Wb) - parameters_.Rr_ohm * i_r,
            (torque_Nm + shaft.torque_Nm - shaft.viscous_Nms * x.omega_m_rad_s) *
                shaft.inv_J_per_kg_m2};
}

template <bool saturated>
void InductionMotor::runge_kutta(MotorState &x, Vec u_s_V, const ShaftDrive &shaft,
                                 double h_s) const
{
    const auto along = [&x](const Derivative &k, double h) {
        return MotorState{x.psi_s_Wb + h * k.psi_s_V, x.psi_r_Wb + h * k.psi_r_V,
                          x.omega_m_rad_s + h * k.omega_m_rad_s2};
    };
    const Derivative k1 = derivative<saturated>(x, u_s_V, shaft);
    const Derivative k2 = derivative<saturated>(along(k1, 0.5 * h_s), u_s_V, shaft);
    const Derivative k3 = derivative<saturated>(along(k2, 0.5 * h_s), u_s_V, shaft);
    const Derivative k4 = derivative<saturated>(along(k3, h_s), u_s_V, shaft);
    const double w = h_s / 6.0;
    x.psi_s_Wb = x.psi_s_Wb + w * (k1.psi_s_V + 2.0 * (k2.psi_s_V + k3.psi_s_V) + k4.psi_s_V);
    x.psi_r_Wb = x.psi_r_Wb + w * (k1.psi_r_V + 2.0 * (k2.psi_r_V + k3.psi_r_V) + k4.psi_r_V);
    x.omega_m_rad_s +=
        w * (k1.omega_m_rad_s2 + 2.0 * (k2.omega_m_rad_s2 + k3.omega_m_rad_s2) + k4.omega_m_rad_s2);
}

void InductionMotor::step(MotorState &x, Vec u_s_V, const ShaftDrive &shaft, double h_s) const
{
    if (saturated_) {
        runge_kutta<true>(x, u_s_V, shaft, h_s);
    } else {
        runge_kutta<false>(x, u_s_V, shaft, h_s);
    }
}

void InductionMotor::step_open(MotorState &x, const ShaftDrive &shaft, double h_s) const
{
    struct Open {
        Vec psi_r;
        double omega;
    };
    const auto slope = [&](const Open &y) {
        const Vec psi_m = saturated_ ? main_flux(y.psi_r, 0.0) : Vec{};
        const Vec i_r =
            saturated_ ? inverse_M(dot(psi_m, psi_m)) * psi_m : (1.0 / parameters_.Lr_H) * y.psi_r;
        return Open{(p_ * y.omega) * turned_90(y.psi_r) - parameters_.Rr_ohm * i_r,
                    (shaft.torque_Nm - shaft.viscous_Nms * y.omega) * shaft.inv_J_per_kg_m2};
    };
    const Open y{x.psi_r_Wb, x.omega_m_rad_s};
    const auto along = [&y](const Open &k, double h) {
        return Open{y.psi_r + h * k.psi_r, y.omega + h * k.omega};
    };
    const Open k1 = slope(y);
    const Open k2 = slope(along(k1, 0.5 * h_s));
    const Open k3 = slope(along(k2, 0.5 * h_s));
    const Open k4 = slope(along(k3, h_s));
    const double w = h_s / 6.0;
    x.psi_r_Wb = y.psi_r + w * (k1.psi_r + 2.0 * (k2.psi_r + k3.psi_r) + k4.psi_r);
    x.omega_m_rad_s = y.omega + w * (k1.omega + 2.0 * (k2.omega + k3.omega) + k4.omega);
    x.psi_s_Wb = stator_flux(x.psi_r_Wb, Vec{});
}

} // namespace zh
