// exp and atan2 of the plant against the C library's.
#include "check.hpp"
#include "elementary.hpp"

#include <numbers>

namespace {

constexpr double pi = std::numbers::pi;

void exp_is_that_of_the_c_library()
{
    for (double x = -690.0; x < 690.0; x += 0.0371) {
        CHECK_RELATIVE(zh::portable_exp(x), std::exp(x), 1e-15);
    }
    for (double x = 1e-12; x < 1.0; x *= 1.07) {
        CHECK_RELATIVE(zh::portable_exp(x), std::exp(x), 1e-15);
        CHECK_RELATIVE(zh::portable_exp(-x), std::exp(-x), 1e-15);
    }
    CHECK(!(zh::portable_exp(0.0) < 1.0) && !(zh::portable_exp(0.0) > 1.0));
    CHECK(std::isfinite(zh::portable_exp(1e9)) && zh::portable_exp(-1e9) > 0.0);
}

void atan2_is_that_of_the_c_library()
{
    for (const double length : {1e-200, 1e-4, 1.0, 1e200}) {
        for (int k = -100000; k <= 100000; ++k) {
            const double angle = pi * k / 100000.0;
            const double x = length * std::cos(angle);
            const double y = length * std::sin(angle);
            CHECK_NEAR(zh::portable_atan2(y, x), std::atan2(y, x), 1e-15);
        }
    }
    for (double small = 1.0; small > 1e-300; small *= 0.3) {
        CHECK_RELATIVE(zh::portable_atan2(small, 1.0), std::atan2(small, 1.0), 1e-15);
        CHECK_NEAR(zh::portable_atan2(-1.0, -small), std::atan2(-1.0, -small), 1e-15);
    }
}

void sin_is_that_of_the_c_library()
{
    for (int k = -100000; k <= 100000; ++k) {
        const double turns = k / 20000.0;
        CHECK_NEAR(zh::portable_sin(turns), std::sin(2.0 * pi * std::remainder(turns, 1.0)), 1e-15);
    }
}

void atan2_on_the_axes()
{
    CHECK_NEAR(zh::portable_atan2(0.0, 0.0), 0.0, 0.0);
    CHECK_NEAR(zh::portable_atan2(0.0, 2.0), 0.0, 0.0);
    CHECK_NEAR(zh::portable_atan2(2.0, 0.0), 0.5 * pi, 0.0);
    CHECK_NEAR(zh::portable_atan2(-2.0, 0.0), -0.5 * pi, 0.0);
    CHECK_NEAR(zh::portable_atan2(0.0, -2.0), pi, 0.0);
}

} // namespace

int main()
{
    return check::run({{"exp is that of the C library", exp_is_that_of_the_c_library},
                       {"sin is that of the C library", sin_is_that_of_the_c_library},
                       {"atan2 is that of the C library", atan2_is_that_of_the_c_library},
                       {"atan2 on the axes", atan2_on_the_axes}});
}
