#include "modbus_map.h"

#include "fieldbus_actual.h"
#include "fieldbus_params.h"
#include "handover.h"
#include "unit_signal.h"

#include <stddef.h>

/* A read that no control period fell into is of one period; the second look nearly always is. */
#define READ_TRIES 4u

#define WORDS         2u /* registers of 32 bits */
#define SPEED_UNKNOWN 0x8000u
#define INT16_LIMIT   32767.0f

/* Control word of the bus, and command of the drive. */
static const struct {
    uint16_t bus;
    uint16_t drive;
} commands[] = {{MODBUS_RUN, SEQUENCE_CMD_RUN},
                {MODBUS_COAST, SEQUENCE_CMD_TORQUE_OFF},
                {MODBUS_TORQUE_MODE, SEQUENCE_CMD_TORQUE_MODE},
                {MODBUS_RESET, SEQUENCE_CMD_FAULT_RESET}};
#define COMMANDS (sizeof commands / sizeof commands[0])

static uint32_t control_word(uint32_t command)
{
    uint32_t word = 0u;
    for (size_t k = 0u; k < COMMANDS; k++) {
        word |= ((command & commands[k].drive) != 0u) ? commands[k].bus : 0u;
    }
    return word;
}

/* False for a bit that says nothing. */
static bool command_of(uint32_t word, uint32_t *command)
{
    uint32_t left = word;
    *command = 0u;
    for (size_t k = 0u; k < COMMANDS; k++) {
        *command |= ((word & commands[k].bus) != 0u) ? commands[k].drive : 0u;
        left &= ~(uint32_t)commands[k].bus;
    }
    return left == 0u;
}

/* Rounded and limited; NaN is that of the unknown speed. */
static uint32_t int16_of(float value)
{
    if (!is_finite(value)) {
        return SPEED_UNKNOWN;
    }
    const float limited = clampf(value, -INT16_LIMIT, INT16_LIMIT);
    const int32_t rounded = (int32_t)(limited + ((limited < 0.0f) ? -0.5f : 0.5f));
    return (uint32_t)rounded & 0xFFFFu;
}

static uint32_t half(uint32_t bits, uint32_t word)
{
    return (word == 0u) ? (bits >> 16) : (bits & 0xFFFFu);
}

/* Registers 0..5. */
static uint32_t command_register(const fieldbus_demand_t *demand, uint32_t address)
{
    const float speed_rpm = fieldbus_rpm_from_rad_s(demand->omega_m_ref_rad_s);
    switch (address) {
    case MODBUS_CONTROL:
        return control_word(demand->command);
    case MODBUS_SPEED:
        return int16_of(speed_rpm);
    case MODBUS_SPEED_FLOAT:
    case MODBUS_SPEED_FLOAT + 1:
        return half(float_bits(speed_rpm), address - (uint32_t)MODBUS_SPEED_FLOAT);
    default:
        return half(float_bits(demand->torque_ref_Nm), address - (uint32_t)MODBUS_TORQUE_FLOAT);
    }
}

static bool holding_register(const fieldbus_t *fb, const unit_t *unit, uint32_t address,
                             uint32_t *value)
{
    if (address < (uint32_t)MODBUS_COMMAND_END) {
        *value = command_register(&fb->demand, address);
        return true;
    }
    if (address < MODBUS_LIST_AT) {
        return false;
    }
    const uint32_t at = address - MODBUS_LIST_AT;
    const size_t index = fieldbus_param_at(at / MODBUS_GROUP, (at % MODBUS_GROUP) / WORDS);
    if (index >= params_count()) {
        return false;
    }
    *value = half(fieldbus_param_bits(unit, index), at % WORDS);
    return true;
}

static bool input_register(const uint32_t *actual, uint32_t actual_n, const unit_t *unit,
                           uint32_t address, uint32_t *value)
{
    if (address < actual_n) {
        *value = actual[address];
        return true;
    }
    const uint32_t at = address - MODBUS_LIST_AT;
    if ((address < MODBUS_LIST_AT) || (at / WORDS >= (uint32_t)UNIT_SIGNALS)) {
        return false;
    }
    *value = half(unit_signal(unit, at / WORDS), at % WORDS);
    return true;
}

