// Seeded noise that is the same on every platform: integer arithmetic only.
#ifndef ZH_NOISE_HPP
#define ZH_NOISE_HPP

#include <array>
#include <bit>
#include <cstdint>

namespace zh {

// xoshiro256++ (Blackman and Vigna 2019), seeded through splitmix64 so that near seeds are far
// apart.
class NoiseSource {
public:
    explicit NoiseSource(std::uint64_t seed)
    {
        for (std::uint64_t &word : state_) {
            seed += 0x9e3779b97f4a7c15U;
            std::uint64_t z = seed;
            z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
            z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
            word = z ^ (z >> 31U);
        }
    }

    using State = std::array<std::uint64_t, 4>;
    // Goes on where another source stood.
    explicit NoiseSource(const State &state) : state_(state)
    {
    }
    const State &state() const
    {
        return state_;
    }

    std::uint64_t bits()
    {
        const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
        const std::uint64_t t = state_[1] << 17U;
        state_[2] ^= state_[0];
        state_[3] ^= state_[1];
        state_[1] ^= state_[2];
        state_[0] ^= state_[3];
        state_[2] ^= t;
        state_[3] = std::rotl(state_[3], 45);
        return result;
    }

    // Nearly Gaussian, mean 0, variance 1: the sum of the eight bytes of one word (excess kurtosis
    // -0.15, cut at 4.9 sigma). Costs a tenth of an exact transform; an ADC cannot tell.
    double gaussian()
    {
        constexpr std::uint64_t low_bytes = 0x00ff00ff00ff00ffU;
        constexpr double mean = 8.0 * 127.5;
        constexpr double inv_sigma = 1.0 / 209.0231247381284; // sqrt(8 (256^2 - 1) / 12)
        const std::uint64_t word = bits();
        const std::uint64_t pairs = (word & low_bytes) + ((word >> 8U) & low_bytes);
        const std::uint64_t two = pairs + (pairs >> 32U);
        const auto sum = static_cast<std::int32_t>((two + (two >> 16U)) & 0xffffU);
        return (static_cast<double>(sum) - mean) * inv_sigma;
    }

private:
    State state_{};
};

} // namespace zh

#endif
