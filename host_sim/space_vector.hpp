// Space vectors of the plant: stationary frame, alpha + j beta, power invariant.
#ifndef ZH_SPACE_VECTOR_HPP
#define ZH_SPACE_VECTOR_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace zh {

using Phases = std::array<double, 3>; // u, v, w

// Written out rather than std::complex, whose product tests for NaN in the innermost loop.
struct Vec {
    double alpha = 0.0;
    double beta = 0.0;
};
constexpr Vec operator+(Vec a, Vec b)
{
    return {a.alpha + b.alpha, a.beta + b.beta};
}
constexpr Vec operator-(Vec a, Vec b)
{
    return {a.alpha - b.alpha, a.beta - b.beta};
}
constexpr Vec operator*(double k, Vec a)
{
    return {k * a.alpha, k * a.beta};
}
// j a
constexpr Vec turned_90(Vec a)
{
    return {-a.beta, a.alpha};
}
// Re(conj(a) b) and Im(conj(a) b)
constexpr double dot(Vec a, Vec b)
{
    return a.alpha * b.alpha + a.beta * b.beta;
}
constexpr double cross(Vec a, Vec b)
{
    return a.alpha * b.beta - a.beta * b.alpha;
}
inline double magnitude(Vec a)
{
    return std::sqrt(dot(a, a));
}

constexpr Phases without_common_mode(const Phases &v)
{
    const double mean = (v[0] + v[1] + v[2]) / 3.0;
    return {v[0] - mean, v[1] - mean, v[2] - mean};
}
inline double largest(const Phases &x)
{
    return std::max({std::abs(x[0]), std::abs(x[1]), std::abs(x[2])});
}

inline constexpr double sqrt_2_3 = 0.816496580927726032732428; // sqrt(2/3)
inline constexpr double inv_sqrt2 = 0.707106781186547524400844;
inline constexpr double rad_s_per_rpm = std::numbers::pi / 30.0;

constexpr Vec vec_from_phases(const Phases &x)
{
    return {sqrt_2_3 * (x[0] - 0.5 * (x[1] + x[2])), inv_sqrt2 * (x[1] - x[2])};
}
constexpr Phases phases_from_vec(Vec a)
{
    const double half_alpha = -0.5 * sqrt_2_3 * a.alpha;
    return {sqrt_2_3 * a.alpha, half_alpha + inv_sqrt2 * a.beta, half_alpha - inv_sqrt2 * a.beta};
}

} // namespace zh

#endif
