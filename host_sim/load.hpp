// The shaft: load machine, Coulomb, static and viscous friction.
//
// J dw/dt = T - T_load - T_coulomb sign(w) - B w. At w = 0 the shaft sticks, exactly, while
// |T - T_load| <= T_static. The load machine is torque controlled: T_load does not depend on speed;
// positive opposes positive rotation.
#ifndef ZH_LOAD_HPP
#define ZH_LOAD_HPP

#include <cmath>

#include "induction_motor.hpp"

namespace zh {

struct Mechanics {
    double J_kg_m2 = 0.015;
    double coulomb_Nm = 0.0;
    double static_Nm = 0.0; // >= coulomb_Nm
    double viscous_Nms = 0.0;
};

class Shaft {
public:
    // Throws std::invalid_argument unless J > 0 and 0 <= coulomb <= static, viscous >= 0.
    explicit Shaft(const Mechanics &mechanics);

    // Before an integration step: the torque the shaft adds, or a held shaft.
    ShaftDrive begin(double omega_m_rad_s, double motor_torque_Nm, double load_torque_Nm)
    {
        if (std::abs(omega_m_rad_s) > 0.0) {
            stuck_ = false;
            direction_ = omega_m_rad_s > 0.0 ? 1.0 : -1.0;
        } else if (!breaks_away(motor_torque_Nm - load_torque_Nm)) {
            return {0.0, 0.0, 0.0};
        }
        return {-load_torque_Nm - direction_ * mechanics_.coulomb_Nm, mechanics_.viscous_Nms,
                inv_J_};
    }
    // After it: whether the speed has passed through zero, and then the speed it really has.
    bool reversed(double omega_after_rad_s) const
    {
        return direction_ * omega_after_rad_s < 0.0;
    }
    double settle(double omega_before_rad_s, double omega_after_rad_s, double motor_torque_Nm,
                  double load_torque_Nm, double h_s);

    bool stuck() const
    {
        return stuck_;
    }
    const Mechanics &mechanics() const
    {
        return mechanics_;
    }

private:
    bool breaks_away(double net_Nm);

    Mechanics mechanics_;
    double inv_J_;
    double direction_ = 0.0; // of rotation during the present step; 0: stuck
    bool stuck_ = true;
};

} // namespace zh

#endif
