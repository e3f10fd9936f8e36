/* The record store on a simulated flash; what power cuts do to it is in tests/powercut. */
#include "param_store.h"

#include "crc32c.h"
#include "param_record.h"
#include "sim_flash.h"

#include <string.h>

#include "unity.h"

#define STEPS_MAX    10000u
#define HEADER_WORDS 8u
#define BODY_WORDS   (HEADER_WORDS + 2u * (uint32_t)params_count())
#define MARKS        (BODY_WORDS + 2u)

static sim_flash_t sim;
static hal_flash_t flash; /* the simulated one behind the failures below */
static param_store_config_t cfg;
static param_store_t st;
static params_t params;
static param_store_report_t report;
static uint32_t busy_every; /* 0: never busy */
static uint32_t fail_at;    /* operation that fails; 0: none */
static uint32_t corrupt_at; /* operation that claims success without having done anything */
static uint32_t operations;

static hal_flash_status_t trouble(bool *skip)
{
    operations++;
    *skip = (corrupt_at != 0u) && (operations == corrupt_at);
    if ((fail_at != 0u) && (operations == fail_at)) {
        return HAL_FLASH_FAILED;
    }
    return ((busy_every != 0u) && (operations % busy_every != 0u)) ? HAL_FLASH_BUSY
                                                                   : HAL_FLASH_DONE;
}

static hal_flash_status_t erase(void *context, uint32_t slot)
{
    bool skip;
    const hal_flash_status_t status = trouble(&skip);
    return ((status != HAL_FLASH_DONE) || skip) ? status : sim.flash.erase(context, slot);
}

static hal_flash_status_t program(void *context, uint32_t slot, uint32_t offset,
                                  const uint32_t *words)
{
    bool skip;
    const hal_flash_status_t status = trouble(&skip);
    return ((status != HAL_FLASH_DONE) || skip) ? status
                                                : sim.flash.program(context, slot, offset, words);
}

void setUp(void)
{
    busy_every = fail_at = corrupt_at = operations = 0u;
    sim_flash_init(&sim, 1u, 7u);
    flash = sim.flash;
    flash.erase = erase;
    flash.program = program;
    cfg = (param_store_config_t){.flash = &flash, .table = {0x1111u, 0x2222u}};
    params_default(&params);
    report = (param_store_report_t){.taken = 1u, .refused = 1u};
    TEST_ASSERT_EQUAL(PARAM_STORE_EMPTY, param_store_load(&cfg, &st, &params, &report));
    TEST_ASSERT_EQUAL_UINT32(params_count(), report.missing);
    TEST_ASSERT_EQUAL_UINT32(0u, report.taken + report.unknown + report.refused);
}
void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, sim.misuses);
}

static param_store_found_t reload(void)
{
    params_default(&params);
    return param_store_load(&cfg, &st, &params, &report);
}

static uint32_t finish(void)
{
    uint32_t steps = 0u;
    while (param_store_step(&cfg, &st, true)) {
        steps++;
        TEST_ASSERT_TRUE(steps < STEPS_MAX);
    }
    return steps;
}

static void save(float i_d_A)
{
    params.i_d_A = i_d_A;
    TEST_ASSERT_TRUE(param_store_save(&cfg, &st, &params));
    operations = 0u;
    (void)finish();
}

static void expect(float i_d_A)
{
    TEST_ASSERT_EQUAL(PARAM_STORE_LOADED, reload());
    TEST_ASSERT_EQUAL_FLOAT(i_d_A, params.i_d_A);
}

/* Brings a changed record's CRC up to date. */
static void seal(uint32_t slot)
{
    const uint32_t body = HEADER_WORDS + 2u * sim.cell[slot][5];
    const uint32_t crc = crc32c(sim.cell[slot], 4u * body);
    sim.cell[slot][body] = crc;
    sim.cell[slot][body + 1u] = ~crc;
}

static uint32_t bits_of(float value)
{
    return float_bits(value);
}

