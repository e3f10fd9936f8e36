/* The registers: tools/docs/modbus.md has the whole map. 32 bits are two registers, the high word
 * first.
 *
 *   holding     0..5     what the drive is asked to do
 *   holding  1000 + 100 g + 2 k   k-th parameter of group g, 32 bits
 *   input       0..15    what the drive does
 *   input    1000 + 2 n  signal n of signal_list.def, 32 bits
 */
#ifndef MODBUS_MAP_H
#define MODBUS_MAP_H

#include "fieldbus.h"

#define MODBUS_LIST_AT  1000u
#define MODBUS_GROUP    100u /* registers from group to group */
#define MODBUS_READ_MAX 125u

/* Holding registers of the command. */
enum {
    MODBUS_CONTROL = 0,
    MODBUS_SPEED = 1,        /* int16, min^-1 */
    MODBUS_SPEED_FLOAT = 2,  /* min^-1 */
    MODBUS_TORQUE_FLOAT = 4, /* Nm */
    MODBUS_COMMAND_END = 6
};

/* Control word. */
#define MODBUS_RUN         (1u << 0)
#define MODBUS_COAST       (1u << 1)
#define MODBUS_TORQUE_MODE (1u << 2)
#define MODBUS_RESET       (1u << 7) /* rising edge */

typedef enum {
    MODBUS_OK = 0,
    MODBUS_ILLEGAL_FUNCTION = 1,
    MODBUS_ILLEGAL_ADDRESS = 2, /* no such register, read-only, or half of 32 bits */
    MODBUS_ILLEGAL_VALUE = 3,   /* out of range, or a request of a wrong length */
    MODBUS_FAILURE = 4          /* refused now: not enabled, not alone, not at rest, by a rule */
} modbus_exception_t;

typedef enum {
    MODBUS_HOLDING,
    MODBUS_INPUT
} modbus_bank_t;

/* What a read is from and to, all of one control period. n <= MODBUS_READ_MAX. */
typedef struct {
    modbus_bank_t bank;
    uint32_t address;
    uint32_t n;
} modbus_range_t;

CHECKED modbus_exception_t modbus_map_read(const fieldbus_t *fb, const unit_t *unit,
                                           const modbus_range_t *range, uint16_t *value);

/* Holding registers: one parameter, or any of the command's. All or nothing. */
CHECKED modbus_exception_t modbus_map_write(fieldbus_t *fb, unit_t *unit, uint32_t address,
                                            uint32_t n, const uint16_t *value);

#endif
