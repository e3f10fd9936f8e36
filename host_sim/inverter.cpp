#include "inverter.hpp"

#include <limits>
#include <stdexcept>

namespace zh {

Inverter::Inverter(const InverterParameters &parameters)
    : parameters_(parameters),
      period_s_(1.0 / parameters.carrier_Hz), leg_{.inv_threshold_per_A =
                                                       1.0 / parameters.i_threshold_A,
                                                   .drop_V = parameters.drop_V},
      devices_{.drop_difference_V = parameters.drop_difference_V,
               .on_ohm = parameters.on_ohm,
               .dead_s_per_F =
                   parameters.leg_F > 0.0 ? parameters.dead_time_s / parameters.leg_F : 0.0},
      ideal_(devices_.ideal()), dead_share_(parameters.dead_time_s * parameters.carrier_Hz)
{
    const bool sensible = parameters.carrier_Hz > 0.0 && parameters.i_threshold_A > 0.0 &&
                          parameters.dead_time_s >= 0.0 &&
                          parameters.dead_time_s < 0.5 * period_s_ && parameters.drop_V >= 0.0 &&
                          parameters.u_dc_V > 0.0 && parameters.on_ohm >= 0.0 &&
                          parameters.leg_F >= 0.0;
    if (!sensible) {
        throw std::invalid_argument("inverter: carrier, threshold and dc link positive; dead time "
                                    "and drop not negative, dead time below half a period");
    }
}

void Inverter::block()
{
    // Whoever turns on next does so after a full dead time.
    for (Leg &leg : legs_) {
        leg = {false, parameters_.dead_time_s};
    }
}

bool Inverter::plain(const Duty &duty) const
{
    // A little more than what rounding could decide.
    const double least = dead_share_ + 1e-9;
    bool all = duty[0] <= 0.5 || duty[1] <= 0.5 || duty[2] <= 0.5;
    for (std::size_t x = 0; x < 3; ++x) {
        all = all && !legs_[x].commanded_high && !(legs_[x].blanking_left_s > 0.0) &&
              duty[x] > least && duty[x] < 1.0 - 2.0 * least;
    }
    return all;
}

std::span<const Segment> Inverter::schedule(const Duty &duty)
{
    if (parameters_.model == InverterModel::averaged) {
        segments_[0] = averaged_half(duty);
        segments_[1] = segments_[0];
        segment_count_ = 2;
    } else {
        schedule_switched({clamp01(duty[0]), clamp01(duty[1]), clamp01(duty[2])});
    }
    return {segments_.data(), segment_count_};
}

// Command edge at t: both switches off, the commanded one on a dead time later unless the next
// command comes first.
void Inverter::command(std::size_t leg, bool high, double t_s, double next_s)
{
    legs_[leg].commanded_high = high;
    legs_[leg].blanking_left_s = 0.0;
    const double on_s = t_s + parameters_.dead_time_s;
    if (parameters_.dead_time_s > 0.0) {
        events_[leg].add({t_s, 0.5, 0.5});
    }
    if (on_s >= period_s_) {
        legs_[leg].blanking_left_s = on_s - period_s_;
    } else if (on_s < next_s) {
        events_[leg].add({on_s, high ? 1.0 : 0.0, 0.0});
    }
}

void Inverter::plan_leg(std::size_t leg, double duty, Segment &start)
{
    const bool was_high = legs_[leg].commanded_high;
    const double blanking_s = legs_[leg].blanking_left_s;
    const bool switches = duty > 0.0 && duty < 1.0;
    const double up_s = 0.5 * period_s_ * (1.0 - duty);
    const double down_s = 0.5 * period_s_ * (1.0 + duty);
    const bool edge_at_crest = was_high != (duty >= 1.0);
    const double first_s = edge_at_crest ? 0.0 : (switches ? up_s : period_s_);

    start.level[leg] = was_high ? 1.0 : 0.0;
    start.dead[leg] = 0.0;
    if (blanking_s > 0.0) {
        start.level[leg] = 0.5;
        start.dead[leg] = 0.5;
        if (blanking_s < first_s) {
            legs_[leg].blanking_left_s = 0.0;
            events_[leg].add({blanking_s, was_high ? 1.0 : 0.0, 0.0});
        }
    }
    if (edge_at_crest) {
        command(leg, !was_high, 0.0, switches ? up_s : period_s_);
    }
    if (switches) {
        command(leg, true, up_s, down_s);
        command(leg, false, down_s, 2.0 * period_s_);
    }
}

// Number by number: a wider copy of what was just written would have to wait for it.
void Inverter::keep(const Segment &segment)
{
    Segment &kept = segments_[segment_count_++];
    for (std::size_t x = 0; x < 3; ++x) {
        kept.level[x] = segment.level[x];
        kept.dead[x] = segment.dead[x];
    }
    kept.h_s = segment.h_s;
}

void Inverter::schedule_switched(const Duty &duty)
{
    constexpr Event never{std::numeric_limits<double>::infinity(), 0.0, 0.0};
    Segment segment;
    std::array<const Event *, 3> next{};
    for (std::size_t leg = 0; leg < 3; ++leg) {
        events_[leg].count = 0;
        plan_leg(leg, duty[leg], segment);
        events_[leg].event[events_[leg].count] = never;
        next[leg] = events_[leg].event.data();
    }
    segment_count_ = 0;
    double t_s = 0.0;
    for (;;) {
        const std::size_t of_two = next[1]->t_s < next[0]->t_s ? 1 : 0;
        const std::size_t leg = next[2]->t_s < next[of_two]->t_s ? 2 : of_two;
        const Event &event = *next[leg]++;
        if (!(event.t_s < never.t_s)) {
            break;
        }
        if (event.t_s > t_s) {
            segment.h_s = event.t_s - t_s;
            keep(segment);
            t_s = event.t_s;
        }
        segment.level[leg] = event.level;
        segment.dead[leg] = event.dead;
    }
    segment.h_s = period_s_ - t_s;
    keep(segment);
}

} // namespace zh
