/* Who may change which parameter: RUN at any time, READY with the gates off, PROTECTED also
 * unlocked.
 *
 * Unlocking is challenge and response: the drive gives a nonce, the host answers SipHash-2-4 over
 * "zhunlock" and the nonce (8 bytes, little endian) under the board's key. A nonce serves one
 * answer, right or wrong, and expires. Three wrong answers lock out for a time. The time also runs
 * from power-up, so that cutting the power shortens no lock-out; nothing has to be stored for it.
 * A zeroed state is valid: locked, and in that first waiting time.
 */
#ifndef ACCESS_H
#define ACCESS_H

#include "params.h"
#include "siphash.h"

#define ACCESS_FAILURES_MAX 3u

typedef struct {
    uint8_t key[SIPHASH_KEY_BYTES];
    bool key_usable;          /* false: never unlocks */
    uint32_t lockout_ticks;   /* no challenge for so long after power-up and after three failures */
    uint32_t challenge_ticks; /* an answer has to come within */
    uint32_t unlocked_ticks;  /* locks by itself after */
} access_config_t;

typedef struct {
    uint64_t nonce;
    bool challenged; /* the nonce waits for its answer */
    bool unlocked;
    uint32_t failures;   /* in a row */
    uint32_t waited;     /* ticks of the lock-out */
    uint32_t age;        /* ticks since challenge or unlock */
    uint32_t challenges; /* so far: no nonce twice, even if the entropy stands still */
} access_t;

/* False, and the drive never unlocks: no key (NULL), one of sixteen equal bytes (what an empty or
 * an erased memory holds), or a time of 0. */
CHECKED bool access_init(access_config_t *cfg, const uint8_t *key, uint32_t lockout_ticks,
                         uint32_t challenge_ticks, uint32_t unlocked_ticks);

/* Once per tick of whatever clock the times are counted in. */
void access_tick(const access_config_t *cfg, access_t *st);

/* A fresh nonce; the one before it is void. `entropy`: 64 bits that the port cannot repeat after a
 * power cycle (a hardware generator); a board without one gives NULL and does not unlock. */
CHECKED bool access_challenge(const access_config_t *cfg, access_t *st, const uint64_t *entropy,
                              uint64_t *nonce);

/* What the host has to answer; here for tests and for hosts in C. */
uint64_t access_response(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce);

/* True: unlocked. The nonce is used up either way; compares in constant time. */
CHECKED bool access_answer(const access_config_t *cfg, access_t *st, uint64_t response);

void access_lock(access_t *st);

/* The one way by which a host changes a parameter: range, class, gates, lock. */
CHECKED params_status_t access_write(const access_t *st, params_t *params, size_t index,
                                     float value, bool gates_on);

#endif
