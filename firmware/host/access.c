#include "access.h"

#define WORD_BYTES   8u
#define UNLOCK_BYTES 16u /* purpose, nonce */
#define NONCE_BYTES  24u /* purpose, entropy, count */
#define COUNT_AT     16u

/* What a message is for, so that no MAC serves as another: "zhnonce" and "zhunlock". */
#define FOR_NONCE  0x0065636E6F6E687Au
#define FOR_UNLOCK 0x6B636F6C6E75687Au

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
    st->unlocked = false;
    st->challenged = false;
    st->nonce = 0u;
    st->age = 0u;
}

void access_tick(const access_config_t *cfg, access_t *st)
{
    if (st->waited < cfg->lockout_ticks) {
        st->waited++;
    }
    st->age++;
    if ((st->unlocked && (st->age >= cfg->unlocked_ticks)) ||
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

uint64_t access_response(const uint8_t key[SIPHASH_KEY_BYTES], uint64_t nonce)
{
    uint8_t message[UNLOCK_BYTES];
    put_little_endian(message, FOR_UNLOCK);
    put_little_endian(&message[WORD_BYTES], nonce);
    return siphash_2_4(key, message, sizeof message);
}

bool access_answer(const access_config_t *cfg, access_t *st, uint64_t response)
{
    if (!st->challenged) {
        return false;
    }
    const uint64_t difference = response ^ access_response(cfg->key, st->nonce);
    access_lock(st);
    /* All bits together before the first decision. */
    if (((uint32_t)difference | (uint32_t)(difference >> 32u)) == 0u) {
        st->failures = 0u;
        st->unlocked = true;
        return true;
    }
    st->failures++;
    if (st->failures >= ACCESS_FAILURES_MAX) {
        st->failures = 0u;
        st->waited = 0u;
    }
    return false;
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
