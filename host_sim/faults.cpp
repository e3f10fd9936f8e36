#include "faults.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace zh {
namespace {

constexpr double longest_s = 36000.0;
constexpr std::size_t dc_link_word = 5;

double time_or_never(TomlReader &in, std::string_view key)
{
    return in.number_or(key, never_s, not_negative(longest_s));
}

// What the severity of a kind may be; its default is the severity that it has without one.
double severity(TomlReader &in, std::string_view key, SensorFaultKind kind)
{
    switch (kind) {
    case SensorFaultKind::gain:
        return in.number(key, within(-10.0, 10.0));
    case SensorFaultKind::offset:
    case SensorFaultKind::fixed:
    case SensorFaultKind::drift:
        return in.number(key, within(-1.0, 1.0));
    case SensorFaultKind::delayed:
        return in.integer(key, 1, FaultySensor::longest_delay - 1);
    case SensorFaultKind::intermittent:
    case SensorFaultKind::noise:
        return in.number(key, within(0.0, 1.0));
    case SensorFaultKind::off:
    case SensorFaultKind::stuck:
    case SensorFaultKind::garbage:
    case SensorFaultKind::exchanged:
        break;
    }
    return in.number_or(key, 0.0, within(0.0, 0.0));
}

// With whom a sensor changes places; the dc link's stays where it is.
std::size_t next_of_its_kind(std::size_t signal)
{
    constexpr std::array<std::size_t, 6> next{1, 2, 0, 4, 3, dc_link_word};
    return next[signal];
}

Distortion distortion_of(const SensorFault &fault)
{
    using enum SensorFaultKind;
    Distortion d;
    d.gain = fault.kind == gain ? fault.severity : 1.0;
    if (fault.kind == off || fault.kind == fixed) {
        d.gain = 0.0;
    }
    d.offset = fault.kind == offset || fault.kind == fixed ? fault.severity : 0.0;
    d.drift_per_s = fault.kind == drift ? fault.severity : 0.0;
    d.deviation = fault.kind == noise ? fault.severity : 0.0;
    return d;
}

struct SensorKeys {
    std::string_view sensor, kind, severity, start_s, end_s;
};
constexpr std::array<SensorKeys, 3> sensor_keys{{
    {"faults.sensor", "faults.kind", "faults.severity", "faults.start_s", "faults.end_s"},
    {"faults.second.sensor", "faults.second.kind", "faults.second.severity",
     "faults.second.start_s", "faults.second.end_s"},
    {"faults.third.sensor", "faults.third.kind", "faults.third.severity", "faults.third.start_s",
     "faults.third.end_s"},
}};

// First and one past the last word of a choice: the six words, then the groups.
std::pair<std::size_t, std::size_t> words_of(std::size_t choice)
{
    constexpr std::array<std::pair<std::size_t, std::size_t>, 3> group{
        {{0, 3}, {3, dc_link_word}, {0, dc_link_word + 1}}};
    return choice > dc_link_word ? group[choice - dc_link_word - 1] : std::pair{choice, choice + 1};
}

void read_sensor(TomlReader &in, const SensorKeys &key, std::vector<SensorFault> &sensors)
{
    SensorFault fault;
    fault.start_s = time_or_never(in, key.start_s);
    fault.end_s = time_or_never(in, key.end_s);
    if (!in.has(key.sensor)) {
        if (fault.start_s < never_s) {
            in.reject(key.start_s, "no sensor is named", "give sensor and kind as well");
        }
        return;
    }
    const std::size_t choice = in.choice(
        key.sensor, {"i_u", "i_v", "i_w", "u_uv", "u_vw", "u_dc", "currents", "voltages", "all"});
    fault.kind = static_cast<SensorFaultKind>(
        in.choice(key.kind, {"off", "stuck", "garbage", "gain", "offset", "delayed", "intermittent",
                             "exchanged", "fixed", "drift", "noise"}));
    if (fault.kind == SensorFaultKind::exchanged && choice >= dc_link_word) {
        in.reject(key.sensor, "two sensors change places, never one or a group",
                  "name a current or a voltage");
    }
    fault.severity = severity(in, key.severity, fault.kind);
    const auto [first, end] = words_of(choice);
    for (fault.signal = first; fault.signal < end; ++fault.signal) {
        sensors.push_back(fault);
    }
}

Crossing read_crossing(TomlReader &in, std::string_view key)
{
    constexpr std::array<Crossing, 3> crossed{{{1, 0, 2}, {0, 2, 1}, {2, 1, 0}}};
    return in.has(key) ? crossed[in.choice(key, {"uv", "vw", "wu"})] : straight;
}

void read_wiring(TomlReader &in, Faults &f)
{
    f.cables = read_crossing(in, "faults.cables");
    f.gates = read_crossing(in, "faults.gates");
    if (in.has("faults.dead_switch")) {
        const std::size_t number =
            in.choice("faults.dead_switch",
                      {"u_upper", "u_lower", "v_upper", "v_lower", "w_upper", "w_lower"});
        f.dead_leg = number / 2;
        f.dead_upper = number % 2 == 0;
    }
}

} // namespace

