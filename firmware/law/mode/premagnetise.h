/* Flux build-up along phase u before torque, and what direct current tells of the stator: its
 * resistance and the voltage the legs lose. Commissioning uses the same frame with a current of its
 * own.
 */
#ifndef PREMAGNETISE_H
#define PREMAGNETISE_H

#include "mode.h"
#include "rs_measurement.h"

typedef struct {
    rs_measurement_config_t measurement;
    float Rs_ohm;           /* the parameter */
    bool identify_leg_loss; /* dead-time compensation by the loss found, not by the parameters */
} premagnetise_config_t;

typedef struct {
    rs_measurement_state_t measurement;
    float Rs_delta_ohm;  /* found minus the parameter; 0: none found */
    float leg_loss_pu;   /* leg voltage lost over dc link, as found */
    bool leg_loss_found; /* else by the parameters */
} premagnetise_state_t;

/* One period of the measurement. True: *i_ref_A is the current it wants, and the legs are not to be
 * compensated. False: it is done, was refused (*faults), or not wanted. */
CHECKED bool premagnetise_measure(const premagnetise_config_t *cfg, premagnetise_state_t *st,
                                  const mode_in_t *in, float *i_ref_A, uint32_t *faults);

#endif
