#include "load.hpp"

#include <stdexcept>

namespace zh {

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
