/* The CANopen slave: NMT, heartbeats, SDO, PDO, EMCY, and CiA 402 on the drive. */
#include "canopen.h"

#include <math.h>
#include <string.h>

#include "bus_fixture.h"
#include "canopen_402.h"
#include "canopen_pdo.h"
#include "fieldbus_params.h"
#include "unit_signal.h"

#define TAPE 256u
#define NODE 5u

static canopen_t co;
static canopen_drive_t drive;
static hal_can_frame_t tape[TAPE];
static uint32_t tape_n;
static uint32_t tape_taken;
static hal_can_frame_t said[TAPE];
static uint32_t said_n;
static uint32_t now_us;
static bool full;

static bool can_read(void *context, hal_can_frame_t *frame)
{
    (void)context;
    if (tape_taken >= tape_n) {
        return false;
    }
    *frame = tape[tape_taken++];
    return true;
}

static bool can_write(void *context, const hal_can_frame_t *frame)
{
    (void)context;
    if (full) {
        return false;
    }
    said[said_n++] = *frame;
    return true;
}

static uint32_t can_clock(void *context)
{
    (void)context;
    return now_us;
}

static const hal_can_t can = {.read = can_read, .write = can_write, .clock_us = can_clock};

static void slice(void)
{
    canopen_background(&co, &drive, &can);
}

static void receive(uint16_t id, const uint8_t *data, uint8_t n)
{
    hal_can_frame_t frame = {.id = id, .length = n};
    memcpy(frame.data, data, n);
    tape_n = 0u;
    tape_taken = 0u;
    said_n = 0u;
    tape[tape_n++] = frame;
    slice();
}

#define RECEIVE(id, ...)                                                                           \
    receive(id, (const uint8_t[]){__VA_ARGS__}, (uint8_t)sizeof((const uint8_t[]){__VA_ARGS__}))

void setUp(void)
{
    start_drive();
    unit()->params.fieldbus_address = NODE;
    co = (canopen_t){0};
    drive = (canopen_drive_t){&fb, unit()};
    tape_n = 0u;
    tape_taken = 0u;
    said_n = 0u;
    now_us = UINT32_MAX - 100000u; /* wraps meanwhile */
    full = false;
    slice();
}
void tearDown(void)
{
}

/* An expedited read; the abort code, or 0 and the value. */
static uint32_t read_object(uint32_t index, uint32_t sub, uint32_t *bits, uint32_t *bytes)
{
    RECEIVE(0x600u + NODE, 0x40u, (uint8_t)index, (uint8_t)(index >> 8), (uint8_t)sub, 0u, 0u, 0u,
            0u);
    TEST_ASSERT_TRUE(said_n >= 1u);
    const hal_can_frame_t *a = &said[0];
    TEST_ASSERT_EQUAL_HEX16(0x580u + NODE, a->id);
    TEST_ASSERT_EQUAL_UINT8(8u, a->length);
    *bits = a->data[4] | ((uint32_t)a->data[5] << 8) | ((uint32_t)a->data[6] << 16) |
            ((uint32_t)a->data[7] << 24);
    TEST_ASSERT_EQUAL_HEX8(index & 0xFFu, a->data[1]);
    TEST_ASSERT_EQUAL_HEX8(index >> 8, a->data[2]);
    TEST_ASSERT_EQUAL_HEX8(sub, a->data[3]);
    if (a->data[0] == 0x80u) {
        return *bits;
    }
    *bytes = 4u - ((a->data[0] >> 2) & 3u);
    TEST_ASSERT_EQUAL_HEX8(0x43u, a->data[0] & 0xF3u);
    return 0u;
}

static uint32_t value_of(uint32_t index, uint32_t sub)
{
    uint32_t bits = 0u;
    uint32_t bytes = 0u;
    TEST_ASSERT_EQUAL_HEX32(0u, read_object(index, sub, &bits, &bytes));
    return bits;
}

static uint32_t abort_of_answer(void)
{
    TEST_ASSERT_TRUE(said_n >= 1u);
    const uint8_t *d = said[0].data;
    return (d[0] != 0x80u)
               ? 0u
               : (d[4] | ((uint32_t)d[5] << 8) | ((uint32_t)d[6] << 16) | ((uint32_t)d[7] << 24));
}

static uint32_t write_object(uint32_t index, uint32_t sub, uint32_t bits, uint32_t bytes)
{
    RECEIVE(0x600u + NODE, (uint8_t)(0x23u | ((4u - bytes) << 2)), (uint8_t)index,
            (uint8_t)(index >> 8), (uint8_t)sub, (uint8_t)bits, (uint8_t)(bits >> 8),
            (uint8_t)(bits >> 16), (uint8_t)(bits >> 24));
    return abort_of_answer();
}

