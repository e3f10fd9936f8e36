// The rig as the firmware meets it: sample at a carrier crest, then advance to the next.
//
//   for k = 0, 1, ...
//       words = plant.sample();                          // crest t_k
//       out = firmware(words);
//       plant.advance(timer.exchange(out.duty), out.gates_on);   // t_k .. t_(k+1)
#ifndef ZH_PLANT_HPP
#define ZH_PLANT_HPP

#include <array>
#include <cstddef>
#include <cstdint>

#include "board.hpp"
#include "dc_link.hpp"
#include "faults.hpp"
#include "induction_motor.hpp"
#include "inverter.hpp"
#include "load.hpp"
#include "rig.hpp"
#include "scenario.hpp"
#include "sensors.hpp"
#include "sine_ahead.hpp"

namespace zh {

// Timer preload: the duties computed in step k act on [t_(k+n), t_(k+n+1)), n = delay_periods of
// the board, 1 or 2. The gate signal is not delayed: gates off acts at once. Before the first step
// the duties are one half.
class PreloadedTimer {
public:
    explicit PreloadedTimer(int delay_periods = 1) : two_periods_(delay_periods > 1)
    {
    }
    // Stores this step's duties, returns those that act on the interval now beginning.
    Duty exchange(const Duty &duty)
    {
        Duty acting;
        exchange(duty[0], duty[1], duty[2], acting);
        return acting;
    }
    // As numbers: a wide copy of what was just written would have to wait for it.
    void exchange(double u, double v, double w, Duty &acting)
    {
        acting = pending_;
        pending_[0] = two_periods_ ? written_[0] : u;
        pending_[1] = two_periods_ ? written_[1] : v;
        pending_[2] = two_periods_ ? written_[2] : w;
        written_[0] = u;
        written_[1] = v;
        written_[2] = w;
    }

private:
    bool two_periods_;
    Duty pending_{0.5, 0.5, 0.5}; // in the timer's shadow register
    Duty written_{0.5, 0.5, 0.5}; // on its way there, where that takes a period
};

// What acts on the plant over the coming interval.
struct PlantCommand {
    Duty duty{}; // those that act now, see PreloadedTimer
    bool gates_on = false;
    bool brake_on = false;
};

// The true quantities at the present crest, for recording and judging.
struct Truth {
    double t_s;
    double omega_m_rad_s;
    double torque_Nm;      // of the motor (air gap)
    double load_torque_Nm; // acting over the last interval
    Vec i_s_A;
    Vec psi_s_Wb;
    Vec psi_r_Wb;
    Phases i_A;      // of the motor
    double i_peak_A; // largest leg current over the last interval, whatever it flows into
    Vec u_s_V;       // mean over the last interval
    double u_dc_V;
};

class Plant {
public:
    // Of a period that is looked at closely: 2 us each at 5 kHz, as long as the comparator takes.
    static constexpr int fine_parts = 100;
    // Blocked legs are followed in steps this fraction of a period: diodes stop within
    // microseconds.
    static constexpr int blocked_steps = 40;

    // Throws ConfigError when rig and board do not fit (carrier and control period, stiffness of
    // the dead-time curve).
    Plant(const Rig &rig, const Board &board, const Disturbances &disturbances, std::uint64_t seed);

    Words sample();
    // Between the drive's terminals and the cables: the meter's reading.
    Phases currents_at_legs() const;
    // To the next crest. The duties are those that act now (see PreloadedTimer).
    void advance(const Duty &duty, bool gates_on, bool brake_on = false);
    void advance(const PlantCommand &command)
    {
        advance(command.duty, command.gates_on, command.brake_on);
    }
    // The board's comparator has opened the gates; until the firmware opens them as well.
    bool broken() const
    {
        return broken_;
    }

    double time_s() const
    {
        return static_cast<double>(steps_) * period_s_;
    }
    // Others from here on, their times those of this run. A jammed shaft stays jammed.
    void disturb(const Disturbances &disturbances);
    // The sensors' noise continues from another seed.
    void reseed(std::uint64_t seed)
    {
        sensors_.set_noise(NoiseSource(seed));
        seed_ = seed;
    }
    Truth truth() const;
    // Not finite, or beyond anything the rig could survive; advance then does nothing more.
    bool diverged() const
    {
        return diverged_;
    }
    bool shaft_stuck() const
    {
        return shaft_.stuck();
    }
    // For tests and for starts from elsewhere than standstill.
    void set_state(const MotorState &state);
    const MotorState &state() const
    {
        return x_;
    }
    const InductionMotor &motor() const
    {
        return motor_;
    }

private:
    friend class PlantLanes;
    friend class PlantPack;
    using Transition = FilterTransition;

