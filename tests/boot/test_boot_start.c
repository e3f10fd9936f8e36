/* What a reset starts, and what it copies first. */
#include "boot_start.h"

#include "boot_rig.h"
#include "unity.h"

static boot_rig_t rig;

void setUp(void)
{
    rig_init(&rig, true, 2u, 1u);
}
void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.misuses);
}

static void send(uint32_t version)
{
    const rig_image_t image = rig_image(&rig, version);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_send(&rig, &image));
}

static void install(uint32_t version)
{
    send(version);
    TEST_ASSERT_TRUE(rig_boot(&rig));
}

static void test_blank_flash_starts_nothing(void)
{
    TEST_ASSERT_FALSE(rig_boot(&rig));
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.operations);
}

static void test_an_update_is_copied_counted_and_started(void)
{
    install(3u);
    const rig_image_t image = rig_image(&rig, 3u);
    TEST_ASSERT_TRUE(rig_runs(&rig, &image));
    TEST_ASSERT_EQUAL_UINT32(3u, rig_counter(&rig));
}

/* An erasure, application, header and mark of the copy, and the counter; nothing else. */
static void test_a_copy_writes_no_more_than_it_has_to(void)
{
    send(1u);
    sim_flash_arm(&rig.sim, SIM_FLASH_NEVER, TORN_NOTHING);
    TEST_ASSERT_TRUE(rig_boot(&rig));
    const uint32_t units = (RIG_IMAGE_BYTES + BOOT_HEADER_BYTES) / BOOT_UNIT_BYTES;
    TEST_ASSERT_EQUAL_UINT32(1u + units + 2u * BOOT_JOURNAL_RECORDS, rig.sim.operations);
}

static void test_the_next_reset_writes_nothing(void)
{
    install(3u);
    sim_flash_arm(&rig.sim, SIM_FLASH_NEVER, TORN_NOTHING);
    TEST_ASSERT_TRUE(rig_boot(&rig));
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.operations);
}

static void test_a_single_slot_starts_what_it_received(void)
{
    rig_init(&rig, false, 2u, 1u);
    install(3u);
    TEST_ASSERT_EQUAL_UINT32(3u, rig_counter(&rig));
    TEST_ASSERT_EQUAL_HEX32(BOOT_ERASED, rig.sim.cell[BOOT_STAGE][0]);
}

/* Bit by bit: whatever decays in the only slot, it is not started. */
static void test_an_image_that_was_changed_is_never_started(void)
{
    rig_init(&rig, false, 2u, 1u);
    install(3u);
    for (uint32_t bit = 0u; bit < 8u * RIG_IMAGE_BYTES; bit += 5u) {
        rig.sim.cell[BOOT_RUN][BOOT_IMAGE_AT / 4u + bit / 32u] ^= 1u << (bit % 32u);
        TEST_ASSERT_FALSE(rig_boot(&rig));
        rig.sim.cell[BOOT_RUN][BOOT_IMAGE_AT / 4u + bit / 32u] ^= 1u << (bit % 32u);
    }
    for (uint32_t bit = 0u; bit < 8u * BOOT_HEADER_BYTES; bit += 5u) {
        rig.sim.cell[BOOT_RUN][bit / 32u] ^= 1u << (bit % 32u);
        TEST_ASSERT_FALSE(rig_boot(&rig));
        rig.sim.cell[BOOT_RUN][bit / 32u] ^= 1u << (bit % 32u);
    }
    TEST_ASSERT_TRUE(rig_boot(&rig));
}

static void test_a_running_slot_that_decayed_is_written_anew(void)
{
    install(3u);
    rig.sim.cell[BOOT_RUN][BOOT_IMAGE_AT / 4u] ^= 1u;
    TEST_ASSERT_TRUE(rig_boot(&rig));
    const rig_image_t image = rig_image(&rig, 3u);
    TEST_ASSERT_TRUE(rig_runs(&rig, &image));
}

static void test_a_forged_update_in_the_second_slot_is_left_there(void)
{
    install(3u);
    send(4u);
    rig.sim.cell[BOOT_STAGE][BOOT_AT_HASH] ^= 1u;
    TEST_ASSERT_TRUE(rig_boot(&rig));
    const rig_image_t image = rig_image(&rig, 3u);
    TEST_ASSERT_TRUE(rig_runs(&rig, &image));
    TEST_ASSERT_EQUAL_UINT32(3u, rig_counter(&rig));
}

