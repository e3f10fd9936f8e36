#include "induction_motor.hpp"

#include <array>
#include <bit>
#include <cstdint>
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
    if (!(m.iron_loss_ohm >= 0.0)) {
        throw std::invalid_argument("motor: the iron-loss resistance is positive, or 0 for none");
    }
    return determinant;
}

// To the bit.
bool same(Vec a, Vec b)
{
    using Bits = std::array<std::uint64_t, 2>;
    return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

bool same_fluxes(const MotorState &a, const MotorState &b)
{
    return same(a.psi_s_Wb, b.psi_s_Wb) && same(a.psi_r_Wb, b.psi_r_Wb);
}

} // namespace

InductionMotor::InductionMotor(const MotorParameters &parameters, IntegrationMethod method)
    : parameters_(parameters), method_(method),
      saturated_(parameters.saturation.flux_knee_Wb > 0.0),
      iron_siemens_(parameters.iron_loss_ohm > 0.0 ? 1.0 / parameters.iron_loss_ohm : 0.0),
      general_(saturated_ || iron_siemens_ > 0.0),
      rotor_share_(1.0 / (1.0 + parameters.Rr_ohm * iron_siemens_)),
      leak_s_H_(parameters.Ls_H - parameters.M_H), leak_r_H_(parameters.Lr_H - parameters.M_H),
      inv_M_(1.0 / parameters.M_H)
{
    const double determinant = checked_leakage(parameters);
    linear_ = {.Rs_ohm = parameters.Rs_ohm,
               .Rr_ohm = parameters.Rr_ohm,
               .pole_pairs = static_cast<double>(parameters.pole_pairs),
               .y_ss = parameters.Lr_H / determinant,
               .y_sr = parameters.M_H / determinant,
               .y_rr = parameters.Ls_H / determinant};
    const double knee = parameters.saturation.flux_knee_Wb;
    inv_knee2_ = saturated_ ? 1.0 / (knee * knee) : 0.0;
    inv_leak_s_ = saturated_ ? 1.0 / leak_s_H_ : 0.0;
}

void InductionMotor::set_stator_resistance_factor(double factor)
{
    linear_.Rs_ohm = parameters_.Rs_ohm * factor;
}

void InductionMotor::set_rotor_resistance_factor(double factor)
{
    linear_.Rr_ohm = parameters_.Rr_ohm * factor;
    rotor_share_ = 1.0 / (1.0 + linear_.Rr_ohm * iron_siemens_);
}

