/* What makes a header good, and an application the one that was signed. */
#include "boot_image.h"

#include "boot_journal.h"
#include "boot_rig.h"
#include "unity.h"

static boot_rig_t rig;
static rig_image_t image;

void setUp(void)
{
    rig_init(&rig, true, 2u, 1u);
    image = rig_image(&rig, 5u);
}
void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.misuses);
}

static boot_status_t check(uint32_t least)
{
    return boot_header_check(&rig.cfg, &image.header, least);
}

/* A field that is wrong, though signed. */
static boot_status_t check_signed(uint32_t at, uint32_t word)
{
    image = rig_image(&rig, 5u);
    image.header.word[at] = word;
    rig_sign(&rig, &image);
    return check(5u);
}

static void test_a_signed_header_of_this_board_is_good(void)
{
    TEST_ASSERT_EQUAL(BOOT_GOOD, check(5u));
    TEST_ASSERT_EQUAL(BOOT_GOOD, check(0u));
}

static void test_a_header_of_another_format_is_none(void)
{
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_MAGIC, BOOT_ERASED));
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_FORMAT, BOOT_FORMAT + 1u));
}

static void test_a_size_has_to_fit_the_slot_and_the_unit(void)
{
    const uint32_t most = rig.flash.slot_bytes - BOOT_IMAGE_AT;
    TEST_ASSERT_EQUAL(BOOT_GOOD, check_signed(BOOT_AT_BYTES, most));
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_BYTES, most + BOOT_UNIT_BYTES));
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_BYTES, BOOT_ERASED - 7u));
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_BYTES, 60u));
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_BYTES, 0u));
}

static void test_a_version_leaves_room_for_the_next(void)
{
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_VERSION, 0u));
    TEST_ASSERT_EQUAL(BOOT_NO_IMAGE, check_signed(BOOT_AT_VERSION, BOOT_ERASED));
    TEST_ASSERT_EQUAL(BOOT_GOOD, check_signed(BOOT_AT_VERSION, BOOT_ERASED - 1u));
}

static void test_another_board_is_refused(void)
{
    for (uint32_t k = 0u; k < BOOT_BOARD_WORDS; k++) {
        TEST_ASSERT_EQUAL(BOOT_OTHER_BOARD, check_signed(BOOT_AT_BOARD + k, 0x31313131u));
    }
}

static void test_an_older_version_is_refused(void)
{
    TEST_ASSERT_EQUAL(BOOT_OLDER, check(6u));
}

/* Every bit counts: what the signature covers, and the signature. */
static void test_a_header_that_nobody_signed_is_refused(void)
{
    for (uint32_t bit = 0u; bit < 8u * BOOT_HEADER_BYTES; bit++) {
        image.header.word[bit / 32u] ^= 1u << (bit % 32u);
        TEST_ASSERT_NOT_EQUAL(BOOT_GOOD, check(0u));
        image.header.word[bit / 32u] ^= 1u << (bit % 32u);
    }
    TEST_ASSERT_EQUAL(BOOT_GOOD, check(0u));
    image.header.word[BOOT_AT_HASH] ^= 1u;
    TEST_ASSERT_EQUAL(BOOT_BAD_SIGNATURE, check(0u));
}

static void install(boot_area_t slot)
{
    for (uint32_t at = 0u; at < RIG_IMAGE_BYTES; at += BOOT_UNIT_BYTES) {
        uint32_t words[2];
        words[0] = 0x01010101u * image.application[at];
        words[1] = at;
        TEST_ASSERT_TRUE(boot_write(&rig.flash, slot, BOOT_IMAGE_AT + at, words));
    }
}

static void test_every_bit_of_the_application_is_signed(void)
{
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_send(&rig, &image));
    TEST_ASSERT_TRUE(boot_image_intact(&rig.flash, BOOT_STAGE, &image.header));
    uint32_t *const cell = &rig.sim.cell[BOOT_STAGE][BOOT_IMAGE_AT / 4u];
    for (uint32_t bit = 0u; bit < 8u * RIG_IMAGE_BYTES; bit++) {
        cell[bit / 32u] ^= 1u << (bit % 32u);
        TEST_ASSERT_FALSE(boot_image_intact(&rig.flash, BOOT_STAGE, &image.header));
        cell[bit / 32u] ^= 1u << (bit % 32u);
    }
    cell[RIG_IMAGE_BYTES / 4u] = 0u; /* what follows does not belong to it */
    TEST_ASSERT_TRUE(boot_image_intact(&rig.flash, BOOT_STAGE, &image.header));
}

