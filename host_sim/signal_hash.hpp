// One hash per traced signal of the firmware over every control period of a run, for `zh golden`.
//
// A hash depends on the signal's values and their order alone: not on its name, its number or the
// struct it is kept in. Equal bits give equal hashes; every NaN counts as the same one.
#ifndef ZH_SIGNAL_HASH_HPP
#define ZH_SIGNAL_HASH_HPP

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware_headers.hpp"

namespace zh {

constexpr std::size_t signal_count = UNIT_SIGNALS;
using SignalHashes = std::array<std::uint64_t, signal_count>;

// Folds the signals of one control period into the hashes of the periods before, 0 at first.
void fold_signals(const unit_t &unit, const hal_output_t &output, SignalHashes &hashes);

} // namespace zh

#endif
