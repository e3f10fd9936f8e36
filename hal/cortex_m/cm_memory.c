/* memcpy and memset, which the compiler calls for structs: whole words first, in the few bytes of
 * flash that the C library's faster ones would take ten times. */
#include <stddef.h>
#include <stdint.h>

void *memcpy(void *restrict to, const void *restrict from, size_t n);
void *memset(void *to, int value, size_t n);

static size_t whole_words(uintptr_t addresses, size_t n)
{
    return (addresses % 4u == 0u) ? (n / 4u) : 0u;
}

void *memcpy(void *restrict to, const void *restrict from, size_t n)
{
    const size_t words = whole_words((uintptr_t)to | (uintptr_t)from, n);
    for (size_t k = 0u; k < words; k++) {
        ((uint32_t *)to)[k] = ((const uint32_t *)from)[k];
    }
    for (size_t k = 4u * words; k < n; k++) {
        ((uint8_t *)to)[k] = ((const uint8_t *)from)[k];
    }
    return to;
}

void *memset(void *to, int value, size_t n)
{
    const uint32_t byte = (uint32_t)value & 0xFFu;
    const size_t words = whole_words((uintptr_t)to, n);
    const uint32_t word = 0x01010101u * byte;
    uint32_t *at = to;
    size_t left = words;
    while (left >= 8u) { /* a drive's state is some hundred words, zeroed in a control period */
        at[0] = word;
        at[1] = word;
        at[2] = word;
        at[3] = word;
        at[4] = word;
        at[5] = word;
        at[6] = word;
        at[7] = word;
        at += 8;
        left -= 8u;
    }
    while (left > 0u) {
        *at = word;
        at++;
        left--;
    }
    for (size_t k = 4u * words; k < n; k++) {
        ((uint8_t *)to)[k] = (uint8_t)byte;
    }
    return to;
}
