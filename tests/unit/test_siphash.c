/* SipHash-2-4 against the vectors published with it: key 00 01 .. 0f, message 00 01 .. n-1. */
#include "siphash.h"

#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

static uint64_t hash_of_length(size_t n)
{
    uint8_t key[SIPHASH_KEY_BYTES];
    uint8_t message[64];
    for (uint32_t k = 0u; k < sizeof key; k++) {
        key[k] = (uint8_t)k;
    }
    for (uint32_t k = 0u; k < sizeof message; k++) {
        message[k] = (uint8_t)k;
    }
    return siphash_2_4(key, message, n);
}

/* Appendix A of the paper: 15 bytes. */
static void test_hash_of_the_papers_example(void)
{
    TEST_ASSERT_EQUAL_HEX64(0xA129CA6149BE45E5u, hash_of_length(15u));
}

/* The first nine of the reference vectors: every length of a last block, and one whole block. */
static void test_hash_of_the_published_vectors(void)
{
    static const uint64_t expected[] = {
        0x726FDB47DD0E0E31u, 0x74F839C593DC67FDu, 0x0D6C8009D9A94F5Au,
        0x85676696D7FB7E2Du, 0xCF2794E0277187B7u, 0x18765564CD99A68Du,
        0xCBC9466E58FEE3CEu, 0xAB0200F58B01D137u, 0x93F5F5799A932462u,
    };
    for (size_t n = 0u; n < sizeof expected / sizeof expected[0]; n++) {
        TEST_ASSERT_EQUAL_HEX64(expected[n], hash_of_length(n));
    }
}

/* The last reference vector: eight blocks but one byte. */
static void test_hash_of_the_longest_vector(void)
{
    TEST_ASSERT_EQUAL_HEX64(0x958A324CEB064572u, hash_of_length(63u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_hash_of_the_papers_example);
    RUN_TEST(test_hash_of_the_published_vectors);
    RUN_TEST(test_hash_of_the_longest_vector);
    return UNITY_END();
}
