// One closed loop, period by period: firmware, plant and what stands between and around them.
//
//   while (loop.goes_on()) {
//       loop.control(loop.plant().sample(), command);
//       loop.plant().advance(command);            // alone, or side by side with others
//       loop.follow();
//   }
#ifndef ZH_LOOP_HPP
#define ZH_LOOP_HPP

#include <cstddef>
#include <cstdint>
#include <numbers>

#include "elementary.hpp"
#include "firmware.hpp"
#include "plant.hpp"
#include "simulate.hpp"
#include "lockstep_peer.hpp"

namespace zh {

// Below this there is no flux whose angle is of use.
inline constexpr double no_flux_Wb = 1e-4;

// What the operator does, followed forward in time.
class Operator {
public:
    explicit Operator(const Scenario &scenario) : scenario_(scenario)
    {
    }
    // Who has fallen silent repeats the last word for ever: that is what a mailbox shows.
    void speak(double t_s)
    {
        if (t_s < scenario_.silent_from_s) {
            if (t_s >= change_s_) {
                change_s_ = scenario_.command_holds_until(t_s);
                last_ = command_at(scenario_, t_s, speed_ref_rpm(t_s), last_.count);
            }
            ++last_.count;
        }
    }
    const unit_command_t &said() const
    {
        return last_;
    }
    // The scenario is another one now.
    void start_again()
    {
        cursor_ = 0;
        change_s_ = 0.0;
    }
    // What the operator wants, said or not.
    float speed_ref_rpm(double t_s)
    {
        return static_cast<float>(scenario_.speed_ref_rpm.value(t_s, cursor_));
    }

private:
    const Scenario &scenario_;
    std::size_t cursor_ = 0;
    double change_s_ = 0.0; // when to look at the scenario again
    unit_command_t last_{};
};

// Frequency of the true rotor flux: how far it turned since the last crest, low-passed.
class FluxFrequency {
public:
    explicit FluxFrequency(double period_s)
        : Hz_per_rad_(0.5 / (std::numbers::pi * period_s)),
          share_(1.0 - portable_exp(-period_s / filter_s))
    {
    }
    void follow(Vec flux_Wb)
    {
        const double sine = cross(last_Wb_, flux_Wb);
        const double cosine = dot(last_Wb_, flux_Wb);
        const bool flux = dot(flux_Wb, flux_Wb) > no_flux_Wb * no_flux_Wb && cosine > 0.0;
        // The angle per period is small; its tangent's series replaces the arctangent.
        const double tangent = flux ? sine / cosine : 0.0;
        const double turned_rad = tangent * (1.0 - tangent * tangent * (1.0 / 3.0));
        f_Hz_ += share_ * (Hz_per_rad_ * turned_rad - f_Hz_);
        last_Wb_ = flux_Wb;
    }
    double f_Hz() const
    {
        return f_Hz_;
    }

private:
    static constexpr double filter_s = 10e-3;

    double Hz_per_rad_;
    double share_;
    double f_Hz_ = 0.0;
    Vec last_Wb_;
};

class Loop {
public:
    // `run` and `peer` have to live as long. Throws ConfigError.
    Loop(const Run &run, LockstepPeer *peer);

    bool goes_on() const
    {
        return !ended_ && out_.steps < run_.steps;
    }
    bool ended() const
    {
        return ended_;
    }
    Plant &plant()
    {
        return plant_;
    }
    // The firmware's period: what acts on the plant from this crest on. A peer may end the loop
    // in it; the command then acts on nothing.
    void control(const Words &words, PlantCommand &command);
    // After the plant has advanced.
    void follow();
    // Of the drive's RAM, before its next period; false: no such bit.
    bool flip(std::uint32_t byte, std::uint32_t bit)
    {
        return firmware_.flip(byte, bit);
    }
    const unit_t &drive() const
    {
        return firmware_.unit();
    }
    Firmware &firmware()
    {
        return firmware_;
    }
    // The run ends: the firmware takes too long.
    void too_slow();
    // The scenario of the run has changed: from the next period on.
    void scenario_changed();
    // As the last period put them out.
    bool gates_on() const
    {
        return output_.gates_on;
    }
    std::uint64_t steps() const
    {
        return out_.steps;
    }
    // So far; Outcome::commissioning only comes with take().
    const Outcome &outcome() const
    {
        return out_;
    }
    // Once, at the end; the loop is empty afterwards.
    Outcome take();

private:
    bool period(const Words &words);
    bool hangs(double t_s);
    void record();
    void watch(double t_s);

    const Run &run_;
    LockstepPeer *peer_;
    Firmware firmware_;
    Plant plant_;
    PreloadedTimer timer_;
    Operator operator_;
    FluxFrequency f_s_;
    Outcome out_;
    std::uint32_t until_row_ = 1;
    int hung_periods_ = 0;
    bool ended_ = false;
    hal_output_t output_{}; // of the last period
};

} // namespace zh

#endif