static uint32_t control(uint32_t word)
{
    return write_object(0x6040u, 0u, word, 2u);
}

static uint32_t state(void)
{
    return value_of(0x6041u, 0u) & 0x6Fu;
}

static void operational(void)
{
    RECEIVE(0u, 1u, NODE);
    TEST_ASSERT_EQUAL(CANOPEN_OPERATIONAL, co.nmt);
}

static void enable(void)
{
    operational();
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x06u));
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x07u));
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x7Fu));
    rounds(3u);
    TEST_ASSERT_EQUAL_HEX32(0x27u, state());
    TEST_ASSERT_TRUE(unit()->asked.mode != DRIVE_OFF);
}

static void test_it_boots_into_pre_operational(void)
{
    TEST_ASSERT_EQUAL_UINT32(1u, said_n);
    TEST_ASSERT_EQUAL_HEX16(0x705u, said[0].id);
    TEST_ASSERT_EQUAL_UINT8(1u, said[0].length);
    TEST_ASSERT_EQUAL_UINT8(0u, said[0].data[0]);
    TEST_ASSERT_EQUAL(CANOPEN_PRE_OPERATIONAL, co.nmt);
}

static void test_network_management(void)
{
    RECEIVE(0u, 1u, 0u); /* everybody */
    TEST_ASSERT_EQUAL(CANOPEN_OPERATIONAL, co.nmt);
    RECEIVE(0u, 2u, NODE + 1u);
    TEST_ASSERT_EQUAL(CANOPEN_OPERATIONAL, co.nmt);
    RECEIVE(0u, 99u, NODE);
    TEST_ASSERT_EQUAL(CANOPEN_OPERATIONAL, co.nmt);
    RECEIVE(0u, 2u);
    TEST_ASSERT_EQUAL(CANOPEN_OPERATIONAL, co.nmt);
    RECEIVE(0u, 128u, NODE);
    TEST_ASSERT_EQUAL(CANOPEN_PRE_OPERATIONAL, co.nmt);
    RECEIVE(0u, 2u, NODE);
    TEST_ASSERT_EQUAL(CANOPEN_STOPPED, co.nmt);
    RECEIVE(0x605u, 0x40u, 0u, 0x10u, 0u, 0u, 0u, 0u, 0u); /* no SDO when stopped */
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    operational();
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1017u, 0u, 7u, 2u));
    RECEIVE(0u, 129u, NODE);
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, value_of(0x1017u, 0u));
    TEST_ASSERT_EQUAL(CANOPEN_PRE_OPERATIONAL, co.nmt);
    RECEIVE(0u, 130u, NODE);
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_HEX16(0x705u, said[0].id);
}

static void test_it_beats_as_often_as_it_was_told(void)
{
    now_us += 1000000u;
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1017u, 0u, 100u, 2u));
    said_n = 0u;
    now_us += 99999u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    now_us += 1u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(1u, said_n);
    TEST_ASSERT_EQUAL_UINT8(127u, said[0].data[0]);
}

static void beat(void)
{
    RECEIVE(0x700u + 9u, 5u);
}

static void test_a_lost_heartbeat_ends_the_run_command_and_is_told_once(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1016u, 1u, (9u << 16) | 100u, 4u));
    enable();
    now_us += 500000u; /* not watched before the first one */
    slice();
    TEST_ASSERT_EQUAL_HEX32(0x27u, state());
    RECEIVE(0x700u + 8u, 5u); /* somebody else's */
    TEST_ASSERT_FALSE(co.hears);
    beat();
    now_us += 99999u;
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, fb.demand.command);
    now_us += 1u;
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, fb.demand.command);
    TEST_ASSERT_EQUAL_HEX16(0x85u, said[0].id);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[]){0x30u, 0x81u, 0x10u, 0u, 0u, 0u, 0u, 0u}),
                                 said[0].data, 8u);
    TEST_ASSERT_EQUAL(CIA402_QUICK_STOP_ACTIVE, co.od.machine.id);
    said_n = 0u;
    slice();
    TEST_ASSERT_TRUE((said_n == 0u) || (said[0].id != 0x85u));
    beat();
    TEST_ASSERT_FALSE(co.lost);
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1016u, 1u, 0u, 4u));
    now_us += 500000u;
    slice();
    TEST_ASSERT_FALSE(co.lost); /* not watched any more */
}

