// What breaks on a rig, and when: sensors, a motor phase, the insulation, the shaft. Section
// [faults] of a scenario.
//
//   sensor, kind, severity, start_s, end_s   a word, or "currents", "voltages", "all"; see
//                                            SensorFaultKind. Two more at once: [faults.second],
//                                            [faults.third]; each acts on what the one before left
//   open_phase, open_s, open_end_s           a motor phase without current; "all": the contactor
//   short_s, short_ohm, short_H              legs u and v joined through the inductance of a cable
//   earth_phase, earth_s, earth_ohm          a leg joined to earth, the dc link's middle
//   cables, gates                            "uv", "vw" or "wu", from the start: two motor cables,
//                                            or the gate signals of two legs, are exchanged
//   dead_switch                              "u_upper" ... "w_lower": never turns on
//   jam_s, jam_Nm                            friction that is added to the shaft's
//   hang_s, hang_periods                     the control interrupt hangs: its last duties stay for
//                                            so many periods, then the gates open
#ifndef ZH_FAULTS_HPP
#define ZH_FAULTS_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "noise.hpp"
#include "sensors.hpp"
#include "toml_reader.hpp"

namespace zh {

inline constexpr double never_s = std::numeric_limits<double>::infinity();

enum class SensorFaultKind {
    off,          // reads zero
    stuck,        // keeps the word of the moment
    garbage,      // any word, another one every sample
    gain,         // severity: factor, of what comes to the converter
    offset,       // severity: share of full scale
    delayed,      // severity: periods
    intermittent, // severity: share of the samples that read zero
    exchanged,    // wired crosswise with the next: u-v, v-w, w-u; the line voltages with each other
    fixed,        // reads severity, a share of full scale
    drift,        // severity: share of full scale per second
    noise,        // severity: standard deviation, share of full scale
};

struct SensorFault {
    std::size_t signal = 0; // in the order of the words
    SensorFaultKind kind = SensorFaultKind::off;
    double severity = 0.0;
    double start_s = never_s;
    double end_s = never_s;

    bool operator==(const SensorFault &) const = default;
};

inline constexpr std::size_t all_phases = 3;
inline constexpr std::size_t no_leg = 3;

// What is connected to what: a number per leg, 0 1 2 when nothing is crossed.
using Crossing = std::array<std::size_t, 3>;
inline constexpr Crossing straight{0, 1, 2};

struct Faults {
    std::vector<SensorFault> sensors; // one entry per broken word
    std::size_t open_phase = 0;       // all_phases: the contactor
    double open_s = never_s;
    double open_end_s = never_s;
    double short_s = never_s;
    double short_ohm = 0.02;
    double short_H = 20e-6; // some ten metres of cable
    std::size_t earth_phase = 0;
    double earth_s = never_s;
    double earth_ohm = 1.0;
    Crossing cables = straight; // motor terminal on each leg
    Crossing gates = straight;  // duty that drives each leg
    std::size_t dead_leg = no_leg;
    bool dead_upper = false; // else the lower switch
    double jam_s = never_s;
    double jam_Nm = 100.0;
    double hang_s = never_s;
    int hang_periods = 3; // an interrupt of higher priority opens the gates within these
};

Faults read_faults(TomlReader &in);

// What a sensor makes of its quantity: a factor, and shares of full scale.
struct Distortion {
    double gain = 1.0, offset = 0.0, drift_per_s = 0.0, deviation = 0.0;
};

// The fault of one sensor, behind the ADC but for its range: a wrong gain acts before that clips.
class FaultySensor {
public:
    FaultySensor(const SensorFault &fault, int adc_bits, std::uint64_t seed);

    Codes apply(const Codes &codes, double t_s)
    {
        return fault_.start_s < never_s ? disturbed(codes, t_s) : codes;
    }

    static constexpr int longest_delay = 64;

private:
    Codes disturbed(const Codes &codes, double t_s);
    double faulty_code(double code, double since_s);

    SensorFault fault_;
    double zero_code_;
    std::int32_t top_code_;
    NoiseSource noise_;
    Distortion distortion_;
    std::array<std::int32_t, longest_delay> history_{};
    std::size_t now_ = 0;
    std::int32_t stuck_code_ = 0;
    bool stuck_ = false;
};

// Every broken sensor, one after the other.
class FaultySensors {
public:
    FaultySensors(const std::vector<SensorFault> &faults, int adc_bits, std::uint64_t seed);

    Words apply(Codes codes, double t_s)
    {
        for (FaultySensor &sensor : sensors_) {
            codes = sensor.apply(codes, t_s);
        }
        return clipped(codes, top_code_);
    }

private:
    std::int32_t top_code_;
    std::vector<FaultySensor> sensors_;
};

} // namespace zh

#endif
