// exp, sin and atan2 with the same bits on every machine; C libraries differ in the last ones.
//
// Made of + - * / and the square root, which IEEE 754 rounds correctly, and of ldexp, which is
// exact. Within 1e-15 of the true value (tests/reference/test_elementary.cpp).
#ifndef ZH_ELEMENTARY_HPP
#define ZH_ELEMENTARY_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace zh {

// e^x; beyond |x| = 700 the value there, so that nothing overflows. x is a number.
inline double portable_exp(double x)
{
    constexpr double largest = 700.0;
    constexpr double ln2_high = 0x1.62e42feep-1; // few bits: its multiples are exact
    constexpr double ln2_low = 0x1.a39ef35793c76p-33;
    const double bounded = std::clamp(x, -largest, largest);
    const double doublings = std::floor(bounded / std::numbers::ln2 + 0.5);
    const double r = (bounded - doublings * ln2_high) - doublings * ln2_low; // |r| <= ln(2) / 2
    double sum = 1.0;
    for (int k = 14; k > 0; --k) { // Taylor; the next term is below 1e-19
        sum = 1.0 + sum * r / k;
    }
    return std::ldexp(sum, static_cast<int>(doublings));
}

// sin(2 pi turns) of several; the series of all go on together.
template <std::size_t count>
void portable_sines(const std::array<double, count> &turns, std::array<double, count> &sine)
{
    std::array<double, count> x{};
    std::array<double, count> sum{};
    for (std::size_t n = 0; n < count; ++n) {
        const double part = turns[n] - std::floor(turns[n] + 0.5); // -1/2 .. 1/2
        const double folded = std::abs(part) <= 0.25 ? part : std::copysign(0.5, part) - part;
        x[n] = 2.0 * std::numbers::pi * folded; // |x| <= pi / 2
        sum[n] = 1.0;
    }
    for (int k = 22; k > 0; k -= 2) { // Taylor; the next term is below 1e-19
        for (std::size_t n = 0; n < count; ++n) {
            sum[n] = 1.0 - sum[n] * x[n] * x[n] / (k * (k + 1));
        }
    }
    for (std::size_t n = 0; n < count; ++n) {
        sine[n] = x[n] * sum[n];
    }
}

// sin(2 pi turns).
inline double portable_sin(double turns)
{
    std::array<double, 1> sine{};
    portable_sines<1>({turns}, sine);
    return sine[0];
}

// Angle of the point (x, y), -pi .. pi; 0 at the origin. x and y are finite.
inline double portable_atan2(double y, double x)
{
    constexpr std::array<double, 11> inverse{1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15,
                                             1.0 / 13, 1.0 / 11, 1.0 / 9,  1.0 / 7,
                                             1.0 / 5,  1.0 / 3,  1.0};
    const double abs_x = std::abs(x);
    const double abs_y = std::abs(y);
    const double longer = std::max(abs_x, abs_y);
    const double tangent = longer > 0.0 ? std::min(abs_x, abs_y) / longer : 0.0;
    // At most 45 degrees, halved twice: the series converges by a factor of 25 per term.
    const double half = tangent / (1.0 + std::sqrt(1.0 + tangent * tangent));
    const double t = half / (1.0 + std::sqrt(1.0 + half * half));
    double sum = 0.0;
    for (const double inv_k : inverse) { // 1 - t^2 / 3 + t^4 / 5 ...
        sum = inv_k - t * t * sum;
    }
    double angle = 4.0 * t * sum;
    angle = abs_y > abs_x ? 0.5 * std::numbers::pi - angle : angle;
    angle = x < 0.0 ? std::numbers::pi - angle : angle;
    return std::copysign(angle, y);
}

} // namespace zh

#endif
