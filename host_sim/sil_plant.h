/* The rig alone, period by period, beside a drive of sil.h or any other controller.
 *
 *     zh_plant_sample(plant, words);               crest t_k
 *     ... a controller computes duties ...
 *     zh_plant_advance(plant, duty, gates_on, 0);  to t_(k+1)
 *
 * The plant keeps the delay of the board's timer: the duties of step k act on [t_(k+1), t_(k+2)),
 * gates off acts at once. Part of the SIL library; one handle belongs to one thread at a time.
 */
#ifndef ZH_SIL_PLANT_H
#define ZH_SIL_PLANT_H

#include "sil.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct zh_plant zh_plant;

/* The true quantities at the present crest; vectors power invariant, stationary frame. */
typedef struct {
    uint32_t struct_size; /* sizeof(zh_plant_truth), set by the caller */
    uint32_t diverged;    /* 1: numbers that no rig survives; advance does nothing more */
    double t_s;
    double speed_rpm;
    double torque_Nm;      /* of the motor, in the air gap */
    double load_torque_Nm; /* over the last period; positive opposes positive rotation */
    double i_s_alpha_A;
    double i_s_beta_A;
    double psi_s_alpha_Wb;
    double psi_s_beta_Wb;
    double psi_r_alpha_Wb;
    double psi_r_beta_Wb;
    double u_s_alpha_V; /* mean over the last period */
    double u_s_beta_V;
    double i_peak_A; /* largest leg current over the last period */
    double u_dc_V;
} zh_plant_truth;

/* Files; a text with a line break is the content itself. scenario: NULL, or disturbances, faults
 * and initial values ([profiles], [load], [faults], [scenario]); commands in it are not followed.
 * rig_overrides: NULL, or lines "section.key=value". seed: of the noise. NULL when refused: see
 * zh_sil_error(). */
ZH_API zh_plant *zh_plant_open(const char *rig, const char *board, const char *scenario,
                               const char *rig_overrides, uint64_t seed);

/* The six ADC words, in the order of zh_sil_in. Once per period: the noise goes on. */
ZH_API int zh_plant_sample(zh_plant *plant, uint16_t words[6]);

/* To the next crest. Refused, and nothing happens: a duty outside 0 .. 1. */
ZH_API int zh_plant_advance(zh_plant *plant, const double duty[3], uint32_t gates_on,
                            uint32_t brake_on);

ZH_API int zh_plant_look(const zh_plant *plant, zh_plant_truth *truth);

/* From now on: load_torque_Nm, rs_factor, rr_factor (true over the rig's) or u_dc_V, instead of the
 * scenario's. */
ZH_API int zh_plant_set(zh_plant *plant, const char *name, double value);

/* The noise continues from another seed. */
ZH_API int zh_plant_reseed(zh_plant *plant, uint64_t seed);

/* `count` periods of drive and plant together. in: one per period, its words are replaced; out,
 * truth: NULL or one per period, at its crest; record: as of zh_sil_run. Arrays as of zh_sil_run.
 * Ends with the first period that the drive refuses. */
ZH_API int zh_plant_run(zh_plant *plant, zh_sil *drive, const zh_sil_in *in, zh_sil_out *out,
                        zh_plant_truth *truth, uint32_t count, const zh_sil_record *record);

/* A snapshot is another plant: a copy, with time and noise. Restored, the plant continues as the
 * copied one would have, bit for bit. Refused when `from` was opened with other files. */
ZH_API zh_plant *zh_plant_copy(const zh_plant *plant);
ZH_API int zh_plant_restore(zh_plant *plant, const zh_plant *from);

/* NULL is allowed. */
ZH_API void zh_plant_close(zh_plant *plant);

#ifdef __cplusplus
}
#endif

#endif
