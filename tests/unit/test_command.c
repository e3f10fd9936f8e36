/* Frames of the host link: what was written is read, what was damaged is not, and noise ends at the
 * next zero. */
#include "command.h"

#include <math.h>
#include <string.h>

#include "crc32c.h"
#include "unity.h"

static command_parser_t parser;
static command_frame_t frame;

void setUp(void)
{
    parser = (command_parser_t){0};
    frame = (command_frame_t){0};
}

void tearDown(void)
{
}

/* How many good frames are in the bytes; the last is in `frame`. */
static uint32_t feed(const uint8_t *byte, size_t n)
{
    uint32_t found = 0u;
    for (size_t k = 0u; k < n; k++) {
        found += command_byte(&parser, byte[k], &frame) ? 1u : 0u;
    }
    return found;
}

static command_writer_t frame_of(uint8_t sequence, uint8_t op, const uint8_t *body, uint32_t n)
{
    command_writer_t w;
    command_begin(&w, sequence, op);
    for (uint32_t k = 0u; k < n; k++) {
        command_put_u8(&w, body[k]);
    }
    command_end(&w);
    return w;
}

/* By hand: COBS of {7, 3, 0} and its CRC, by the definition of COBS. */
static void test_a_frame_on_the_wire_is_what_the_definition_says(void)
{
    const uint8_t raw[] = {7u, 3u, 0u};
    const uint32_t crc = crc32c(raw, sizeof raw);
    const command_writer_t w = frame_of(7u, 3u, &raw[2], 1u);
    const uint8_t expected[] = {0u,
                                3u,
                                7u,
                                3u,
                                5u,
                                (uint8_t)crc,
                                (uint8_t)(crc >> 8),
                                (uint8_t)(crc >> 16),
                                (uint8_t)(crc >> 24),
                                0u};
    TEST_ASSERT_EQUAL_UINT32(sizeof expected, w.length);
    for (size_t k = 5u; k < 9u; k++) {
        TEST_ASSERT_NOT_EQUAL_UINT8(0u, expected[k]); /* or this example needs another body */
    }
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, w.byte, sizeof expected);
}

static void test_every_length_of_zeros_ones_and_counts_comes_back(void)
{
    for (uint32_t n = 0u; n <= COMMAND_BODY_MAX; n++) {
        for (uint32_t kind = 0u; kind < 4u; kind++) {
            uint8_t body[COMMAND_BODY_MAX];
            for (uint32_t k = 0u; k < n; k++) {
                body[k] = (uint8_t)((kind == 0u)   ? 0u
                                    : (kind == 1u) ? 0xFFu
                                    : (kind == 2u) ? k
                                                   : k % 3u);
            }
            const command_writer_t w = frame_of((uint8_t)n, 0x42u, body, n);
            TEST_ASSERT_FALSE(w.full);
            TEST_ASSERT_TRUE(w.length <= COMMAND_WIRE_MAX);
            for (uint32_t k = 1u; k + 1u < w.length; k++) {
                TEST_ASSERT_NOT_EQUAL_UINT8(0u, w.byte[k]);
            }
            TEST_ASSERT_EQUAL_UINT32(1u, feed(w.byte, w.length));
            TEST_ASSERT_EQUAL_UINT8((uint8_t)n, frame.sequence);
            TEST_ASSERT_EQUAL_UINT8(0x42u, frame.op);
            TEST_ASSERT_EQUAL_UINT32(n, frame.body_bytes);
            TEST_ASSERT_EQUAL_INT(0, memcmp(body, frame.body, n));
        }
    }
    TEST_ASSERT_EQUAL_UINT32(4u * (COMMAND_BODY_MAX + 1u), parser.good);
    TEST_ASSERT_EQUAL_UINT32(0u, parser.bad);
}

static void test_no_flipped_bit_and_no_lost_byte_gets_through(void)
{
    const uint8_t body[] = {1u, 0u, 0u, 200u, 255u, 0u, 9u};
    const command_writer_t w = frame_of(1u, 2u, body, sizeof body);
    for (uint32_t at = 1u; at + 1u < w.length; at++) {
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            command_writer_t damaged = w;
            damaged.byte[at] ^= (uint8_t)(1u << bit);
            TEST_ASSERT_EQUAL_UINT32(0u, feed(damaged.byte, damaged.length));
        }
        command_writer_t shorter = w;
        memmove(&shorter.byte[at], &shorter.byte[at + 1u], w.length - at - 1u);
        TEST_ASSERT_EQUAL_UINT32(0u, feed(shorter.byte, w.length - 1u));
    }
    TEST_ASSERT_EQUAL_UINT32(1u, feed(w.byte, w.length));
}