static void test_an_update_without_its_mark_is_left_there(void)
{
    install(3u);
    send(4u);
    for (uint32_t k = BOOT_MARKS_AT / 4u; k < BOOT_IMAGE_AT / 4u; k++) {
        rig.sim.cell[BOOT_STAGE][k] = BOOT_ERASED;
    }
    TEST_ASSERT_TRUE(rig_boot(&rig));
    TEST_ASSERT_EQUAL_UINT32(3u, rig_counter(&rig));
}

/* Put there with a programmer: signed once, but withdrawn since. */
static void test_what_is_older_than_the_counter_is_never_started(void)
{
    rig_init(&rig, false, 2u, 1u);
    install(3u);
    const boot_journal_t counter = boot_counter(&rig.cfg);
    TEST_ASSERT_TRUE(boot_journal_raise(&counter, 4u));
    TEST_ASSERT_FALSE(rig_boot(&rig));
}

static void test_an_older_image_in_the_second_slot_does_not_come_back(void)
{
    install(3u);
    sim_flash_t old = rig.sim;
    install(4u);
    for (uint32_t k = 0u; k < SIM_FLASH_WORDS; k++) {
        rig.sim.cell[BOOT_STAGE][k] = old.cell[BOOT_STAGE][k];
        rig.sim.cell[BOOT_RUN][k] = BOOT_ERASED;
    }
    TEST_ASSERT_FALSE(rig_boot(&rig));
    TEST_ASSERT_EQUAL_UINT32(4u, rig_counter(&rig));
}

static void test_without_the_counter_nothing_new_is_started(void)
{
    send(3u);
    for (uint32_t k = 0u; k < RIG_COUNTER_BYTES / 4u; k++) {
        rig.sim.cell[BOOT_COUNTER][k] = 0u; /* no room */
    }
    TEST_ASSERT_FALSE(rig_boot(&rig));
}

/* Power that goes while the copy is made: the second slot still has all of it. */
static void test_a_copy_cut_short_begins_anew(void)
{
    install(3u);
    send(4u);
    sim_flash_arm(&rig.sim, 4u, TORN_GARBAGE);
    TEST_ASSERT_FALSE(rig_boot(&rig));
    sim_flash_boot(&rig.sim, LEAN_OLD);
    TEST_ASSERT_TRUE(rig_boot(&rig));
    const rig_image_t image = rig_image(&rig, 4u);
    TEST_ASSERT_TRUE(rig_runs(&rig, &image));
}

static void test_an_erasure_that_fails_starts_nothing_unverified(void)
{
    const torn_t left[] = {TORN_GARBAGE, TORN_NOTHING};
    for (uint32_t k = 0u; k < sizeof left / sizeof left[0]; k++) {
        install(2u * k + 1u);
        send(2u * k + 2u);
        rig.fails = true;
        sim_flash_arm(&rig.sim, 0u, left[k]);
        TEST_ASSERT_FALSE(rig_boot(&rig));
        TEST_ASSERT_TRUE(rig_boot(&rig));
    }
}

/* A mark that reads right today and wrong tomorrow: before the running slot goes, it is written
 * anew.
 */
static void test_an_unproven_mark_is_proven_before_the_old_image_goes(void)
{
    install(3u);
    const rig_image_t image = rig_image(&rig, 4u);
    sim_flash_arm(&rig.sim, SIM_FLASH_NEVER, TORN_NOTHING);
    TEST_ASSERT_EQUAL(BOOT_GOOD, rig_send(&rig, &image));
    const uint32_t first_mark = rig.sim.operations - BOOT_JOURNAL_RECORDS;
    rig_init(&rig, true, 2u, 2u);
    install(3u);
    sim_flash_arm(&rig.sim, first_mark, TORN_UNSTABLE);
    TEST_ASSERT_NOT_EQUAL(BOOT_GOOD, rig_send(&rig, &image));
    sim_flash_boot(&rig.sim, LEAN_NEW);
    sim_flash_arm(&rig.sim, 6u, TORN_NOTHING); /* three marks, an erasure, two units of the copy */
    TEST_ASSERT_FALSE(rig_boot(&rig));
    sim_flash_boot(&rig.sim, LEAN_OLD);
    TEST_ASSERT_TRUE(rig_boot(&rig));
    TEST_ASSERT_TRUE(rig_runs(&rig, &image));
}

