// Two-level inverter, averaged over a carrier period or switched, behind one value type.
//
// Carrier: symmetric triangle, crest at t_k, one duty update per crest; a leg is commanded high for
// T (1-d)/2 .. T (1+d)/2. Each transistor turns on dead_time_s after its command; while neither is
// on the current decides. One leg formula serves both models (terminal against the dc mid point):
//
//   v = u_dc (clamp(d - delta s, 0, 1) - 1/2) - drop s,   s = clamp(i / i_threshold, -1, 1)
//
// averaged: d = duty, delta = dead_time f_c;  switched: d, delta = 1, 0 | 0, 0 | 1/2, 1/2 for upper
// on, lower on, none on (i_threshold then stands for the charging of the leg's capacitance).
//
// Devices that are not ideal (DeviceLaw), with C the capacitance of a leg and D the difference of
// the drops:
//
//   v = u_dc (clamp(d - delta g, 0, 1) - 1/2) - drop s - (d - 1/2) D |s| - R_on i
//   g = x/2 up to x = 1, then 1 - 1/(2x), x = |i| dead_time / (C u_dc), with the sign of i
#ifndef ZH_INVERTER_HPP
#define ZH_INVERTER_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "space_vector.hpp"

namespace zh {

using Duty = std::array<double, 3>; // u, v, w; 0..1

enum class InverterModel {
    averaged,
    switched,
};

struct InverterParameters {
    InverterModel model = InverterModel::averaged;
    double u_dc_V = 283.0;
    double carrier_Hz = 5000.0;
    double dead_time_s = 0.0;
    double i_threshold_A = 0.1;
    double drop_V = 0.0;            // per leg, transistor or diode: their mean
    double drop_difference_V = 0.0; // transistor's drop less the diode's
    double on_ohm = 0.0;            // of whichever conducts
    double leg_F = 0.0; // charged by the current within the dead time; 0: i_threshold decides
};

// A stretch of time in which no leg changes its switches.
struct Segment {
    double h_s = 0.0;
    Phases level{}; // d of the formula above
    Phases dead{};  // delta of the formula above
};

constexpr double clamp01(double x)
{
    const double raised = x > 0.0 ? x : 0.0; // NaN becomes 0; one instruction each
    return raised < 1.0 ? raised : 1.0;
}

// What of the inverter enters the leg formula.
struct LegConstants {
    double inv_threshold_per_A;
    double drop_V;
};

// The leg formula above.
constexpr double leg_voltage(const LegConstants &c, double level, double dead, double i_A,
                             double u_dc_V)
{
    const double sign = i_A * c.inv_threshold_per_A;
    const double raised = sign > -1.0 ? sign : -1.0;
    const double s = raised < 1.0 ? raised : 1.0;
    return u_dc_V * (clamp01(level - dead * s) - 0.5) - c.drop_V * s;
}
// What a leg does beyond that.
struct DeviceLaw {
    double drop_difference_V = 0.0;
    double on_ohm = 0.0;
    double dead_s_per_F = 0.0; // dead time over capacitance; 0: none

    bool ideal() const
    {
        return std::abs(drop_difference_V) + on_ohm + dead_s_per_F <= 0.0;
    }
};

// Share of the dead time for which a leg is lost, with the sign of the current: the capacitance is
// charged linearly, to the end if there is time.
inline double charging_share(double dead_s_per_F, double i_A, double u_dc_V)
{
    const double x = std::abs(i_A) * dead_s_per_F / u_dc_V;
    return std::copysign(x < 1.0 ? 0.5 * x : 1.0 - 0.5 / x, i_A);
}

// The leg formula with devices.
inline double device_leg_voltage(const LegConstants &c, const DeviceLaw &law, double level,
                                 double dead, double i_A, double u_dc_V)
{
    const double s = std::clamp(i_A * c.inv_threshold_per_A, -1.0, 1.0);
    const bool charged = law.dead_s_per_F > 0.0;
    const double g = charged ? charging_share(law.dead_s_per_F, i_A, u_dc_V) : s;
    const double drop_V = c.drop_V * s + (level - 0.5) * law.drop_difference_V * std::abs(s);
    return u_dc_V * (clamp01(level - dead * g) - 0.5) - drop_V - law.on_ohm * i_A;
}
// delta of the averaged model: a duty of 0 or 1 switches nothing.
constexpr double averaged_dead(double level, double dead_share)
{
    const double below_one = level < 1.0 ? dead_share : 0.0;
    return level > 0.0 ? below_one : 0.0;
}

class Inverter {
public:
    // Throws std::invalid_argument for values outside their range.
    explicit Inverter(const InverterParameters &parameters);

