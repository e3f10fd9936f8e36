// Arrays of the C interface, whose elements have the size that the caller's header gave them.
#ifndef ZH_SIL_ARRAY_HPP
#define ZH_SIL_ARRAY_HPP

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "sil.h"

namespace zh {

// Elements lie struct_size of the first apart.
template <typename T> T *element(T *first, std::uint32_t k)
{
    using Void = std::conditional_t<std::is_const_v<T>, const void, void>;
    using Byte = std::conditional_t<std::is_const_v<T>, const std::byte, std::byte>;
    Void *at = reinterpret_cast<Byte *>(first) + std::size_t{k} * first->struct_size;
    return static_cast<T *>(at);
}

// Whether the signals to note exist. `caller` begins the text.
int record_status(const char *caller, const zh_sil_record *record);

// Notes them after a period. record may be NULL.
void note(const zh_sil &drive, const zh_sil_record *record, std::uint32_t period);

} // namespace zh

#endif
