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
    if (!(m.iron_loss_ohm >= 0.0)) {
        throw std::invalid_argument("motor: the iron-loss resistance is positive, or 0 for none");
    }
    return determinant;
}

SaturationLaw law_of(const Saturation &s)
{
    if (!(s.flux_knee_Wb > 0.0)) {
        return SaturationLaw::none;
    }
    if (s.soft) {
        return SaturationLaw::soft;
    }
    switch (s.exponent) {
    case 4:
        return SaturationLaw::power4;
    case 6:
        return SaturationLaw::power6;
    case 8:
        return SaturationLaw::power8;
    default:
        return SaturationLaw::power2;
    }
}

MainBranch branch_of(const MotorParameters &m)
{
    const double knee = m.saturation.flux_knee_Wb;
    const bool saturated = knee > 0.0;
    MainBranch b{};
    b.leak_s_H = m.Ls_H - m.M_H;
    b.leak_r_H = m.Lr_H - m.M_H;
    b.inv_M = 1.0 / m.M_H;
    b.inv_knee2 = saturated ? 1.0 / (knee * knee) : 0.0;
    b.inv_leak_s = saturated ? 1.0 / b.leak_s_H : 0.0;
    b.ratio = b.leak_r_H * b.inv_leak_s;
    b.start = b.start_at(b.ratio);
    return b;
}

} // namespace