static uint32_t word_of(const char *name)
{
    return HEADER_WORDS + 2u * (uint32_t)params_find(name);
}

static void test_every_parameter_comes_back(void)
{
    for (size_t k = 0u; k < params_count(); k++) {
        TEST_ASSERT_EQUAL(PARAMS_OK, params_set(&params, k, params_info(k)->minimum));
    }
    const params_t saved = params;
    TEST_ASSERT_TRUE(param_store_save(&cfg, &st, &params));
    (void)finish();
    TEST_ASSERT_FALSE(st.failed);
    TEST_ASSERT_EQUAL(PARAM_STORE_LOADED, reload());
    TEST_ASSERT_EQUAL_MEMORY(&saved, &params, sizeof params);
    TEST_ASSERT_EQUAL_UINT32(params_count(), report.taken);
    TEST_ASSERT_EQUAL_UINT32(0u, report.missing + report.unknown + report.refused);
    TEST_ASSERT_EQUAL_HEX32(0x1111u, report.made_for.motor_id);
    TEST_ASSERT_EQUAL_HEX32(0x2222u, report.made_for.crc32c);
}

static void test_names_have_keys_of_their_own_and_values_fit_a_float(void)
{
    for (size_t k = 0u; k < params_count(); k++) {
        const param_info_t *info = params_info(k);
        const uint32_t key = crc32c(params_name(k), strlen(params_name(k)));
        for (size_t n = 0u; n < k; n++) {
            const char *other = params_name(n);
            TEST_ASSERT_TRUE_MESSAGE(key != crc32c(other, strlen(other)), other);
        }
        TEST_ASSERT_TRUE((info->type == PARAM_FLOAT) || (info->maximum <= 16777216.0f));
    }
}

/* A page of the STM32G431, the smallest slot of a port (hal/stm32g431/g431_slots.h). */
static void test_the_list_fits_the_smallest_slot(void)
{
    flash.slot_bytes = 2048u;
    flash.unit_words = 2u;
    TEST_ASSERT_TRUE(param_record_fits(&flash, (uint32_t)params_count()));
}

/* However large the flash: a count beyond that was never written. */
static void test_a_record_has_1024_entries_at_most(void)
{
    flash.slot_bytes = 1u << 20;
    TEST_ASSERT_TRUE(param_record_fits(&flash, 1024u));
    TEST_ASSERT_FALSE(param_record_fits(&flash, 1025u));
}

static void test_the_layout_stays_what_it_is(void)
{
    save(3.0f);
    const uint32_t head[] = {0x5A485053u, 1u, 1u, 0x1111u, 0x2222u, (uint32_t)params_count(),
                             0u,          0u};
    TEST_ASSERT_EQUAL_HEX32_ARRAY(head, sim.cell[0], 8u);
    TEST_ASSERT_EQUAL_HEX32(crc32c("i_d_A", 5u), sim.cell[0][word_of("i_d_A")]);
    TEST_ASSERT_EQUAL_HEX32(0x40400000u, sim.cell[0][word_of("i_d_A") + 1u]);
    const uint32_t crc = crc32c(sim.cell[0], 4u * BODY_WORDS);
    TEST_ASSERT_EQUAL_HEX32(crc, sim.cell[0][BODY_WORDS]);
    TEST_ASSERT_EQUAL_HEX32(~crc, sim.cell[0][BODY_WORDS + 1u]);
    TEST_ASSERT_EQUAL_HEX32(0x4B52414Du, sim.cell[0][MARKS]);
    TEST_ASSERT_EQUAL_HEX32(0x4B52414Du, sim.cell[0][MARKS + 1u]);
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFu, sim.cell[0][MARKS + 2u]);
}