Faults read_faults(TomlReader &in)
{
    Faults f;
    for (const SensorKeys &key : sensor_keys) {
        read_sensor(in, key, f.sensors);
    }
    read_wiring(in, f);
    if (in.has("faults.open_phase")) {
        f.open_phase = in.choice("faults.open_phase", {"u", "v", "w", "all"});
    }
    f.open_s = time_or_never(in, "faults.open_s");
    f.open_end_s = time_or_never(in, "faults.open_end_s");
    f.short_s = time_or_never(in, "faults.short_s");
    f.short_ohm = in.number_or("faults.short_ohm", f.short_ohm, not_negative(1e6));
    f.short_H = in.number_or("faults.short_H", f.short_H, within(1e-6, 1.0));
    f.earth_phase =
        in.has("faults.earth_phase") ? in.choice("faults.earth_phase", {"u", "v", "w"}) : 0;
    f.earth_s = time_or_never(in, "faults.earth_s");
    f.earth_ohm = in.number_or("faults.earth_ohm", f.earth_ohm, within(1e-3, 1e9));
    f.jam_s = time_or_never(in, "faults.jam_s");
    f.jam_Nm = in.number_or("faults.jam_Nm", f.jam_Nm, not_negative(1e5));
    f.hang_s = time_or_never(in, "faults.hang_s");
    f.hang_periods = in.has("faults.hang_periods") ? in.integer("faults.hang_periods", 0, 1000000)
                                                   : f.hang_periods;
    return f;
}

FaultySensor::FaultySensor(const SensorFault &fault, int adc_bits, std::uint64_t seed)
    : fault_(fault), zero_code_(fault.signal == dc_link_word ? 0.0 : std::exp2(adc_bits - 1)),
      top_code_((1 << adc_bits) - 1), noise_(~seed), distortion_(distortion_of(fault))
{
}

double FaultySensor::faulty_code(double code, double since_s)
{
    const SensorFaultKind kind = fault_.kind;
    const Distortion &d = distortion_;
    if (kind == SensorFaultKind::drift) { // the one that whole campaigns have, and no chance in it
        const double share = d.offset + d.drift_per_s * since_s + d.deviation * 0.0;
        return zero_code_ + d.gain * (code - zero_code_) + share * (top_code_ + 1.0 - zero_code_);
    }
    // A uniform number in [0, 1), drawn in every period so that no kind shifts another.
    const double chance = std::ldexp(static_cast<double>(noise_.bits() >> 11U), -53);
    if (kind == SensorFaultKind::stuck) {
        return stuck_code_;
    }
    if (kind == SensorFaultKind::garbage) {
        return chance * (top_code_ + 1.0);
    }
    if (kind == SensorFaultKind::delayed) {
        const auto back = static_cast<std::size_t>(fault_.severity);
        return history_[(now_ + longest_delay - back) % longest_delay];
    }
    if (kind == SensorFaultKind::intermittent) {
        return chance < fault_.severity ? zero_code_ : code;
    }
    const double draw = kind == SensorFaultKind::noise ? noise_.gaussian() : 0.0;
    const double share = d.offset + d.drift_per_s * since_s + d.deviation * draw;
    return zero_code_ + d.gain * (code - zero_code_) + share * (top_code_ + 1.0 - zero_code_);
}

Codes FaultySensor::disturbed(const Codes &codes, double t_s)
{
    Codes out = codes;
    std::int32_t &code = out[fault_.signal];
    if (fault_.kind != SensorFaultKind::gain) {
        code = clipped(code, top_code_);
    }
    now_ = (now_ + 1) % longest_delay;
    history_[now_] = code;
    if (t_s < fault_.start_s || t_s >= fault_.end_s) {
        return out;
    }
    if (fault_.kind == SensorFaultKind::exchanged) {
        std::swap(code, out[next_of_its_kind(fault_.signal)]);
        return out;
    }
    if (!stuck_) {
        stuck_ = true;
        stuck_code_ = code;
    }
    code = static_cast<std::int32_t>(
        std::clamp(faulty_code(code, t_s - fault_.start_s), 0.0, static_cast<double>(top_code_)));
    return out;
}

FaultySensors::FaultySensors(const std::vector<SensorFault> &faults, int adc_bits,
                             std::uint64_t seed)
    : top_code_((1 << adc_bits) - 1)
{
    constexpr std::uint64_t apart = 0x9E3779B97F4A7C15U; // each word draws its own numbers
    for (const SensorFault &fault : faults) {
        sensors_.emplace_back(fault, adc_bits, seed + apart * sensors_.size());
    }
}

} // namespace zh
