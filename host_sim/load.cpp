#include "load.hpp"

#include <stdexcept>

namespace zh {

Shaft::Shaft(const Mechanics &mechanics) : mechanics_(mechanics), inv_J_(1.0 / mechanics.J_kg_m2)
{
    const bool sensible = mechanics.J_kg_m2 > 0.0 && mechanics.coulomb_Nm >= 0.0 &&
                          mechanics.static_Nm >= mechanics.coulomb_Nm &&
                          mechanics.viscous_Nms >= 0.0;
    if (!sensible) {
        throw std::invalid_argument("shaft: J > 0, 0 <= coulomb <= static, viscous >= 0");
    }
}

// At standstill: sets the direction in which it starts, if it does.
bool Shaft::breaks_away(double net_Nm)
{
    stuck_ = std::abs(net_Nm) <= mechanics_.static_Nm;
    direction_ = stuck_ ? 0.0 : (net_Nm > 0.0 ? 1.0 : -1.0);
    return !stuck_;
}

double Shaft::settle(double omega_before_rad_s, double omega_after_rad_s, double motor_torque_Nm,
                     double load_torque_Nm, double h_s)
{
    const double net_Nm = motor_torque_Nm - load_torque_Nm;
    // It stops if friction holds it, or if it broke away and was pushed back at once.
    if (std::abs(net_Nm) <= mechanics_.static_Nm || direction_ * net_Nm > 0.0) {
        stuck_ = std::abs(net_Nm) <= mechanics_.static_Nm;
        return 0.0;
    }
    // It passes: behind zero the sliding friction points the other way.
    const double after = std::abs(omega_after_rad_s);
    const double share = after / (after + std::abs(omega_before_rad_s));
    const double omega =
        omega_after_rad_s + direction_ * 2.0 * mechanics_.coulomb_Nm * inv_J_ * h_s * share;
    return direction_ * omega < 0.0 ? omega : 0.0;
}

} // namespace zh