static void test_a_heartbeat_renews_the_command(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1016u, 1u, (9u << 16) | 1000u, 4u));
    beat();
    TEST_ASSERT_EQUAL_UINT32(0u, fb.commands); /* not operational */
    enable();
    const uint32_t before = fb.commands;
    beat();
    TEST_ASSERT_EQUAL_UINT32(before + 1u, fb.commands);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, fb.demand.command);
}

static void test_silence_shows_as_quick_stop(void)
{
    enable();
    rounds(600u);
    slice();
    TEST_ASSERT_EQUAL_HEX32(0x40u, state()); /* coasts: over at once */
}

static void test_leaving_operational_ends_the_run_command(void)
{
    enable();
    RECEIVE(0u, 128u, NODE);
    TEST_ASSERT_EQUAL_UINT32(0u, fb.demand.command);
    rounds(5u);
    RECEIVE(0u, 128u, NODE); /* nothing runs */
    operational();
    RECEIVE(0u, 128u, NODE);
    enable();
    RECEIVE(0u, 129u, NODE);
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, fb.demand.command & SEQUENCE_CMD_RUN);
}

static void test_every_object_is_read_with_its_length(void)
{
    static const struct {
        uint16_t index;
        uint8_t sub;
        uint32_t bytes;
    } all[] = {
#define CANOPEN_STORED(index, sub, type, access, initial, name) {index, sub, TEST_##type},
#define CANOPEN_NODE(index, sub, type, access, initial, name)   {index, sub, TEST_##type},
#define CANOPEN_LIVE(index, sub, type, access, value, name)     {index, sub, TEST_##type},
#define TEST_U8                                                 1u
#define TEST_I8                                                 1u
#define TEST_U16                                                2u
#define TEST_I16                                                2u
#define TEST_U32                                                4u
#include "canopen_objects.def"
    };
    for (size_t k = 0u; k < sizeof all / sizeof all[0]; k++) {
        uint32_t bits = 0u;
        uint32_t bytes = 0u;
        TEST_ASSERT_EQUAL_HEX32(0u, read_object(all[k].index, all[k].sub, &bits, &bytes));
        TEST_ASSERT_EQUAL_UINT32(all[k].bytes, bytes);
    }
    TEST_ASSERT_EQUAL_HEX32(0x00010192u, value_of(0x1000u, 0u));
    TEST_ASSERT_EQUAL_HEX32(0x85u, value_of(0x1014u, 0u));
    TEST_ASSERT_EQUAL_HEX32(0x605u, value_of(0x1200u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0x205u, value_of(0x1400u, 1u));
}

static void test_parameters_and_signals_are_objects(void)
{
    const uint32_t rs = value_of(0x2000u, 1u);
    TEST_ASSERT_EQUAL_HEX32(float_bits(unit()->params.Rs_ohm), rs);
    TEST_ASSERT_EQUAL_HEX32(unit_signal(unit(), 4u), value_of(0x3004u, 0u));
    uint32_t bits;
    uint32_t bytes;
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT, read_object(0x2000u, 0u, &bits, &bytes));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT, read_object(0x2000u, 7u, &bits, &bytes));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT, read_object(0x20FFu, 1u, &bits, &bytes));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT, read_object(0x1FFFu, 1u, &bits, &bytes));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT, read_object(0x3004u, 1u, &bits, &bytes));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT,
                            read_object(0x3000u + UNIT_SIGNALS, 0u, &bits, &bytes));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_SUB_INDEX, read_object(0x6040u, 1u, &bits, &bytes));
}