static modbus_exception_t read_once(const fieldbus_t *fb, const unit_t *unit,
                                    const modbus_range_t *range, uint16_t *value)
{
    fieldbus_actual_t a;
    fieldbus_actual(fb, unit, &a);
    const uint32_t speed = float_bits(a.speed_rpm);
    const uint32_t torque = float_bits(a.torque_Nm);
    const uint32_t current = float_bits(a.current_A);
    const uint32_t u_dc = float_bits(a.u_dc_V);
    const uint32_t actual[] = {a.status,
                               int16_of(a.speed_rpm),
                               int16_of(10.0f * a.torque_Nm),
                               int16_of(100.0f * a.current_A),
                               int16_of(10.0f * a.u_dc_V),
                               a.state,
                               half(a.faults, 0u),
                               half(a.faults, 1u),
                               half(speed, 0u),
                               half(speed, 1u),
                               half(torque, 0u),
                               half(torque, 1u),
                               half(current, 0u),
                               half(current, 1u),
                               half(u_dc, 0u),
                               half(u_dc, 1u)};
    for (uint32_t k = 0u; k < range->n; k++) {
        uint32_t word = 0u;
        const uint32_t at = range->address + k;
        const bool known =
            (range->bank == MODBUS_HOLDING)
                ? holding_register(fb, unit, at, &word)
                : input_register(actual, (uint32_t)(sizeof actual / sizeof actual[0]), unit, at,
                                 &word);
        if (!known) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        value[k] = (uint16_t)word;
    }
    return MODBUS_OK;
}

modbus_exception_t modbus_map_read(const fieldbus_t *fb, const unit_t *unit,
                                   const modbus_range_t *range, uint16_t *value)
{
    modbus_exception_t done = MODBUS_OK;
    /* Whether a period fell into the reading no unit test decides. */
    for (uint32_t tries = 0u; tries < READ_TRIES; tries++) { /* GCOVR_EXCL_BR_LINE */
        const uint32_t period = unit->period_count;
        handover();
        done = read_once(fb, unit, range, value);
        handover();
        if (period == unit->period_count) { /* GCOVR_EXCL_BR_LINE */
            break;
        }
    }
    return done;
}

static uint32_t both(const uint16_t *value)
{
    return ((uint32_t)value[0] << 16) | value[1];
}

static modbus_exception_t of_link(unit_link_status_t status)
{
    if (status == UNIT_LINK_OK) {
        return MODBUS_OK;
    }
    if (status == UNIT_LINK_PROTECTED) {
        return MODBUS_ILLEGAL_ADDRESS;
    }
    /* Not finite, out of range, not whole; else it is refused now. */
    return (status <= UNIT_LINK_NOT_WHOLE) ? MODBUS_ILLEGAL_VALUE : MODBUS_FAILURE;
}

static modbus_exception_t write_parameter(unit_t *unit, uint32_t at, uint32_t n,
                                          const uint16_t *value)
{
    const size_t index = fieldbus_param_at(at / MODBUS_GROUP, (at % MODBUS_GROUP) / WORDS);
    if ((index >= params_count()) || (at % WORDS != 0u) || (n != WORDS)) {
        return MODBUS_ILLEGAL_ADDRESS;
    }
    return of_link(fieldbus_param_set(unit, index, both(value)));
}

/* One value of the command into *demand; its registers in *taken. */
static modbus_exception_t take_command(fieldbus_demand_t *demand, uint32_t address, uint32_t left,
                                       const uint16_t *value, uint32_t *taken)
{
    *taken = 1u;
    if (address == (uint32_t)MODBUS_CONTROL) {
        return command_of(value[0], &demand->command) ? MODBUS_OK : MODBUS_ILLEGAL_VALUE;
    }
    if (address == (uint32_t)MODBUS_SPEED) {
        demand->omega_m_ref_rad_s = fieldbus_rad_s_from_rpm((float)(int16_t)value[0]);
        return MODBUS_OK;
    }
    const bool whole = (address % WORDS == 0u) && (left >= WORDS);
    if (!whole || (address >= (uint32_t)MODBUS_COMMAND_END)) {
        return MODBUS_ILLEGAL_ADDRESS;
    }
    *taken = WORDS;
    const float given = float_of_bits(both(value));
    if (address == (uint32_t)MODBUS_SPEED_FLOAT) {
        demand->omega_m_ref_rad_s = fieldbus_rad_s_from_rpm(given);
    } else {
        demand->torque_ref_Nm = given;
    }
    return MODBUS_OK;
}

static modbus_exception_t write_command(fieldbus_t *fb, const unit_t *unit, uint32_t address,
                                        uint32_t n, const uint16_t *value)
{
    fieldbus_demand_t demand = fb->demand;
    uint32_t taken = 0u;
    for (uint32_t k = 0u; k < n; k += taken) {
        const modbus_exception_t bad = take_command(&demand, address + k, n - k, &value[k], &taken);
        if (bad != MODBUS_OK) {
            return bad;
        }
        if (!fieldbus_in_range(unit, &demand)) {
            return MODBUS_ILLEGAL_VALUE; /* although a later one may be in range */
        }
    }
    return (fieldbus_ask(fb, unit, &demand) == FIELDBUS_OK) ? MODBUS_OK : MODBUS_FAILURE;
}

modbus_exception_t modbus_map_write(fieldbus_t *fb, unit_t *unit, uint32_t address, uint32_t n,
                                    const uint16_t *value)
{
    if (address >= MODBUS_LIST_AT) {
        return write_parameter(unit, address - MODBUS_LIST_AT, n, value);
    }
    return write_command(fb, unit, address, n, value);
}
