/* Processor in the loop: the flash image on an emulated core against the same plant.
 *
 * Part of the SIL library. The image's duties drive the plant. The SIL firmware runs beside it on
 * the same samples, and every signal of firmware/unit/signal_list.def is compared bit for bit in
 * every control period. Linux only (FIFOs). The caller has to ignore SIGPIPE, as Python does; `end`
 * reports an image that leaves.
 */
#ifndef ZH_PIL_H
#define ZH_PIL_H

#include "sim.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How the run ended. */
enum {
    ZH_PIL_EQUAL = 0, /* all periods, every bit the same */
    ZH_PIL_DIFFERS = 1,
    ZH_PIL_LEFT = 2,  /* the image stopped by itself: see its exit code */
    ZH_PIL_SILENT = 3 /* no answer in time */
};

typedef struct {
    uint32_t struct_size;    /* sizeof(zh_pil_job), set by the caller */
    uint32_t inject;         /* defect for the image (hal/qemu_mps2/pil_protocol.h), 0: none */
    uint32_t inject_at;      /* control period */
    uint32_t own_params;     /* 1: the image's own parameters must equal the run's, none are sent */
    const char *folder;      /* with the FIFOs, where the emulator runs */
    uint32_t inject_address; /* address of the instruction that PIL_INJECT_SKIP skips */
    zh_sim_result *record;   /* NULL, or where to leave the record (zh_sim_free): what the plant did
                              * and gates_on are the image's, all else is the SIL's */
    const char *words; /* NULL, or a file for every signal of every period as the image said it:
                        * 32-bit words in the order of signal_list.def */
    uint32_t bus; /* 1: a fieldbus commands the image (pil_protocol.h); the SIL gets the same */
} zh_pil_job;

/* One control period: end minus begin is the time in the interrupt, entry to exit. */
typedef struct {
    uint32_t begin_ticks; /* since the image's start, at clock_Hz, modulo 2^32 */
    uint32_t end_ticks;
    uint32_t state;  /* of the state machine, after the period */
    uint32_t slot;   /* of the schedule for what runs slower than a period */
    uint32_t faults; /* latched after the period */
} zh_pil_period;

typedef struct {
    uint32_t struct_size;        /* sizeof(zh_pil_result), set by the caller */
    uint32_t end;                /* ZH_PIL_* */
    uint64_t periods;            /* compared */
    uint64_t answered;           /* length of period[]: with a difference one more than compared */
    const zh_pil_period *period; /* belongs to the library until zh_pil_free */
    void *owner;                 /* owned by the library; NULL after zh_pil_free */
    uint32_t clock_Hz;           /* of the ticks */
    uint32_t worst_latency_ticks;
    uint32_t late_periods;
    uint32_t stack_bytes; /* of the image, and its watermark */
    uint32_t stack_used_bytes;
    uint32_t background_calls;
    uint32_t gates_on;       /* in the last period answered */
    uint32_t faults;         /* latched in the last period answered */
    uint32_t warned;         /* every bit that was ever set in faults */
    uint32_t differing_bits; /* of all signals, in the period that differs */
    double loop_s;           /* wall clock */
    char difference[160];    /* period, signal and both words; empty when none */
} zh_pil_result;

/* A status of sil.h; text in zh_sil_error(). A difference is no error: see `end`. */
ZH_API int zh_pil_run(const zh_sim_job *job, const zh_pil_job *pil, zh_pil_result *result);
ZH_API void zh_pil_free(zh_pil_result *result);

#ifdef __cplusplus
}
#endif

#endif
