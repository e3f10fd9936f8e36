/* Both fieldbuses of one drive in one background. */
#include "fieldbus_slave.h"

#include "bus_fixture.h"
#include "modbus_crc.h"

static fieldbus_slave_t slave;
static uint8_t tape[64];
static uint32_t tape_n;
static uint32_t tape_taken;
static uint32_t answered; /* bytes on the serial line */
static uint32_t sent;     /* frames on the other one */
static uint32_t now_us;

static bool serial_read(void *context, uint8_t *byte, uint32_t *at_us)
{
    (void)context;
    if (tape_taken >= tape_n) {
        return false;
    }
    *byte = tape[tape_taken++];
    *at_us = now_us;
    return true;
}

static uint32_t serial_write(void *context, const uint8_t *data, uint32_t n)
{
    (void)context;
    (void)data;
    answered += n;
    return n;
}

static bool can_read(void *context, hal_can_frame_t *frame)
{
    (void)context;
    (void)frame;
    return false;
}

static bool can_write(void *context, const hal_can_frame_t *frame)
{
    (void)context;
    (void)frame;
    sent++;
    return true;
}

static uint32_t clock_us(void *context)
{
    (void)context;
    return now_us;
}

static const hal_serial_t serial = {NULL, 1750u, serial_read, serial_write, clock_us};
static const hal_can_t can = {NULL, can_read, can_write, clock_us};

void setUp(void)
{
    start_drive();
    slave = (fieldbus_slave_t){0};
    tape_n = 0u;
    tape_taken = 0u;
    answered = 0u;
    sent = 0u;
}
void tearDown(void)
{
}

static void background(const fieldbus_lines_t *lines, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        now_us += 2000u;
        fieldbus_slave_background(&slave, unit(), lines);
    }
}

static void write_control(const fieldbus_lines_t *lines, uint8_t control)
{
    const uint8_t frame[] = {1u, 6u, 0u, 0u, 0u, control};
    const uint16_t crc = modbus_crc(frame, sizeof frame);
    tape_n = 0u;
    tape_taken = 0u;
    for (size_t k = 0u; k < sizeof frame; k++) {
        tape[tape_n++] = frame[k];
    }
    tape[tape_n++] = (uint8_t)crc;
    tape[tape_n++] = (uint8_t)(crc >> 8);
    background(lines, 3u);
}

static void test_a_run_by_modbus_is_not_ended_by_a_silent_canopen(void)
{
    const fieldbus_lines_t both = {&serial, &can};
    write_control(&both, 0u);
    write_control(&both, MODBUS_RUN);
    background(&both, 3u);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, slave.fieldbus.demand.command);
    TEST_ASSERT_EQUAL_UINT32(16u, answered);
    TEST_ASSERT_EQUAL_UINT32(1u, sent); /* it booted */
}

static void test_a_host_takes_the_drive_from_the_bus(void)
{
    const fieldbus_lines_t both = {&serial, &can};
    write_control(&both, 0u);
    write_control(&both, MODBUS_RUN);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, fieldbus_command(&slave.fieldbus, unit()).command);
    host_commands(0u);
    TEST_ASSERT_EQUAL_UINT32(0u, fieldbus_command(&slave.fieldbus, unit()).command);
}

static void test_a_line_that_is_not_there_is_left_alone(void)
{
    write_control(&(fieldbus_lines_t){&serial, NULL}, 0u);
    TEST_ASSERT_EQUAL_UINT32(8u, answered);
    TEST_ASSERT_EQUAL_UINT32(0u, sent);
    background(&(fieldbus_lines_t){NULL, &can}, 1u);
    TEST_ASSERT_EQUAL_UINT32(8u, answered);
    TEST_ASSERT_EQUAL_UINT32(1u, sent);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_run_by_modbus_is_not_ended_by_a_silent_canopen);
    RUN_TEST(test_a_host_takes_the_drive_from_the_bus);
    RUN_TEST(test_a_line_that_is_not_there_is_left_alone);
    return UNITY_END();
}
