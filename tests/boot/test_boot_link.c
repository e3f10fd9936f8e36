/* Requests to the loader: nothing is erased before a signature, nothing done out of order. */
#include "boot_link.h"

#include <string.h>

#include "boot_call.h"
#include "boot_rig.h"
#include "unity.h"

/* Zero, COBS code, sequence, op, status; CRC and zero behind the body. */
#define HEAD_BYTES 10u

static boot_rig_t rig;

void setUp(void)
{
    rig_init(&rig, true, 2u, 1u);
}
void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.misuses);
}

static void install(uint32_t version)
{
    const rig_image_t image = rig_image(&rig, version);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_send(&rig, &image));
    TEST_ASSERT_TRUE(rig.link.done);
    TEST_ASSERT_TRUE(rig_boot(&rig));
}

static boot_status_t begin(uint32_t version)
{
    const rig_image_t image = rig_image(&rig, version);
    return rig_begin(&rig, &image);
}

/* The answer's body, behind the status. */
static const uint8_t *told(void)
{
    static command_parser_t parser;
    command_frame_t frame = {0};
    parser = (command_parser_t){.length = 0u};
    bool whole = false;
    for (uint32_t k = 0u; k < rig.link.answer.length; k++) {
        whole = command_byte(&parser, rig.link.answer.byte[k], &frame);
    }
    TEST_ASSERT_TRUE(whole);
    return &frame.body[1];
}

static uint32_t word(const uint8_t *at)
{
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static void test_it_tells_what_runs_and_what_fits(void)
{
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_request(&rig, BOOT_LINK_ASK, NULL, 0u));
    TEST_ASSERT_EQUAL_UINT32(0u, word(told() + 2));
    install(3u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_request(&rig, BOOT_LINK_ASK, NULL, 0u));
    TEST_ASSERT_EQUAL_UINT8(BOOT_LINK_PROTOCOL, told()[0]);
    TEST_ASSERT_EQUAL_UINT32(3u, word(told() + 2));
    TEST_ASSERT_EQUAL_UINT32(3u, word(told() + 6));
    TEST_ASSERT_EQUAL_UINT32(rig.flash.slot_bytes - BOOT_IMAGE_AT, word(told() + 10));
    TEST_ASSERT_EQUAL_MEMORY(rig.cfg.board, told() + 14, sizeof rig.cfg.board);
    TEST_ASSERT_EQUAL_UINT32(30u + HEAD_BYTES, rig.link.answer.length);
}

static void test_only_a_signed_newer_header_erases_anything(void)
{
    for (uint32_t staged = 0u; staged < 2u; staged++) {
        rig_init(&rig, staged != 0u, 2u, 1u);
        install(3u);
        sim_flash_arm(&rig.sim, SIM_FLASH_NEVER, TORN_NOTHING);
        rig_image_t image = rig_image(&rig, 4u);
        image.header.word[BOOT_AT_SIGNATURE] ^= 1u;
        TEST_ASSERT_EQUAL(BOOT_BAD_SIGNATURE, rig_begin(&rig, &image));
        TEST_ASSERT_EQUAL(BOOT_OLDER, begin(3u));
        TEST_ASSERT_EQUAL(BOOT_OLDER, begin(2u));
        image = rig_image(&rig, 4u);
        image.header.word[BOOT_AT_BOARD] ^= 1u;
        rig_sign(&rig, &image);
        TEST_ASSERT_EQUAL(BOOT_OTHER_BOARD, rig_begin(&rig, &image));
        TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.operations);
        TEST_ASSERT_EQUAL(BOOT_GOOD, begin(4u));
        TEST_ASSERT_EQUAL_UINT32(1u, rig.sim.operations);
    }
}

static void test_with_nothing_to_run_the_same_version_may_be_sent_again(void)
{
    rig_init(&rig, false, 2u, 1u);
    install(3u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, begin(4u)); /* and no more of it */
    TEST_ASSERT_EQUAL(BOOT_OLDER, begin(2u));
    install(3u);
}

