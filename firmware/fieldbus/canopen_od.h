/* Object dictionary: canopen_objects.def, the parameters, the signals.
 *
 *   0x2000 + g, k + 1   k-th parameter of group g, 32 bits
 *   0x3000 + n          signal n of signal_list.def, 32 bits
 */
#ifndef CANOPEN_OD_H
#define CANOPEN_OD_H

#include "cia402.h"
#include "fieldbus.h"

enum {
#define CANOPEN_STORED(index, sub, type, access, initial, name) CANOPEN_AT_##index##_##sub,
#define CANOPEN_NODE(index, sub, type, access, initial, name)   CANOPEN_AT_##index##_##sub,
#define CANOPEN_LIVE(index, sub, type, access, value, name)     CANOPEN_AT_##index##_##sub,
#include "canopen_objects.def"
    CANOPEN_OBJECTS
};

#define CANOPEN_PARAMETERS 0x2000u
#define CANOPEN_SIGNALS    0x3000u

/* Modes of operation. */
#define CANOPEN_VELOCITY 2u
#define CANOPEN_TORQUE   4u

/* Abort codes of SDO; 0: done. */
#define CANOPEN_DONE         0x00000000u
#define CANOPEN_READ_ONLY    0x06010002u
#define CANOPEN_NO_OBJECT    0x06020000u
#define CANOPEN_NOT_MAPPABLE 0x06040041u
#define CANOPEN_PDO_TOO_LONG 0x06040042u
#define CANOPEN_WRONG_LENGTH 0x06070010u
#define CANOPEN_NO_SUB_INDEX 0x06090011u
#define CANOPEN_OUT_OF_RANGE 0x06090030u
#define CANOPEN_NOT_NOW      0x08000022u

typedef struct {
    uint32_t word[CANOPEN_OBJECTS]; /* of the stored ones */
    cia402_state_t machine;
} canopen_od_t;

/* The drive behind the dictionary. */
typedef struct {
    fieldbus_t *fb;
    unit_t *unit;
} canopen_drive_t;

typedef struct {
    uint16_t index;
    uint8_t sub;
} canopen_key_t;

typedef struct {
    uint32_t bits;
    uint32_t bytes; /* 1, 2, 4 */
} canopen_value_t;

/* Everything as after power-up, for this node number. */
void canopen_od_init(canopen_od_t *od, uint32_t node);

CHECKED uint32_t canopen_od_read(const canopen_od_t *od, const canopen_drive_t *drive,
                                 canopen_key_t key, canopen_value_t *value);

/* Unless CANOPEN_DONE nothing has changed. */
CHECKED uint32_t canopen_od_write(canopen_od_t *od, const canopen_drive_t *drive, canopen_key_t key,
                                  const canopen_value_t *value);

/* Bytes of an object that a PDO may carry in that direction; 0: none. */
uint32_t canopen_od_mappable(canopen_key_t key, bool received);

/* CiA 402 in each slice: what the drive does, and what follows for its command. */
void canopen_od_follow(canopen_od_t *od, const canopen_drive_t *drive);

/* The bus says that it is alive: renews the command that stands. */
void canopen_od_renew(const canopen_od_t *od, const canopen_drive_t *drive);

/* Ends the run command: heartbeat lost, or the network is not operational. */
void canopen_od_stop(canopen_od_t *od, const canopen_drive_t *drive);

/* Error code of CiA 402 for latched faults; 0: none. */
uint32_t canopen_od_error_code(uint32_t faults);

#endif
