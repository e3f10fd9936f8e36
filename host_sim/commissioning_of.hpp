// The firmware's result of commissioning as the C interface shows it.
#ifndef ZH_COMMISSIONING_OF_HPP
#define ZH_COMMISSIONING_OF_HPP

#include <algorithm>

#include "firmware_headers.hpp"
#include "sil.h"

namespace zh {

inline zh_commissioning commissioning_of(bool done, commissioning_refusal_t refusal,
                                         const commissioning_result_t &r)
{
    static_assert(ZH_COMMISSIONING_LEVELS == COMMISSIONING_LEVELS);
    zh_commissioning c{};
    c.done = done ? 1U : 0U;
    c.refusal = static_cast<std::uint32_t>(refusal);
    c.Rs_ohm = r.Rs_ohm;
    c.lost_V = r.lost_V;
    c.sigma_Ls_H = r.sigma_Ls_H;
    c.Rr_gamma_ohm = r.Rr_gamma_ohm;
    c.M_gamma_H = r.M_gamma_H;
    c.bias_A = r.bias_A;
    std::copy_n(r.level_A, COMMISSIONING_LEVELS, c.level_A);
    std::copy_n(r.flux_Wb, COMMISSIONING_LEVELS, c.flux_Wb);
    std::copy_n(r.error_V, COMMISSIONING_LEVELS, c.error_V);
    return c;
}

} // namespace zh

#endif
