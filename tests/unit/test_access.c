/* Who may write what, and the way from a challenge to an unlocked drive. */
#include "access.h"

#include "unity.h"

#define LOCKOUT   10u
#define CHALLENGE 5u
#define UNLOCKED  20u

static const uint8_t key[SIPHASH_KEY_BYTES] = {1, 2,  3,  4,  5,  6,  7,  8,
                                               9, 10, 11, 12, 13, 14, 15, 16};
static const uint64_t entropy = 0x0123456789ABCDEFu;
static access_config_t cfg;
static access_t st;
static params_t params;

static void ticks(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        access_tick(&cfg, &st);
    }
}

void setUp(void)
{
    TEST_ASSERT_TRUE(access_init(&cfg, key, LOCKOUT, CHALLENGE, UNLOCKED));
    st = (access_t){0};
    params_default(&params);
    ticks(LOCKOUT);
}
void tearDown(void)
{
}

static uint64_t challenge(void)
{
    uint64_t nonce = 0u;
    TEST_ASSERT_TRUE(access_challenge(&cfg, &st, &entropy, &nonce));
    return nonce;
}

static void unlock(void)
{
    TEST_ASSERT_TRUE(access_answer(&cfg, &st, access_response(key, challenge())));
}

static params_status_t write(const char *name, bool gates_on)
{
    const size_t index = params_find(name);
    return access_write(&st, &params, index, params_info(index)->maximum, gates_on);
}

static void test_each_class_is_written_when_and_only_when_it_may(void)
{
    TEST_ASSERT_EQUAL(PARAMS_OK, write("adapt_kp", true));
    TEST_ASSERT_EQUAL(PARAMS_OK, write("adapt_kp", false));
    TEST_ASSERT_EQUAL(PARAMS_GATES_ON, write("i_max_A", true));
    TEST_ASSERT_EQUAL(PARAMS_OK, write("i_max_A", false));
    TEST_ASSERT_EQUAL(PARAMS_LOCKED, write("Rs_ohm", true));
    TEST_ASSERT_EQUAL(PARAMS_LOCKED, write("Rs_ohm", false));
    TEST_ASSERT_EQUAL_FLOAT(0.93f, params.Rs_ohm);
    unlock();
    TEST_ASSERT_EQUAL(PARAMS_GATES_ON, write("Rs_ohm", true));
    TEST_ASSERT_EQUAL(PARAMS_OK, write("Rs_ohm", false));
    TEST_ASSERT_EQUAL_FLOAT(1000.0f, params.Rs_ohm);
}

static void test_range_and_index_are_checked_for_every_class(void)
{
    unlock();
    TEST_ASSERT_EQUAL(PARAMS_OUT_OF_RANGE,
                      access_write(&st, &params, params_find("Rs_ohm"), -1.0f, false));
    TEST_ASSERT_EQUAL(PARAMS_NO_SUCH, access_write(&st, &params, params_count(), 1.0f, false));
}

/* Byte order and prefix: SipHash-2-4 of "zhunlock", then 1 as eight little-endian bytes. */
static void test_response_is_the_mac_of_the_nonce(void)
{
    uint8_t message[16] = {'z', 'h', 'u', 'n', 'l', 'o', 'c', 'k', 1};
    TEST_ASSERT_EQUAL_HEX64(siphash_2_4(key, message, 16u), access_response(key, 1u));
    message[8] = 0u;
    message[15] = 0x80u;
    TEST_ASSERT_EQUAL_HEX64(siphash_2_4(key, message, 16u),
                            access_response(key, 0x8000000000000000u));
}

static void test_an_answer_serves_once(void)
{
    const uint64_t right = access_response(key, challenge());
    TEST_ASSERT_TRUE(access_answer(&cfg, &st, right));
    TEST_ASSERT_TRUE(st.unlocked);
    access_lock(&st);
    TEST_ASSERT_FALSE(access_answer(&cfg, &st, right));
    TEST_ASSERT_FALSE(st.unlocked);
    TEST_ASSERT_EQUAL_UINT32(0u, st.failures); /* nothing was asked */
}

static void test_a_wrong_answer_voids_the_nonce(void)
{
    const uint64_t right = access_response(key, challenge());
    TEST_ASSERT_FALSE(access_answer(&cfg, &st, right ^ 1u));
    TEST_ASSERT_FALSE(access_answer(&cfg, &st, right));
}

static void test_each_bit_of_the_answer_counts(void)
{
    for (uint32_t bit = 0u; bit < 64u; bit++) {
        st.failures = 0u;
        const uint64_t right = access_response(key, challenge());
        TEST_ASSERT_FALSE(access_answer(&cfg, &st, right ^ ((uint64_t)1u << bit)));
    }
}