/* Longer than what the hash is fed with at a time, and no multiple of it. */
static void test_a_long_application_is_hashed_to_its_end(void)
{
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_send(&rig, &image));
    image.header.word[BOOT_AT_BYTES] = 264u;
    uint32_t content[66];
    for (uint32_t k = 0u; k < 66u; k++) {
        content[k] = rig.flash.read(&rig, BOOT_STAGE, BOOT_IMAGE_AT + 4u * k);
    }
    rig_hash(&image.header, content, sizeof content);
    TEST_ASSERT_TRUE(boot_image_intact(&rig.flash, BOOT_STAGE, &image.header));
    rig.sim.cell[BOOT_STAGE][BOOT_IMAGE_AT / 4u + 65u] ^= 1u;
    TEST_ASSERT_FALSE(boot_image_intact(&rig.flash, BOOT_STAGE, &image.header));
}

static void test_a_slot_is_complete_with_header_and_mark(void)
{
    install(BOOT_RUN);
    TEST_ASSERT_FALSE(boot_image_marked(&rig.flash, BOOT_RUN));
    const uint32_t units = rig.sim.operations;
    TEST_ASSERT_TRUE(boot_image_complete(&rig.flash, BOOT_RUN, &image.header));
    TEST_ASSERT_EQUAL_UINT32(BOOT_HEADER_WORDS / 2u + BOOT_JOURNAL_RECORDS,
                             rig.sim.operations - units);
    TEST_ASSERT_TRUE(boot_image_marked(&rig.flash, BOOT_RUN));
    boot_header_t read;
    boot_header_read(&rig.flash, BOOT_RUN, &read);
    TEST_ASSERT_EQUAL_HEX32_ARRAY(image.header.word, read.word, BOOT_HEADER_WORDS);
    const uint32_t before = rig.sim.operations;
    TEST_ASSERT_TRUE(boot_image_settle(&rig.flash, BOOT_RUN));
    TEST_ASSERT_EQUAL_UINT32(before, rig.sim.operations);
}

/* Those of files, slots and keys of before, and of tools/zerohertz/update/image.py. */
static void test_the_numbers_of_the_format_stay(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x5055485Au, image.header.word[0]);
    TEST_ASSERT_EQUAL_UINT32(1u, image.header.word[1]);
    TEST_ASSERT_EQUAL_UINT32(64u, BOOT_HASH_BYTES);
    TEST_ASSERT_EQUAL_UINT32(32u, BOOT_KEY_BYTES);
    TEST_ASSERT_TRUE(boot_image_settle(&rig.flash, BOOT_RUN));
    TEST_ASSERT_EQUAL_HEX32(1u, rig.sim.cell[BOOT_RUN][256 / 4]);
    TEST_ASSERT_EQUAL_HEX32(~1u, rig.sim.cell[BOOT_RUN][256 / 4 + 1]);
}

static void test_without_its_whole_header_a_slot_gets_no_mark(void)
{
    for (uint32_t at = 0u; at < BOOT_HEADER_WORDS / 2u; at++) {
        rig_init(&rig, true, 2u, 1u);
        rig.fails = true;
        sim_flash_arm(&rig.sim, at, TORN_NOTHING);
        TEST_ASSERT_FALSE(boot_image_complete(&rig.flash, BOOT_RUN, &image.header));
        TEST_ASSERT_FALSE(boot_image_marked(&rig.flash, BOOT_RUN));
    }
}

static void test_a_write_is_read_back(void)
{
    const uint32_t words[2] = {1u, 2u};
    rig.sim.cell[BOOT_RUN][0] = 2u; /* a bit that is 0 stays 0 */
    TEST_ASSERT_FALSE(boot_write(&rig.flash, BOOT_RUN, 0u, words));
    rig.sim.cell[BOOT_RUN][3] = 1u;
    TEST_ASSERT_FALSE(boot_write(&rig.flash, BOOT_RUN, 8u, words));
    TEST_ASSERT_TRUE(boot_write(&rig.flash, BOOT_RUN, 16u, words));
    TEST_ASSERT_EQUAL_UINT32(2u, rig.sim.misuses); /* what was not blank */
    rig.sim.misuses = 0u;
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_signed_header_of_this_board_is_good);
    RUN_TEST(test_a_header_of_another_format_is_none);
    RUN_TEST(test_a_size_has_to_fit_the_slot_and_the_unit);
    RUN_TEST(test_a_version_leaves_room_for_the_next);
    RUN_TEST(test_another_board_is_refused);
    RUN_TEST(test_an_older_version_is_refused);
    RUN_TEST(test_a_header_that_nobody_signed_is_refused);
    RUN_TEST(test_every_bit_of_the_application_is_signed);
    RUN_TEST(test_a_long_application_is_hashed_to_its_end);
    RUN_TEST(test_a_slot_is_complete_with_header_and_mark);
    RUN_TEST(test_the_numbers_of_the_format_stay);
    RUN_TEST(test_without_its_whole_header_a_slot_gets_no_mark);
    RUN_TEST(test_a_write_is_read_back);
    return UNITY_END();
}
