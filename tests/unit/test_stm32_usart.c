/* Which registers of the serial port are read, and in which order.
 *
 * The port's flags are cleared by reads (status, then data), which RAM does not show. Here the two
 * registers lie on two pages without access: the first read of each raises a signal, which notes
 * the register and opens its page.
 */
#define _GNU_SOURCE

#include "stm32_usart.h"

#include "unity.h"

#include <signal.h>
#include <stddef.h>
#include <sys/mman.h>
#include <unistd.h>

#define READS_MAX 2

static uint8_t *pages;
static size_t page_bytes;
static stm32_usart_t *usart;
static volatile size_t offset[READS_MAX];
static volatile int reads;

static void note_read(int number, siginfo_t *info, void *context)
{
    (void)number;
    (void)context;
    const size_t from_begin = (size_t)((uint8_t *)info->si_addr - pages);
    if ((from_begin >= 2u * page_bytes) || (reads >= READS_MAX)) {
        _exit(1); /* a crash of the test itself */
    }
    offset[reads] = (size_t)((uint8_t *)info->si_addr - (uint8_t *)usart);
    reads++;
    uint8_t *page = pages + (from_begin / page_bytes) * page_bytes;
    (void)mprotect(page, page_bytes, PROT_READ | PROT_WRITE);
}

void setUp(void)
{
    page_bytes = (size_t)sysconf(_SC_PAGESIZE);
    pages = mmap(NULL, 2u * page_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    TEST_ASSERT_TRUE(pages != MAP_FAILED);
    usart = (stm32_usart_t *)(void *)(pages + page_bytes - offsetof(stm32_usart_t, DR));
    const struct sigaction action = {.sa_sigaction = note_read, .sa_flags = SA_SIGINFO};
    TEST_ASSERT_EQUAL_INT(0, sigaction(SIGSEGV, &action, NULL));
}

void tearDown(void)
{
    (void)munmap(pages, 2u * page_bytes);
}

static bool receive(uint32_t status, uint8_t *byte)
{
    usart->SR = status;
    usart->DR = 'd';
    reads = 0;
    TEST_ASSERT_EQUAL_INT(0, mprotect(pages, 2u * page_bytes, PROT_NONE));
    const bool came = stm32_usart_receive(usart, byte);
    TEST_ASSERT_EQUAL_INT(0, mprotect(pages, 2u * page_bytes, PROT_READ | PROT_WRITE));
    return came;
}

static void assert_status_then_data(void)
{
    TEST_ASSERT_EQUAL_INT(2, reads);
    TEST_ASSERT_EQUAL_size_t(offsetof(stm32_usart_t, SR), offset[0]);
    TEST_ASSERT_EQUAL_size_t(offsetof(stm32_usart_t, DR), offset[1]);
}

/* ORE requests the interrupt as RXNE does: left standing, nothing but this interrupt would run. */
static void test_an_overrun_without_a_byte_is_cleared_and_gives_none(void)
{
    uint8_t byte = 'x';
    TEST_ASSERT_FALSE(receive(1u << 3, &byte));
    assert_status_then_data();
    TEST_ASSERT_EQUAL_HEX8('x', byte);
}

static void test_an_overrun_behind_a_byte_is_cleared_and_the_byte_kept(void)
{
    uint8_t byte = 'x';
    TEST_ASSERT_TRUE(receive((1u << 3) | USART_SR_RXNE, &byte));
    assert_status_then_data();
    TEST_ASSERT_EQUAL_HEX8('d', byte);
}

static void test_a_bad_byte_is_taken_from_the_port_all_the_same(void)
{
    uint8_t byte = 'x';
    TEST_ASSERT_FALSE(receive(USART_SR_RXNE | USART_SR_FE, &byte));
    assert_status_then_data();
    TEST_ASSERT_EQUAL_HEX8('x', byte);
}

/* A byte that arrives behind the status would be lost. */
static void test_without_a_request_the_data_is_left_alone(void)
{
    uint8_t byte = 'x';
    TEST_ASSERT_FALSE(receive(USART_SR_TXE, &byte));
    TEST_ASSERT_EQUAL_INT(1, reads);
    TEST_ASSERT_EQUAL_HEX8('x', byte);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_overrun_without_a_byte_is_cleared_and_gives_none);
    RUN_TEST(test_an_overrun_behind_a_byte_is_cleared_and_the_byte_kept);
    RUN_TEST(test_a_bad_byte_is_taken_from_the_port_all_the_same);
    RUN_TEST(test_without_a_request_the_data_is_left_alone);
    return UNITY_END();
}