static void test_nonces_differ_even_if_the_entropy_stands_still(void)
{
    const uint64_t first = challenge();
    const uint64_t second = challenge();
    TEST_ASSERT_TRUE(first != second);
    TEST_ASSERT_FALSE(access_answer(&cfg, &st, access_response(key, first)));
    /* After a power cycle the entropy decides. */
    const uint64_t other = entropy + 1u;
    uint64_t nonce = 0u;
    st = (access_t){.waited = LOCKOUT};
    TEST_ASSERT_TRUE(access_challenge(&cfg, &st, &other, &nonce));
    TEST_ASSERT_TRUE(nonce != first);
}

static void test_a_challenge_locks_and_expires(void)
{
    unlock();
    uint64_t right = access_response(key, challenge());
    TEST_ASSERT_FALSE(st.unlocked);
    ticks(CHALLENGE - 1u);
    TEST_ASSERT_TRUE(access_answer(&cfg, &st, right));
    right = access_response(key, challenge());
    ticks(CHALLENGE);
    TEST_ASSERT_FALSE(access_answer(&cfg, &st, right));
}

static void test_the_drive_locks_by_itself(void)
{
    unlock();
    ticks(UNLOCKED - 1u);
    TEST_ASSERT_TRUE(st.unlocked);
    ticks(1u);
    TEST_ASSERT_FALSE(st.unlocked);
}

/* Not the unlocking: one's own request, whole, with a counter that rises, in a session. */
static void test_an_open_session_takes_each_sealed_request_once(void)
{
    const uint8_t request[] = {0x11u, 0xAAu, 0xBBu, 5u};
    const uint64_t nonce = challenge();
    uint8_t sealing[SIPHASH_KEY_BYTES];
    access_session_key(key, nonce, sealing);
    const uint64_t mac = siphash_2_4(sealing, request, sizeof request);
    TEST_ASSERT_FALSE(access_sealed(&st, request, sizeof request, 5u, mac));
    TEST_ASSERT_TRUE(access_answer(&cfg, &st, access_open_response(key, nonce)));
    TEST_ASSERT_TRUE(st.open);
    TEST_ASSERT_FALSE(st.unlocked);
    for (uint32_t bit = 0u; bit < 64u; bit++) {
        const uint64_t wrong = mac ^ ((uint64_t)1u << bit);
        TEST_ASSERT_FALSE(access_sealed(&st, request, sizeof request, 5u, wrong));
    }
    TEST_ASSERT_FALSE(access_sealed(&st, request, sizeof request - 1u, 5u, mac));
    TEST_ASSERT_FALSE(access_sealed(&st, request, sizeof request, 0u, mac)); /* never counted */
    TEST_ASSERT_TRUE(access_sealed(&st, request, sizeof request, 5u, mac));
    TEST_ASSERT_FALSE(access_sealed(&st, request, sizeof request, 5u, mac));
    TEST_ASSERT_FALSE(access_sealed(&st, request, sizeof request, 4u, mac));
    TEST_ASSERT_TRUE(access_sealed(&st, request, sizeof request, 6u, mac));
    access_lock(&st);
    const uint8_t nobody[SIPHASH_KEY_BYTES] = {0};
    TEST_ASSERT_EQUAL_MEMORY(nobody, st.session_key, sizeof nobody);
    TEST_ASSERT_FALSE(access_sealed(&st, request, sizeof request, 7u,
                                    siphash_2_4(nobody, request, sizeof request)));
}

/* Purpose, nonce and half, byte for byte, as a host has to make them. */
static void test_the_session_key_is_of_key_and_nonce(void)
{
    uint8_t message[24] = {'z', 'h', 's', 'e', 'a', 'l', 'e', 'd', 1};
    uint8_t made[SIPHASH_KEY_BYTES];
    access_session_key(key, 1u, made);
    for (uint32_t half = 0u; half < 2u; half++) {
        message[16] = (uint8_t)half;
        const uint64_t word = siphash_2_4(key, message, sizeof message);
        for (uint32_t k = 0u; k < 8u; k++) {
            TEST_ASSERT_EQUAL_HEX8((uint8_t)(word >> (8u * k)), made[8u * half + k]);
        }
    }
    const uint8_t opening[16] = {'z', 'h', 'o', 'p', 'e', 'n', 'e', 'd', 1};
    TEST_ASSERT_EQUAL_HEX64(siphash_2_4(key, opening, 16u), access_open_response(key, 1u));
}