static void test_text_and_noise_before_a_frame_do_no_harm(void)
{
    const char *const text = "ZeroHertz 0.1.0 port=stm32f405\r\n";
    const uint8_t body[] = {5u};
    const command_writer_t w = frame_of(9u, 1u, body, 1u);
    TEST_ASSERT_EQUAL_UINT32(0u, feed((const uint8_t *)text, strlen(text)));
    TEST_ASSERT_EQUAL_UINT32(1u, feed(w.byte, w.length));
    TEST_ASSERT_EQUAL_UINT32(1u, parser.bad);
    uint8_t noise[1000];
    memset(noise, 0xFE, sizeof noise);
    TEST_ASSERT_EQUAL_UINT32(0u, feed(noise, sizeof noise));
    TEST_ASSERT_EQUAL_UINT32(1u, feed(w.byte, w.length));
}

/* A stop in the middle, and the next frame begins as if nothing had been. */
static void test_a_frame_cut_short_is_dropped_alone(void)
{
    const uint8_t body[] = {1u, 2u, 3u};
    const command_writer_t w = frame_of(1u, 2u, body, sizeof body);
    for (uint32_t n = 2u; n + 1u < w.length; n++) {
        TEST_ASSERT_EQUAL_UINT32(0u, feed(w.byte, n));
        TEST_ASSERT_EQUAL_UINT32(1u, feed(w.byte, w.length));
    }
}

static void test_zeros_alone_are_nothing(void)
{
    const uint8_t zeros[20] = {0};
    TEST_ASSERT_EQUAL_UINT32(0u, feed(zeros, sizeof zeros));
    TEST_ASSERT_EQUAL_UINT32(0u, parser.bad);
}

static void test_a_frame_longer_than_ours_is_refused_whole(void)
{
    /* 251 bytes with a right CRC: one more than may be. */
    uint8_t raw[COMMAND_FRAME_MAX + 1u];
    memset(raw, 0x11, sizeof raw);
    const uint32_t crc = crc32c(raw, sizeof raw - 4u);
    for (uint32_t k = 0u; k < 4u; k++) {
        raw[sizeof raw - 4u + k] = (uint8_t)(crc >> (8u * k));
        TEST_ASSERT_NOT_EQUAL_UINT8(0u, raw[sizeof raw - 4u + k]);
    }
    const uint8_t code = (uint8_t)(sizeof raw + 1u);
    const uint8_t zero = 0u;
    (void)feed(&code, 1u);
    (void)feed(raw, sizeof raw);
    TEST_ASSERT_EQUAL_UINT32(0u, feed(&zero, 1u));
    TEST_ASSERT_EQUAL_UINT32(1u, parser.bad);
}

/* Of a frame that is whole before its end not even the beginning is taken. */
static void test_a_good_frame_with_a_byte_too_many_is_refused(void)
{
    uint8_t raw[COMMAND_FRAME_MAX + 1u];
    memset(raw, 0x11, sizeof raw);
    const uint32_t crc = crc32c(raw, COMMAND_FRAME_MAX - 4u);
    for (uint32_t k = 0u; k < 4u; k++) {
        raw[COMMAND_FRAME_MAX - 4u + k] = (uint8_t)(crc >> (8u * k));
        TEST_ASSERT_NOT_EQUAL_UINT8(0u, raw[COMMAND_FRAME_MAX - 4u + k]);
    }
    const uint8_t zero = 0u;
    for (uint32_t n = COMMAND_FRAME_MAX; n <= sizeof raw; n++) {
        const uint8_t code = (uint8_t)(n + 1u);
        (void)feed(&code, 1u);
        (void)feed(raw, n);
        TEST_ASSERT_EQUAL_UINT32((n == COMMAND_FRAME_MAX) ? 1u : 0u, feed(&zero, 1u));
    }
    TEST_ASSERT_EQUAL_UINT32(1u, parser.bad);
}

