/* A recorded flight run again: the firmware on the ADC words, commands and parameter changes that a
 * drive was given. Part of the SIL library.
 *
 * No plant: what comes out of the drive changes nothing that goes into it. The rows are those of
 * firmware/host/flight.h, each three words.
 */
#ifndef ZH_FLIGHT_REPLAY_H
#define ZH_FLIGHT_REPLAY_H

#include "sil.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ZH_FLIGHT_ROW_WORDS 3u

typedef struct zh_flight zh_flight;

/* Why a replay cannot go on. */
enum {
    ZH_FLIGHT_GOES_ON = 0,
    ZH_FLIGHT_NO_START = 1,  /* the first row is no START */
    ZH_FLIGHT_UNKNOWN = 2,   /* a row of a later firmware */
    ZH_FLIGHT_CHANGES = 3,   /* two parameters changed at once, and only the second was recorded */
    ZH_FLIGHT_PARAMETER = 4, /* the firmware refuses a parameter that the drive took */
    ZH_FLIGHT_SECOND = 5     /* another START: a recording of its own */
};

typedef struct {
    uint32_t struct_size; /* sizeof(zh_flight_state), set by the caller */
    uint32_t ended;       /* ZH_FLIGHT_* */
    uint64_t periods;
    uint64_t checks;  /* digests of the drive's outputs that were compared */
    uint64_t equal;   /* periods before the first digest that differs: those of the drive, to the
                       * bit */
    uint32_t differs; /* 1: one does */
    uint32_t first_fault; /* bits of the first fault, 0: none */
    uint64_t fault_at;    /* its period, from 0 */
} zh_flight_state;

/* params: lines "name=value", all of the drive's. gain: 4 floats per entry as in l_gain.json, or
 * NULL for a drive without a table. NULL when refused: zh_sil_error(). */
ZH_API zh_flight *zh_flight_open(const char *params, const float *gain, uint32_t gain_entries);

/* Runs `count` rows. words: NULL, or room for `signals` words per period: the signals of those
 * numbers behind each period (zh_sim_signal_name). *periods: room, and on return how many there
 * were. */
ZH_API int zh_flight_run(zh_flight *handle, const uint32_t *rows, uint32_t count,
                         const uint32_t *number, uint32_t signals, uint32_t *words,
                         uint32_t *periods);

ZH_API int zh_flight_get_state(const zh_flight *handle, zh_flight_state *state);

/* The state of the replayed drive behind its last period, in memory of the caller. A recorder that
 * keeps only the last seconds begins its file with one. ZH_NOT_NOW between a parameter change and
 * the period that takes it; ask again behind the next row.
 *
 * Restore it into a replay that has run no row, opened with the parameters and the table that were
 * in force then. Other parameters are allowed: they act from there on. `periods` and `equal` count
 * from there. ZH_REFUSED: a state of another firmware or table, or a damaged one. */
ZH_API size_t zh_flight_snapshot_bytes(void);
ZH_API int zh_flight_snapshot(const zh_flight *handle, void *buffer, size_t bytes);
ZH_API int zh_flight_restore(zh_flight *handle, const void *buffer, size_t bytes);

/* 1: the word of this signal is a float. */
ZH_API uint32_t zh_flight_signal_is_float(uint32_t number);

/* NULL is allowed. */
ZH_API void zh_flight_close(zh_flight *handle);

#ifdef __cplusplus
}
#endif

#endif
