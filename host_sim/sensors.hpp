// Sensors and ADC: from true currents and voltages to the six words the firmware sees.
//
// Line voltages pass a second-order low-pass, y'' + 2 D wc y' + wc^2 y = wc^2 u, propagated exactly
// while u is constant. measured = gain x true + offset + noise, then rounded and clipped to the
// ADC.
#ifndef ZH_SENSORS_HPP
#define ZH_SENSORS_HPP

#include <array>
#include <cstdint>

#include <Eigen/Core>

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

// Both line-voltage filters: column 0 is u_uv, column 1 u_vw; rows are output and slope / wc.
class LineVoltageFilter {
public:
    using Transition = Eigen::Matrix2d;

    LineVoltageFilter(double cutoff_Hz, double damping);
    // Exact transition over h; cheap enough for every switching interval.
    Transition transition(double h_s) const;
    void advance(const Transition &e, double u_uv_V, double u_vw_V)
    {
        const double a = x_(0, 0) - u_uv_V;
        const double b = x_(0, 1) - u_vw_V;
        const double slope_a = x_(1, 0);
        const double slope_b = x_(1, 1);
        x_(0, 0) = u_uv_V + e(0, 0) * a + e(0, 1) * slope_a;
        x_(1, 0) = e(1, 0) * a + e(1, 1) * slope_a;
        x_(0, 1) = u_vw_V + e(0, 0) * b + e(0, 1) * slope_b;
        x_(1, 1) = e(1, 0) * b + e(1, 1) * slope_b;
    }
    double u_uv_V() const
    {
        return x_(0, 0);
    }
    double u_vw_V() const
    {
        return x_(0, 1);
    }

private:
    double cutoff_rad_s_;
    double damping_;
    Eigen::Matrix2d x_ = Eigen::Matrix2d::Zero();
};

class Sensors {
public:
    Sensors(const SensorParameters &parameters, const Board &board, std::uint64_t seed);

    Words sample(const Phases &i_A, double u_uv_V, double u_vw_V, double u_dc_V);

private:
    // In units of one code: measured = gain x true + offset + noise x draw, rounded and clipped.
    struct Channel {
        double gain;
        double offset; // includes the code of zero and the half that turns truncation into rounding
        double noise;
    };
    std::uint16_t code(const Channel &channel, double value, double draw) const
    {
        const double measured = (channel.gain * value + channel.offset) + channel.noise * draw;
        // NaN reads 0, like a broken wire.
        const double raised = measured > 0.0 ? measured : 0.0;
        const double bounded = raised < top_code_ ? raised : top_code_;
        return static_cast<std::uint16_t>(static_cast<int>(bounded));
    }

    std::array<Channel, 6> channels_{}; // in the order of the words
    double top_code_;
    bool noisy_;
    NoiseSource noise_;
};

} // namespace zh

#endif
