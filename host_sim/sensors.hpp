// Sensors and ADC: from true currents and voltages to the six words the firmware sees.
//
// Line voltages pass a second-order low-pass, y'' + 2 D wc y' + wc^2 y = wc^2 u, propagated exactly
// while u is constant. measured = gain x true + offset + noise, then rounded and clipped to the
// ADC.
#ifndef ZH_SENSORS_HPP
#define ZH_SENSORS_HPP

#include <array>
#include <cstdint>

#include "board.hpp"
#include "noise.hpp"
#include "space_vector.hpp"

namespace zh {

struct SensorParameters {
    Phases current_offset_A{0.0, 0.0, 0.0};
    Phases current_gain{1.0, 1.0, 1.0};
    double current_noise_A = 0.0;
    std::array<double, 2> voltage_offset_V{0.0, 0.0}; // u_uv, u_vw
    std::array<double, 2> voltage_gain{1.0, 1.0};
    double voltage_noise_V = 0.0;
    double dc_gain = 1.0;
    double dc_offset_V = 0.0;
    double dc_noise_V = 0.0;
};

// The order of the firmware's sample.
struct Words {
    std::uint16_t i_u = 0, i_v = 0, i_w = 0;
    std::uint16_t u_uv = 0, u_vw = 0;
    std::uint16_t u_dc = 0;
};

// exp(A wc h) of the filter, A = [0 1; -1 -2D] in the states output and slope / wc: since
// A^2 = -2D A - I it is p I + q A.
struct FilterTransition {
    double p, q;
    double r; // p - 2 D q
};

// Both line-voltage filters: output and slope / wc.
struct LineVoltages {
    double uv_V = 0.0, uv_slope_V = 0.0;
    double vw_V = 0.0, vw_slope_V = 0.0;
};

// One step with constant inputs.
constexpr LineVoltages filtered(const LineVoltages &y, const FilterTransition &e, double u_uv_V,
                                double u_vw_V)
{
    const double a = y.uv_V - u_uv_V;
    const double b = y.vw_V - u_vw_V;
    return {u_uv_V + e.p * a + e.q * y.uv_slope_V, e.r * y.uv_slope_V - e.q * a,
            u_vw_V + e.p * b + e.q * y.vw_slope_V, e.r * y.vw_slope_V - e.q * b};
}

// The transition over any part of a control period, without a branch: the series of p and q in h/16
// up to its eighth power, squared four times.
struct TransitionSeries {
    using Coefficients = std::array<double, 9>;
    Coefficients p, q;
    double twice_damping;

    FilterTransition operator()(double h_s) const
    {
        return transition(doubled(doubled(doubled(doubled({sum(p, h_s), sum(q, h_s)})))));
    }

private:
    struct Pair {
        double p, q;
    };
    static double sum(const Coefficients &c, double x)
    {
        const double upper = c[4] + x * (c[5] + x * (c[6] + x * (c[7] + x * c[8])));
        return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * upper)));
    }
    // (p I + q A)^2
    Pair doubled(Pair e) const
    {
        return {e.p * e.p - e.q * e.q, e.q * (2.0 * e.p - twice_damping * e.q)};
    }
    FilterTransition transition(Pair e) const
    {
        return {e.p, e.q, e.p - twice_damping * e.q};
    }
};

class LineVoltageFilter {
public:
    // The period bounds the time a series has to cover; longer ones go the long way.
    LineVoltageFilter(double cutoff_Hz, double damping, double period_s = 0.0);
    // Exact transition over any h.
    FilterTransition transition(double h_s) const;
    // The same over h up to the period, cheap enough for every switching interval.
    FilterTransition part_of_period(double h_s) const
    {
        return series_fits_ ? series_(h_s) : transition(h_s);
    }
    void advance(const FilterTransition &e, double u_uv_V, double u_vw_V)
    {
        y_ = filtered(y_, e, u_uv_V, u_vw_V);
    }
    double u_uv_V() const
    {
        return y_.uv_V;
    }
    double u_vw_V() const
    {
        return y_.vw_V;
    }
    const LineVoltages &state() const
    {
        return y_;
    }
    void set_state(const LineVoltages &y)
    {
        y_ = y;
    }
    bool series_fits() const
    {
        return series_fits_;
    }
    const TransitionSeries &series() const
    {
        return series_;
    }

private:
    double cutoff_rad_s_;
    double damping_;
    TransitionSeries series_{};
    bool series_fits_ = false;
    LineVoltages y_;
};

// The words before the converter's range clips them, in the same order.
using Codes = std::array<std::int32_t, 6>;

// Far beyond every converter, so that the gain of a broken sensor finds what its amplifier saw.
inline constexpr double widest_code = 1 << 24;

// One channel, in units of one code: measured = gain x true + offset + noise x draw, rounded.
struct Channel {
    double gain;
    double offset; // includes the code of zero and the half that turns truncation into rounding
    double noise;
};
constexpr std::int32_t wide_code(const Channel &channel, double value, double draw)
{
    const double measured = (channel.gain * value + channel.offset) + channel.noise * draw;
    // NaN reads the least, like a broken wire.
    const double raised = measured > -widest_code ? measured : -widest_code;
    const double bounded = raised < widest_code ? raised : widest_code;
    const auto whole = static_cast<std::int32_t>(bounded);
    return whole - (bounded < static_cast<double>(whole) ? 1 : 0);
}

constexpr std::uint16_t clipped(std::int32_t code, std::int32_t top_code)
{
    const std::int32_t raised = code > 0 ? code : 0;
    return static_cast<std::uint16_t>(raised < top_code ? raised : top_code);
}

constexpr Words clipped(const Codes &codes, std::int32_t top_code)
{
    return {clipped(codes[0], top_code), clipped(codes[1], top_code), clipped(codes[2], top_code),
            clipped(codes[3], top_code), clipped(codes[4], top_code), clipped(codes[5], top_code)};
}

class Sensors {
public:
    Sensors(const SensorParameters &parameters, const Board &board, std::uint64_t seed);

    Codes sample(const Phases &i_A, double u_uv_V, double u_vw_V, double u_dc_V);

    // In the order of the words.
    const std::array<Channel, 6> &channels() const
    {
        return channels_;
    }
    const NoiseSource &noise() const
    {
        return noise_;
    }
    // Samples taken side by side with others (plant_lanes.cpp) have drawn from it.
    void set_noise(const NoiseSource &noise)
    {
        noise_ = noise;
    }

private:
    std::array<Channel, 6> channels_{};
    bool noisy_;
    NoiseSource noise_;
};

} // namespace zh

#endif
