/* What an application leaves for the loader below it before it resets: wait for an update.
 *
 * Two words, lowest in RAM: the application has the guard below its stack there, the loader nothing
 * else. A reset keeps them; what a power-up leaves there is taken for them once in 2^64 times.
 */
#ifndef BOOT_CALL_H
#define BOOT_CALL_H

#include <stdbool.h>
#include <stdint.h>

#define BOOT_CALL       0x4C4C4143u /* "CALL" */
#define BOOT_CALL_WORDS 2u

static inline void boot_call(volatile uint32_t *mark)
{
    mark[0] = BOOT_CALL;
    mark[1] = ~BOOT_CALL;
}

/* True once. */
static inline bool boot_called(volatile uint32_t *mark)
{
    const uint32_t first = mark[0];
    const uint32_t second = mark[1];
    mark[0] = 0u;
    mark[1] = 0u;
    return (first == BOOT_CALL) && (second == ~BOOT_CALL);
}

#endif
