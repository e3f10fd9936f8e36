#include "access.h"

#define WORD_BYTES   8u
#define ANSWER_BYTES 16u /* purpose, nonce */
#define NONCE_BYTES  24u /* purpose, entropy, count */
#define SEAL_BYTES   24u /* purpose, nonce, half */
#define COUNT_AT     16u

/* What a message is for, so that no MAC serves as another: "zhnonce", "zhopened", ... */
#define FOR_NONCE  0x0065636E6F6E687Au
#define FOR_OPEN   0x64656E65706F687Au
#define FOR_UNLOCK 0x6B636F6C6E75687Au
#define FOR_SEAL   0x64656C616573687Au

static void put_little_endian(uint8_t *to, uint64_t word)
{
    for (uint32_t k = 0u; k < WORD_BYTES; k++) {
        const uint32_t shift = 8u * k;
        to[k] = (uint8_t)(word >> shift);
    }
}

static bool usable(const uint8_t *key)
{
    uint8_t different = 0u;
    for (uint32_t k = 1u; k < SIPHASH_KEY_BYTES; k++) {
        different |= (uint8_t)(key[k] ^ key[0]);
    }
    return different != 0u;
}

bool access_init(access_config_t *cfg, const uint8_t *key, uint32_t lockout_ticks,
                 uint32_t challenge_ticks, uint32_t unlocked_ticks)
{
    *cfg = (access_config_t){.lockout_ticks = lockout_ticks,
                             .challenge_ticks = challenge_ticks,
                             .unlocked_ticks = unlocked_ticks};
    if ((key == NULL) || (lockout_ticks == 0u) || (challenge_ticks == 0u) ||
        (unlocked_ticks == 0u)) {
        return false;
    }
    for (uint32_t k = 0u; k < SIPHASH_KEY_BYTES; k++) {
        cfg->key[k] = key[k];
    }
    cfg->key_usable = usable(key);
    return cfg->key_usable;
}

void access_lock(access_t *st)
{
    st->open = false;
    st->unlocked = false;
    st->challenged = false;
    st->nonce = 0u;
    st->age = 0u;
    st->idle = 0u;
    st->counter = 0u;
    for (uint32_t k = 0u; k < SIPHASH_KEY_BYTES; k++) {
        st->session_key[k] = 0u;
    }
}

void access_tick(const access_config_t *cfg, access_t *st)
{
    if (st->waited < cfg->lockout_ticks) {
        st->waited++;
    }
    st->age++;
    st->idle++;
    if (st->age >= cfg->unlocked_ticks) {
        st->unlocked = false;
    }
    if ((st->open && (st->idle >= cfg->unlocked_ticks)) ||
        (st->challenged && (st->age >= cfg->challenge_ticks))) {
        access_lock(st);
    }
}

bool access_challenge(const access_config_t *cfg, access_t *st, const uint64_t *entropy,
                      uint64_t *nonce)
{
    access_lock(st);
    if (!cfg->key_usable || (entropy == NULL) || (st->waited < cfg->lockout_ticks)) {
        return false;
    }
    uint8_t message[NONCE_BYTES];
    put_little_endian(message, FOR_NONCE);
    put_little_endian(&message[WORD_BYTES], *entropy);
    put_little_endian(&message[COUNT_AT], st->challenges);
    /* Under the key: a weak generator shows nothing of its state, and cannot be steered. */
    st->nonce = siphash_2_4(cfg->key, message, sizeof message);
    st->challenges++;
    st->challenged = true;
    *nonce = st->nonce;
    return true;
}

static uint64_t answer_for(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t purpose, uint64_t nonce)
{
    uint8_t message[ANSWER_BYTES];
    put_little_endian(message, purpose);
    put_little_endian(&message[WORD_BYTES], nonce);
    return siphash_2_4(key, message, sizeof message);
}

uint64_t access_open_response(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce)
{
    return answer_for(key, FOR_OPEN, nonce);
}

uint64_t access_response(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce)
{
    return answer_for(key, FOR_UNLOCK, nonce);
}

void access_session_key(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce,
                        uint8_t session_key[SIPHASH_KEY_BYTES])
{
    uint8_t message[SEAL_BYTES];
    put_little_endian(message, FOR_SEAL);
    put_little_endian(&message[WORD_BYTES], nonce);
    for (uint32_t half = 0u; half < 2u; half++) {
        put_little_endian(&message[COUNT_AT], half);
        put_little_endian(&session_key[(size_t)half * WORD_BYTES],
                          siphash_2_4(key, message, sizeof message));
    }
}

/* All bits together before the first decision. */
static bool same(uint64_t a, uint64_t b)
{
    const uint64_t difference = a ^ b;
    return ((uint32_t)difference | (uint32_t)(difference >> 32u)) == 0u;
}

bool access_answer(const access_config_t *cfg, access_t *st, uint64_t response)
{
    if (!st->challenged) {
        return false;
    }
    const uint64_t nonce = st->nonce;
    const bool unlocks = same(response, access_response(cfg->key, nonce));
    const bool opens = same(response, access_open_response(cfg->key, nonce));
    access_lock(st);
    if (unlocks || opens) {
        st->failures = 0u;
        st->open = true;
        st->unlocked = unlocks;
        access_session_key(cfg->key, nonce, st->session_key);
        return true;
    }
    st->failures++;
    if (st->failures >= ACCESS_FAILURES_MAX) {
        st->failures = 0u;
        st->waited = 0u;
    }
    return false;
}

bool access_sealed(access_t *st, const uint8_t *message, size_t n, uint32_t counter, uint64_t mac)
{
    const bool right = same(mac, siphash_2_4(st->session_key, message, n));
    if (!st->open || !right || (counter <= st->counter)) {
        return false;
    }
    st->counter = counter;
    st->idle = 0u;
    return true;
}

params_status_t access_write(const access_t *st, params_t *params, size_t index, float value,
                             bool gates_on)
{
    const param_info_t *info = params_info(index);
    if (info == NULL) {
        return PARAMS_NO_SUCH;
    }
    if (((param_access_t)info->access == PARAM_ACCESS_PROTECTED) && !st->unlocked) {
        return PARAMS_LOCKED;
    }
    if (((param_access_t)info->access != PARAM_ACCESS_RUN) && gates_on) {
        return PARAMS_GATES_ON;
    }
    return params_set(params, index, value);
}
