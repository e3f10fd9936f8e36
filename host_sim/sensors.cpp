#include "sensors.hpp"

#include <array>
#include <numbers>

namespace zh {

namespace {

// Of |A wc h/16|: the ninth power is then below 1e-13.
constexpr double series_reach = 0.13;

} // namespace

LineVoltageFilter::LineVoltageFilter(double cutoff_Hz, double damping, double period_s)
    : cutoff_rad_s_(2.0 * std::numbers::pi * cutoff_Hz), damping_(damping)
{
    // exp(A x) = sum of A^k x^k / k!, A^k = a I + b A: a, b -> -b, a - 2 D b.
    const double share = cutoff_rad_s_ / 16.0;
    series_fits_ = share * period_s * (1.0 + damping) <= series_reach;
    series_.twice_damping = 2.0 * damping;
    double a = 1.0;
    double b = 0.0;
    for (std::size_t k = 0; k < series_.p.size(); ++k) {
        series_.p[k] = a;
        series_.q[k] = b;
        const double scale = share / static_cast<double>(k + 1);
        const double a_next = -b * scale;
        b = (a - series_.twice_damping * b) * scale;
        a = a_next;
    }
}

// exp(B), B = [0 1; -1 -2D] theta, theta = wc h, as p I + q B since B^2 = -2 D theta B - theta^2 I:
// Taylor by Horner after halving, then squaring. No libm: the same bits everywhere.
FilterTransition LineVoltageFilter::transition(double h_s) const
{
    constexpr double small = 0.0625; // the eighth term is then below 1e-13
    constexpr std::array<double, 7> inverse{1.0 / 7, 1.0 / 6, 1.0 / 5, 1.0 / 4, 1.0 / 3, 0.5, 1.0};
    double theta = cutoff_rad_s_ * h_s;
    int halvings = 0;
    while (theta * (1.0 + damping_) > small && halvings < 40) {
        theta *= 0.5;
        ++halvings;
    }
    double theta2 = theta * theta;
    double trace = 2.0 * damping_ * theta;
    double p = 1.0;
    double q = 0.0;
    for (const double inv_k : inverse) {
        const double q_next = (p - trace * q) * inv_k;
        p = 1.0 - theta2 * q * inv_k;
        q = q_next;
    }
    for (; halvings > 0; --halvings) {
        // (p I + q B)^2, then in terms of the doubled B.
        const double q_next = q * (2.0 * p - trace * q);
        p = p * p - theta2 * q * q;
        q = 0.5 * q_next;
        theta *= 2.0;
        theta2 *= 4.0;
        trace *= 2.0;
    }
    return {p, q * theta, p - trace * q};
}

Sensors::Sensors(const SensorParameters &p, const Board &board, std::uint64_t seed) : noise_(seed)
{
    const double codes = static_cast<double>(1U << static_cast<unsigned>(board.adc_bits));
    const double middle = 0.5 * codes;
    const auto channel = [](double per_unit, double gain, double offset, double noise,
                            double zero_code) {
        return Channel{gain * per_unit, offset * per_unit + zero_code + 0.5, noise * per_unit};
    };
    const double per_A = middle / board.current_full_scale_A;
    const double per_V = middle / board.line_voltage_full_scale_V;
    const double per_dc_V = codes / board.dc_link_full_scale_V;
    for (std::size_t x = 0; x < 3; ++x) {
        channels_[x] =
            channel(per_A, p.current_gain[x], p.current_offset_A[x], p.current_noise_A, middle);
    }
    for (std::size_t x = 0; x < 2; ++x) {
        channels_[3 + x] =
            channel(per_V, p.voltage_gain[x], p.voltage_offset_V[x], p.voltage_noise_V, middle);
    }
    channels_[5] = channel(per_dc_V, p.dc_gain, p.dc_offset_V, p.dc_noise_V, 0.0);
    noisy_ = p.current_noise_A > 0.0 || p.voltage_noise_V > 0.0 || p.dc_noise_V > 0.0;
}

Codes Sensors::sample(const Phases &i_A, double u_uv_V, double u_vw_V, double u_dc_V)
{
    // One draw per channel and sample, whatever its size, so that channels do not shift each other.
    std::array<double, 6> draw{};
    if (noisy_) {
        for (double &value : draw) {
            value = noise_.gaussian();
        }
    }
    const std::array<Channel, 6> &c = channels_;
    return {wide_code(c[0], i_A[0], draw[0]), wide_code(c[1], i_A[1], draw[1]),
            wide_code(c[2], i_A[2], draw[2]), wide_code(c[3], u_uv_V, draw[3]),
            wide_code(c[4], u_vw_V, draw[4]), wide_code(c[5], u_dc_V, draw[5])};
}

} // namespace zh
