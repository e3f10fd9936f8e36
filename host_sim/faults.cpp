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

std::size_t phase(TomlReader &in, std::string_view key)
{
    return in.has(key) ? in.choice(key, {"u", "v", "w"}) : 0;
}

// What the severity of a kind may be; its default is the severity that it has without one.
double severity(TomlReader &in, SensorFaultKind kind)
{
    constexpr std::string_view key = "faults.severity";
    switch (kind) {
    case SensorFaultKind::gain:
        return in.number(key, within(0.0, 10.0));
    case SensorFaultKind::offset:
        return in.number(key, within(-1.0, 1.0));
    case SensorFaultKind::delayed:
        return in.integer("faults.severity", 1, FaultySensor::longest_delay - 1);
    case SensorFaultKind::intermittent:
        return in.number(key, within(0.0, 1.0));
    case SensorFaultKind::off:
    case SensorFaultKind::stuck:
    case SensorFaultKind::garbage:
    case SensorFaultKind::exchanged:
        break;
    }
    return in.number_or(key, 0.0, within(0.0, 0.0));
}

std::uint16_t &word(Words &words, std::size_t signal)
{
    const std::array<std::uint16_t *, 6> all{&words.i_u,  &words.i_v,  &words.i_w,
                                             &words.u_uv, &words.u_vw, &words.u_dc};
    return *all[signal];
}

// With whom a sensor changes places; the dc link's stays where it is.
std::size_t next_of_its_kind(std::size_t signal)
{
    constexpr std::array<std::size_t, 6> next{1, 2, 0, 4, 3, dc_link_word};
    return next[signal];
}

} // namespace

Faults read_faults(TomlReader &in)
{
    Faults f;
    f.sensor.start_s = time_or_never(in, "faults.start_s");
    f.sensor.end_s = time_or_never(in, "faults.end_s");
    if (in.has("faults.sensor")) {
        f.sensor.signal = in.choice("faults.sensor", {"i_u", "i_v", "i_w", "u_uv", "u_vw", "u_dc"});
        f.sensor.kind = static_cast<SensorFaultKind>(
            in.choice("faults.kind", {"off", "stuck", "garbage", "gain", "offset", "delayed",
                                      "intermittent", "exchanged"}));
        if (f.sensor.kind == SensorFaultKind::exchanged && f.sensor.signal == dc_link_word) {
            in.reject("faults.sensor", "there is one dc-link sensor",
                      "name a current or a voltage");
        }
        f.sensor.severity = severity(in, f.sensor.kind);
    } else if (f.sensor.start_s < never_s) {
        in.reject("faults.start_s", "no sensor is named", "give faults.sensor and faults.kind");
    }
    f.open_phase = phase(in, "faults.open_phase");
    f.open_s = time_or_never(in, "faults.open_s");
    f.short_s = time_or_never(in, "faults.short_s");
    f.short_ohm = in.number_or("faults.short_ohm", f.short_ohm, not_negative(1e6));
    f.short_H = in.number_or("faults.short_H", f.short_H, within(1e-6, 1.0));
    f.earth_phase = phase(in, "faults.earth_phase");
    f.earth_s = time_or_never(in, "faults.earth_s");
    f.earth_ohm = in.number_or("faults.earth_ohm", f.earth_ohm, within(1e-3, 1e9));
    return f;
}

FaultySensor::FaultySensor(const SensorFault &fault, int adc_bits, std::uint64_t seed)
    : fault_(fault), zero_code_(fault.signal == dc_link_word ? 0.0 : std::exp2(adc_bits - 1)),
      top_code_(std::exp2(adc_bits) - 1.0), noise_(~seed)
{
}

double FaultySensor::faulty_code(double code)
{
    // A uniform number in [0, 1), drawn in every period so that no kind shifts another.
    const double chance = std::ldexp(static_cast<double>(noise_.bits() >> 11U), -53);
    switch (fault_.kind) {
    case SensorFaultKind::off:
        return zero_code_;
    case SensorFaultKind::stuck:
        return stuck_code_;
    case SensorFaultKind::garbage:
        return chance * (top_code_ + 1.0);
    case SensorFaultKind::gain:
        return zero_code_ + fault_.severity * (code - zero_code_);
    case SensorFaultKind::offset:
        return code + fault_.severity * (top_code_ + 1.0 - zero_code_);
    case SensorFaultKind::delayed: {
        const auto back = static_cast<std::size_t>(fault_.severity);
        return history_[(now_ + longest_delay - back) % longest_delay];
    }
    case SensorFaultKind::intermittent:
        return chance < fault_.severity ? zero_code_ : code;
    case SensorFaultKind::exchanged:
        break; // a matter of two words
    }
    return code;
}

Words FaultySensor::disturbed(const Words &words, double t_s)
{
    Words out = words;
    std::uint16_t &code = word(out, fault_.signal);
    now_ = (now_ + 1) % longest_delay;
    history_[now_] = code;
    if (t_s < fault_.start_s || t_s >= fault_.end_s) {
        return out;
    }
    if (fault_.kind == SensorFaultKind::exchanged) {
        std::swap(code, word(out, next_of_its_kind(fault_.signal)));
        return out;
    }
    if (!stuck_) {
        stuck_ = true;
        stuck_code_ = code;
    }
    code = static_cast<std::uint16_t>(std::clamp(faulty_code(code), 0.0, top_code_));
    return out;
}

} // namespace zh