static void test_writes_have_their_abort_codes(void)
{
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_READ_ONLY, write_object(0x3004u, 0u, 1u, 2u)); /* a signal */
    const uint32_t group = PARAM_GROUP_FLUX;
    uint32_t k = 0u;
    while (fieldbus_param_at(group, k) != params_find("premagnetise_s")) {
        k++;
    }
    const uint32_t at = 0x2000u + group;
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(at, k + 1u, float_bits(0.75f), 4u));
    TEST_ASSERT_EQUAL_FLOAT(0.75f, unit()->params.premagnetise_s);
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_OUT_OF_RANGE, write_object(at, k + 1u, 0xFFFFFFFFu, 4u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_WRONG_LENGTH, write_object(at, k + 1u, 1u, 2u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_READ_ONLY, write_object(0x2000u, 1u, float_bits(1.0f), 4u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_READ_ONLY, write_object(0x3000u, 0u, 1u, 4u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_READ_ONLY, write_object(0x6041u, 0u, 1u, 2u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_READ_ONLY, write_object(0x1000u, 0u, 1u, 4u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT, write_object(0x7000u, 0u, 1u, 4u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_OUT_OF_RANGE, write_object(0x6060u, 0u, 3u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x7Fu));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_OUT_OF_RANGE, write_object(0x6042u, 0u, 32767u, 2u));
    TEST_ASSERT_EQUAL_UINT32(0u, value_of(0x6042u, 0u));
    unit()->params.fieldbus_commands = 0u;
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NOT_NOW, control(0x06u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NOT_NOW, write_object(at, k + 1u, float_bits(0.5f), 4u));
    host_commands(0u);
}

static void test_a_text_comes_in_segments(void)
{
    static const char name[] = "ZeroHertz induction-motor drive";
    char got[40] = {0};
    uint32_t n = 0u;
    RECEIVE(0x605u, 0x40u, 0x08u, 0x10u, 0u, 0u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL_HEX8(0x41u, said[0].data[0]);
    TEST_ASSERT_EQUAL_UINT8(sizeof name - 1u, said[0].data[4]);
    for (uint8_t toggle = 0u; n < sizeof name - 1u; toggle ^= 0x10u) {
        RECEIVE(0x605u, (uint8_t)(0x60u | toggle), 0u, 0u, 0u, 0u, 0u, 0u, 0u);
        const uint8_t head = said[0].data[0];
        TEST_ASSERT_EQUAL_HEX8(toggle, head & 0xF0u);
        const uint32_t bytes = 7u - ((head >> 1) & 7u);
        memcpy(&got[n], &said[0].data[1], bytes);
        n += bytes;
        TEST_ASSERT_EQUAL_UINT8((n == sizeof name - 1u) ? 1u : 0u, head & 1u);
    }
    TEST_ASSERT_EQUAL_STRING(name, got);
    TEST_ASSERT_EQUAL_UINT32(sizeof name - 1u, n);
    RECEIVE(0x605u, 0x60u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL_HEX32(0x05040001u, abort_of_answer()); /* it is over */
    RECEIVE(0x605u, 0x40u, 0x08u, 0x10u, 0u, 0u, 0u, 0u, 0u);
    RECEIVE(0x605u, 0x70u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL_HEX32(0x05030000u, abort_of_answer()); /* wrong toggle */
    uint32_t bits;
    uint32_t bytes;
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NO_OBJECT, read_object(0x1008u, 1u, &bits, &bytes));
}

static void test_a_value_is_downloaded_in_segments(void)
{
    RECEIVE(0x605u, 0x21u, 0x16u, 0x10u, 1u, 4u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL_HEX8(0x60u, said[0].data[0]);
    RECEIVE(0x605u, 0x0Au, 0x64u, 0x00u, 0u, 0u, 0u, 0u, 0u); /* two bytes, more follow */
    TEST_ASSERT_EQUAL_HEX8(0x20u, said[0].data[0]);
    RECEIVE(0x605u, 0x1Bu, 0x09u, 0x00u, 0u, 0u, 0u, 0u, 0u); /* the last two */
    TEST_ASSERT_EQUAL_HEX8(0x30u, said[0].data[0]);
    TEST_ASSERT_EQUAL_HEX32(0x00090064u, value_of(0x1016u, 1u));
    TEST_ASSERT_EQUAL(CANOPEN_SDO_IDLE, co.sdo.phase);
    RECEIVE(0x605u, 0x0Bu, 1u, 2u, 0u, 0u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL_HEX32(0x05040001u, abort_of_answer()); /* none is begun */
    RECEIVE(0x605u, 0x20u, 0x16u, 0x10u, 1u, 0u, 0u, 0u, 0u);
    RECEIVE(0x605u, 0x1Bu, 1u, 2u, 0u, 0u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL_HEX32(0x05030000u, abort_of_answer());
    RECEIVE(0x605u, 0x20u, 0x16u, 0x10u, 1u, 0u, 0u, 0u, 0u);
    RECEIVE(0x605u, 0x01u, 1u, 2u, 3u, 4u, 5u, 6u, 7u);
    TEST_ASSERT_EQUAL_HEX32(0x06070012u, abort_of_answer());
    RECEIVE(0x605u, 0x20u, 0x16u, 0x10u, 1u, 0u, 0u, 0u, 0u);
    RECEIVE(0x605u, 0x80u, 0u, 0u, 0u, 0u, 0u, 0u, 0u); /* the client gives up */
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    TEST_ASSERT_EQUAL(CANOPEN_SDO_IDLE, co.sdo.phase);
    RECEIVE(0x605u, 0x22u, 0x16u, 0x10u, 1u, 1u, 0u, 0u, 0u); /* no size said: four bytes */
    TEST_ASSERT_EQUAL_HEX32(1u, value_of(0x1016u, 1u));
    RECEIVE(0x605u, 0x2Eu, 0x16u, 0x10u, 1u, 2u, 0u, 9u, 0u); /* then its count says nothing */
    TEST_ASSERT_EQUAL_HEX32(0x00090002u, value_of(0x1016u, 1u));
    RECEIVE(0x605u, 0xA0u, 0x16u, 0x10u, 1u, 0u, 0u, 0u, 0u); /* block transfer */
    TEST_ASSERT_EQUAL_HEX32(0x05040001u, abort_of_answer());
    RECEIVE(0x605u, 0x40u, 0x16u);
    TEST_ASSERT_EQUAL_UINT32(0u, said_n); /* short */
}

static void test_enabling_starts_the_drive_with_its_target(void)
{
    operational();
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x6042u, 0u, 60u, 2u));
    enable();
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.0f * NUM_PI, fb.demand.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_UINT32(60u, value_of(0x6043u, 0u));
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x17Fu)); /* halt */
    TEST_ASSERT_EQUAL_FLOAT(0.0f, fb.demand.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x3Fu)); /* the ramp's reference is not enabled */
    TEST_ASSERT_EQUAL_FLOAT(0.0f, fb.demand.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x7Fu));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x6042u, 0u, 0xFFC4u, 2u));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, -2.0f * NUM_PI, fb.demand.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x00u));
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_TORQUE_OFF, fb.demand.command);
    TEST_ASSERT_EQUAL_HEX32(0x40u, state());
}

