/* The ring of the flight recorder: what it holds, when it is full, what is freed. */
#define _DEFAULT_SOURCE /* mmap */
#include "flight.h"

#include <signal.h>
#include <stddef.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "unity.h"

#define WORDS (FLIGHT_ROWS_MIN * FLIGHT_ROW_WORDS)

static uint32_t memory[4u * WORDS];
static flight_t f;

void setUp(void)
{
    flight_init(&f, memory, WORDS);
    TEST_ASSERT_TRUE(flight_arm(&f));
    f.state = FLIGHT_ON;
}

void tearDown(void)
{
}

static void put(uint32_t number)
{
    flight_put(&f, number, number + 1000u, number + 2000u);
}

static void test_the_ring_is_the_largest_power_of_two_that_fits(void)
{
    const struct {
        uint32_t words;
        uint32_t rows;
    } expected[] = {{WORDS - 1u, 0u},
                    {WORDS, FLIGHT_ROWS_MIN},
                    {2u * WORDS - 1u, FLIGHT_ROWS_MIN},
                    {2u * WORDS, 2u * FLIGHT_ROWS_MIN},
                    {4u * WORDS, 4u * FLIGHT_ROWS_MIN}};
    for (size_t k = 0u; k < sizeof expected / sizeof expected[0]; k++) {
        flight_init(&f, memory, expected[k].words);
        TEST_ASSERT_EQUAL_UINT32(expected[k].rows, f.rows);
        TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, f.state);
    }
}

static void test_without_memory_nothing_is_armed(void)
{
    flight_init(&f, NULL, 0u);
    TEST_ASSERT_FALSE(flight_arm(&f));
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, f.state);
}

static void test_arming_forgets_what_was_before(void)
{
    put(1u);
    TEST_ASSERT_TRUE(flight_take(&f, 1u));
    f.lost = 3u;
    f.digest = 4u;
    f.samples = 5u;
    TEST_ASSERT_TRUE(flight_arm(&f));
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_ASKED, f.state);
    TEST_ASSERT_EQUAL_UINT32(0u, f.written);
    TEST_ASSERT_EQUAL_UINT32(0u, f.taken);
    TEST_ASSERT_EQUAL_UINT32(0u, f.lost);
    TEST_ASSERT_EQUAL_UINT32(0u, f.digest);
    TEST_ASSERT_EQUAL_UINT32(0u, f.samples);
}

/* A control period may come between any two writes: before the first count is touched, the
 * recorder is off. The counts are on a page that cannot be written, so the process that arms ends
 * there; the state before them is on a page shared with this one.
 */
static void test_arming_stops_the_recorder_before_it_touches_a_count(void)
{
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    uint8_t *const two =
        mmap(NULL, 2u * page, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    TEST_ASSERT_TRUE(two != MAP_FAILED);
    TEST_ASSERT_TRUE(offsetof(flight_t, state) < offsetof(flight_t, written));
    flight_t *const shared = (void *)&two[page - offsetof(flight_t, written)];
    flight_init(shared, memory, WORDS);
    shared->state = FLIGHT_ON;
    TEST_ASSERT_EQUAL_INT(0, mprotect(&two[page], page, PROT_READ));
    const pid_t child = fork();
    if (child == 0) {
        (void)signal(SIGSEGV, SIG_DFL);
        (void)signal(SIGBUS, SIG_DFL);
        _exit(flight_arm(shared) ? 0 : 1);
    }
    int status = 0;
    TEST_ASSERT_EQUAL_INT(child, waitpid(child, &status, 0));
    TEST_ASSERT_TRUE(WIFSIGNALED(status));
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, shared->state);
    TEST_ASSERT_EQUAL_INT(0, munmap(two, 2u * page));
}

static void test_stopped_it_is_off(void)
{
    flight_stop(&f);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, f.state);
}

static void test_rows_are_read_back_round_the_ring(void)
{
    for (uint32_t k = 0u; k < 3u * FLIGHT_ROWS_MIN + 7u; k++) {
        put(k);
        const uint32_t *row = flight_row(&f, k);
        TEST_ASSERT_EQUAL_UINT32(k, row[0]);
        TEST_ASSERT_EQUAL_UINT32(k + 1000u, row[1]);
        TEST_ASSERT_EQUAL_UINT32(k + 2000u, row[2]);
    }
    /* The newest as many as the ring holds. */
    for (uint32_t k = 2u * FLIGHT_ROWS_MIN + 7u; k < f.written; k++) {
        TEST_ASSERT_EQUAL_UINT32(k, flight_row(&f, k)[0]);
    }
}

