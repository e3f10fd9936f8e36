/* Stator resistance by direct current, at two levels, before every start; the inverter's loss too.
 *
 * u = Rs i + u_0 along a fixed axis once the flux is constant. The difference of two levels gives
 * Rs, free of sensor offsets and of a dead-time voltage that is saturated at both. The voltage of
 * the duties minus the one that arrives is the loss in dead time and devices (identified, per
 * leg). Where the curve of the loss is wanted, two more levels show how it bends. A leg with
 * capacitance loses whole (1 - tail/i) of a current i, so that u = Rs i + u_0 - c/i. Three levels
 * show c, and so do the teeth (below) of two of them: the smaller counts. Behind the voltage of
 * the duties c also makes Rs too large, and is taken off. A small current finds the line on which
 * the loss begins: it ends where the loss is whole, or at the tail.
 *
 * While the small current is averaged it is reversed with every tooth (below), and the slope of
 * voltage over current counts. With one sign the offsets left in coarse words, which are as large
 * as this current, made the line up to twice as long as it is, and the torque swung at six times
 * the stator frequency. The current controller's integrator is reversed with it, and with that the
 * voltage at once: left to itself the current crossed zero slowly, and words of 10 bit that stood
 * still while the voltage rose looked frozen.
 *
 * The flux still moves by some share of each step while a level is averaged. In the order low,
 * small, bend, high that leaves Rs alone, and little in c. Nothing less than low comes first: while
 * the current is about zero the legs' loss takes the whole voltage, and a coarse ADC that reads
 * zero looks frozen (with bend first it did, in one of 790 runs of the envelope).
 *
 * A triangle of current runs along every level but the small one. It takes the voltage over several
 * steps of its sensor, so that their mean is finer than one step. Without it the voltage stays
 * within one step: with 10 bit Rs was wrong by up to 23 %.
 *
 * The triangle is so fast that the rotor's flux stands still: the rotor is a resistance beside Rs
 * then. The slope of voltage over current within the teeth, less that between two levels, is
 * Rr (M/Lr)^2, with the slope of M(i) in M's place. Saturation makes that too small, at the high
 * level more than at the low one; RS_BENT of what lies between them is added. How far off the
 * result is: tools/docs/seeds.md.
 *
 * With the curve, the levels before the largest current show already whether Rs is too large, and
 * with voltage sensors whether it is next to nothing. It is refused then: current sensors that read
 * a quarter would let the largest current be four times as large.
 *
 * Rs in use is the measured one times a bias. Slightly too high keeps regeneration, slightly too
 * low loses it (the fold at zero stator frequency is one-sided).
 */
#ifndef RS_MEASUREMENT_H
#define RS_MEASUREMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "motor.h"
#include "slots.h"

/* In the order of time; without the curve high, then low. */
#define RS_LEVEL_LOW   0
#define RS_LEVEL_SMALL 1
#define RS_LEVEL_BEND  2
#define RS_LEVEL_HIGH  3
#define RS_LEVELS      4

/* Currents, power invariant: low < high, bend < low for the tail of the curve, and small < bend,
 * where the loss is not whole; not above 0: the curve is not looked at. */
typedef struct {
    float A[RS_LEVELS];
} rs_levels_t;

typedef struct {
    bool enable;
    bool by_duty; /* the observer's voltage is that of the duties */
    rs_levels_t level;
    float level_s;   /* length of each level; several rotor time constants */
    float average_s; /* its last part, which is averaged */
    float bias;      /* Rs in use over measured */
    float ratio_max; /* refused outside nameplate / ratio .. nameplate * ratio */
} rs_measurement_params_t;

typedef struct {
    rs_levels_t level;
    bool curve;
    bool by_duty;
    uint32_t level_periods; /* 0: no measurement */
    uint32_t average_periods;
    float dither_A;     /* amplitude of a triangle on every level but the small one */
    float dither_turns; /* teeth a period; the small current is reversed with each */
    float bias;
    float Rs_min_ohm;
    float Rs_max_ohm;
} rs_measurement_config_t;

/* Sums of one level. x: the mean current of a period, off the level. */
typedef struct {
    float i_A;
    float u_V;
    float u_duty_V;
    float x_A;
    float xx_A2;
    float xu_VA; /* u: of the duties */
} rs_measurement_sums_t;

typedef struct {
    uint32_t periods;
    rs_measurement_sums_t level[RS_LEVELS];
    float bent_V; /* c/i of the high level; a period before the result, to spread the work */
    float i_before_A;
    bool reversed; /* the small current, in the period before */
    bool mirror;   /* reversed now: the caller reverses the voltage along u at once */
} rs_measurement_state_t;

typedef struct {
    float i_A;      /* along u */
    float u_V;      /* the observer's voltage */
    float u_duty_V; /* voltage of the duties, uncompensated */
    uint32_t slot;  /* slots.h */
} rs_measurement_in_t;

typedef enum {
    RS_MEASUREMENT_BUSY = 0,
    RS_MEASUREMENT_DONE = 1,    /* the result is valid: in this period only */
    RS_MEASUREMENT_REFUSED = 2, /* while requested: Rs_ohm or the current does not fit a motor */
    RS_MEASUREMENT_IDLE = 3     /* finished before, or not wanted */
} rs_measurement_status_t;

typedef struct {
    rs_measurement_status_t status;
    float i_ref_A;     /* while BUSY, along u */
    float Rs_ohm;      /* DONE: times bias; REFUSED: as measured, 0 before the high level */
    float Rr_ohm;      /* DONE: of the rotor, seen from the stator: Rr (M/Lr)^2 */
    float lost_V;      /* DONE: loss per leg in dead time and devices at these currents */
    float tail_A;      /* DONE: of that a current i of a leg loses 1 - tail_A/i; 0: all */
    float threshold_A; /* DONE: a leg's current from which on it does; 0: not found */
} rs_measurement_out_t;

/* False for a number that is not finite or of the wrong sign, small >= bend,
 * bend >= low, low >= high, average > level, ratio_max <= 1, or an average shorter than a period or
 * longer than 8192 of them (the precision of a float sum). With enable false nothing is checked. */
CHECKED bool rs_measurement_init(rs_measurement_config_t *cfg,
                                 const rs_measurement_params_t *params, float Rs_nameplate_ohm,
                                 float period_s);

rs_measurement_out_t rs_measurement_step(const rs_measurement_config_t *cfg,
                                         rs_measurement_state_t *st, const rs_measurement_in_t *in);

/* A number that differs where any of the sums does. */
uint32_t rs_measurement_digest(const rs_measurement_state_t *st);

#endif
