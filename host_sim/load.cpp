#include "load.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "elementary.hpp"

namespace zh {

double LoadLaw::torque_Nm(double profile_Nm, double omega_m_rad_s, double t_s) const
{
    const double speed = omega_m_rad_s / reference_rad_s;
    double share = 1.0;
    if (exponent == 1) {
        share = speed;
    } else if (exponent == 2) {
        share = speed * std::abs(speed);
    }
    const double pulse = pulse_pu > 0.0 ? 1.0 + pulse_pu * portable_sin(pulse_Hz * t_s) : 1.0;
    return profile_Nm * share * pulse;
}

double FluxTurns::turns_between(Vec from_Wb, Vec to_Wb)
{
    const double cosine = dot(from_Wb, to_Wb);
    const double sine = cross(from_Wb, to_Wb);
    const bool flux = cosine > 0.0; // it turns by a small angle per period, or there is none
    return flux ? portable_atan2(sine, cosine) * (0.5 / std::numbers::pi) : 0.0;
}

ElasticLoad::ElasticLoad(const Mechanics &mechanics)
    : J_kg_m2_(mechanics.load_J_kg_m2), stiffness_Nm_(mechanics.stiffness_Nm),
      damping_Nms_(mechanics.damping_Nms)
{
    const bool coupled = stiffness_Nm_ > 0.0 && damping_Nms_ >= 0.0;
    if (!(J_kg_m2_ >= 0.0) || (present() && !coupled)) {
        throw std::invalid_argument("shaft: a second mass needs stiffness > 0 and damping >= 0");
    }
}

// Twist first, then the speed it leads to: symplectic, the resonance neither grows nor fades.
double ElasticLoad::advance(double omega_m_rad_s, double load_torque_Nm, double h_s)
{
    const double slip_rad_s = omega_m_rad_s - omega_rad_s_;
    twist_rad_ += h_s * slip_rad_s;
    const double coupling_Nm = stiffness_Nm_ * twist_rad_ + damping_Nms_ * slip_rad_s;
    omega_rad_s_ += h_s * (coupling_Nm - load_torque_Nm) / J_kg_m2_;
    return coupling_Nm;
}

Shaft::Shaft(const Mechanics &mechanics)
    : friction_{.coulomb_Nm = mechanics.coulomb_Nm,
                .static_Nm = mechanics.static_Nm,
                .viscous_Nms = mechanics.viscous_Nms,
                .inv_J_per_kg_m2 = 1.0 / mechanics.J_kg_m2}
{
    const bool sensible = mechanics.J_kg_m2 > 0.0 && mechanics.coulomb_Nm >= 0.0 &&
                          mechanics.static_Nm >= mechanics.coulomb_Nm &&
                          mechanics.viscous_Nms >= 0.0;
    if (!sensible) {
        throw std::invalid_argument("shaft: J > 0, 0 <= coulomb <= static, viscous >= 0");
    }
}

double Shaft::settle(double omega_before_rad_s, double omega_after_rad_s, double motor_torque_Nm,
                     double load_torque_Nm, double h_s)
{
    const double net_Nm = motor_torque_Nm - load_torque_Nm;
    stuck_ = friction_holds(friction_, net_Nm);
    return passed_zero(friction_, direction_, omega_before_rad_s, omega_after_rad_s, net_Nm, h_s);
}

} // namespace zh