static void test_a_full_counter_is_told_before_anything_is_erased(void)
{
    const uint32_t last = RIG_COUNTER_BYTES / 4u - 4u;
    rig.sim.cell[BOOT_COUNTER][last] = 0u;
    TEST_ASSERT_EQUAL(BOOT_COUNTER_FULL, begin(1u));
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.operations);
}

static void test_an_erasure_that_fails_is_told(void)
{
    rig.fails = true;
    sim_flash_arm(&rig.sim, 0u, TORN_NOTHING);
    TEST_ASSERT_EQUAL(BOOT_FLASH_FAILS, begin(1u));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 0u, "01234567", 8u));
    TEST_ASSERT_EQUAL(BOOT_GOOD, begin(1u));
}

static void test_data_come_in_order_and_behind_a_begin(void)
{
    const rig_image_t image = rig_image(&rig, 1u);
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 0u, image.application, 8u));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_request(&rig, BOOT_LINK_COMMIT, NULL, 0u));
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_begin(&rig, &image));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 8u, image.application, 8u));
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_data(&rig, 0u, image.application, 8u));
    TEST_ASSERT_EQUAL_UINT32(8u, word(told()));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 0u, image.application, 8u));
    TEST_ASSERT_EQUAL(BOOT_NOT_COMPLETE, rig_data(&rig, 8u, &image.application[8], 4u));
    TEST_ASSERT_EQUAL(BOOT_NOT_COMPLETE, rig_request(&rig, BOOT_LINK_COMMIT, NULL, 0u));
    TEST_ASSERT_FALSE(rig.link.done);
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 8u, &image.application[8], 8u));
}

static void test_a_begin_that_is_refused_ends_the_update(void)
{
    const rig_image_t image = rig_image(&rig, 1u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_begin(&rig, &image));
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, begin(0u));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 0u, image.application, 8u));
}

static void test_the_numbers_of_the_protocol_stay(void)
{
    TEST_ASSERT_EQUAL_UINT32(1u, BOOT_LINK_PROTOCOL);
    TEST_ASSERT_EQUAL_HEX8(0x80u, BOOT_LINK_ANSWER);
    TEST_ASSERT_EQUAL_UINT32(224u, BOOT_LINK_DATA_MAX);
    TEST_ASSERT_EQUAL_UINT32(500u, BOOT_LINK_WINDOW_MS);
    TEST_ASSERT_EQUAL_UINT32(30000u, BOOT_LINK_CALLED_MS);
    TEST_ASSERT_EQUAL_UINT32(3000u, BOOT_LINK_PATIENCE_MS);
}

static void test_no_byte_goes_behind_the_application(void)
{
    const uint8_t much[BOOT_LINK_DATA_MAX] = {0u};
    TEST_ASSERT_EQUAL(BOOT_GOOD, begin(1u));
    TEST_ASSERT_EQUAL(BOOT_NOT_COMPLETE, rig_data(&rig, 0u, much, RIG_IMAGE_BYTES + 8u));
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_data(&rig, 0u, much, RIG_IMAGE_BYTES));
    TEST_ASSERT_EQUAL(BOOT_NOT_COMPLETE, rig_data(&rig, RIG_IMAGE_BYTES, much, 8u));
}

static void test_other_bytes_than_those_signed_are_not_completed(void)
{
    rig_image_t image = rig_image(&rig, 1u);
    image.application[RIG_IMAGE_BYTES - 1u] ^= 1u;
    TEST_ASSERT_EQUAL(BOOT_NOT_COMPLETE, rig_send(&rig, &image));
    TEST_ASSERT_FALSE(rig_boot(&rig));
}

static void test_a_unit_that_fails_ends_the_update(void)
{
    const rig_image_t image = rig_image(&rig, 1u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_begin(&rig, &image));
    rig.fails = true;
    sim_flash_arm(&rig.sim, 1u, TORN_NOTHING);
    TEST_ASSERT_EQUAL(BOOT_FLASH_FAILS, rig_data(&rig, 0u, image.application, 24u));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 8u, &image.application[8], 8u));
}