static void test_two_words_at_a_time_give_the_same_record(void)
{
    save(3.0f);
    uint32_t narrow[SIM_FLASH_WORDS];
    memcpy(narrow, sim.cell[0], sizeof narrow);
    sim_flash_init(&sim, 2u, 7u);
    flash.unit_words = 2u;
    (void)reload();
    save(3.0f);
    TEST_ASSERT_EQUAL_HEX32_ARRAY(narrow, sim.cell[0], MARKS);
    const uint32_t marks[] = {0x4B52414Du, 0xB4ADBEB2u, 0x4B52414Du, 0xB4ADBEB2u, 0xFFFFFFFFu};
    TEST_ASSERT_EQUAL_HEX32_ARRAY(marks, &sim.cell[0][MARKS], 5u);
    expect(3.0f);
    sim.cell[0][MARKS + 1u] ^= 1u; /* half a mark is none */
    TEST_ASSERT_FALSE(reload() == PARAM_STORE_LOADED);
}

static void test_slots_take_turns_and_the_newer_one_counts(void)
{
    for (uint32_t k = 1u; k < 6u; k++) {
        save((float)k);
        TEST_ASSERT_EQUAL_UINT32((k + 1u) % 2u, st.used.slot);
        TEST_ASSERT_EQUAL_UINT32(k, st.used.sequence);
        expect((float)k);
        TEST_ASSERT_TRUE(st.used.settled);
    }
}

static void test_the_sequence_may_wrap(void)
{
    save(1.0f);
    sim.cell[0][2] = 0xFFFFFFFFu;
    seal(0u);
    expect(1.0f);
    save(2.0f);
    TEST_ASSERT_EQUAL_HEX32(0u, sim.cell[1][2]);
    expect(2.0f);
    save(3.0f);
    expect(3.0f);
}

static void test_a_damaged_record_gives_way_to_the_older(void)
{
    save(1.0f);
    save(2.0f);
    for (uint32_t k = 0u; k < BODY_WORDS + 2u; k++) {
        for (uint32_t bit = k % 5u; bit < 32u; bit += 7u) {
            sim.cell[1][k] ^= 1u << bit;
            expect(1.0f);
            sim.cell[1][k] ^= 1u << bit;
        }
    }
    expect(2.0f);
}

static void test_without_a_mark_a_record_does_not_count(void)
{
    save(1.0f);
    save(2.0f);
    sim.cell[1][MARKS] ^= 1u;
    expect(1.0f);
}

static void test_both_records_damaged_is_told_as_lost(void)
{
    save(1.0f);
    sim.cell[0][20] ^= 1u;
    TEST_ASSERT_EQUAL(PARAM_STORE_LOST, reload());
    params_t defaults;
    params_default(&defaults);
    TEST_ASSERT_EQUAL_MEMORY(&defaults, &params, sizeof params);
    TEST_ASSERT_EQUAL_UINT32(params_count(), report.missing);
    TEST_ASSERT_EQUAL_UINT32(0u, report.taken);
    sim.cell[0][20] ^= 1u;
    save(2.0f); /* into slot 0: nothing was loaded */
    save(3.0f);
    sim.cell[0][20] ^= 1u;
    sim.cell[1][20] ^= 1u;
    TEST_ASSERT_EQUAL(PARAM_STORE_LOST, reload());
    save(4.0f);
    expect(4.0f);
}

static void test_a_first_save_that_was_cut_off_is_no_loss(void)
{
    save(1.0f);
    for (uint32_t k = 0u; k < 8u; k++) {
        sim.cell[0][MARKS + k] = 0xFFFFFFFFu;
    }
    TEST_ASSERT_EQUAL(PARAM_STORE_EMPTY, reload());
    TEST_ASSERT_EQUAL_UINT32(0u, st.used.sequence);
    sim.cell[0][5] = 0xFFFFFFFFu;
    TEST_ASSERT_EQUAL(PARAM_STORE_EMPTY, reload());
}

