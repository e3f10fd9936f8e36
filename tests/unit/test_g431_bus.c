/* Lines of the fieldbuses on the STM32G431: FDCAN with its message memory, the serial port's part
 * of RS-485, pins of both boards. What the parts share is tested on the F405's registers.
 */
#include "g431_board.h"
#include "stm32_can_line.h"
#include "stm32_rs485.h"

#include "unity.h"

static stm32_fdcan_t can;
static stm32_reg_t ram[STM32_CAN_RAM_WORDS];
static const stm32_can_device_t device = {&can, ram};
static stm32_usart_t usart;
static stm32_rcc_t rcc;
static stm32_gpio_t port[3];

void setUp(void)
{
    can = (stm32_fdcan_t){0};
    usart = (stm32_usart_t){.ISR = USART_ISR_TXE};
    rcc = (stm32_rcc_t){.CCIPR = (3u << 24) | 0x1FFu};
    for (uint32_t k = 0u; k < STM32_CAN_RAM_WORDS; k++) {
        ram[k] = 0u;
    }
    for (uint32_t k = 0u; k < 3u; k++) {
        port[k] = (stm32_gpio_t){0};
    }
}

void tearDown(void)
{
}

static void test_can_starts_for_standard_data_frames(void)
{
    const stm32_can_timing_t timing = {17u, 16u, 3u};
    TEST_ASSERT_TRUE(stm32_can_start(&device, &timing, 10u));
    TEST_ASSERT_EQUAL_HEX32((16u << 16) | (15u << 8) | 2u, can.NBTP);
    TEST_ASSERT_EQUAL_HEX32(0xBu, can.RXGFC); /* no remote, no extended frames */
    TEST_ASSERT_EQUAL_HEX32(1u, can.IE);
    TEST_ASSERT_EQUAL_HEX32(1u, can.ILE);
    TEST_ASSERT_EQUAL_HEX32(0u, can.CCCR);
    TEST_ASSERT_FALSE(stm32_can_start(&device, &timing, 0u)); /* the controller does not come */
}

static void test_a_frame_is_taken_from_where_the_controller_says(void)
{
    hal_can_frame_t frame = {0};
    TEST_ASSERT_FALSE(stm32_can_receive(&device, &frame));
    TEST_ASSERT_EQUAL_HEX32(FDCAN_IR_RF0N, can.IR);
    for (uint32_t at = 0u; at < 3u; at++) {
        stm32_reg_t *const word = &ram[STM32_CAN_RAM_RECEIVED + STM32_CAN_RAM_FRAME * at];
        word[0] = (0x600u + at) << 18;
        word[1] = 6u << 16;
        word[2] = 0x04030201u;
        word[3] = 0xFFFF0605u;
        can.RXF0S = 1u | (at << 8);
        can.RXF0A = 99u;
        TEST_ASSERT_TRUE(stm32_can_receive(&device, &frame));
        TEST_ASSERT_EQUAL_HEX16(0x600u + at, frame.id);
        TEST_ASSERT_EQUAL_UINT8(6u, frame.length);
        TEST_ASSERT_EQUAL_MEMORY("\1\2\3\4\5\6\0\0", frame.data, 8u);
        TEST_ASSERT_EQUAL_UINT32(at, can.RXF0A);
    }
    can.RXF0S = 1u | (3u << 8); /* there are three places */
    TEST_ASSERT_FALSE(stm32_can_receive(&device, &frame));
    ram[STM32_CAN_RAM_RECEIVED + 1u] = 12u << 16;
    can.RXF0S = 1u;
    TEST_ASSERT_TRUE(stm32_can_receive(&device, &frame));
    TEST_ASSERT_EQUAL_UINT8(8u, frame.length);
}

static void test_a_frame_is_put_where_the_controller_says(void)
{
    const hal_can_frame_t frame = {.id = 0x581u, .length = 7u, .data = {1, 2, 3, 4, 5, 6, 7}};
    can.TXFQS = 2u << 16;
    TEST_ASSERT_TRUE(stm32_can_send(&device, &frame));
    const stm32_reg_t *const word = &ram[STM32_CAN_RAM_SENT + 2u * STM32_CAN_RAM_FRAME];
    TEST_ASSERT_EQUAL_HEX32(0x581u << 18, word[0]);
    TEST_ASSERT_EQUAL_HEX32(7u << 16, word[1]);
    TEST_ASSERT_EQUAL_HEX32(0x04030201u, word[2]);
    TEST_ASSERT_EQUAL_HEX32(0x00070605u, word[3]);
    TEST_ASSERT_EQUAL_HEX32(4u, can.TXBAR);
    can.TXBAR = 0u;
    can.TXFQS = FDCAN_TXFQS_TFQF;
    TEST_ASSERT_FALSE(stm32_can_send(&device, &frame));
    can.TXFQS = 3u << 16;
    TEST_ASSERT_FALSE(stm32_can_send(&device, &frame));
    TEST_ASSERT_EQUAL_HEX32(0u, can.TXBAR);
}