static void test_a_header_that_fails_leaves_the_slot_incomplete(void)
{
    const rig_image_t image = rig_image(&rig, 1u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_begin(&rig, &image));
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_data(&rig, 0u, image.application, RIG_IMAGE_BYTES));
    rig.fails = true;
    sim_flash_arm(&rig.sim, 3u, TORN_NOTHING);
    TEST_ASSERT_EQUAL(BOOT_FLASH_FAILS, rig_request(&rig, BOOT_LINK_COMMIT, NULL, 0u));
    TEST_ASSERT_FALSE(rig.link.done);
    TEST_ASSERT_FALSE(rig_boot(&rig));
}

static void test_a_request_of_another_length_or_name_is_refused(void)
{
    uint8_t body[BOOT_HEADER_BYTES + 4u + BOOT_LINK_DATA_MAX] = {0u};
    TEST_ASSERT_EQUAL(BOOT_UNKNOWN, rig_request(&rig, BOOT_LINK_ASK, body, 1u));
    TEST_ASSERT_EQUAL(BOOT_UNKNOWN,
                      rig_request(&rig, BOOT_LINK_BEGIN, body, BOOT_HEADER_BYTES - 1u));
    TEST_ASSERT_EQUAL(BOOT_UNKNOWN,
                      rig_request(&rig, BOOT_LINK_BEGIN, body, BOOT_HEADER_BYTES + 1u));
    TEST_ASSERT_EQUAL(BOOT_UNKNOWN, rig_request(&rig, BOOT_LINK_DATA, body, 4u));
    TEST_ASSERT_EQUAL(BOOT_UNKNOWN,
                      rig_request(&rig, BOOT_LINK_DATA, body, 5u + BOOT_LINK_DATA_MAX));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_request(&rig, BOOT_LINK_DATA, body, 5u));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER,
                      rig_request(&rig, BOOT_LINK_DATA, body, 4u + BOOT_LINK_DATA_MAX));
    TEST_ASSERT_EQUAL(BOOT_UNKNOWN, rig_request(&rig, BOOT_LINK_COMMIT, body, 1u));
    TEST_ASSERT_EQUAL(BOOT_UNKNOWN, rig_request(&rig, 0x01u, NULL, 0u));
}

/* The answer was lost on its way, and the host asks again. */
static void test_a_repeated_request_is_answered_and_done_once(void)
{
    const rig_image_t image = rig_image(&rig, 1u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_begin(&rig, &image));
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_data(&rig, 0u, image.application, 8u));
    const uint32_t before = rig.sim.operations;
    rig.sequence--;
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_data(&rig, 0u, image.application, 8u));
    TEST_ASSERT_EQUAL_UINT32(before, rig.sim.operations);
    rig.sequence--; /* the same number with other content is another request */
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_data(&rig, 8u, &image.application[8], 8u));
    TEST_ASSERT_EQUAL(BOOT_OUT_OF_ORDER, rig_data(&rig, 8u, &image.application[8], 8u));
}

static void test_a_new_begin_starts_over(void)
{
    const rig_image_t image = rig_image(&rig, 1u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_begin(&rig, &image));
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_data(&rig, 0u, image.application, 8u));
    install(2u);
    TEST_ASSERT_EQUAL_UINT32(2u, rig_counter(&rig));
}

static void test_noise_is_not_answered(void)
{
    for (uint32_t byte = 0u; byte < 4096u; byte++) {
        TEST_ASSERT_FALSE(boot_link_byte(&rig.cfg, &rig.link, (uint8_t)(byte * 37u + byte / 256u)));
    }
}

/* So many milliseconds pass; whether the loader still listens then. */
static bool listens_after(uint32_t ms)
{
    for (uint32_t k = 0u; k < ms; k++) {
        TEST_ASSERT_TRUE(boot_link_listens(&rig.link));
        boot_link_tick(&rig.link);
    }
    return boot_link_listens(&rig.link);
}

