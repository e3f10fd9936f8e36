/* Parameters that survive power-down: two flash slots, always the old or the new set.
 *
 * Record (32-bit words): magic, format, sequence, motor id and CRC of the gain table it was saved
 * with, number of entries, 2 spare; per entry the CRC-32C of its name and its value as float;
 * CRC-32C of all that, its complement; then pairs of marks, one program unit each. A save goes to
 * the slot not in use: erase, program, read back, then the marks. It counts from the first mark on.
 *
 * Why pairs: what was programmed when the power went may read right today and wrong tomorrow. The
 * second mark is begun only when the first has been read back, so a second one that is not blank
 * proves the first, and the first proves the record. Without that proof the next pair is written
 * before the other slot, with the older set, may be erased. Three spare pairs: only a fourth power
 * cut in a row exactly within a mark finds none left.
 *
 * Entries are found by name: a list with other parameters, or in another order, reads the record.
 */
#ifndef PARAM_STORE_H
#define PARAM_STORE_H

#include "gain_table.h"
#include "hal_devices.h"
#include "params.h"

#define PARAM_STORE_PAIRS 4u

/* A parameter of today under its name of before. */
typedef struct {
    const char *before;
    const char *now;
} param_rename_t;

typedef struct {
    const hal_flash_t *flash; /* NULL: nothing is found, no save is taken */
    gain_table_id_t table;    /* in use: goes into the record */
    const param_rename_t *rename;
    uint32_t rename_count;
} param_store_config_t;

typedef enum {
    PARAM_STORE_EMPTY = 0,  /* never saved, or the very first save was cut off */
    PARAM_STORE_LOADED = 1, /* the newest set */
    PARAM_STORE_LOST = 2    /* there was a record, and none can be read: do not run on defaults */
} param_store_found_t;

/* What became of the entries; told, not hidden. */
typedef struct {
    uint32_t taken; /* renamed ones included */
    uint32_t renamed;
    uint32_t missing;         /* not in the record: the default stays */
    uint32_t unknown;         /* in the record, not in the list any more: dropped */
    uint32_t refused;         /* outside today's range: the default stays */
    uint32_t last_refused;    /* index of the last of them */
    gain_table_id_t made_for; /* the table it was saved with: unit_init_for compares */
} param_store_report_t;

typedef enum {
    PARAM_STORE_TAKEN = 0,
    PARAM_STORE_RENAMED = 1, /* taken, under its name of today */
    PARAM_STORE_UNKNOWN = 2,
    PARAM_STORE_REFUSED = 3
} param_store_fate_t;

/* One entry of the record in use, and what becomes of it when it is loaded. */
typedef struct {
    uint32_t key; /* CRC-32C of the name it was saved under */
    float value;
    size_t index; /* of today's list; params_count(): unknown */
    param_store_fate_t fate;
} param_store_entry_t;

typedef enum {
    PARAM_STORE_IDLE = 0,
    PARAM_STORE_ERASE = 1,
    PARAM_STORE_PROGRAM = 2,
    PARAM_STORE_VERIFY = 3,
    PARAM_STORE_MARK_FIRST = 4,
    PARAM_STORE_MARK_SECOND = 5
} param_store_phase_t;

/* A record in a slot, as far as the marks need it. */
typedef struct {
    uint32_t slot;
    uint32_t sequence;
    uint32_t entries;
    uint32_t pair; /* next unused pair of marks */
    bool settled;  /* proven: the other slot may be erased */
} param_store_record_t;

typedef struct {
    param_store_phase_t phase;
    bool present; /* there is a record in use */
    bool wanted;  /* a save waits or is under way */
    bool saving;  /* false while only marks of the record in use are written */
    bool failed;  /* the last save: the set before it stays */
    param_store_record_t used;
    param_store_record_t next;
    uint32_t at; /* word to program or to read back */
    uint32_t crc;
    uint32_t read_back;
    params_t set; /* being saved */
} param_store_t;

/* At start: *params comes with the defaults and leaves with what the record says. Takes its time
 * (two passes over the list). Leaves *params alone unless LOADED. */
CHECKED param_store_found_t param_store_load(const param_store_config_t *cfg, param_store_t *st,
                                             params_t *params, param_store_report_t *report);

/* The n-th entry of the record in use; false when there is none. */
CHECKED bool param_store_entry(const param_store_config_t *cfg, const param_store_t *st, uint32_t n,
                               param_store_entry_t *entry);

/* Asks for a save of this set; false while one is under way, or when the flash is none or too
 * small. */
CHECKED bool param_store_save(const param_store_config_t *cfg, param_store_t *st,
                              const params_t *params);

/* One slice of work: at most one operation of the flash. `allowed`: the gates are off and stay off
 * until it returns; without it nothing is touched. True while a save waits or is under way. */
bool param_store_step(const param_store_config_t *cfg, param_store_t *st, bool allowed);

#endif
