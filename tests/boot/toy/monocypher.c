#include "monocypher.h"

#include <string.h>

void crypto_blake2b_init(crypto_blake2b_ctx *ctx, size_t hash_size)
{
    memset(ctx, 0, sizeof *ctx);
    ctx->length = hash_size;
}

void crypto_blake2b_update(crypto_blake2b_ctx *ctx, const uint8_t *message, size_t message_size)
{
    for (size_t k = 0u; k < message_size; k++) {
        uint64_t *const word = &ctx->state[ctx->length % 8u];
        ctx->length++;
        *word = (*word ^ message[k] ^ ctx->length) * 0x9E3779B97F4A7C15u;
        *word ^= *word >> 29;
    }
}

void crypto_blake2b_final(crypto_blake2b_ctx *ctx, uint8_t *hash)
{
    memcpy(hash, ctx->state, sizeof ctx->state);
}

void toy_sign(uint8_t signature[64], const uint8_t public_key[32], const uint8_t *message,
              size_t message_size)
{
    crypto_blake2b_ctx ctx;
    crypto_blake2b_init(&ctx, 64u);
    crypto_blake2b_update(&ctx, public_key, 32u);
    crypto_blake2b_update(&ctx, message, message_size);
    crypto_blake2b_final(&ctx, signature);
}

int crypto_eddsa_check(const uint8_t signature[64], const uint8_t public_key[32],
                       const uint8_t *message, size_t message_size)
{
    uint8_t expected[64];
    toy_sign(expected, public_key, message, message_size);
    return (memcmp(expected, signature, sizeof expected) == 0) ? 0 : -1;
}