static void test_with_nothing_to_start_it_listens_for_ever(void)
{
    TEST_ASSERT_FALSE(rig_boot(&rig));
    TEST_ASSERT_TRUE(listens_after(BOOT_LINK_WINDOW_MS + 1u));
}

static void test_it_starts_what_runs_when_nobody_asks(void)
{
    install(3u);
    TEST_ASSERT_FALSE(listens_after(BOOT_LINK_WINDOW_MS));
    boot_link_tick(&rig.link);
    TEST_ASSERT_FALSE(boot_link_listens(&rig.link));
}

static void test_a_call_of_the_application_is_taken_once(void)
{
    uint32_t mark[BOOT_CALL_WORDS] = {0u, 0u};
    TEST_ASSERT_FALSE(boot_called(mark));
    boot_call(mark);
    TEST_ASSERT_EQUAL_HEX32(0x4C4C4143u, mark[0]);
    TEST_ASSERT_EQUAL_HEX32(~0x4C4C4143u, mark[1]);
    TEST_ASSERT_TRUE(boot_called(mark));
    TEST_ASSERT_FALSE(boot_called(mark));
}

/* Memory after a power-up holds anything. */
static void test_half_a_call_is_none(void)
{
    for (uint32_t word = 0u; word < BOOT_CALL_WORDS; word++) {
        uint32_t mark[BOOT_CALL_WORDS];
        boot_call(mark);
        mark[word] ^= 1u;
        TEST_ASSERT_FALSE(boot_called(mark));
        TEST_ASSERT_EQUAL_HEX32(0u, mark[0] | mark[1]);
    }
}

static void test_each_request_is_waited_for_again(void)
{
    install(3u);
    TEST_ASSERT_TRUE(listens_after(BOOT_LINK_WINDOW_MS - 1u));
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_request(&rig, BOOT_LINK_ASK, NULL, 0u));
    TEST_ASSERT_TRUE(listens_after(BOOT_LINK_PATIENCE_MS - 1u));
    rig.sequence--; /* one whose answer was lost counts as much */
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_request(&rig, BOOT_LINK_ASK, NULL, 0u));
    TEST_ASSERT_FALSE(listens_after(BOOT_LINK_PATIENCE_MS));
}

static void test_a_complete_update_ends_the_listening(void)
{
    const rig_image_t image = rig_image(&rig, 1u);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_send(&rig, &image));
    TEST_ASSERT_FALSE(boot_link_listens(&rig.link));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_tells_what_runs_and_what_fits);
    RUN_TEST(test_only_a_signed_newer_header_erases_anything);
    RUN_TEST(test_with_nothing_to_run_the_same_version_may_be_sent_again);
    RUN_TEST(test_a_full_counter_is_told_before_anything_is_erased);
    RUN_TEST(test_an_erasure_that_fails_is_told);
    RUN_TEST(test_data_come_in_order_and_behind_a_begin);
    RUN_TEST(test_a_begin_that_is_refused_ends_the_update);
    RUN_TEST(test_the_numbers_of_the_protocol_stay);
    RUN_TEST(test_no_byte_goes_behind_the_application);
    RUN_TEST(test_other_bytes_than_those_signed_are_not_completed);
    RUN_TEST(test_a_unit_that_fails_ends_the_update);
    RUN_TEST(test_a_header_that_fails_leaves_the_slot_incomplete);
    RUN_TEST(test_a_request_of_another_length_or_name_is_refused);
    RUN_TEST(test_a_repeated_request_is_answered_and_done_once);
    RUN_TEST(test_a_new_begin_starts_over);
    RUN_TEST(test_noise_is_not_answered);
    RUN_TEST(test_with_nothing_to_start_it_listens_for_ever);
    RUN_TEST(test_it_starts_what_runs_when_nobody_asks);
    RUN_TEST(test_a_call_of_the_application_is_taken_once);
    RUN_TEST(test_half_a_call_is_none);
    RUN_TEST(test_each_request_is_waited_for_again);
    RUN_TEST(test_a_complete_update_ends_the_listening);
    return UNITY_END();
}
