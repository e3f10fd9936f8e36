/* Lines of the fieldbuses on the STM32F405: RS-485 and bxCAN, on register blocks that behave. */
#include "stm32_board.h"
#include "stm32_can_line.h"
#include "stm32_pwm.h"
#include "stm32_rs485.h"
#include "stm32_services.h"

#include <string.h>

#include "unity.h"

#define NOTHING 0xFFFFu
#define PIN     12u

static stm32_usart_t usart;
static stm32_gpio_t gpio;
static stm32_tim_t tim;
static stm32_rs485_t line;
static uint8_t sent[300];
static uint32_t sent_n;
static bool enabled; /* the transceiver's driver */
static bool shifts;  /* a byte is on its way */
static stm32_can_t can;
static stm32_can_line_t bus;

void setUp(void)
{
    usart = (stm32_usart_t){.SR = USART_SR_TXE | USART_SR_TC, .DR = NOTHING};
    gpio = (stm32_gpio_t){0};
    tim = (stm32_tim_t){.CNT = 1000u};
    line = (stm32_rs485_t){.usart = &usart, .port = &gpio, .pin = PIN, .timebase = &tim};
    sent_n = 0u;
    enabled = false;
    shifts = false;
    can = (stm32_can_t){.MSR = CAN_MSR_INAK, .TSR = CAN_TSR_TME0};
    bus = (stm32_can_line_t){.device = {&can}, .timebase = &tim};
}

void tearDown(void)
{
}

/* What the port has done with the pin and the data register. */
static void follow(void)
{
    if (gpio.BSRR != 0u) {
        enabled = (gpio.BSRR & (1u << PIN)) != 0u;
        gpio.BSRR = 0u;
    }
    if (usart.DR != NOTHING) {
        TEST_ASSERT_TRUE(enabled);
        sent[sent_n++] = (uint8_t)usart.DR;
        usart.DR = NOTHING;
        usart.SR &= ~(USART_SR_TXE | USART_SR_TC);
        shifts = true;
    }
}

static bool requested(void)
{
    const uint32_t flags = usart.SR & (USART_SR_RXNE | USART_SR_TC | USART_SR_TXE);
    return (flags & usart.CR1) != 0u; /* each enable lies where its flag does */
}

/* A character's time: what is on its way leaves, and interrupts follow. */
static void character(void)
{
    tim.CNT += 573u;
    if (shifts) {
        shifts = false;
        usart.SR |= USART_SR_TXE;
    } else {
        usart.SR |= USART_SR_TC;
    }
    for (uint32_t n = 0u; requested(); n++) {
        TEST_ASSERT_TRUE(n < 5u); /* else nothing but this interrupt would run */
        stm32_rs485_interrupt(&line);
        follow();
    }
}

static void hear(uint8_t byte)
{
    usart.SR |= USART_SR_RXNE;
    usart.DR = byte;
    stm32_rs485_interrupt(&line);
    usart.SR &= ~USART_SR_RXNE;
    usart.DR = NOTHING;
}

static void start(void)
{
    TEST_ASSERT_TRUE(stm32_rs485_start(&line, 42000000u, 19200u));
    follow();
    tim.CNT += 573u;
}

static void test_a_line_starts_with_even_parity_and_its_driver_off(void)
{
    enabled = true;
    start();
    TEST_ASSERT_FALSE(enabled);
    TEST_ASSERT_EQUAL_HEX32(USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_M |
                                USART_CR1_PCE | USART_CR1_RXNEIE,
                            usart.CR1);
    TEST_ASSERT_FALSE(stm32_rs485_start(&line, 42000000u, 0u));
}

static void test_bytes_come_with_their_times_and_256_of_them_wait(void)
{
    uint8_t byte = 0u;
    uint32_t at_us = 0u;
    start();
    TEST_ASSERT_FALSE(stm32_rs485_read(&line, &byte, &at_us));
    for (uint32_t k = 0u; k < 257u; k++) {
        hear((uint8_t)k);
        tim.CNT += 10u;
    }
    for (uint32_t k = 0u; k < 256u; k++) {
        TEST_ASSERT_TRUE(stm32_rs485_read(&line, &byte, &at_us));
        TEST_ASSERT_EQUAL_UINT8(k, byte);
        TEST_ASSERT_EQUAL_UINT32(1573u + 10u * k, at_us);
    }
    TEST_ASSERT_FALSE(stm32_rs485_read(&line, &byte, &at_us));
    TEST_ASSERT_EQUAL_UINT32(tim.CNT, stm32_rs485_clock_us(&line));
}

