#include "sensors.hpp"

#include <numbers>

namespace zh {

LineVoltageFilter::LineVoltageFilter(double cutoff_Hz, double damping)
    : cutoff_rad_s_(2.0 * std::numbers::pi * cutoff_Hz), damping_(damping)
{
}

// exp(B), B = [0 1; -1 -2D] theta, theta = wc h, as p I + q B since B^2 = -2 D theta B - theta^2 I:
// Taylor by Horner after halving, then squaring. No libm: the same bits everywhere.
LineVoltageFilter::Transition LineVoltageFilter::transition(double h_s) const
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
    Transition e;
    e << p, q * theta, -q * theta, p - trace * q;
    return e;
}

Sensors::Sensors(const SensorParameters &parameters, const Board &board, std::uint64_t seed)
    : parameters_(parameters), noise_(seed)
{
    const double codes = static_cast<double>(1U << static_cast<unsigned>(board.adc_bits));
    zero_code_ = 0.5 * codes;
    top_code_ = codes - 1.0;
    inv_current_lsb_A_ = zero_code_ / board.current_full_scale_A;
    inv_line_lsb_V_ = zero_code_ / board.line_voltage_full_scale_V;
    inv_dc_lsb_V_ = codes / board.dc_link_full_scale_V;
    noisy_ = parameters.current_noise_A > 0.0 || parameters.voltage_noise_V > 0.0 ||
             parameters.dc_noise_V > 0.0;
}

// Rounds to the nearest code; NaN reads 0, like a broken wire.
std::uint16_t Sensors::code(double lsb) const
{
    const double bounded = lsb > 0.0 ? (lsb < top_code_ ? lsb : top_code_) : 0.0;
    return static_cast<std::uint16_t>(static_cast<int>(bounded + 0.5));
}

Words Sensors::sample(const Phases &i_A, double u_uv_V, double u_vw_V, double u_dc_V)
{
    // One draw per channel and sample, whatever its size, so that channels do not shift each other.
    std::array<double, 6> n{};
    if (noisy_) {
        for (double &draw : n) {
            draw = noise_.gaussian();
        }
    }
    const SensorParameters &s = parameters_;
    const auto current = [&](std::size_t x) {
        const double measured =
            s.current_gain[x] * i_A[x] + s.current_offset_A[x] + s.current_noise_A * n[x];
        return code(measured * inv_current_lsb_A_ + zero_code_);
    };
    const auto line = [&](std::size_t x, double u_V) {
        const double measured =
            s.voltage_gain[x] * u_V + s.voltage_offset_V[x] + s.voltage_noise_V * n[3 + x];
        return code(measured * inv_line_lsb_V_ + zero_code_);
    };
    const double dc_V = s.dc_gain * u_dc_V + s.dc_offset_V + s.dc_noise_V * n[5];
    return {current(0),      current(1),      current(2),
            line(0, u_uv_V), line(1, u_vw_V), code(dc_V * inv_dc_lsb_V_)};
}

} // namespace zh