    // advance() in three parts: the middle one can be done for several plants at once.
    enum class Interval {
        none,
        blocked,
        in_parts,
        averaged,
        switched
    };
    Interval begin_interval(bool gates_on);
    void step_interval(Interval interval, const Duty &legs);
    void end_interval(bool brake_on);
    bool fits_lanes() const;

    void follow_disturbances();
    void follow_flux();
    void advance_averaged(const Duty &duty);
    void advance_switched(const Duty &duty);
    int parts_of(double segment_s) const;
    void advance_blocked();
    void advance_in_parts(const Duty &duty);
    bool needs_parts() const;
    bool phase_open() const;
    void step_open_phase(const Segment &half, double h_s);
    void step_open_contactor(const Segment &half, double h_s);
    void follow_leaks(const Duty &duty, int part);
    bool over_comparator(const Phases &i_A) const;
    Phases leg_currents() const;
    bool crossed() const;
    std::array<double, 2> lines_at_legs() const;
    Duty duty_of_terminals(const Duty &legs) const;
    void step_dead_switch(const Segment &half, double h_s);
    void integrate(const Segment &segment, double h_s, const Transition &transition);
    void apply(Vec u_s_V, Vec i_s_A, double h_s);
    void settle_shaft(double omega_before_rad_s, double h_s);
    void enter_blocked();
    void step_blocked(double h_s, const Transition &transition);
    void step_open(double h_s);
    void extinguish(const Phases &i_A);
    Phases blocked_voltages(const Phases &i_A, Phases &sign) const;

    double period_s_;
    InductionMotor motor_;
    Shaft shaft_;
    ElasticLoad elastic_;
    FluxTurns flux_turns_; // what the load's servo goes by
    Inverter inverter_;
    Sensors sensors_;
    LineVoltageFilter filter_;
    Transition whole_period_;
    Transition half_period_;
    Transition blocked_step_;
    Transition part_step_;
    Disturbances disturbances_;
    double drop_V_;
    int substeps_;       // 0: as whole_steps_ says
    bool whole_steps_;   // averaged: one integration step per period
    Transition substep_; // of period / substeps

    std::uint64_t steps_ = 0;
    MotorState x_;
    DcLink link_;
    SineAhead ripple_sine_;
    double u_dc_V_;
    double energy_J_ = 0.0; // from the legs to the motor over the interval
    FaultySensors faulty_sensors_;
    int adc_bits_;
    std::uint64_t seed_;
    double comparator_A_;
    double comparator_near_A_; // out of whose reach it is for a period
    bool never_in_parts_;      // no comparator, no broken phase or leg in the scenario
    double short_A_ = 0.0;     // out of leg u, into leg v
    double earth_A_ = 0.0;     // out of the earthed leg
    double i_peak_A_ = 0.0;
    double profile_load_Nm_ = 0.0;
    double load_torque_Nm_ = 0.0; // the profile's, by the load's law
    double shaft_load_Nm_ = 0.0;  // of it, or of the coupling to it
    double source_V_ = 0.0;       // of the dc link, without ripple
    Vec u_s_V_s_;                 // integral of u_s over the interval
    Vec i_s_before_A_;            // at the start of the last averaged interval
    double quiet_until_s_ = 0.0;  // no disturbance changes before
    double slope_until_s_ = 0.0;  // one of them changes all the time until then
    std::size_t load_cursor_ = 0;
    std::size_t rs_cursor_ = 0;
    std::size_t rr_cursor_ = 0;
    std::size_t u_dc_cursor_ = 0;
    std::array<bool, 3> open_{true, true, true}; // blocked phases without current
    bool blocked_ = true;
    bool broken_ = false;
    bool jammed_ = false;
    bool diverged_ = false;
};

} // namespace zh

#endif