/* Protected parameters so long after the answer; the session so long after its last request. */
static void test_a_session_ends_after_silence(void)
{
    const uint8_t request[] = {1u};
    const uint64_t nonce = challenge();
    uint8_t sealing[SIPHASH_KEY_BYTES];
    access_session_key(key, nonce, sealing);
    const uint64_t mac = siphash_2_4(sealing, request, sizeof request);
    TEST_ASSERT_TRUE(access_answer(&cfg, &st, access_response(key, nonce)));
    ticks(UNLOCKED - 1u);
    TEST_ASSERT_TRUE(st.unlocked && access_sealed(&st, request, sizeof request, 1u, mac));
    ticks(1u);
    TEST_ASSERT_TRUE(st.open && !st.unlocked);
    ticks(UNLOCKED - 2u);
    TEST_ASSERT_TRUE(st.open);
    ticks(1u);
    TEST_ASSERT_FALSE(st.open);
}

static void fail_times(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        TEST_ASSERT_FALSE(access_answer(&cfg, &st, ~access_response(key, challenge())));
    }
}

static void test_three_failures_lock_out_for_the_time(void)
{
    uint64_t nonce = 0u;
    fail_times(3u);
    TEST_ASSERT_FALSE(access_challenge(&cfg, &st, &entropy, &nonce));
    ticks(LOCKOUT - 1u);
    TEST_ASSERT_FALSE(access_challenge(&cfg, &st, &entropy, &nonce));
    TEST_ASSERT_EQUAL_HEX64(0u, nonce);
    ticks(1u);
    unlock();
}

static void test_a_success_forgets_the_failures_before(void)
{
    fail_times(2u);
    unlock();
    fail_times(2u);
    unlock();
}

static void test_power_up_is_a_lockout(void)
{
    uint64_t nonce = 0u;
    st = (access_t){0};
    ticks(LOCKOUT - 1u);
    TEST_ASSERT_FALSE(access_challenge(&cfg, &st, &entropy, &nonce));
    ticks(1u);
    unlock();
}

static void test_without_key_entropy_or_times_nothing_unlocks(void)
{
    uint64_t nonce = 0u;
    TEST_ASSERT_FALSE(access_challenge(&cfg, &st, NULL, &nonce));
    uint8_t blank[SIPHASH_KEY_BYTES];
    for (uint32_t value = 0u; value < 256u; value++) {
        for (uint32_t k = 0u; k < sizeof blank; k++) {
            blank[k] = (uint8_t)value;
        }
        TEST_ASSERT_FALSE(access_init(&cfg, blank, LOCKOUT, CHALLENGE, UNLOCKED));
        TEST_ASSERT_FALSE(access_challenge(&cfg, &st, &entropy, &nonce));
    }
    blank[15] = 0u;
    TEST_ASSERT_TRUE(access_init(&cfg, blank, LOCKOUT, CHALLENGE, UNLOCKED));
    TEST_ASSERT_FALSE(access_init(&cfg, NULL, LOCKOUT, CHALLENGE, UNLOCKED));
    TEST_ASSERT_FALSE(access_init(&cfg, key, 0u, CHALLENGE, UNLOCKED));
    TEST_ASSERT_FALSE(access_init(&cfg, key, LOCKOUT, 0u, UNLOCKED));
    TEST_ASSERT_FALSE(access_init(&cfg, key, LOCKOUT, CHALLENGE, 0u));
    TEST_ASSERT_FALSE(access_challenge(&cfg, &st, &entropy, &nonce));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_class_is_written_when_and_only_when_it_may);
    RUN_TEST(test_range_and_index_are_checked_for_every_class);
    RUN_TEST(test_response_is_the_mac_of_the_nonce);
    RUN_TEST(test_an_answer_serves_once);
    RUN_TEST(test_a_wrong_answer_voids_the_nonce);
    RUN_TEST(test_each_bit_of_the_answer_counts);
    RUN_TEST(test_nonces_differ_even_if_the_entropy_stands_still);
    RUN_TEST(test_a_challenge_locks_and_expires);
    RUN_TEST(test_the_drive_locks_by_itself);
    RUN_TEST(test_an_open_session_takes_each_sealed_request_once);
    RUN_TEST(test_the_session_key_is_of_key_and_nonce);
    RUN_TEST(test_a_session_ends_after_silence);
    RUN_TEST(test_three_failures_lock_out_for_the_time);
    RUN_TEST(test_a_success_forgets_the_failures_before);
    RUN_TEST(test_power_up_is_a_lockout);
    RUN_TEST(test_without_key_entropy_or_times_nothing_unlocks);
    return UNITY_END();
}
