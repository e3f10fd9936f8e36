#include "siphash.h"

#define BLOCK_BYTES     8u
#define BLOCK_ROUNDS    2u
#define FINISH_ROUNDS   4u
#define FINISH_CONSTANT 0xFFu

typedef struct {
    uint64_t v0;
    uint64_t v1;
    uint64_t v2;
    uint64_t v3;
} sip_state_t;

static uint64_t rotate_left(uint64_t x, uint32_t bits)
{
    const uint32_t rest = 64u - bits;
    return (x << bits) | (x >> rest);
}

static void rounds(sip_state_t *s, uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        s->v0 += s->v1;
        s->v2 += s->v3;
        s->v1 = rotate_left(s->v1, 13u) ^ s->v0;
        s->v3 = rotate_left(s->v3, 16u) ^ s->v2;
        s->v0 = rotate_left(s->v0, 32u);
        s->v2 += s->v1;
        s->v0 += s->v3;
        s->v1 = rotate_left(s->v1, 17u) ^ s->v2;
        s->v3 = rotate_left(s->v3, 21u) ^ s->v0;
        s->v2 = rotate_left(s->v2, 32u);
    }
}

/* n <= 8 bytes, the missing ones zero. */
static uint64_t little_endian(const uint8_t *byte, size_t n)
{
    uint64_t word = 0u;
    for (size_t k = 0u; k < n; k++) {
        const size_t shift = 8u * k;
        word |= (uint64_t)byte[k] << shift;
    }
    return word;
}

static void absorb(sip_state_t *s, uint64_t block)
{
    s->v3 ^= block;
    rounds(s, BLOCK_ROUNDS);
    s->v0 ^= block;
}

uint64_t siphash_2_4(const uint8_t key[SIPHASH_KEY_BYTES], const uint8_t *message, size_t n)
{
    const uint64_t k0 = little_endian(key, BLOCK_BYTES);
    const uint64_t k1 = little_endian(&key[BLOCK_BYTES], BLOCK_BYTES);
    /* "somepseudorandomlygeneratedbytes" of the paper. */
    sip_state_t s = {.v0 = k0 ^ 0x736F6D6570736575u,
                     .v1 = k1 ^ 0x646F72616E646F6Du,
                     .v2 = k0 ^ 0x6C7967656E657261u,
                     .v3 = k1 ^ 0x7465646279746573u};
    const size_t whole = n - (n % BLOCK_BYTES);
    for (size_t k = 0u; k < whole; k += BLOCK_BYTES) {
        absorb(&s, little_endian(&message[k], BLOCK_BYTES));
    }
    /* The last block ends with the length, modulo 256. */
    absorb(&s, little_endian(&message[whole], n - whole) | ((uint64_t)n << 56u));
    s.v2 ^= FINISH_CONSTANT;
    rounds(&s, FINISH_ROUNDS);
    return s.v0 ^ s.v1 ^ s.v2 ^ s.v3;
}