static void test_a_damaged_byte_is_dropped(void)
{
    uint8_t byte = 0u;
    uint32_t at_us = 0u;
    start();
    usart.SR |= USART_SR_PE;
    hear(5u);
    TEST_ASSERT_FALSE(stm32_rs485_read(&line, &byte, &at_us));
}

static void test_the_driver_is_on_from_the_first_bit_to_behind_the_last(void)
{
    uint8_t byte = 0u;
    uint32_t at_us = 0u;
    start();
    TEST_ASSERT_EQUAL_UINT32(0u, stm32_rs485_write(&line, (const uint8_t *)"", 0u));
    TEST_ASSERT_EQUAL_UINT32(3u, stm32_rs485_write(&line, (const uint8_t *)"abc", 3u));
    follow();
    TEST_ASSERT_TRUE(enabled);
    TEST_ASSERT_EQUAL_UINT32(0u, stm32_rs485_write(&line, (const uint8_t *)"d", 1u));
    for (uint32_t k = 0u; k < 4u; k++) {
        character();
        TEST_ASSERT_TRUE(enabled);
        hear('e'); /* its echo */
    }
    TEST_ASSERT_EQUAL_UINT32(3u, sent_n);
    TEST_ASSERT_EQUAL_MEMORY("abc", sent, 3u);
    character();
    TEST_ASSERT_FALSE(enabled);
    TEST_ASSERT_EQUAL_HEX32(0u, usart.CR1 & (USART_CR1_TXEIE | USART_CR1_TCIE));
    TEST_ASSERT_FALSE(stm32_rs485_read(&line, &byte, &at_us));
    tim.CNT += 573u;
    hear('f');
    TEST_ASSERT_TRUE(stm32_rs485_read(&line, &byte, &at_us));
    TEST_ASSERT_EQUAL_UINT8('f', byte);
}

/* Its last bit has left, and what it says comes back late: behind an isolator, or because the
 * interrupt looked between both. */
static void test_the_last_echo_is_nobodys_byte(void)
{
    uint8_t byte = 0u;
    uint32_t at_us = 0u;
    start();
    (void)stm32_rs485_write(&line, (const uint8_t *)"ab", 2u);
    follow();
    for (uint32_t k = 0u; k < 4u; k++) {
        character();
    }
    TEST_ASSERT_FALSE(enabled);
    tim.CNT += 30u;
    hear('b');
    TEST_ASSERT_FALSE(stm32_rs485_read(&line, &byte, &at_us));
    tim.CNT += 520u - 30u; /* bits of a whole byte */
    hear('x');
    TEST_ASSERT_TRUE(stm32_rs485_read(&line, &byte, &at_us));
    TEST_ASSERT_EQUAL_UINT8('x', byte);
    tim.CNT += UINT32_MAX - 600u; /* the clock comes round */
    hear('y');
    TEST_ASSERT_TRUE(stm32_rs485_read(&line, &byte, &at_us));
}

static void test_a_byte_under_way_at_the_start_is_dropped(void)
{
    uint8_t byte = 0u;
    uint32_t at_us = 0u;
    TEST_ASSERT_TRUE(stm32_rs485_start(&line, 42000000u, 19200u));
    tim.CNT += 519u;
    hear('x');
    TEST_ASSERT_FALSE(stm32_rs485_read(&line, &byte, &at_us));
    tim.CNT += 573u;
    hear('y');
    TEST_ASSERT_TRUE(stm32_rs485_read(&line, &byte, &at_us));
    TEST_ASSERT_EQUAL_UINT8('y', byte);
}