static void test_numbers_are_little_endian_and_come_back(void)
{
    command_writer_t w;
    command_begin(&w, 1u, 2u);
    command_put_u16(&w, 0xA1B2u);
    command_put_u32(&w, 0xC3D4E5F6u);
    command_put_float(&w, -1.5f);
    command_put_text(&w, "rad/s");
    command_end(&w);
    TEST_ASSERT_EQUAL_UINT32(1u, feed(w.byte, w.length));
    const uint8_t expected[] = {0xB2u, 0xA1u, 0xF6u, 0xE5u, 0xD4u, 0xC3u, 0u,  0u,
                                0xC0u, 0xBFu, 5u,    'r',   'a',   'd',   '/', 's'};
    TEST_ASSERT_EQUAL_UINT32(sizeof expected, frame.body_bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, frame.body, sizeof expected);
    command_reader_t r = {.at = frame.body, .left = frame.body_bytes};
    TEST_ASSERT_EQUAL_HEX16(0xA1B2u, command_take_u16(&r));
    TEST_ASSERT_EQUAL_HEX32(0xC3D4E5F6u, command_take_u32(&r));
    TEST_ASSERT_EQUAL_FLOAT(-1.5f, command_take_float(&r));
    TEST_ASSERT_EQUAL_UINT8(5u, command_take_u8(&r));
    TEST_ASSERT_FALSE(command_all_taken(&r));
}

static void test_a_body_read_past_its_end_gives_zeros_and_tells(void)
{
    const uint8_t three[] = {1u, 2u, 3u};
    command_reader_t r = {.at = three, .left = 3u};
    TEST_ASSERT_EQUAL_HEX32(0x00030201u, command_take_u32(&r));
    TEST_ASSERT_TRUE(r.missing);
    TEST_ASSERT_FALSE(command_all_taken(&r));
    command_reader_t exact = {.at = three, .left = 3u};
    (void)command_take_u16(&exact);
    (void)command_take_u8(&exact);
    TEST_ASSERT_TRUE(command_all_taken(&exact));
}

static void test_a_full_writer_says_so_and_keeps_its_frame_whole(void)
{
    command_writer_t w;
    command_begin(&w, 1u, 2u);
    for (uint32_t k = 0u; k < COMMAND_BODY_MAX; k++) {
        command_put_u8(&w, 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(0u, command_room(&w));
    TEST_ASSERT_FALSE(w.full);
    command_put_u32(&w, 1u);
    TEST_ASSERT_TRUE(w.full);
    command_end(&w);
    TEST_ASSERT_EQUAL_UINT32(1u, feed(w.byte, w.length));
    TEST_ASSERT_EQUAL_UINT32(COMMAND_BODY_MAX, frame.body_bytes);
}

static void test_a_text_is_cut_where_the_body_ends(void)
{
    char text[301];
    memset(text, 'x', 300u);
    text[300] = '\0';
    command_writer_t w;
    command_begin(&w, 1u, 2u);
    command_put_text(&w, text);
    TEST_ASSERT_FALSE(w.full);
    TEST_ASSERT_EQUAL_UINT8(COMMAND_BODY_MAX - 1u, w.byte[4]);
    command_put_text(&w, "x");
    TEST_ASSERT_TRUE(w.full); /* not even its length */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_frame_on_the_wire_is_what_the_definition_says);
    RUN_TEST(test_every_length_of_zeros_ones_and_counts_comes_back);
    RUN_TEST(test_no_flipped_bit_and_no_lost_byte_gets_through);
    RUN_TEST(test_text_and_noise_before_a_frame_do_no_harm);
    RUN_TEST(test_a_frame_cut_short_is_dropped_alone);
    RUN_TEST(test_zeros_alone_are_nothing);
    RUN_TEST(test_a_frame_longer_than_ours_is_refused_whole);
    RUN_TEST(test_a_good_frame_with_a_byte_too_many_is_refused);
    RUN_TEST(test_numbers_are_little_endian_and_come_back);
    RUN_TEST(test_a_body_read_past_its_end_gives_zeros_and_tells);
    RUN_TEST(test_a_full_writer_says_so_and_keeps_its_frame_whole);
    RUN_TEST(test_a_text_is_cut_where_the_body_ends);
    return UNITY_END();
}
