// What the functions of sil.h share: the handle, and how structs of any version are written.
#ifndef ZH_SIL_HANDLE_HPP
#define ZH_SIL_HANDLE_HPP

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "firmware.hpp"
#include "sil.h"

namespace zh {
// Before the first period.
inline constexpr hal_output_t no_output{0.5F, 0.5F, 0.5F, false, false};
} // namespace zh

struct zh_sil {
    zh::Firmware firmware;
    params_t opened; // parameters at zh_sil_open
    std::uint32_t steps = 0;
    hal_output_t output = zh::no_output;
};

namespace zh {

// Writes what the caller's struct has room for, its struct_size untouched.
template <typename T> void hand_out(const T &value, T *out)
{
    const std::size_t size = std::min<std::size_t>(out->struct_size, sizeof value);
    constexpr std::size_t head = sizeof value.struct_size;
    std::memcpy(reinterpret_cast<std::byte *>(out) + head,
                reinterpret_cast<const std::byte *>(&value) + head, size - head);
}

// One period. broken: the board's comparator has opened the gates. *out is written whole.
int step(zh_sil &drive, const zh_sil_in &in, bool broken, zh_sil_out &out);

// One signal of the last period, by its number.
double signal_value(const zh_sil &drive, std::uint32_t index);

} // namespace zh

#endif