/* Flash that reads otherwise from the second look at one word of the second slot on, or before. */
static struct {
    uint32_t (*honest)(void *context, boot_area_t area, uint32_t offset);
    uint32_t at;
    uint32_t change;
    uint32_t looks;
    bool first; /* the first look is the wrong one */
} liar;

static uint32_t read_liar(void *context, boot_area_t area, uint32_t offset)
{
    const uint32_t word = liar.honest(context, area, offset);
    if ((area != BOOT_STAGE) || (offset != liar.at)) {
        return word;
    }
    liar.looks++;
    return ((liar.looks == 1u) == liar.first) ? (word ^ liar.change) : word;
}

static void lie(uint32_t at, uint32_t change, bool first)
{
    liar.honest = rig.flash.read;
    liar.at = at;
    liar.change = change;
    liar.looks = 0u;
    liar.first = first;
    rig.flash.read = read_liar;
}

/* What was verified in one slot and copied to the other is verified there again. */
static void test_a_copy_that_differs_is_not_started(void)
{
    install(3u);
    send(4u);
    lie(BOOT_IMAGE_AT, 1u, false);
    TEST_ASSERT_FALSE(rig_boot(&rig));
    TEST_ASSERT_EQUAL_UINT32(2u, liar.looks);
    TEST_ASSERT_EQUAL_UINT32(3u, rig_counter(&rig));
    rig.flash.read = liar.honest;
    TEST_ASSERT_TRUE(rig_boot(&rig));
    const rig_image_t image = rig_image(&rig, 4u);
    TEST_ASSERT_TRUE(rig_runs(&rig, &image));
}

static void test_a_version_that_only_seemed_newer_leaves_the_running_slot(void)
{
    install(3u);
    sim_flash_arm(&rig.sim, SIM_FLASH_NEVER, TORN_NOTHING);
    lie(4u * BOOT_AT_VERSION, 4u, true); /* 7, then 3 */
    TEST_ASSERT_TRUE(rig_boot(&rig));
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.operations);
}

/* One mark that nothing proves, and no room for another. */
static void spoil_marks(boot_area_t slot)
{
    for (uint32_t k = BOOT_MARKS_AT / 4u + 2u; k < BOOT_IMAGE_AT / 4u; k++) {
        rig.sim.cell[slot][k] = 0u;
    }
    TEST_ASSERT_TRUE(boot_image_marked(&rig.flash, slot));
}

static void test_an_update_that_cannot_be_proven_leaves_the_old_image(void)
{
    install(3u);
    send(4u);
    spoil_marks(BOOT_STAGE);
    TEST_ASSERT_TRUE(rig_boot(&rig));
    const rig_image_t image = rig_image(&rig, 3u);
    TEST_ASSERT_TRUE(rig_runs(&rig, &image));
}

static void test_a_single_slot_that_cannot_be_proven_waits_for_a_repeat(void)
{
    rig_init(&rig, false, 2u, 1u);
    send(3u);
    spoil_marks(BOOT_RUN);
    TEST_ASSERT_FALSE(rig_boot(&rig));
    install(3u);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_blank_flash_starts_nothing);
    RUN_TEST(test_an_update_is_copied_counted_and_started);
    RUN_TEST(test_a_copy_writes_no_more_than_it_has_to);
    RUN_TEST(test_the_next_reset_writes_nothing);
    RUN_TEST(test_a_single_slot_starts_what_it_received);
    RUN_TEST(test_an_image_that_was_changed_is_never_started);
    RUN_TEST(test_a_running_slot_that_decayed_is_written_anew);
    RUN_TEST(test_a_forged_update_in_the_second_slot_is_left_there);
    RUN_TEST(test_an_update_without_its_mark_is_left_there);
    RUN_TEST(test_what_is_older_than_the_counter_is_never_started);
    RUN_TEST(test_an_older_image_in_the_second_slot_does_not_come_back);
    RUN_TEST(test_without_the_counter_nothing_new_is_started);
    RUN_TEST(test_a_copy_cut_short_begins_anew);
    RUN_TEST(test_an_erasure_that_fails_starts_nothing_unverified);
    RUN_TEST(test_an_unproven_mark_is_proven_before_the_old_image_goes);
    RUN_TEST(test_a_copy_that_differs_is_not_started);
    RUN_TEST(test_a_version_that_only_seemed_newer_leaves_the_running_slot);
    RUN_TEST(test_an_update_that_cannot_be_proven_leaves_the_old_image);
    RUN_TEST(test_a_single_slot_that_cannot_be_proven_waits_for_a_repeat);
    return UNITY_END();
}
