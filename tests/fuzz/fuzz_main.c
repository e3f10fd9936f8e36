/* A fuzz target with any compiler: seeded random inputs, `<target>_sample COUNT SEED`. */
#include <stdio.h>
#include <stdlib.h>

#include "fuzz_link.h"

#define INPUT_MAX 600u

/* 64-bit LCG, high bits. */
static uint32_t next_random(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*seed >> 33);
}

/* Random bytes with many zeros, op numbers and repetitions among them: pure noise meets little. */
static size_t random_input(uint64_t *seed, uint8_t *data)
{
    static const uint8_t ops[] = {1,    2,    3,    4,    0x10, 0x11, 0x20,
                                  0x21, 0x22, 0x23, 0x30, 0x31, 0x40, 0x43};
    const size_t n = next_random(seed) % INPUT_MAX;
    const uint32_t flavour = next_random(seed) % 4u;
    for (size_t k = 0u; k < n; k++) {
        const uint32_t r = next_random(seed);
        if (((r >> 8) % 4u) < flavour) {
            data[k] = (r & 1u) != 0u ? ops[(r >> 12) % sizeof ops] : (uint8_t)((r >> 12) % 3u);
        } else {
            data[k] = (uint8_t)(r >> 16);
        }
    }
    return n;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        (void)fprintf(stderr, "usage: %s COUNT SEED\n", argv[0]);
        return 2;
    }
    const unsigned long count = strtoul(argv[1], NULL, 10);
    uint64_t seed = strtoul(argv[2], NULL, 10);
    static uint8_t data[INPUT_MAX];
    for (unsigned long k = 0u; k < count; k++) {
        (void)LLVMFuzzerTestOneInput(data, random_input(&seed, data));
    }
    (void)printf("%lu inputs\n", count);
    return 0;
}