    const InverterParameters &parameters() const
    {
        return parameters_;
    }
    // The averaged model's segment: half a period, to be passed twice, so that the current deciding
    // the error is looked at as often as a leg switches. A duty of 0 or 1 switches nothing.
    Segment averaged_half(const Duty &duty) const
    {
        Segment half;
        half.h_s = 0.5 * period_s_;
        for (std::size_t x = 0; x < 3; ++x) {
            half.level[x] = clamp01(duty[x]);
            half.dead[x] = averaged_dead(half.level[x], dead_share_);
        }
        return half;
    }
    // The segments of the coming carrier period, in order, their lengths summing to it. The view is
    // valid until the next call. A duty outside 0..1 (or NaN) counts as the nearest bound.
    std::span<const Segment> schedule(const Duty &duty);
    // All switches off: the next schedule starts from blocked legs.
    void block();

    // Terminal voltages against the dc mid point.
    Phases leg_voltages(const Segment &segment, const Phases &i_A, double u_dc_V) const
    {
        Phases v{};
        for (std::size_t x = 0; x < 3; ++x) {
            v[x] = ideal_ ? leg_voltage(leg_, segment.level[x], segment.dead[x], i_A[x], u_dc_V)
                          : device_leg_voltage(leg_, devices_, segment.level[x], segment.dead[x],
                                               i_A[x], u_dc_V);
        }
        return v;
    }
    double period_s() const
    {
        return period_s_;
    }
    const LegConstants &leg() const
    {
        return leg_;
    }
    const DeviceLaw &devices() const
    {
        return devices_;
    }
    // leg() says all about a leg.
    bool ideal_devices() const
    {
        return ideal_;
    }
    double dead_share() const
    {
        return dead_share_;
    }
    // Each leg low at the coming crest, then up once and down once, dead times over before the next
    // edge, no stretch without an edge longer than half the period: twelve events in an order known
    // beforehand. It leaves the legs as they were.
    bool plain(const Duty &duty) const;

private:
    struct Leg {
        bool commanded_high = false;
        double blanking_left_s = 0.0; // dead time that reaches into the coming period
    };
    struct Event {
        double t_s;
        double level;
        double dead;
    };

    void schedule_switched(const Duty &duty);
    void plan_leg(std::size_t leg, double duty, Segment &start);
    void keep(const Segment &segment);
    void command(std::size_t leg, bool high, double t_s, double next_s);

    InverterParameters parameters_;
    double period_s_;
    LegConstants leg_;
    DeviceLaw devices_;
    bool ideal_;
    double dead_share_; // dead time over carrier period
    std::array<Leg, 3> legs_{};
    // The end of the last period's dead time, then at most three commands (a crest edge, up, down),
    // each ending in two states.
    static constexpr std::size_t leg_events = 7;
    // A leg's events in the order of time, then one that never comes.
    struct LegEvents {
        std::array<Event, leg_events + 1> event;
        std::size_t count = 0;
        void add(const Event &e)
        {
            event[count++] = e;
        }
    };
    std::array<LegEvents, 3> events_{};
    std::array<Segment, 3 * leg_events + 1> segments_{};
    std::size_t segment_count_ = 0;
};

} // namespace zh

#endif
