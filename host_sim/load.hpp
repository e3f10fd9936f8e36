// The shaft: load machine, Coulomb, static and viscous friction; a second mass on request.
//
// J dw/dt = T - T_load - T_coulomb sign(w) - B w. At w = 0 the shaft sticks, exactly, while
// |T - T_load| <= T_static. The load machine is torque controlled, T_load does not depend on speed,
// unless a LoadLaw says otherwise; positive opposes positive rotation.
#ifndef ZH_LOAD_HPP
#define ZH_LOAD_HPP

#include "motor_step.hpp"

namespace zh {

struct Mechanics {
    double J_kg_m2 = 0.015;
    double coulomb_Nm = 0.0;
    double static_Nm = 0.0; // >= coulomb_Nm
    double viscous_Nms = 0.0;
    // A second mass, the load's, that J_kg_m2 does not contain; 0: none.
    double load_J_kg_m2 = 0.0;
    double stiffness_Nm = 0.0; // of the coupling, per rad
    double damping_Nms = 0.0;
};

// What a driven machine makes of the load profile: constant, in proportion to speed or to its
// square, with a torque that pulsates around that. A servo may add torque until the rotor flux
// stands still on average, whatever the drive does: zero stator frequency, kept by the load.
struct LoadLaw {
    int exponent = 0;
    double reference_rad_s = 1.0; // where the profile's torque is reached
    double pulse_pu = 0.0;
    double pulse_Hz = 0.0;
    double servo_Nm_per_turn = 0.0; // the integral of the stator frequency counts; 0: no servo
    double servo_from_s = 0.0;

    bool constant() const
    {
        return exponent == 0 && !(pulse_pu > 0.0) && !servo();
    }
    bool servo() const
    {
        return servo_Nm_per_turn > 0.0;
    }
    double torque_Nm(double profile_Nm, double omega_m_rad_s, double t_s) const;
};

// A load mass behind an elastic coupling, stepped once per control period: its resonance lies far
// below 1 / period. The motor's shaft feels the coupling's torque instead of the load.
class ElasticLoad {
public:
    // Throws std::invalid_argument for a mass without a coupling.
    explicit ElasticLoad(const Mechanics &mechanics);

    bool present() const
    {
        return J_kg_m2_ > 0.0;
    }
    // Both masses turn at this speed, and the coupling is not twisted.
    void turn_with(double omega_m_rad_s)
    {
        omega_rad_s_ = omega_m_rad_s;
        twist_rad_ = 0.0;
    }
    // The torque on the motor's shaft over the coming h.
    double advance(double omega_m_rad_s, double load_torque_Nm, double h_s);
    double omega_rad_s() const
    {
        return omega_rad_s_;
    }

private:
    double J_kg_m2_, stiffness_Nm_, damping_Nms_;
    double omega_rad_s_ = 0.0;
    double twist_rad_ = 0.0;
};

// Turns of the rotor flux from a time on, counted once per control period.
class FluxTurns {
public:
    void follow(Vec flux_Wb)
    {
        turns_ += turns_between(last_Wb_, flux_Wb);
        last_Wb_ = flux_Wb;
    }
    // Counts from this flux on.
    void start(Vec flux_Wb)
    {
        last_Wb_ = flux_Wb;
    }
    double turns() const
    {
        return turns_;
    }

private:
    static double turns_between(Vec from_Wb, Vec to_Wb);

    Vec last_Wb_;
    double turns_ = 0.0;
};

class Shaft {
public:
    // Throws std::invalid_argument unless J > 0 and 0 <= coulomb <= static, viscous >= 0.
    explicit Shaft(const Mechanics &mechanics);

    // Before an integration step: the torque the shaft adds, or a held shaft.
    ShaftDrive begin(double omega_m_rad_s, double motor_torque_Nm, double load_torque_Nm)
    {
        const ShaftMotion motion =
            begin_motion(friction_, omega_m_rad_s, motor_torque_Nm, load_torque_Nm);
        direction_ = motion.direction;
        stuck_ = !(std::abs(direction_) > 0.0);
        return motion.drive;
    }
    // After it: whether the speed has passed through zero, and then the speed it really has.
    bool reversed(double omega_after_rad_s) const
    {
        return direction_ * omega_after_rad_s < 0.0;
    }
    double settle(double omega_before_rad_s, double omega_after_rad_s, double motor_torque_Nm,
                  double load_torque_Nm, double h_s);

    // From now on, in motion and at rest.
    void add_friction(double torque_Nm)
    {
        friction_.coulomb_Nm += torque_Nm;
        friction_.static_Nm += torque_Nm;
    }

    bool stuck() const
    {
        return stuck_;
    }
    const Friction &friction() const
    {
        return friction_;
    }
    // Steps taken side by side with others (plant_lanes.cpp) end in this.
    void set_motion(double direction, bool stuck)
    {
        direction_ = direction;
        stuck_ = stuck;
    }

private:
    Friction friction_;
    double direction_ = 0.0; // of rotation during the present step; 0: stuck
    bool stuck_ = true;
};

} // namespace zh

#endif