static void test_another_format_or_an_impossible_length_is_no_record(void)
{
    save(1.0f);
    sim.cell[0][1] = 2u;
    seal(0u);
    TEST_ASSERT_FALSE(reload() == PARAM_STORE_LOADED);
    sim.cell[0][1] = 1u;
    sim.cell[0][5] = 1025u;
    TEST_ASSERT_FALSE(reload() == PARAM_STORE_LOADED);
    sim.cell[0][5] = 1000u; /* beyond the slot */
    TEST_ASSERT_FALSE(reload() == PARAM_STORE_LOADED);
}

static void test_parameters_that_are_gone_new_or_out_of_range_are_told(void)
{
    save(3.0f);
    sim.cell[0][word_of("i_d_A")] = crc32c("gone", 4u);
    sim.cell[0][word_of("Rs_ohm") + 1u] = bits_of(-5.0f);
    sim.cell[0][word_of("adc_bits") + 1u] = bits_of(12.5f);
    seal(0u);
    TEST_ASSERT_EQUAL(PARAM_STORE_LOADED, reload());
    TEST_ASSERT_EQUAL_UINT32(1u, report.unknown);
    TEST_ASSERT_EQUAL_UINT32(1u, report.missing);
    TEST_ASSERT_EQUAL_UINT32(2u, report.refused);
    TEST_ASSERT_EQUAL_UINT32(params_find("adc_bits"), report.last_refused);
    TEST_ASSERT_EQUAL_FLOAT(4.5f, params.i_d_A);
    TEST_ASSERT_EQUAL_FLOAT(0.93f, params.Rs_ohm);
    TEST_ASSERT_EQUAL_UINT32(14u, params.adc_bits);
}

static void test_order_and_names_of_before_are_understood(void)
{
    static const param_rename_t rename[] = {{"somewhat_else", "Rs_ohm"}, {"i_magn_A", "i_d_A"}};
    save(3.0f);
    uint32_t *a = &sim.cell[0][word_of("i_d_A")];
    uint32_t *b = &sim.cell[0][word_of("M_H")];
    const uint32_t old[] = {b[0], b[1]};
    b[0] = crc32c("i_magn_A", 8u);
    b[1] = a[1];
    a[0] = old[0];
    a[1] = old[1];
    seal(0u);
    cfg.rename = rename;
    cfg.rename_count = 2u;
    expect(3.0f);
    TEST_ASSERT_EQUAL_FLOAT(0.102f, params.M_H);
    TEST_ASSERT_EQUAL_UINT32(params_count(), report.taken);
}

/* A record of a longer list than today's: nothing is missing, the rest is told. */
static void test_an_entry_twice_does_not_upset_the_count(void)
{
    save(3.0f);
    const uint32_t count = (uint32_t)params_count();
    uint32_t marks[2];
    memcpy(marks, &sim.cell[0][MARKS], sizeof marks);
    sim.cell[0][5] = count + 1u;
    sim.cell[0][BODY_WORDS] = crc32c("i_d_A", 5u);
    sim.cell[0][BODY_WORDS + 1u] = bits_of(2.5f);
    memcpy(&sim.cell[0][MARKS + 2u], marks, sizeof marks);
    seal(0u);
    expect(2.5f);
    TEST_ASSERT_EQUAL_UINT32(0u, report.missing);
}

static void test_nothing_is_touched_while_it_is_not_allowed(void)
{
    TEST_ASSERT_TRUE(param_store_save(&cfg, &st, &params));
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_TRUE(param_store_step(&cfg, &st, false));
    }
    TEST_ASSERT_EQUAL_UINT32(0u, operations);
    (void)finish();
    TEST_ASSERT_FALSE(param_store_step(&cfg, &st, false));
}

static void test_a_step_does_one_operation_at_most(void)
{
    TEST_ASSERT_TRUE(param_store_save(&cfg, &st, &params));
    uint32_t before = 0u;
    bool more = true;
    while (more) {
        more = param_store_step(&cfg, &st, true);
        TEST_ASSERT_TRUE(operations - before <= 1u);
        before = operations;
    }
    TEST_ASSERT_EQUAL_UINT32(1u + BODY_WORDS + 2u + 2u, operations);
}