static void test_torque_is_per_mille_of_the_rated_one(void)
{
    operational();
    const params_t *p = &unit()->params;
    const float rated_Nm = p->pole_pairs * p->M_H / p->Lr_H * p->M_H * p->i_d_A * p->i_q_max_A;
    TEST_ASSERT_UINT32_WITHIN(1u, (uint32_t)(1000.0f * rated_Nm), value_of(0x6076u, 0u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x6060u, 0u, 4u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x6071u, 0u, 0xFF9Cu, 2u)); /* -100 */
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, -0.1f * rated_Nm, fb.demand.torque_ref_Nm);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_TORQUE_MODE | SEQUENCE_CMD_TORQUE_OFF, fb.demand.command);
    TEST_ASSERT_EQUAL_UINT32(4u, value_of(0x6061u, 0u));
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x106u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, fb.demand.torque_ref_Nm);
    unit()->drive.estimator.estimate.lambda_r_hat_Wb = (ab_t){0.5f, 0.0f};
    unit()->last.meas.i_s_A = (ab_t){0.0f, 2.0f};
    const float share = 1000.0f * 2.0f * 0.5f * 2.0f / rated_Nm;
    TEST_ASSERT_UINT32_WITHIN(1u, (uint32_t)share, value_of(0x6077u, 0u));
}

static void test_faults_are_states_codes_and_emergencies(void)
{
    enable();
    unit()->machine.faults = FAULT_OVER_CURRENT;
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[]){0x10u, 0x23u, 1u, 1u, 0u, 0u, 0u, 0u}),
                                 said[0].data, 8u);
    TEST_ASSERT_EQUAL(CIA402_FAULT_REACTION_ACTIVE, co.od.machine.id);
    TEST_ASSERT_EQUAL_UINT32(0u, fb.demand.command);
    unit()->machine.id = SEQUENCE_FAULT;
    slice();
    TEST_ASSERT_EQUAL_HEX32(0x08u, state() & 0x4Fu);
    TEST_ASSERT_EQUAL_HEX32(0x2310u, value_of(0x603Fu, 0u));
    TEST_ASSERT_EQUAL_HEX32(1u, value_of(0x1001u, 0u));
    TEST_ASSERT_EQUAL_HEX32(0u, control(0x80u));
    TEST_ASSERT_TRUE(fb.reset);
    unit()->machine.id = SEQUENCE_READY;
    unit()->machine.faults = 0u;
    unit()->asked.mode = DRIVE_OFF;
    full = true;
    said_n = 0u;
    slice(); /* the line is busy: it tells later */
    full = false;
    slice();
    TEST_ASSERT_EQUAL_UINT32(1u, said_n);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[8]){0u}), said[0].data, 8u);
    TEST_ASSERT_EQUAL_HEX32(0x40u, state());
    said_n = 0u;
    RECEIVE(0u, 2u, NODE);
    unit()->machine.faults = FAULT_STALL;
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, said_n); /* stopped: NMT and heartbeat alone */
}

