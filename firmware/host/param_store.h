/* Parameters that survive power-down: two flash slots, always the old or the new set.
 *
 * Record (32-bit words): magic, format, sequence, motor id and CRC of the gain table it was saved
 * with, number of entries, 2 spare; per entry the CRC-32C of its name and its value as float;
 * CRC-32C of all that, its complement; then pairs of marks, one program unit each. A save goes to
 * the unused slot: erase, program, read back, then the marks. The record counts from its first
 * mark.
 *
 * Why pairs: a word that was being programmed when the power failed may read correctly today and
 * wrongly tomorrow. The second mark is begun only after the first has been read back. So a second
 * mark that is not blank proves the first, and the first proves the record. Without that proof the
 * next pair is written before the other slot, with the older set, may be erased. There are three
 * spare pairs: only a fourth power cut in a row exactly within a mark finds none left.
 *
 * Entries are found by name: a list with other parameters, or in another order, can still read the
 * record.
 */
#ifndef PARAM_STORE_H
#define PARAM_STORE_H

#include "gain_table.h"
#include "hal_devices.h"
#include "params.h"

#define PARAM_STORE_PAIRS 4u

/* A present parameter under its former name. */
typedef struct {
    const char *before;
    const char *now;
} param_rename_t;

typedef struct {
    const hal_flash_t *flash; /* NULL: nothing is found, no save is accepted */
    gain_table_id_t table;    /* table in use: goes into the record */
    const param_rename_t *rename;
    uint32_t rename_count;
} param_store_config_t;

typedef enum {
    PARAM_STORE_EMPTY = 0,  /* never saved, or the first save was interrupted */
    PARAM_STORE_LOADED = 1, /* the newest set */
    PARAM_STORE_LOST = 2    /* a record exists but cannot be read: do not run on defaults */
} param_store_found_t;

/* Result of loading each entry. */
typedef struct {
    uint32_t taken; /* loaded, renamed ones included */
    uint32_t renamed;
    uint32_t missing;         /* not in the record: the default stays */
    uint32_t unknown;         /* in the record but no longer in the list: dropped */
    uint32_t refused;         /* outside the present range: the default stays */
    uint32_t last_refused;    /* index of the last of them */
    gain_table_id_t made_for; /* table of the record: unit_init_for compares */
} param_store_report_t;

typedef enum {
    PARAM_STORE_TAKEN = 0,
    PARAM_STORE_RENAMED = 1, /* loaded, under its present name */
    PARAM_STORE_UNKNOWN = 2,
    PARAM_STORE_REFUSED = 3
} param_store_fate_t;

/* One entry of the record in use, and the result of loading it. */
typedef struct {
    uint32_t key; /* CRC-32C of the name in the record */
    float value;
    size_t index; /* in the present list; params_count(): unknown */
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

/* State of a record in a slot, for the marks. */
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
    bool wanted;  /* a save is pending or running */
    bool saving;  /* false while only marks of the record in use are written */
    bool failed;  /* the last save failed: the set before it stays */
    param_store_record_t used;
    param_store_record_t next;
    uint32_t at; /* next word to program or to read back */
    uint32_t crc;
    uint32_t read_back;
    params_t set; /* being saved */
} param_store_t;

/* At start: *params holds the defaults and receives the values of the record. Takes time (two
 * passes over the list). Changes *params only when LOADED. */
CHECKED param_store_found_t param_store_load(const param_store_config_t *cfg, param_store_t *st,
                                             params_t *params, param_store_report_t *report);

/* The n-th entry of the record in use; false when there is none. */
CHECKED bool param_store_entry(const param_store_config_t *cfg, const param_store_t *st, uint32_t n,
                               param_store_entry_t *entry);

/* Requests a save of this set; false while one is running, or when there is no flash or it is too
 * small. */
CHECKED bool param_store_save(const param_store_config_t *cfg, param_store_t *st,
                              const params_t *params);

/* One slice of work: at most one flash operation. `allowed`: the gates are off and stay off until
 * it returns; otherwise it does nothing. True while a save is pending or running. */
bool param_store_step(const param_store_config_t *cfg, param_store_t *st, bool allowed);

#endif
