#include "canopen_od.h"

#include "canopen_402.h"
#include "fieldbus_params.h"
#include "unit_signal.h"

#include <stddef.h>

#define LONG_BYTES    4u
#define NODE_NUMBER   0x80u /* of a row's access: the node's number is added */
#define LIVE_ROW      0x40u
#define MAPPED_FIRST  0x1600u
#define MAPPED_LAST   0x1A01u
#define MAPPED_MOST   4u
#define PDO_BITS      64u
#define BITS_PER_BYTE 8u

typedef enum {
    RO = 0,
    RW = 1,
    TX = 2,
    RX = 3
} access_class_t;
#define ACCESS_MASK 0x03u

enum {
    U8 = 1,
    I8 = 1,
    U16 = 2,
    I16 = 2,
    U32 = 4
};

typedef struct {
    uint16_t index;
    uint8_t sub;
    uint8_t bytes;
    uint8_t flags;  /* access_class_t, NODE_NUMBER, LIVE_ROW */
    uint32_t value; /* initial, or canopen_live_t */
} row_t;

static const row_t rows[CANOPEN_OBJECTS] = {
#define CANOPEN_STORED(index, sub, type, access, initial, name) {index, sub, type, access, initial},
#define CANOPEN_NODE(index, sub, type, access, initial, name)                                      \
    {index, sub, type, (uint32_t)(access) | NODE_NUMBER, initial},
#define CANOPEN_LIVE(index, sub, type, access, value, name)                                        \
    {index, sub, type, (uint32_t)(access) | LIVE_ROW, CANOPEN_LIVE_##value},
#include "canopen_objects.def"
};

void canopen_od_init(canopen_od_t *od, uint32_t node)
{
    *od = (canopen_od_t){0};
    for (size_t k = 0u; k < CANOPEN_OBJECTS; k++) {
        od->word[k] = rows[k].value + (((rows[k].flags & NODE_NUMBER) != 0u) ? node : 0u);
    }
}

/* CANOPEN_OBJECTS for none; *index_known: another sub-index exists. */
static size_t row_of(canopen_key_t key, bool *index_known)
{
    *index_known = false;
    for (size_t k = 0u; k < CANOPEN_OBJECTS; k++) {
        if (rows[k].index == key.index) {
            *index_known = true;
            if (rows[k].sub == key.sub) {
                return k;
            }
        }
    }
    return CANOPEN_OBJECTS;
}

/* params_count() for none. */
static size_t parameter_of(canopen_key_t key)
{
    const uint32_t group = (uint32_t)key.index - CANOPEN_PARAMETERS;
    if ((key.index < CANOPEN_PARAMETERS) || (key.sub == 0u)) {
        return params_count();
    }
    return fieldbus_param_at(group, (uint32_t)key.sub - 1u);
}

/* UNIT_SIGNALS for none. */
static uint32_t signal_of(canopen_key_t key)
{
    const uint32_t number = (uint32_t)key.index - CANOPEN_SIGNALS;
    const bool known =
        (key.index >= CANOPEN_SIGNALS) && (key.sub == 0u) && (number < (uint32_t)UNIT_SIGNALS);
    return known ? number : (uint32_t)UNIT_SIGNALS;
}

uint32_t canopen_od_read(const canopen_od_t *od, const canopen_drive_t *drive, canopen_key_t key,
                         canopen_value_t *value)
{
    bool index_known;
    const size_t row = row_of(key, &index_known);
    if (row < CANOPEN_OBJECTS) {
        value->bytes = rows[row].bytes;
        value->bits = ((rows[row].flags & LIVE_ROW) != 0u)
                          ? canopen_402_live(od, drive, (canopen_live_t)rows[row].value)
                          : od->word[row];
        return CANOPEN_DONE;
    }
    value->bytes = LONG_BYTES;
    const size_t parameter = parameter_of(key);
    if (parameter < params_count()) {
        value->bits = fieldbus_param_bits(drive->unit, parameter);
        return CANOPEN_DONE;
    }
    const uint32_t signal = signal_of(key);
    if (signal < (uint32_t)UNIT_SIGNALS) {
        value->bits = unit_signal(drive->unit, signal);
        return CANOPEN_DONE;
    }
    return index_known ? CANOPEN_NO_SUB_INDEX : CANOPEN_NO_OBJECT;
}

uint32_t canopen_od_mappable(canopen_key_t key, bool received)
{
    bool index_known;
    const size_t row = row_of(key, &index_known);
    if (row >= CANOPEN_OBJECTS) {
        return (!received && (signal_of(key) < (uint32_t)UNIT_SIGNALS)) ? LONG_BYTES : 0u;
    }
    const uint32_t access = rows[row].flags & ACCESS_MASK;
    const bool allowed = received ? (access == (uint32_t)RX) : (access >= (uint32_t)TX);
    return allowed ? rows[row].bytes : 0u;
}

/* Whether n mapped objects, the words behind `row`, make a PDO. */
static uint32_t check_mapping(const canopen_od_t *od, size_t row, uint32_t n)
{
    uint32_t bits = 0u;
    if (n > MAPPED_MOST) {
        return CANOPEN_PDO_TOO_LONG;
    }
    for (uint32_t k = 1u; k <= n; k++) {
        const uint32_t word = od->word[row + k];
        const canopen_key_t key = {(uint16_t)(word >> 16), (uint8_t)((word >> 8) & 0xFFu)};
        const bool received = rows[row].index < 0x1A00u;
        const uint32_t length = word & 0xFFu;
        if ((length == 0u) || (BITS_PER_BYTE * canopen_od_mappable(key, received) != length)) {
            return CANOPEN_NOT_MAPPABLE;
        }
        bits += length;
    }
    return (bits <= PDO_BITS) ? CANOPEN_DONE : CANOPEN_PDO_TOO_LONG;
}

/* A mapping changes while its number of objects is 0. */
static uint32_t write_mapping(canopen_od_t *od, size_t row, uint32_t bits)
{
    const size_t number = row - rows[row].sub;
    if (rows[row].sub != 0u) {
        if (od->word[number] != 0u) {
            return CANOPEN_NOT_NOW;
        }
    } else {
        const uint32_t bad = check_mapping(od, row, bits);
        if (bad != CANOPEN_DONE) {
            return bad;
        }
    }
    od->word[row] = bits;
    return CANOPEN_DONE;
}

static uint32_t write_row(canopen_od_t *od, const canopen_drive_t *drive, size_t row, uint32_t bits)
{
    const uint16_t index = rows[row].index;
    if ((index >= MAPPED_FIRST) && (index <= MAPPED_LAST) && ((index & 0x0F00u) != 0x0800u)) {
        return write_mapping(od, row, bits);
    }
    if ((rows[row].flags & ACCESS_MASK) == (uint32_t)RX) {
        canopen_od_t next = *od;
        next.word[row] = bits;
        return canopen_402_apply(od, drive, &next, row == (size_t)CANOPEN_AT_0x6040_0);
    }
    od->word[row] = bits;
    return CANOPEN_DONE;
}

static uint32_t of_link(unit_link_status_t status)
{
    if (status == UNIT_LINK_OK) {
        return CANOPEN_DONE;
    }
    if (status == UNIT_LINK_PROTECTED) {
        return CANOPEN_READ_ONLY;
    }
    return (status <= UNIT_LINK_NOT_WHOLE) ? CANOPEN_OUT_OF_RANGE : CANOPEN_NOT_NOW;
}

uint32_t canopen_od_write(canopen_od_t *od, const canopen_drive_t *drive, canopen_key_t key,
                          const canopen_value_t *value)
{
    canopen_value_t now;
    const uint32_t missing = canopen_od_read(od, drive, key, &now);
    if (missing != CANOPEN_DONE) {
        return missing;
    }
    bool index_known;
    const size_t row = row_of(key, &index_known);
    const uint32_t access =
        (row < CANOPEN_OBJECTS) ? (rows[row].flags & ACCESS_MASK) : (uint32_t)RW;
    const size_t parameter = parameter_of(key);
    const bool writable = (access == (uint32_t)RW) || (access == (uint32_t)RX);
    if (!writable || ((row >= CANOPEN_OBJECTS) && (parameter >= params_count()))) {
        return CANOPEN_READ_ONLY;
    }
    if (value->bytes != now.bytes) {
        return CANOPEN_WRONG_LENGTH;
    }
    if (row < CANOPEN_OBJECTS) {
        return write_row(od, drive, row, value->bits);
    }
    return of_link(fieldbus_param_set(drive->unit, parameter, value->bits));
}
