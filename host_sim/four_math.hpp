// The operations of space_vector.hpp, four times: vector code for any machine. For a file whose
// functions are all inlined: how vectors are passed depends on the instruction set.
#ifndef ZH_FOUR_MATH_HPP
#define ZH_FOUR_MATH_HPP

#include "four.hpp"

#define ZH_INLINE [[gnu::always_inline]] inline

namespace zh {

ZH_INLINE Mask bits(const Four &x)
{
    return reinterpret_cast<Mask>(x);
}
ZH_INLINE Four absolute(const Four &x)
{
    return reinterpret_cast<Four>(bits(x) & INT64_MAX);
}
ZH_INLINE Four with_sign(const Four &x, const Four &sign)
{
    return reinterpret_cast<Four>((bits(x) & INT64_MAX) | (bits(sign) & INT64_MIN));
}
ZH_INLINE bool any(const Mask &m)
{
    return (m[0] | m[1] | m[2] | m[3]) != 0;
}
ZH_INLINE Four all(double x)
{
    return Four{x, x, x, x};
}
ZH_INLINE Four dot(const FourVec &a, const FourVec &b)
{
    return a.alpha * b.alpha + a.beta * b.beta;
}
ZH_INLINE Four cross(const FourVec &a, const FourVec &b)
{
    return a.alpha * b.beta - a.beta * b.alpha;
}
ZH_INLINE FourVec sum(const FourVec &a, const FourVec &b)
{
    return {a.alpha + b.alpha, a.beta + b.beta};
}
ZH_INLINE FourVec difference(const FourVec &a, const FourVec &b)
{
    return {a.alpha - b.alpha, a.beta - b.beta};
}
ZH_INLINE FourVec times(const Four &k, const FourVec &a)
{
    return {k * a.alpha, k * a.beta};
}
ZH_INLINE FourVec choose(const Mask &m, const FourVec &a, const FourVec &b)
{
    return {m ? a.alpha : b.alpha, m ? a.beta : b.beta};
}

} // namespace zh

#endif
