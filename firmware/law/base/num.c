#include "num.h"

bool all_finite(const float *x, size_t n)
{
    bool all = true;
    for (size_t k = 0u; k < n; k++) {
        all = all && is_finite(x[k]);
    }
    return all;
}

bool all_positive(const float *x, size_t n)
{
    bool all = true;
    for (size_t k = 0u; k < n; k++) {
        all = all && positivef(x[k]);
    }
    return all;
}

bool nonnegativef(float x)
{
    return (float_bits(x) < NUM_BITS_OF_INFINITY) || (float_bits(x) == NUM_BITS_OF_MINUS_0);
}

bool all_nonnegative(const float *x, size_t n)
{
    bool all = true;
    for (size_t k = 0u; k < n; k++) {
        all = all && nonnegativef(x[k]);
    }
    return all;
}
