// sin(2 pi f t) in the middle of control periods, some periods ahead: side by side their series run
// together, one after the other each would wait for the one before.
#ifndef ZH_SINE_AHEAD_HPP
#define ZH_SINE_AHEAD_HPP

#include <array>
#include <cstddef>
#include <cstdint>

#include "elementary.hpp"

namespace zh {

class SineAhead {
public:
    // portable_sin(f_Hz * (step * period_s + 0.5 * period_s)), f_Hz and period_s always the same.
    double operator()(std::uint64_t step, double f_Hz, double period_s)
    {
        if (step - first_ >= known_) {
            fill(step, f_Hz, period_s);
        }
        return sine_[static_cast<std::size_t>(step - first_)];
    }

private:
    static constexpr std::size_t count = 8;

    void fill(std::uint64_t step, double f_Hz, double period_s)
    {
        std::array<double, count> turns{};
        for (std::size_t n = 0; n < count; ++n) {
            turns[n] = f_Hz * (static_cast<double>(step + n) * period_s + 0.5 * period_s);
        }
        portable_sines(turns, sine_);
        first_ = step;
        known_ = count;
    }

    std::uint64_t first_ = 0;
    std::uint64_t known_ = 0; // so many from first_ on
    std::array<double, count> sine_{};
};

} // namespace zh

#endif