double InductionMotor::inverse_M(double flux_squared) const
{
    const double q = flux_squared * inv_knee2_;
    if (parameters_.saturation.soft) {
        return inv_M_ * (1.0 + 2.0 * q * q / (1.0 + q));
    }
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

// d ln(inverse_M - 1/M) / d ln(flux).
double InductionMotor::saturation_exponent(double flux_squared) const
{
    const double q = flux_squared * inv_knee2_;
    return parameters_.saturation.soft ? 2.0 + 2.0 / (1.0 + q) : parameters_.saturation.exponent;
}

// Eliminating i_r leaves psi_m (1 + leakage_ratio + leak_r / M(psi_m)) = weighted flux. Both have
// one direction; their ratio r solves r (base + leak_r / M(r)) = 1, increasing and convex in r, so
// that Newton from above cannot miss. No square root: the even exponent takes magnitudes squared.
Vec InductionMotor::main_flux(Vec weighted_flux_Wb, double leakage_ratio) const
{
    const double base = 1.0 + leakage_ratio;
    if (!(leak_r_H_ > 0.0)) {
        return (1.0 / base) * weighted_flux_Wb;
    }
    const double flux_squared = dot(weighted_flux_Wb, weighted_flux_Wb);
    double r = 1.0 / (base + leak_r_H_ * inv_M_);
    for (int iteration = 0; iteration < 30; ++iteration) {
        const double inverse = inverse_M(r * r * flux_squared);
        const double n = saturation_exponent(r * r * flux_squared);
        const double excess = r * (base + leak_r_H_ * inverse) - 1.0;
        r -= excess / (base + leak_r_H_ * (inverse + n * (inverse - inv_M_)));
        if (!(excess > 1e-9)) { // quadratic: the correction just made leaves about its square
            break;
        }
    }
    return r * weighted_flux_Wb;
}

MotorCurrents InductionMotor::currents(const MotorState &x) const
{
    if (!saturated_) {
        const Vec i_s = linear_.stator_current(x);
        const Vec i_r = linear_.y_rr * x.psi_r_Wb - linear_.y_sr * x.psi_s_Wb;
        return {i_s, i_r, parameters_.M_H * (i_s + i_r)};
    }
    if (!same_fluxes(x, last_.x)) {
        last_ = {x, saturated_currents(x)};
    }
    return last_.currents;
}

MotorCurrents InductionMotor::saturated_currents(const MotorState &x) const
{
    const double ratio = leak_r_H_ * inv_leak_s_;
    const Vec psi_m = main_flux(ratio * x.psi_s_Wb + x.psi_r_Wb, ratio);
    const Vec i_s = inv_leak_s_ * (x.psi_s_Wb - psi_m);
    const Vec i_m = inverse_M(dot(psi_m, psi_m)) * psi_m;
    return {i_s, i_m - i_s, psi_m};
}

double InductionMotor::torque_Nm(const MotorState &x) const
{
    return torque_Nm(x, stator_current(x));
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

Vec InductionMotor::rotor_flux_rate_V(const MotorState &x) const
{
    return rotor_share_ * ((linear_.pole_pairs * x.omega_m_rad_s) * turned_90(x.psi_r_Wb) -
                           linear_.Rr_ohm * currents(x).i_r_A);
}

Vec InductionMotor::transient_emf(const MotorState &x) const
{
    const Vec psi_r_V = rotor_flux_rate_V(x);
    if (!saturated_) {
        return (parameters_.M_H / parameters_.Lr_H) * psi_r_V;
    }
    // Derivative of psi_s along psi_r at constant i_s; the curve is smooth over a microsecond.
    constexpr double dt_s = 1e-6;
    const Vec i_s_A = stator_current(x);
    return (1.0 / dt_s) *
           (stator_flux(x.psi_r_Wb + dt_s * psi_r_V, i_s_A) - stator_flux(x.psi_r_Wb, i_s_A));
}

// h times the derivative, with saturation, iron loss or both.
struct InductionMotor::GeneralIncrement {
    const InductionMotor &motor;
    Vec h_u;
    double h_Rs, h_Rr, h_p, h_inv_J, inv_J;
    double torque, viscous;

    GeneralIncrement(const InductionMotor &m, Vec u_s_V, const ShaftDrive &shaft, double h_s)
        : motor(m), h_u(h_s * u_s_V), h_Rs(h_s * m.linear_.Rs_ohm), h_Rr(h_s * m.linear_.Rr_ohm),
          h_p(h_s * m.linear_.pole_pairs), h_inv_J(h_s * shaft.inv_J_per_kg_m2),
          inv_J(shaft.inv_J_per_kg_m2), torque(h_inv_J * shaft.torque_Nm),
          viscous(h_inv_J * shaft.viscous_Nms)
    {
    }

    MotorState operator()(const MotorState &x) const
    {
        const Vec rotation = (h_p * x.omega_m_rad_s) * turned_90(x.psi_r_Wb);
        const double drag = torque - viscous * x.omega_m_rad_s;
        const MotorCurrents i = motor.currents(x);
        const Vec h_psi_r_V = motor.rotor_share_ * (rotation - h_Rr * i.i_r_A);
        const double h_iron_Nm = motor.iron_torque_Nm(x.psi_r_Wb, h_psi_r_V);
        return {h_u - h_Rs * i.i_s_A, h_psi_r_V,
                h_inv_J * motor.linear_.pole_pairs * cross(x.psi_s_Wb, i.i_s_A) + drag -
                    inv_J * h_iron_Nm};
    }
};

template <class Increment>
void InductionMotor::advance(MotorState &x, const Increment &increment) const
{
    if (method_ == IntegrationMethod::rk4) {
        x = runge_kutta(x, increment);
        return;
    }
    const MotorState k1 = increment(x);
    const MotorState k2 = increment(along(x, 1.0, k1));
    x = along(along(x, 0.5, k1), 0.5, k2);
}

void InductionMotor::step(MotorState &x, Vec u_s_V, const ShaftDrive &shaft, double h_s) const
{
    if (general_) {
        advance(x, GeneralIncrement(*this, u_s_V, shaft, h_s));
    } else {
        advance(x, LinearIncrement(linear_, u_s_V, shaft, h_s));
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
        const Vec psi_r_V = rotor_share_ * ((linear_.pole_pairs * y.omega) * turned_90(y.psi_r) -
                                            linear_.Rr_ohm * i_r);
        const double drag_Nm = shaft.viscous_Nms * y.omega + iron_torque_Nm(y.psi_r, psi_r_V);
        return Open{psi_r_V, (shaft.torque_Nm - drag_Nm) * shaft.inv_J_per_kg_m2};
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