static void test_a_busy_flash_is_asked_again(void)
{
    busy_every = 3u;
    save(3.0f);
    TEST_ASSERT_FALSE(st.failed);
    TEST_ASSERT_EQUAL_UINT32(3u * (1u + BODY_WORDS + 2u + 2u), operations);
    expect(3.0f);
}

static void test_a_save_takes_the_set_of_its_request(void)
{
    params.i_d_A = 3.0f;
    TEST_ASSERT_TRUE(param_store_save(&cfg, &st, &params));
    (void)param_store_step(&cfg, &st, true);
    params.i_d_A = 4.0f;
    TEST_ASSERT_FALSE(param_store_save(&cfg, &st, &params)); /* one at a time */
    (void)finish();
    expect(3.0f);
}

static void test_any_operation_that_fails_leaves_the_old_or_the_new_set(void)
{
    const uint32_t all = 1u + BODY_WORDS + 2u + 2u;
    save(1.0f);
    for (uint32_t k = 1u; k <= all; k++) {
        fail_at = k;
        save(2.0f);
        fail_at = 0u;
        const bool committed = k == all; /* only the proof is missing */
        TEST_ASSERT_EQUAL(!committed, st.failed);
        expect(committed ? 2.0f : 1.0f);
        save(1.0f); /* and the next one works */
        expect(1.0f);
    }
}

static void test_an_operation_that_lies_is_found_out(void)
{
    const uint32_t all = 1u + BODY_WORDS + 2u + 2u;
    save(1.0f);
    for (uint32_t k = 2u; k <= all; k++) {
        corrupt_at = k;
        save(2.0f);
        corrupt_at = 0u;
        TEST_ASSERT_EQUAL(k < all, st.failed); /* of the last one only the proof is missing */
        expect((k < all) ? 1.0f : 2.0f);
        save(1.0f);
        expect(1.0f);
    }
}

static void test_a_record_without_proof_gets_one_before_the_other_is_erased(void)
{
    save(1.0f);
    save(2.0f);
    sim.cell[1][MARKS + 1u] = 0xFFFFFFFFu;
    expect(2.0f);
    TEST_ASSERT_FALSE(st.used.settled);
    operations = 0u;
    for (uint32_t k = 0u; k < 10u; k++) {
        TEST_ASSERT_FALSE(param_store_step(&cfg, &st, true)); /* no save was asked for */
    }
    TEST_ASSERT_EQUAL_UINT32(2u, operations);
    TEST_ASSERT_TRUE(st.used.settled);
    TEST_ASSERT_EQUAL_HEX32(0x4B52414Du, sim.cell[1][MARKS + 3u]);
    expect(2.0f);
    TEST_ASSERT_TRUE(st.used.settled);
    TEST_ASSERT_EQUAL_UINT32(2u, st.used.pair);
}

static void test_a_damaged_pair_is_passed_over(void)
{
    save(1.0f);
    sim.cell[0][MARKS + 1u] = 0xFFFFFFFFu;
    sim.cell[0][MARKS + 3u] = 0x12345678u; /* a second mark alone */
    expect(1.0f);
    TEST_ASSERT_FALSE(st.used.settled);
    TEST_ASSERT_EQUAL_UINT32(2u, st.used.pair);
    fail_at = 1u;
    operations = 0u;
    for (uint32_t k = 0u; k < 10u; k++) {
        (void)param_store_step(&cfg, &st, true);
    }
    TEST_ASSERT_TRUE(st.used.settled);
    TEST_ASSERT_EQUAL_UINT32(4u, st.used.pair);
}

