#include "crc32c.h"

#include "exact.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_crc_of_the_check_string(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xE3069283u, crc32c("123456789", 9u));
}

/* Vectors of RFC 3720, appendix B.4. */
static void test_crc_of_the_iscsi_vectors(void)
{
    uint8_t data[32];
    memset(data, 0x00, sizeof data);
    TEST_ASSERT_EQUAL_HEX32(0x8A9136AAu, crc32c(data, sizeof data));
    memset(data, 0xFF, sizeof data);
    TEST_ASSERT_EQUAL_HEX32(0x62A8AB43u, crc32c(data, sizeof data));
    for (uint32_t k = 0u; k < sizeof data; k++) {
        data[k] = (uint8_t)k;
    }
    TEST_ASSERT_EQUAL_HEX32(0x46DD794Eu, crc32c(data, sizeof data));
    for (uint32_t k = 0u; k < sizeof data; k++) {
        data[k] = (uint8_t)(31u - k);
    }
    TEST_ASSERT_EQUAL_HEX32(0x113FDB5Cu, crc32c(data, sizeof data));
}

/* Bit by bit from the polynomial: every table entry is reached. */
static uint32_t bitwise(uint8_t byte)
{
    uint32_t crc = 0xFFFFFFFFu ^ byte;
    for (int bit = 0; bit < 8; bit++) {
        crc = ((crc & 1u) != 0u) ? ((crc >> 1) ^ 0x82F63B78u) : (crc >> 1);
    }
    return crc ^ 0xFFFFFFFFu;
}

static void test_crc_of_every_byte_is_polynomial_division(void)
{
    for (uint32_t value = 0u; value < 256u; value++) {
        const uint8_t byte = (uint8_t)value;
        TEST_ASSERT_EQUAL_HEX32(bitwise(byte), crc32c(&byte, 1u));
    }
}

static void test_crc_of_nothing_is_zero(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, crc32c("", 0u));
}

static void test_update_of_nothing_changes_nothing(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x12345678u, crc32c_update(0x12345678u, "", 0u));
}

static void test_update_in_parts_gives_the_crc_of_the_whole(void)
{
    const char *text = "123456789";
    for (size_t first = 0u; first <= 9u; first++) {
        const uint32_t crc = crc32c_update(0u, text, first);
        TEST_ASSERT_EQUAL_HEX32(0xE3069283u, crc32c_update(crc, text + first, 9u - first));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_crc_of_the_check_string);
    RUN_TEST(test_crc_of_the_iscsi_vectors);
    RUN_TEST(test_crc_of_every_byte_is_polynomial_division);
    RUN_TEST(test_crc_of_nothing_is_zero);
    RUN_TEST(test_update_of_nothing_changes_nothing);
    RUN_TEST(test_update_in_parts_gives_the_crc_of_the_whole);
    return UNITY_END();
}
