/* Identification of the motor's circuit at standstill: all current flows along phase u, so that
 * there is no torque.
 *
 * In this order:
 *   1. Rs, and the leg loss in dead time and devices, by two direct currents (rs_measurement);
 *   2. the magnetising curve, from the flux build-up between successive direct currents:
 *      integral of u minus the straight line between the two settled voltages;
 *   3. the leakage sigma Ls by a fast tone on a direct current;
 *   4. (M/Lr)^2 Rr and M^2/Lr by a slow one.
 * No phase current comes near zero meanwhile, so that dead time only shifts the mean. Below the
 * smallest current the curve is straight. Measurements at the terminals do not show how the leakage
 * is shared: that is the tool's choice (zh commission).
 */
#ifndef COMMISSIONING_H
#define COMMISSIONING_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "params.h"
#include "rs_measurement.h"
#include "tone.h"

#define COMMISSIONING_LEVELS 8u

typedef enum {
    COMMISSIONING_NOT_REFUSED = 0,
    COMMISSIONING_NO_CURRENT = 1, /* current does not follow: no motor, or too little voltage */
    COMMISSIONING_OPEN_PHASE = 2, /* current across the axis: v and w differ */
    COMMISSIONING_RS = 3,         /* not a motor's stator resistance */
    COMMISSIONING_UNSETTLED = 4,  /* the flux was still changing: use longer levels */
    COMMISSIONING_CURVE = 5,      /* more current did not give more flux */
    COMMISSIONING_LEAKAGE = 6,    /* sigma Ls not positive, or not below the inductance */
    COMMISSIONING_ROTOR = 7       /* Rr or M not positive, or out of proportion to Rs and Ls */
} commissioning_refusal_t;

/* Zero until found. */
typedef struct {
    float Rs_ohm;
    float lost_V; /* per leg, beyond the threshold */
    float sigma_Ls_H;
    float Rr_gamma_ohm; /* (M/Lr)^2 Rr */
    float M_gamma_H;    /* M^2/Lr for small changes about bias_A */
    float bias_A;
    float level_A[COMMISSIONING_LEVELS];
    float flux_Wb[COMMISSIONING_LEVELS]; /* stator flux at that current */
    float error_V[COMMISSIONING_LEVELS]; /* u - Rs i there: error curve of the inverter */
} commissioning_result_t;

typedef struct {
    float level_step_A;
    float bias_A;
    float swing_A;
    float lowest_A; /* the curve begins here */
    float period_s;
    uint32_t level_periods;
    uint32_t average_periods;
    rs_measurement_config_t rs;
    tone_config_t fast;
    tone_config_t slow;
} commissioning_config_t;

typedef enum {
    COMMISSIONING_STAGE_RS = 0,
    COMMISSIONING_STAGE_LOWEST = 1,
    COMMISSIONING_STAGE_CURVE = 2,
    COMMISSIONING_STAGE_BIAS = 3,
    COMMISSIONING_STAGE_FAST = 4,
    COMMISSIONING_STAGE_SLOW = 5,
    COMMISSIONING_STAGE_END = 6
} commissioning_stage_t;

typedef struct {
    commissioning_stage_t stage;
    commissioning_refusal_t refusal;
    uint32_t level;   /* of the curve */
    uint32_t periods; /* in this stage or level */
    float i_before_A;
    float u_coming_V; /* of the interval that now begins */
    float sum_V;      /* of u - Rs i less that of the level below, over all of this one ... */
    float first_V;    /* ... over the first half of its average ... */
    float last_V;     /* ... and over the second */
    float i_sum_A;    /* of i less that of the level below, over all ... */
    float i_end_A;    /* ... and over the average */
    float across_A;   /* over the average */
    float settled_V;  /* of the level below: u - Rs i */
    float settled_A;  /* and i */
    rs_measurement_state_t rs;
    tone_state_t tone;
    commissioning_result_t result;
} commissioning_state_t;

typedef struct {
    ab_t i_A;         /* sampled now */
    float u_coming_V; /* along the axis, of the duties that act from now on */
} commissioning_in_t;

typedef enum {
    COMMISSIONING_BUSY = 0,
    COMMISSIONING_DONE = 1,
    COMMISSIONING_REFUSED = 2
} commissioning_status_t;

typedef struct {
    commissioning_status_t status;
    float i_ref_A;
} commissioning_out_t;

/* False for a number that is not finite and positive, or a level shorter than 100 periods or longer
 * than a million. */
CHECKED bool commissioning_init(commissioning_config_t *cfg, const params_t *params);

/* One step per period, starting from a zeroed state. */
commissioning_out_t commissioning_step(const commissioning_config_t *cfg, commissioning_state_t *st,
                                       const commissioning_in_t *in);

#endif