/* The port never listens in another format than that of the line. */
static void test_the_parity_is_there_before_the_port_is_on(void)
{
    usart.CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
    stm32_usart_even(&usart);
    TEST_ASSERT_EQUAL_HEX32(USART_CR1_M | USART_CR1_PCE, usart.CR1);
    TEST_ASSERT_FALSE(stm32_rs485_start(&line, 42000000u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, usart.CR1 & (USART_CR1_UE | USART_CR1_RE));
}

/* The byte was taken between load and store of the background's own request. */
static void test_a_request_for_room_behind_the_last_byte_ends(void)
{
    start();
    (void)stm32_rs485_write(&line, (const uint8_t *)"a", 1u);
    stm32_rs485_interrupt(&line);
    follow();
    stm32_usart_wish(&usart, STM32_USART_ROOM);
    for (uint32_t k = 0u; k < 3u; k++) {
        character();
    }
    TEST_ASSERT_EQUAL_UINT32(1u, sent_n);
    TEST_ASSERT_FALSE(enabled);
}

static void test_the_longest_answer_is_256_bytes(void)
{
    uint8_t answer[257];
    memset(answer, 0x5A, sizeof answer);
    start();
    TEST_ASSERT_EQUAL_UINT32(256u, stm32_rs485_write(&line, answer, 257u));
    follow();
    for (uint32_t k = 0u; k < 260u; k++) {
        character();
    }
    TEST_ASSERT_EQUAL_UINT32(256u, sent_n);
    TEST_ASSERT_FALSE(enabled);
}

static void test_bit_times_sample_behind_seven_eighths(void)
{
    stm32_can_timing_t t;
    TEST_ASSERT_TRUE(stm32_can_timing(42000000u, 500000u, &t));
    TEST_ASSERT_EQUAL_UINT32(6u, t.divider); /* 14 quanta */
    TEST_ASSERT_EQUAL_UINT32(11u, t.before);
    TEST_ASSERT_EQUAL_UINT32(2u, t.behind);
    TEST_ASSERT_TRUE(stm32_can_timing(170000000u, 500000u, &t));
    TEST_ASSERT_EQUAL_UINT32(17u, t.divider); /* 20 quanta */
    TEST_ASSERT_EQUAL_UINT32(16u, t.before);
    TEST_ASSERT_EQUAL_UINT32(3u, t.behind);
    TEST_ASSERT_TRUE(stm32_can_timing(8000000u, 1000000u, &t));
    TEST_ASSERT_EQUAL_UINT32(1u, t.divider);
    TEST_ASSERT_FALSE(stm32_can_timing(7000000u, 1000000u, &t));
    TEST_ASSERT_FALSE(stm32_can_timing(42000000u, 501000u, &t));
    TEST_ASSERT_TRUE(stm32_can_timing(20u * 512u * 50u, 50u, &t));
    TEST_ASSERT_EQUAL_UINT32(512u, t.divider);
    TEST_ASSERT_FALSE(stm32_can_timing(20u * 2048u * 50u, 50u, &t));
}

static void test_can_starts_for_standard_data_frames(void)
{
    const stm32_can_timing_t timing = {6u, 11u, 2u};
    TEST_ASSERT_TRUE(stm32_can_start(&bus.device, &timing, 10u));
    TEST_ASSERT_EQUAL_HEX32((1u << 20) | (10u << 16) | 5u, can.BTR);
    TEST_ASSERT_EQUAL_HEX32(6u, can.F0R2); /* IDE and RTR have to be 0 */
    TEST_ASSERT_EQUAL_HEX32(0u, can.F0R1);
    TEST_ASSERT_EQUAL_HEX32(1u, can.FA1R);
    TEST_ASSERT_EQUAL_HEX32(1u, can.FS1R);
    TEST_ASSERT_EQUAL_HEX32(0u, can.FMR);
    TEST_ASSERT_EQUAL_HEX32(CAN_IER_FMPIE0, can.IER);
    TEST_ASSERT_EQUAL_HEX32(CAN_MCR_ABOM, can.MCR);
    can.MSR = 0u;
    TEST_ASSERT_FALSE(stm32_can_start(&bus.device, &timing, 10u));
}

static void test_a_frame_is_received_and_released(void)
{
    hal_can_frame_t frame = {0};
    TEST_ASSERT_FALSE(stm32_can_line_read(&bus, &frame));
    can.RF0R = 2u;
    can.RI0R = 0x605u << 21;
    can.RDT0R = 0xAB000005u;
    can.RDL0R = 0x04030201u;
    can.RDH0R = 0xFFFFFF05u;
    stm32_can_line_interrupt(&bus);
    TEST_ASSERT_EQUAL_HEX32(CAN_RF0R_RFOM0, can.RF0R);
    TEST_ASSERT_TRUE(stm32_can_line_read(&bus, &frame));
    TEST_ASSERT_EQUAL_HEX16(0x605u, frame.id);
    TEST_ASSERT_EQUAL_UINT8(5u, frame.length);
    TEST_ASSERT_EQUAL_MEMORY("\1\2\3\4\5\0\0\0", frame.data, 8u);
    TEST_ASSERT_FALSE(stm32_can_line_read(&bus, &frame));
    can.RF0R = CAN_RF0R_RFOM0 | 1u; /* not released yet: the old one still shows */
    stm32_can_line_interrupt(&bus);
    TEST_ASSERT_FALSE(stm32_can_line_read(&bus, &frame));
    can.RF0R = 1u;
    can.RDT0R = 15u; /* a length that classic frames have not: eight bytes */
    stm32_can_line_interrupt(&bus);
    TEST_ASSERT_TRUE(stm32_can_line_read(&bus, &frame));
    TEST_ASSERT_EQUAL_UINT8(8u, frame.length);
    TEST_ASSERT_EQUAL_UINT32(tim.CNT, stm32_can_line_clock_us(&bus));
}

static void test_a_full_queue_drops_the_newest_frame(void)
{
    hal_can_frame_t frame = {0};
    for (uint32_t k = 0u; k < STM32_CAN_FRAMES + 1u; k++) {
        can.RF0R = 1u;
        can.RI0R = k << 21;
        stm32_can_line_interrupt(&bus);
    }
    for (uint32_t k = 0u; k < STM32_CAN_FRAMES; k++) {
        TEST_ASSERT_TRUE(stm32_can_line_read(&bus, &frame));
        TEST_ASSERT_EQUAL_UINT16(k, frame.id);
    }
    TEST_ASSERT_FALSE(stm32_can_line_read(&bus, &frame));
}

static void test_frames_leave_in_their_order_as_the_mailbox_has_room(void)
{
    hal_can_frame_t frame = {.id = 0x185u, .length = 8u, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    TEST_ASSERT_TRUE(stm32_can_line_write(&bus, &frame));
    TEST_ASSERT_EQUAL_HEX32((0x185u << 21) | CAN_TI0R_TXRQ, can.TI0R);
    TEST_ASSERT_EQUAL_UINT32(8u, can.TDT0R);
    TEST_ASSERT_EQUAL_HEX32(0x04030201u, can.TDL0R);
    TEST_ASSERT_EQUAL_HEX32(0x08070605u, can.TDH0R);
    can.TSR = 0u;
    for (uint32_t k = 0u; k < STM32_CAN_FRAMES; k++) {
        frame.id = (uint16_t)k;
        TEST_ASSERT_TRUE(stm32_can_line_write(&bus, &frame));
    }
    TEST_ASSERT_FALSE(stm32_can_line_write(&bus, &frame));
    TEST_ASSERT_EQUAL_HEX32((0x185u << 21) | CAN_TI0R_TXRQ, can.TI0R);
    can.TSR = CAN_TSR_TME0;
    for (uint32_t k = 0u; k < STM32_CAN_FRAMES / 3u + 1u; k++) {
        TEST_ASSERT_FALSE(stm32_can_line_read(&bus, &frame));
    }
    TEST_ASSERT_EQUAL_HEX32(((STM32_CAN_FRAMES - 1u) << 21) | CAN_TI0R_TXRQ, can.TI0R);
    can.TI0R = 0u;
    TEST_ASSERT_FALSE(stm32_can_line_read(&bus, &frame));
    TEST_ASSERT_EQUAL_HEX32(0u, can.TI0R);
}

static void test_the_boards_pins_and_clocks(void)
{
    static stm32_rcc_t rcc;
    static stm32_gpio_t port[3];
    const stm32_board_t board = {&rcc, &port[0], &port[1], &port[2]};
    stm32_board_bus(&board);
    TEST_ASSERT_EQUAL_HEX32((1u << 19) | (1u << 25), rcc.APB1ENR);
    TEST_ASSERT_EQUAL_HEX32(1u << (12u + 16u), port[2].BSRR);
    TEST_ASSERT_EQUAL_HEX32((2u << 20) | (2u << 22) | (1u << 24), port[2].MODER);
    TEST_ASSERT_EQUAL_HEX32(0x8800u, port[2].AFRH);
    TEST_ASSERT_EQUAL_HEX32((2u << 16) | (2u << 18), port[1].MODER);
    TEST_ASSERT_EQUAL_HEX32(0x99u, port[1].AFRH);
    TEST_ASSERT_EQUAL_HEX32(0u, port[0].MODER);
}

static void test_a_reset_clears_the_break_and_who_asks_is_told_of_it(void)
{
    tim.SR = TIM_SR_BIF;
    TEST_ASSERT_TRUE(stm32_pwm_held(&tim, false));
    TEST_ASSERT_EQUAL_HEX32(TIM_SR_BIF, tim.SR & TIM_SR_BIF);
    TEST_ASSERT_TRUE(stm32_pwm_held(&tim, true));
    TEST_ASSERT_FALSE(stm32_pwm_held(&tim, true));
}

static void test_the_background_is_served_by_the_part(void)
{
    static stm32_inbox_t inbox;
    static stm32_iwdg_t iwdg;
    static stm32_rng_t rng;
    const stm32_services_t services = {&usart, &tim, &iwdg, &rng, &inbox};
    void *const context = (void *)&services;
    uint8_t byte = 0u;
    uint64_t bits = 0u;
    TEST_ASSERT_FALSE(stm32_services_link_read(context, &byte));
    usart.SR = USART_SR_RXNE;
    usart.DR = 7u;
    stm32_services_received(&services);
    usart.SR = 0u;
    stm32_services_received(&services);
    TEST_ASSERT_TRUE(stm32_services_link_read(context, &byte));
    TEST_ASSERT_EQUAL_UINT8(7u, byte);
    TEST_ASSERT_FALSE(stm32_services_link_read(context, &byte));
    TEST_ASSERT_EQUAL_UINT32(0u, stm32_services_link_write(context, &byte, 1u));
    usart.SR = USART_SR_TXE;
    TEST_ASSERT_EQUAL_UINT32(0u, stm32_services_link_write(context, &byte, 0u));
    TEST_ASSERT_EQUAL_UINT32(1u, stm32_services_link_write(context, (const uint8_t *)"xy", 2u));
    TEST_ASSERT_EQUAL_UINT32('x', usart.DR);
    stm32_services_watchdog(context);
    TEST_ASSERT_EQUAL_HEX32(0xAAAAu, iwdg.KR);
    TEST_ASSERT_EQUAL_UINT32(1000u, stm32_services_clock_us(context));
    TEST_ASSERT_FALSE(stm32_services_entropy(context, &bits)); /* no word in time */
    stm32_services_drain(&services); /* and no end of the sending: not for ever */
    usart.SR = USART_SR_TC;
    stm32_services_drain(&services);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_line_starts_with_even_parity_and_its_driver_off);
    RUN_TEST(test_bytes_come_with_their_times_and_256_of_them_wait);
    RUN_TEST(test_a_damaged_byte_is_dropped);
    RUN_TEST(test_the_driver_is_on_from_the_first_bit_to_behind_the_last);
    RUN_TEST(test_the_last_echo_is_nobodys_byte);
    RUN_TEST(test_a_byte_under_way_at_the_start_is_dropped);
    RUN_TEST(test_the_parity_is_there_before_the_port_is_on);
    RUN_TEST(test_a_request_for_room_behind_the_last_byte_ends);
    RUN_TEST(test_the_longest_answer_is_256_bytes);
    RUN_TEST(test_bit_times_sample_behind_seven_eighths);
    RUN_TEST(test_can_starts_for_standard_data_frames);
    RUN_TEST(test_a_frame_is_received_and_released);
    RUN_TEST(test_a_full_queue_drops_the_newest_frame);
    RUN_TEST(test_frames_leave_in_their_order_as_the_mailbox_has_room);
    RUN_TEST(test_the_boards_pins_and_clocks);
    RUN_TEST(test_a_reset_clears_the_break_and_who_asks_is_told_of_it);
    RUN_TEST(test_the_background_is_served_by_the_part);
    return UNITY_END();
}
