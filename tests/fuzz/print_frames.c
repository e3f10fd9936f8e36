/* `print_frames COUNT SEED SESSION`: random frames as bytes on stdout, for a line of another kind.
 */
#include <stdio.h>
#include <stdlib.h>

#include "random_frames.h"

int main(int argc, char **argv)
{
    if (argc != 4) {
        (void)fprintf(stderr, "usage: %s COUNT SEED SESSION\n", argv[0]);
        return 2;
    }
    const unsigned long count = strtoul(argv[1], NULL, 10);
    random_frames_t frames = {.seed = strtoul(argv[2], NULL, 10),
                              .session = (uint32_t)strtoul(argv[3], NULL, 10)};
    uint8_t wire[RANDOM_FRAME_MAX];
    for (unsigned long k = 0u; k < count; k++) {
        const uint32_t n = random_frame(&frames, wire);
        if (fwrite(wire, 1u, n, stdout) != n) {
            return 1;
        }
    }
    return 0;
}
