#include "signal_hash.hpp"

#include <bit>

namespace zh {
namespace {

// For a fixed word a one-to-one map of the hash and for a fixed hash one of the word: of two
// sequences that differ in one place the hashes differ.
constexpr std::uint64_t folded(std::uint64_t hash, std::uint32_t word)
{
    constexpr std::uint64_t golden_ratio = 0x9e3779b97f4a7c15U;
    const std::uint64_t mixed = ((hash ^ word) + golden_ratio) * golden_ratio;
    return mixed ^ (mixed >> 32U);
}

constexpr std::uint32_t word_of(float value)
{
    constexpr std::uint32_t not_a_number = 0x7fc00000U;
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return (bits & 0x7fffffffU) > 0x7f800000U ? not_a_number : bits;
}

} // namespace

void fold_signals(const unit_t &unit, const hal_output_t &output, SignalHashes &hashes)
{
    const unit_t *const a = &unit;
    const hal_output_t *const o = &output;
    const std::array<std::uint32_t, signal_count> words{
#define SIGNAL_F(name, path, text)  word_of(a->path),
#define SIGNAL_U(name, path, text)  a->path,
#define SIGNAL_OF(name, path, text) word_of(o->path),
#define SIGNAL_OU(name, path, text) (o->path ? 1u : 0u),
#define SIGNAL_X(name, value, text) (value),
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
    };
    for (std::size_t k = 0; k < signal_count; ++k) {
        hashes[k] = folded(hashes[k], words[k]);
    }
}

} // namespace zh