static void test_an_emergency_carries_every_fault_bit(void)
{
    unit()->machine.faults = 0x93C1A501u;
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[]){0x01u, 0xA5u, 0xC1u, 0x93u, 0u}),
                                 &said[0].data[3], 5u);
}

static void test_actual_values_have_a_sign_and_a_limit(void)
{
    unit()->drive.estimator.estimate.lambda_r_hat_Wb = (ab_t){0.5f, 0.0f};
    unit()->last.meas.i_s_A = (ab_t){0.0f, -2.0f};
    const uint32_t torque = value_of(0x6077u, 0u);
    TEST_ASSERT_TRUE((torque > 0x8000u) && (torque < 0xFFFFu));
    unit()->last.meas.i_s_A = (ab_t){0.0f, -2e6f};
    TEST_ASSERT_EQUAL_HEX32(0x8001u, value_of(0x6077u, 0u));
    unit()->last.meas.i_s_A = (ab_t){0.0f, 2e6f};
    TEST_ASSERT_EQUAL_HEX32(0x7FFFu, value_of(0x6077u, 0u));
}

static void test_error_codes(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, canopen_od_error_code(0u));
    TEST_ASSERT_EQUAL_HEX32(0x2330u, canopen_od_error_code(FAULT_EARTH_FAULT));
    TEST_ASSERT_EQUAL_HEX32(0x3210u, canopen_od_error_code(FAULT_DC_OVER_VOLTAGE));
    TEST_ASSERT_EQUAL_HEX32(0x3220u, canopen_od_error_code(FAULT_DC_UNDER_VOLTAGE));
    TEST_ASSERT_EQUAL_HEX32(0x4310u, canopen_od_error_code(FAULT_OVERLOAD));
    TEST_ASSERT_EQUAL_HEX32(0x8100u, canopen_od_error_code(FAULT_COMMAND_TIMEOUT));
    TEST_ASSERT_EQUAL_HEX32(0x8400u, canopen_od_error_code(FAULT_OVER_SPEED));
    TEST_ASSERT_EQUAL_HEX32(0x8400u, canopen_od_error_code(FAULT_SPEED_DEVIATION));
    TEST_ASSERT_EQUAL_HEX32(0x1000u, canopen_od_error_code(FAULT_STALL));
}

static void test_status_word_beside_its_state(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x0250u, value_of(0x6041u, 0u)); /* voltage, remote */
    unit()->params.fieldbus_commands = 0u;
    unit()->last.meas.u_dc_V = 0.0f;
    unit()->drive.guard.speed.speed_unknown = true;
    TEST_ASSERT_EQUAL_HEX32(0x00C0u, value_of(0x6041u, 0u));
    TEST_ASSERT_EQUAL_UINT32(0u, value_of(0x6044u, 0u));
    unit()->machine.id = SEQUENCE_SELF_TEST;
    slice();
    TEST_ASSERT_EQUAL_HEX32(0x0080u, value_of(0x6041u, 0u));
    unit()->machine.id = SEQUENCE_BOOT;
    slice();
    TEST_ASSERT_EQUAL_HEX32(0x0080u, value_of(0x6041u, 0u));
}

static void test_received_pdos_write_their_objects(void)
{
    RECEIVE(0x205u, 0x06u, 0u, 60u, 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, fb.commands); /* not operational */
    operational();
    RECEIVE(0x205u, 0x06u, 0u, 60u, 0u);
    TEST_ASSERT_EQUAL_UINT32(60u, co.od.word[CANOPEN_AT_0x6042_0]);
    TEST_ASSERT_EQUAL(CIA402_READY_TO_SWITCH_ON, co.od.machine.id);
    RECEIVE(0x205u, 0x07u, 0u, 61u); /* short */
    TEST_ASSERT_EQUAL(CIA402_READY_TO_SWITCH_ON, co.od.machine.id);
    RECEIVE(0x206u, 0x07u, 0u, 61u, 0u);
    TEST_ASSERT_EQUAL(CIA402_READY_TO_SWITCH_ON, co.od.machine.id);
    RECEIVE(0x305u, 0x07u, 0u, 0x9Cu, 0xFFu);
    TEST_ASSERT_EQUAL(CIA402_SWITCHED_ON, co.od.machine.id);
    TEST_ASSERT_EQUAL_HEX32(0xFF9Cu, co.od.word[CANOPEN_AT_0x6071_0]);
    RECEIVE(0x205u, 0x06u, 0u, 62u, 0u, 0x55u); /* what is not mapped belongs to nobody */
    TEST_ASSERT_EQUAL_HEX32(62u, co.od.word[CANOPEN_AT_0x6042_0]);
}

