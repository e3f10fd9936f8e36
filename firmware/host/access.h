/* Access control: who may act on the drive, and who may change which parameter. RUN at any time,
 * READY with the gates off, PROTECTED also unlocked.
 *
 * Challenge and response: the drive gives a nonce. The host answers SipHash-2-4 over a purpose and
 * the nonce (8 bytes, little endian) under the board's key. Purpose "zhopened" opens the session,
 * "zhunlock" also unlocks the protected parameters. A nonce serves one answer, right or wrong, and
 * expires. Three wrong answers lock out for a time. A shorter lock-out follows power-up, so that
 * cutting the power gains no free guess; nothing has to be stored for it.
 *
 * From then on requests are sealed: a counter that only rises, and a MAC over the whole request
 * under the session's key. That key is SipHash-2-4 of "zhsealed", the nonce and 0 or 1 (8 bytes)
 * for each half. A zeroed state is valid: locked, and in the lock-out after power-up.
 */
#ifndef ACCESS_H
#define ACCESS_H

#include "params.h"
#include "siphash.h"

#define ACCESS_FAILURES_MAX 3u

typedef struct {
    uint8_t key[SIPHASH_KEY_BYTES];
    bool key_usable;          /* false: never unlocks */
    uint32_t lockout_ticks;   /* lock-out after power-up and after three failures */
    uint32_t challenge_ticks; /* time limit of an answer */
    uint32_t unlocked_ticks;  /* locks again after this; closes after this long without a request */
} access_config_t;

typedef struct {
    uint64_t nonce;
    bool challenged;   /* a nonce waits for its answer */
    bool open;         /* sealed requests are taken */
    bool unlocked;     /* protected parameters too */
    uint32_t failures; /* in a row */
    uint32_t waited;   /* ticks of the lock-out */
    uint32_t age;      /* ticks since challenge or answer */
    uint32_t idle;     /* ticks since the last sealed request */
    uint32_t counter;  /* of the last sealed request */
    uint8_t session_key[SIPHASH_KEY_BYTES];
    uint32_t challenges; /* number so far: no nonce repeats, even with frozen entropy */
} access_t;

/* False, and the drive never unlocks: no key (NULL), a key of sixteen equal bytes (empty or erased
 * memory), or a time of 0. */
CHECKED bool access_init(access_config_t *cfg, const uint8_t *key, uint32_t lockout_ticks,
                         uint32_t challenge_ticks, uint32_t unlocked_ticks);

/* Once per tick of the clock that counts the times. */
void access_tick(const access_config_t *cfg, access_t *st);

/* A new nonce; the previous one becomes void. `entropy`: 64 bits that the port cannot repeat after
 * a power cycle (a hardware generator). A board without one gives NULL and does not unlock. */
CHECKED bool access_challenge(const access_config_t *cfg, access_t *st, const uint64_t *entropy,
                              uint64_t *nonce);

/* The host's answers to open a session and to unlock; for tests and hosts in C. */
uint64_t access_open_response(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce);
uint64_t access_response(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce);

/* The key that seals a session's requests. */
void access_session_key(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce,
                        uint8_t session_key[SIPHASH_KEY_BYTES]);

/* True: open, or also unlocked. The nonce is used up in any case; compares in constant time. */
CHECKED bool access_answer(const access_config_t *cfg, access_t *st, uint64_t response);

/* True once for a request made with the key in this session: the MAC fits the message with its
 * counter, and the counter is above the last one. */
CHECKED bool access_sealed(access_t *st, const uint8_t *message, size_t n, uint32_t counter,
                           uint64_t mac);

void access_lock(access_t *st);

/* The only way for a host to change a parameter: checks range, class, gates, lock. */
CHECKED params_status_t access_write(const access_t *st, params_t *params, size_t index,
                                     float value, bool gates_on);

#endif
