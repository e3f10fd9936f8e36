/* SipHash-2-4 (Aumasson, Bernstein 2012): a 64-bit keyed MAC of a short message.
 *
 * State of four 64-bit words, 2 rounds per 8-byte block, 4 at the end; words little endian on any
 * machine. Constant time for a given length: additions, rotations, exclusive or.
 */
#ifndef SIPHASH_H
#define SIPHASH_H

#include <stddef.h>
#include <stdint.h>

#define SIPHASH_KEY_BYTES 16u

uint64_t siphash_2_4(const uint8_t key[SIPHASH_KEY_BYTES], const uint8_t *message, size_t n);

#endif