/* Frames of that identifier among what was said. */
static uint32_t count_of(uint16_t id)
{
    uint32_t n = 0u;
    for (uint32_t k = 0u; k < said_n; k++) {
        n += (said[k].id == id) ? 1u : 0u;
    }
    return n;
}

static void test_sent_pdos_come_by_their_timer(void)
{
    /* The smallest type that has a timer. */
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1800u, 2u, 254u, 1u));
    operational();
    now_us += 100000u;
    slice();
    said_n = 0u;
    now_us += 99999u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    now_us += 1u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(2u, said_n);
    TEST_ASSERT_EQUAL_HEX16(0x185u, said[0].id);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[]){0x50u, 0x02u, 0u, 0u}), said[0].data, 4u);
    TEST_ASSERT_EQUAL_UINT8(4u, said[0].length);
    TEST_ASSERT_EQUAL_HEX16(0x285u, said[1].id);
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1800u, 5u, 0u, 2u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1801u, 1u, 0x80000285u, 4u));
    now_us += 500000u;
    said_n = 0u;
    slice();
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
}

static void test_sent_pdos_come_at_every_nth_sync(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1800u, 2u, 1u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1801u, 2u, 3u, 1u));
    RECEIVE(0x080u, 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, said_n); /* not operational */
    operational();
    uint32_t first = 0u;
    uint32_t second = 0u;
    for (uint32_t k = 0u; k < 6u; k++) {
        RECEIVE(0x080u, 0u);
        first += count_of(0x185u);
        second += count_of(0x285u);
    }
    TEST_ASSERT_EQUAL_UINT32(6u, first);
    TEST_ASSERT_EQUAL_UINT32(2u, second);
    for (uint32_t k = 0u; k < 3u; k++) {
        RECEIVE(0x080u, 0u);
        TEST_ASSERT_EQUAL_UINT32((k == 2u) ? 1u : 0u, count_of(0x285u));
    }
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1800u, 2u, 241u, 1u)); /* no such type */
    for (uint32_t k = 0u; k < 250u; k++) {
        RECEIVE(0x080u, 0u);
        TEST_ASSERT_EQUAL_UINT32(0u, count_of(0x185u));
    }
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1800u, 2u, 253u, 1u)); /* on request: never */
    now_us += 500000u;
    RECEIVE(0x080u, 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, count_of(0x185u));
}

static void test_a_mapping_is_checked_when_it_is_put_in_force(void)
{
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NOT_NOW, write_object(0x1A00u, 1u, 0x60440010u, 4u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 0u, 0u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 1u, 0x30040020u, 4u)); /* a signal */
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 2u, 0x60760020u, 4u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 3u, 0x60410010u, 4u));
    TEST_ASSERT_EQUAL_HEX32(0x06040042u, CANOPEN_PDO_TOO_LONG); /* CiA 301 */
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_PDO_TOO_LONG, write_object(0x1A00u, 0u, 3u, 1u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_PDO_TOO_LONG, write_object(0x1A00u, 0u, 5u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 0u, 2u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 0u, 0u, 1u));
    static const uint32_t bad[] = {0x60410008u, 0x60410000u, 0x10170010u, 0x20000120u,
                                   0x70000010u, 0x10170008u, 0x20000108u, 0x60410108u};
    for (size_t k = 0u; k < sizeof bad / sizeof bad[0]; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 1u, bad[k], 4u));
        TEST_ASSERT_EQUAL_HEX32(CANOPEN_NOT_MAPPABLE, write_object(0x1A00u, 0u, 1u, 1u));
    }
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 1u, 0x60400010u, 4u)); /* may be sent, too */
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1A00u, 0u, 1u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1600u, 0u, 0u, 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1600u, 1u, 0x60410010u, 4u));
    TEST_ASSERT_EQUAL_HEX32(CANOPEN_NOT_MAPPABLE, write_object(0x1600u, 0u, 1u, 1u));
    static const uint32_t sent_only[] = {0x30040020u, 0x30040008u, 0x60410008u};
    for (size_t k = 0u; k < sizeof sent_only / sizeof sent_only[0]; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1600u, 1u, sent_only[k], 4u));
        TEST_ASSERT_EQUAL_HEX32(CANOPEN_NOT_MAPPABLE, write_object(0x1600u, 0u, 1u, 1u));
    }
}