static void test_a_row_behind_what_was_freed_is_gone(void)
{
    for (uint32_t k = 0u; k < 10u; k++) {
        put(k);
    }
    TEST_ASSERT_FALSE(flight_take(&f, 11u)); /* not written yet */
    TEST_ASSERT_EQUAL_UINT32(0u, f.taken);
    TEST_ASSERT_TRUE(flight_take(&f, 4u));
    TEST_ASSERT_EQUAL_UINT32(4u, f.taken);
    TEST_ASSERT_TRUE(flight_take(&f, 4u)); /* asked for again */
    TEST_ASSERT_FALSE(flight_take(&f, 3u));
    TEST_ASSERT_TRUE(flight_take(&f, 10u)); /* the next one to come */
}

static void test_there_is_room_until_a_period_might_not_fit(void)
{
    for (uint32_t k = 0u; k < FLIGHT_ROWS_MIN - FLIGHT_PER_PERIOD; k++) {
        put(k);
        TEST_ASSERT_TRUE(flight_room(&f));
    }
    put(0u);
    TEST_ASSERT_FALSE(flight_room(&f));
    TEST_ASSERT_TRUE(flight_take(&f, 1u));
    TEST_ASSERT_TRUE(flight_room(&f));
}

/* After ten days at 5 kHz. */
static void test_the_count_of_rows_may_wrap(void)
{
    f.written = UINT32_MAX - 2u;
    f.taken = UINT32_MAX - 2u;
    for (uint32_t k = 0u; k < 6u; k++) {
        put(k);
    }
    TEST_ASSERT_EQUAL_UINT32(3u, f.written);
    TEST_ASSERT_TRUE(flight_room(&f));
    for (uint32_t k = 0u; k < 6u; k++) {
        TEST_ASSERT_EQUAL_UINT32(k, flight_row(&f, UINT32_MAX - 2u + k)[0]);
    }
    TEST_ASSERT_TRUE(flight_take(&f, 1u));
    TEST_ASSERT_FALSE(flight_take(&f, UINT32_MAX));
}

static void test_a_kind_carries_its_value_in_the_upper_half(void)
{
    flight_put_kind(&f, FLIGHT_COMMAND, 5u, 6u, 7u);
    const uint32_t expected[] = {0x00058001u, 6u, 7u};
    TEST_ASSERT_EQUAL_HEX32_ARRAY(expected, flight_row(&f, 0u), 3u);
}

/* Recordings are kept, and read by other hosts: a kind never becomes another. */
static void test_the_kinds_stay_what_they_are(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x8000u, FLIGHT_START);
    TEST_ASSERT_EQUAL_HEX32(0x8001u, FLIGHT_COMMAND);
    TEST_ASSERT_EQUAL_HEX32(0x8002u, FLIGHT_PARAMETER);
    TEST_ASSERT_EQUAL_HEX32(0x8003u, FLIGHT_EVENT);
    TEST_ASSERT_EQUAL_HEX32(0x8004u, FLIGHT_CHECK);
}

/* Published vectors of FNV-1a are of bytes; of a word below 256 they are the same. */
static void test_the_digest_is_fnv_1a(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xE40C292Cu, flight_fold(0x811C9DC5u, 'a'));
    TEST_ASSERT_EQUAL_HEX32(0x5u * 0x01000193u, flight_fold(0x4u, 0x1u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_ring_is_the_largest_power_of_two_that_fits);
    RUN_TEST(test_without_memory_nothing_is_armed);
    RUN_TEST(test_arming_forgets_what_was_before);
    RUN_TEST(test_arming_stops_the_recorder_before_it_touches_a_count);
    RUN_TEST(test_stopped_it_is_off);
    RUN_TEST(test_rows_are_read_back_round_the_ring);
    RUN_TEST(test_a_row_behind_what_was_freed_is_gone);
    RUN_TEST(test_there_is_room_until_a_period_might_not_fit);
    RUN_TEST(test_the_count_of_rows_may_wrap);
    RUN_TEST(test_a_kind_carries_its_value_in_the_upper_half);
    RUN_TEST(test_the_kinds_stay_what_they_are);
    RUN_TEST(test_the_digest_is_fnv_1a);
    return UNITY_END();
}