static void test_off_the_bus_it_is_told_to_return(void)
{
    can.CCCR = 0x8000u;
    stm32_can_return(&device);
    TEST_ASSERT_EQUAL_HEX32(0x8000u, can.CCCR);
    can.CCCR = 0x8001u;
    stm32_can_return(&device);
    TEST_ASSERT_EQUAL_HEX32(0u, can.CCCR);
}

static void test_the_serial_port_has_a_parity_and_tells_of_the_last_bit(void)
{
    usart.CR1 = USART_CR1_UE | USART_CR1_RE;
    stm32_usart_even(&usart);
    TEST_ASSERT_EQUAL_HEX32(USART_CR1_M0 | USART_CR1_PCE, usart.CR1); /* still off */
    TEST_ASSERT_TRUE(stm32_usart_start(&usart, 170000000u, 19200u));
    const uint32_t on = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_M0 | USART_CR1_PCE;
    TEST_ASSERT_EQUAL_HEX32(on, usart.CR1);
    stm32_usart_wish(&usart, STM32_USART_ROOM);
    TEST_ASSERT_EQUAL_HEX32(on | USART_CR1_TXEIE, usart.CR1);
    stm32_usart_wish(&usart, STM32_USART_DONE);
    TEST_ASSERT_EQUAL_HEX32(on | USART_CR1_TCIE, usart.CR1);
    stm32_usart_wish(&usart, STM32_USART_QUIET);
    TEST_ASSERT_EQUAL_HEX32(on, usart.CR1);
    TEST_ASSERT_FALSE(stm32_usart_sent(&usart));
    usart.ISR = USART_ISR_TC;
    TEST_ASSERT_TRUE(stm32_usart_sent(&usart));
}

static void check_pins(const g431_wiring_t *wiring)
{
    const g431_board_t board = {&rcc, {&port[0], &port[1], &port[2]}, wiring};
    g431_board_bus(&board);
    TEST_ASSERT_EQUAL_HEX32(2u << 24, rcc.CCIPR & RCC_CCIPR_FDCANSEL_Msk);
    TEST_ASSERT_EQUAL_HEX32(0x1FFu, rcc.CCIPR & 0x1FFu); /* of other devices */
    TEST_ASSERT_EQUAL_HEX32(RCC_APB1ENR1_FDCANEN, rcc.APB1ENR1);
    TEST_ASSERT_EQUAL_HEX32(RCC_APB2ENR_USART1EN, rcc.APB2ENR);
    TEST_ASSERT_EQUAL_HEX32(2u << 22, port[0].MODER); /* PA11 */
    TEST_ASSERT_EQUAL_HEX32(9u << 12, port[0].AFRH);
    TEST_ASSERT_EQUAL_HEX32((2u << 12) | (2u << 14) | (1u << 16) | (2u << 18), port[1].MODER);
    TEST_ASSERT_EQUAL_HEX32(0x77000000u, port[1].AFRL);
    TEST_ASSERT_EQUAL_HEX32(0x90u, port[1].AFRH);
    TEST_ASSERT_EQUAL_HEX32(1u << (8u + 16u), port[1].BSRR);
}

static void test_pins_and_clocks_of_both_boards(void)
{
    check_pins(&g431_ihm08m1);
    TEST_ASSERT_EQUAL_HEX32(0u, port[2].MODER);
    setUp();
    check_pins(&g431_esc);
    TEST_ASSERT_EQUAL_HEX32(1u << 22, port[2].MODER); /* PC11: the transceiver is awake */
    TEST_ASSERT_EQUAL_HEX32(1u << (11u + 16u), port[2].BSRR);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_can_starts_for_standard_data_frames);
    RUN_TEST(test_a_frame_is_taken_from_where_the_controller_says);
    RUN_TEST(test_a_frame_is_put_where_the_controller_says);
    RUN_TEST(test_off_the_bus_it_is_told_to_return);
    RUN_TEST(test_the_serial_port_has_a_parity_and_tells_of_the_last_bit);
    RUN_TEST(test_pins_and_clocks_of_both_boards);
    return UNITY_END();
}
