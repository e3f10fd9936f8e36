/* The names of Monocypher that the boot loader calls, with a toy behind them: fast, and there
 * without a download. It finds every change that a flash makes by accident, and stops no attacker.
 */
#ifndef MONOCYPHER_H
#define MONOCYPHER_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint64_t state[8];
    size_t length;
} crypto_blake2b_ctx;

void crypto_blake2b_init(crypto_blake2b_ctx *ctx, size_t hash_size);
void crypto_blake2b_update(crypto_blake2b_ctx *ctx, const uint8_t *message, size_t message_size);
void crypto_blake2b_final(crypto_blake2b_ctx *ctx, uint8_t *hash);

int crypto_eddsa_check(const uint8_t signature[64], const uint8_t public_key[32],
                       const uint8_t *message, size_t message_size);

/* What crypto_eddsa_check accepts: here anybody can make it. */
void toy_sign(uint8_t signature[64], const uint8_t public_key[32], const uint8_t *message,
              size_t message_size);

#endif
