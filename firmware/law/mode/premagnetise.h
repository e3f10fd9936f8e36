/* Flux build-up along phase u before torque, and measurement of the stator resistance and of the
 * legs' voltage loss by direct current. Commissioning uses the same frame with its own current.
 */
#ifndef PREMAGNETISE_H
#define PREMAGNETISE_H

#include "mode.h"
#include "rs_measurement.h"

typedef struct {
    rs_measurement_config_t measurement;
    float Rs_ohm;           /* the parameter */
    float Rr_ohm;           /* likewise, seen from the stator */
    bool identify_leg_loss; /* compensate the loss found, not the parameters */
} premagnetise_config_t;

typedef struct {
    rs_measurement_state_t measurement;
    float Rs_delta_ohm;    /* found minus the parameter; 0: none found */
    float Rr_extra_pu;     /* found over the parameter, beyond what heat explains; 0: none found */
    float leg_loss_pu;     /* leg voltage lost over dc link, as found */
    float leg_threshold_A; /* leg current from which on it is lost, as found; 0: the parameter */
    float leg_tail_A;      /* of that a current i loses 1 - tail/i, as found; 0: all */
    bool leg_loss_found;   /* false: use the parameters */
} premagnetise_state_t;

/* One period of the measurement. True: *i_ref_A is its current reference, and the legs must not be
 * compensated. False: it is done, was refused (*faults), or is not wanted. */
CHECKED bool premagnetise_measure(const premagnetise_config_t *cfg, premagnetise_state_t *st,
                                  const mode_in_t *in, float *i_ref_A, uint32_t *faults);

#endif