InductionMotor::InductionMotor(const MotorParameters &parameters, IntegrationMethod method)
    : parameters_(parameters), method_(method),
      saturated_(parameters.saturation.flux_knee_Wb > 0.0),
      iron_siemens_(parameters.iron_loss_ohm > 0.0 ? 1.0 / parameters.iron_loss_ohm : 0.0),
      general_(saturated_ || iron_siemens_ > 0.0),
      rotor_share_(1.0 / (1.0 + parameters.Rr_ohm * iron_siemens_)),
      law_(law_of(parameters.saturation)), branch_(branch_of(parameters))
{
    const double determinant = checked_leakage(parameters);
    linear_ = {.Rs_ohm = parameters.Rs_ohm,
               .Rr_ohm = parameters.Rr_ohm,
               .pole_pairs = static_cast<double>(parameters.pole_pairs),
               .y_ss = parameters.Lr_H / determinant,
               .y_sr = parameters.M_H / determinant,
               .y_rr = parameters.Ls_H / determinant};
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

Vec InductionMotor::main_flux(Vec weighted_flux_Wb) const
{
    return with_law(law_, [&]<SaturationLaw law>() {
        return branch_.main_flux<law>(weighted_flux_Wb, 0.0, branch_.start_at(0.0));
    });
}

Vec InductionMotor::main_current(Vec psi_m_Wb) const
{
    return with_law(law_, [&]<SaturationLaw law>() {
        return branch_.inverse_M<law>(dot(psi_m_Wb, psi_m_Wb)) * psi_m_Wb;
    });
}

// Number by number: who reads one of them at once would have to wait for a wider copy.
void InductionMotor::remember(const MotorState &x) const
{
    with_law(law_, [&]<SaturationLaw law>() {
        const MotorCurrents i = branch_.currents<law>(x);
        last_.x.psi_s_Wb.alpha = x.psi_s_Wb.alpha;
        last_.x.psi_s_Wb.beta = x.psi_s_Wb.beta;
        last_.x.psi_r_Wb.alpha = x.psi_r_Wb.alpha;
        last_.x.psi_r_Wb.beta = x.psi_r_Wb.beta;
        last_.currents.i_s_A.alpha = i.i_s_A.alpha;
        last_.currents.i_s_A.beta = i.i_s_A.beta;
        last_.currents.i_r_A.alpha = i.i_r_A.alpha;
        last_.currents.i_r_A.beta = i.i_r_A.beta;
        last_.currents.psi_m_Wb.alpha = i.psi_m_Wb.alpha;
        last_.currents.psi_m_Wb.beta = i.psi_m_Wb.beta;
    });
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
    return main_flux(psi_r_Wb + branch_.leak_r_H * i_s_A) + branch_.leak_s_H * i_s_A;
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
template <SaturationLaw law> struct InductionMotor::GeneralIncrement {
    LinearMotor linear;
    MainBranch branch;
    double rotor_share, iron_siemens;
    Vec h_u;
    double h_Rs, h_Rr, h_p, h_inv_J, inv_J;
    double torque, viscous;

    GeneralIncrement(const InductionMotor &m, Vec u_s_V, const ShaftDrive &shaft, double h_s)
        : linear(m.linear_), branch(m.branch_), rotor_share(m.rotor_share_),
          iron_siemens(m.iron_siemens_), h_u(h_s * u_s_V), h_Rs(h_s * linear.Rs_ohm),
          h_Rr(h_s * linear.Rr_ohm), h_p(h_s * linear.pole_pairs),
          h_inv_J(h_s * shaft.inv_J_per_kg_m2), inv_J(shaft.inv_J_per_kg_m2),
          torque(h_inv_J * shaft.torque_Nm), viscous(h_inv_J * shaft.viscous_Nms)
    {
    }

    MotorState operator()(const MotorState &x) const
    {
        if constexpr (law == SaturationLaw::none) {
            return of(x, linear.stator_current(x),
                      linear.y_rr * x.psi_r_Wb - linear.y_sr * x.psi_s_Wb);
        } else {
            const MotorCurrents i = branch.currents<law>(x);
            return of(x, i.i_s_A, i.i_r_A);
        }
    }
    // With the currents of x.
    MotorState of(const MotorState &x, Vec i_s_A, Vec i_r_A) const
    {
        const Vec rotation = (h_p * x.omega_m_rad_s) * turned_90(x.psi_r_Wb);
        const double drag = torque - viscous * x.omega_m_rad_s;
        const Vec h_psi_r_V = rotor_share * (rotation - h_Rr * i_r_A);
        const double h_iron_Nm = linear.pole_pairs * iron_siemens * cross(x.psi_r_Wb, h_psi_r_V);
        return {h_u - h_Rs * i_s_A, h_psi_r_V,
                h_inv_J * linear.pole_pairs * cross(x.psi_s_Wb, i_s_A) + drag - inv_J * h_iron_Nm};
    }
};

// k1: the increment at x.
template <class Increment>
void InductionMotor::advance(MotorState &x, const MotorState &k1, const Increment &increment) const
{
    if (method_ == IntegrationMethod::rk4) {
        x = runge_kutta(x, k1, increment);
        return;
    }
    const MotorState k2 = increment(along(x, 1.0, k1));
    x = along(along(x, 0.5, k1), 0.5, k2);
}

template <SaturationLaw law>
void InductionMotor::step_general(MotorState &x, Vec u_s_V, const ShaftDrive &shaft,
                                  double h_s) const
{
    const GeneralIncrement<law> increment(*this, u_s_V, shaft, h_s);
    const MotorCurrents i = currents(x);
    advance(x, increment.of(x, i.i_s_A, i.i_r_A), increment);
}

void InductionMotor::step(MotorState &x, Vec u_s_V, const ShaftDrive &shaft, double h_s) const
{
    if (!general_) {
        const LinearIncrement increment(linear_, u_s_V, shaft, h_s);
        advance(x, increment(x), increment);
    } else if (!saturated_) {
        step_general<SaturationLaw::none>(x, u_s_V, shaft, h_s);
    } else {
        with_law(law_, [&]<SaturationLaw law>() { step_general<law>(x, u_s_V, shaft, h_s); });
    }
}

void InductionMotor::step_open(MotorState &x, const ShaftDrive &shaft, double h_s) const
{
    struct Open {
        Vec psi_r;
        double omega;
    };
    const auto slope = [&](const Open &y) {
        const Vec i_r =
            saturated_ ? main_current(main_flux(y.psi_r)) : (1.0 / parameters_.Lr_H) * y.psi_r;
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