static void test_an_identifier_is_set_and_frames_of_others_are_left(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1400u, 1u, 0x222u, 4u));
    operational();
    RECEIVE(0x222u, 0x06u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL(CIA402_READY_TO_SWITCH_ON, co.od.machine.id);
    RECEIVE(0x123u, 1u);
    TEST_ASSERT_EQUAL(CANOPEN_OPERATIONAL, co.nmt);
}

static void test_a_received_pdo_of_the_identifier_of_sync_is_no_sync(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1400u, 1u, 0x080u, 4u));
    TEST_ASSERT_EQUAL_HEX32(0u, write_object(0x1800u, 2u, 1u, 1u));
    operational();
    said_n = 0u;
    RECEIVE(0x080u, 0x06u, 0u, 0u, 0u);
    TEST_ASSERT_EQUAL(CIA402_READY_TO_SWITCH_ON, co.od.machine.id);
    TEST_ASSERT_EQUAL_UINT32(0u, count_of(0x185u));
}

/* CiA 301. */
static void test_abort_codes_are_those_of_the_standard(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x06010002u, CANOPEN_READ_ONLY);
    TEST_ASSERT_EQUAL_HEX32(0x06020000u, CANOPEN_NO_OBJECT);
    TEST_ASSERT_EQUAL_HEX32(0x06040041u, CANOPEN_NOT_MAPPABLE);
    TEST_ASSERT_EQUAL_HEX32(0x06070010u, CANOPEN_WRONG_LENGTH);
    TEST_ASSERT_EQUAL_HEX32(0x06090011u, CANOPEN_NO_SUB_INDEX);
    TEST_ASSERT_EQUAL_HEX32(0x06090030u, CANOPEN_OUT_OF_RANGE);
    TEST_ASSERT_EQUAL_HEX32(0x08000022u, CANOPEN_NOT_NOW);
}

/* Whatever memory it is given. */
static void test_the_dictionary_begins_from_its_list(void)
{
    static canopen_od_t clean;
    static canopen_od_t used;
    memset(&clean, 0, sizeof clean);
    memset(&used, 0xA5, sizeof used);
    canopen_od_init(&clean, NODE);
    canopen_od_init(&used, NODE);
    TEST_ASSERT_EQUAL_MEMORY(&clean, &used, sizeof clean);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_boots_into_pre_operational);
    RUN_TEST(test_network_management);
    RUN_TEST(test_it_beats_as_often_as_it_was_told);
    RUN_TEST(test_a_lost_heartbeat_ends_the_run_command_and_is_told_once);
    RUN_TEST(test_a_heartbeat_renews_the_command);
    RUN_TEST(test_silence_shows_as_quick_stop);
    RUN_TEST(test_leaving_operational_ends_the_run_command);
    RUN_TEST(test_every_object_is_read_with_its_length);
    RUN_TEST(test_parameters_and_signals_are_objects);
    RUN_TEST(test_writes_have_their_abort_codes);
    RUN_TEST(test_a_text_comes_in_segments);
    RUN_TEST(test_a_value_is_downloaded_in_segments);
    RUN_TEST(test_enabling_starts_the_drive_with_its_target);
    RUN_TEST(test_torque_is_per_mille_of_the_rated_one);
    RUN_TEST(test_faults_are_states_codes_and_emergencies);
    RUN_TEST(test_an_emergency_carries_every_fault_bit);
    RUN_TEST(test_actual_values_have_a_sign_and_a_limit);
    RUN_TEST(test_error_codes);
    RUN_TEST(test_status_word_beside_its_state);
    RUN_TEST(test_received_pdos_write_their_objects);
    RUN_TEST(test_sent_pdos_come_by_their_timer);
    RUN_TEST(test_sent_pdos_come_at_every_nth_sync);
    RUN_TEST(test_a_mapping_is_checked_when_it_is_put_in_force);
    RUN_TEST(test_an_identifier_is_set_and_frames_of_others_are_left);
    RUN_TEST(test_a_received_pdo_of_the_identifier_of_sync_is_no_sync);
    RUN_TEST(test_abort_codes_are_those_of_the_standard);
    RUN_TEST(test_the_dictionary_begins_from_its_list);
    return UNITY_END();
}
