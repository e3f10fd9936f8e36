// Induction motor, T-equivalent circuit, stator and rotor flux as states, stationary frame.
//
//   d psi_s/dt = u_s - Rs i_s            d psi_r/dt = -Rr i_r + j p w_m psi_r
//   psi_s = Ls i_s + M i_r,  psi_r = M i_s + Lr i_r,  T = p Im(conj(psi_s) i_s)
// Power-invariant vectors. With saturation Ls - M and Lr - M are constant leakages and the main
// inductance falls with the main flux: M(psi_m) = M / (1 + (psi_m/knee)^exponent), or by the softer
// law M / (1 + 2 q^2 / (1 + q)), q = (psi_m/knee)^2: a fourth power below the knee, a square above.
//
// Iron loss: a resistance R_fe in the stationary frame across d psi_r/dt, that is across the
// magnetising branch of the inverse-Gamma circuit. Its current i_fe = (d psi_r/dt) / R_fe comes out
// of the rotor's, which leaves no further state and no stiff one:
//   (1 + Rr/R_fe) d psi_r/dt = -Rr i_r + j p w_m psi_r,  T = p Im(conj(psi_s) i_s - conj(psi_r)
//   i_fe)
#ifndef ZH_INDUCTION_MOTOR_HPP
#define ZH_INDUCTION_MOTOR_HPP

#include <bit>
#include <cmath>
#include <cstdint>

#include "main_branch.hpp"
#include "motor_step.hpp"
#include "space_vector.hpp"

namespace zh {

struct Saturation {
    double flux_knee_Wb = 0.0; // main flux at which M has halved; 0: no saturation
    int exponent = 4;          // even, 2..8
    bool soft = false;         // the other law; the exponent then says nothing
};

struct MotorParameters {
    double Rs_ohm = 0.93;
    double Rr_ohm = 0.50;
    double Ls_H = 0.110;
    double Lr_H = 0.102;
    double M_H = 0.102;
    int pole_pairs = 2;
    Saturation saturation;
    double iron_loss_ohm = 0.0; // across the rotor flux; 0: no iron loss
};

// How the equations are stepped; the second one to show that results do not depend on the first.
enum class IntegrationMethod {
    rk4,  // classical Runge-Kutta, order 4
    heun, // order 2
};

class InductionMotor {
public:
    // Throws std::invalid_argument unless resistances and leakage are positive.
    explicit InductionMotor(const MotorParameters &parameters,
                            IntegrationMethod method = IntegrationMethod::rk4);

    const MotorParameters &parameters() const
    {
        return parameters_;
    }
    // Heating: the resistance of the parameters times a factor.
    void set_stator_resistance_factor(double factor);
    void set_rotor_resistance_factor(double factor);

    MotorCurrents currents(const MotorState &x) const
    {
        if (saturated_) {
            if (!same_fluxes(x, last_.x)) {
                remember(x);
            }
            return last_.currents;
        }
        const Vec i_s = linear_.stator_current(x);
        const Vec i_r = linear_.y_rr * x.psi_r_Wb - linear_.y_sr * x.psi_s_Wb;
        return {i_s, i_r, parameters_.M_H * (i_s + i_r)};
    }
    Vec stator_current(const MotorState &x) const
    {
        return saturated_ ? currents(x).i_s_A : linear_.stator_current(x);
    }
    double torque_Nm(const MotorState &x) const;
    double torque_Nm(const MotorState &x, Vec i_s_A) const
    {
        const double gap_Nm = linear_.torque_Nm(x, i_s_A);
        return iron_siemens_ > 0.0 ? gap_Nm - iron_torque_Nm(x.psi_r_Wb, rotor_flux_rate_V(x))
                                   : gap_Nm;
    }
    // Stator flux that belongs to a stator current at the present rotor flux.
    Vec stator_flux(Vec psi_r_Wb, Vec i_s_A) const;
    // Voltage behind the transient inductance: u_s at which i_s would stand still but for Rs i_s.
    Vec transient_emf(const MotorState &x) const;

    // Linear magnetics and no iron loss, stepped by Runge-Kutta: what `linear` says is all of it.
    bool is_linear() const
    {
        return !general_ && method_ == IntegrationMethod::rk4;
    }
    const LinearMotor &linear() const
    {
        return linear_;
    }

    // One step, electrical and mechanical together, u_s constant.
    void step(MotorState &x, Vec u_s_V, const ShaftDrive &shaft, double h_s) const;
    // The same with open stator terminals (i_s = 0), always by Runge-Kutta.
    void step_open(MotorState &x, const ShaftDrive &shaft, double h_s) const;

private:
    friend class PlantPack;
    template <SaturationLaw law> struct GeneralIncrement;
    template <class Increment>
    void advance(MotorState &x, const MotorState &k1, const Increment &increment) const;
    template <SaturationLaw law>
    void step_general(MotorState &x, Vec u_s_V, const ShaftDrive &shaft, double h_s) const;
    Vec rotor_flux_rate_V(const MotorState &x) const
    {
        return rotor_share_ * ((linear_.pole_pairs * x.omega_m_rad_s) * turned_90(x.psi_r_Wb) -
                               linear_.Rr_ohm * currents(x).i_r_A);
    }
    double iron_torque_Nm(Vec psi_r_Wb, Vec psi_r_rate_V) const
    {
        return linear_.pole_pairs * iron_siemens_ * cross(psi_r_Wb, psi_r_rate_V);
    }
    // The saturating branch by itself: the flux of `weighted_flux_Wb`, and its current.
    Vec main_flux(Vec weighted_flux_Wb) const;
    Vec main_current(Vec psi_m_Wb) const;
    void remember(const MotorState &x) const;
    // To the bit.
    static bool same(double a, double b)
    {
        return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
    }
    static bool same_fluxes(const MotorState &a, const MotorState &b)
    {
        return same(a.psi_s_Wb.alpha, b.psi_s_Wb.alpha) && same(a.psi_s_Wb.beta, b.psi_s_Wb.beta) &&
               same(a.psi_r_Wb.alpha, b.psi_r_Wb.alpha) && same(a.psi_r_Wb.beta, b.psi_r_Wb.beta);
    }

    // What currents() said last: a step begins where the one before ended, and asks more than once.
    static constexpr Vec no_number{NAN, NAN};
    struct Last {
        MotorState x;
        MotorCurrents currents;
    };

    MotorParameters parameters_;
    IntegrationMethod method_;
    bool saturated_;
    double iron_siemens_; // 0: none
    bool general_;        // with saturation, iron loss or both
    double rotor_share_;  // 1 / (1 + Rr/R_fe)
    LinearMotor linear_;
    SaturationLaw law_;
    MainBranch branch_;
    mutable Last last_{{no_number, no_number}, {no_number, no_number, no_number}};
};

} // namespace zh

#endif
