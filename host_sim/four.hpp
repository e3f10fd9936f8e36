// Four numbers and four space vectors side by side, by the compiler's vector types.
#ifndef ZH_FOUR_HPP
#define ZH_FOUR_HPP

#include <cstdint>

namespace zh {

using Four = double __attribute__((vector_size(32)));
using Mask = std::int64_t __attribute__((vector_size(32))); // of a comparison: 0 or all bits
struct FourVec {
    Four alpha, beta;
};

} // namespace zh

#endif