static void test_with_no_pair_left_a_save_goes_on(void)
{
    save(1.0f);
    for (uint32_t k = 0u; k < PARAM_STORE_PAIRS; k++) {
        sim.cell[0][MARKS + 2u * k] = 0x4B52414Du;
        sim.cell[0][MARKS + 2u * k + 1u] = 0xFFFFFFFFu;
    }
    expect(1.0f);
    save(2.0f);
    expect(2.0f);
    TEST_ASSERT_TRUE(st.used.settled);
}

static void test_no_flash_or_one_too_small_refuses(void)
{
    cfg.flash = NULL;
    TEST_ASSERT_EQUAL(PARAM_STORE_EMPTY, reload());
    TEST_ASSERT_FALSE(param_store_save(&cfg, &st, &params));
    TEST_ASSERT_FALSE(param_store_step(&cfg, &st, true));
    cfg.flash = &flash;
    flash.slot_bytes = 4u * (MARKS + 2u * PARAM_STORE_PAIRS);
    TEST_ASSERT_TRUE(param_store_save(&cfg, &st, &params));
    (void)finish();
    flash.slot_bytes -= 4u;
    TEST_ASSERT_FALSE(param_store_save(&cfg, &st, &params));
}

/* However many words a record has: the slice ends with it. */
static void test_a_record_is_verified_to_its_last_word(void)
{
    for (uint32_t entries = 1u; entries <= 8u; entries++) {
        st = (param_store_t){.phase = PARAM_STORE_VERIFY, .next = {.entries = entries}};
        const uint32_t words = HEADER_WORDS + 2u * entries;
        const uint32_t slices = (words + 15u) / 16u;
        for (uint32_t n = 1u; n < slices; n++) {
            TEST_ASSERT_FALSE(param_store_step(&cfg, &st, true) && st.failed);
            TEST_ASSERT_EQUAL_UINT32(16u * n, st.at);
        }
        (void)param_store_step(&cfg, &st, true);
        TEST_ASSERT_EQUAL_UINT32(words, st.at);
        TEST_ASSERT_TRUE(st.failed); /* the flash is empty */
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_parameter_comes_back);
    RUN_TEST(test_names_have_keys_of_their_own_and_values_fit_a_float);
    RUN_TEST(test_the_list_fits_the_smallest_slot);
    RUN_TEST(test_a_record_has_1024_entries_at_most);
    RUN_TEST(test_the_layout_stays_what_it_is);
    RUN_TEST(test_two_words_at_a_time_give_the_same_record);
    RUN_TEST(test_slots_take_turns_and_the_newer_one_counts);
    RUN_TEST(test_the_sequence_may_wrap);
    RUN_TEST(test_a_damaged_record_gives_way_to_the_older);
    RUN_TEST(test_without_a_mark_a_record_does_not_count);
    RUN_TEST(test_both_records_damaged_is_told_as_lost);
    RUN_TEST(test_a_first_save_that_was_cut_off_is_no_loss);
    RUN_TEST(test_another_format_or_an_impossible_length_is_no_record);
    RUN_TEST(test_parameters_that_are_gone_new_or_out_of_range_are_told);
    RUN_TEST(test_order_and_names_of_before_are_understood);
    RUN_TEST(test_an_entry_twice_does_not_upset_the_count);
    RUN_TEST(test_nothing_is_touched_while_it_is_not_allowed);
    RUN_TEST(test_a_step_does_one_operation_at_most);
    RUN_TEST(test_a_busy_flash_is_asked_again);
    RUN_TEST(test_a_save_takes_the_set_of_its_request);
    RUN_TEST(test_any_operation_that_fails_leaves_the_old_or_the_new_set);
    RUN_TEST(test_an_operation_that_lies_is_found_out);
    RUN_TEST(test_a_record_without_proof_gets_one_before_the_other_is_erased);
    RUN_TEST(test_a_damaged_pair_is_passed_over);
    RUN_TEST(test_with_no_pair_left_a_save_goes_on);
    RUN_TEST(test_no_flash_or_one_too_small_refuses);
    RUN_TEST(test_a_record_is_verified_to_its_last_word);
    return UNITY_END();
}
