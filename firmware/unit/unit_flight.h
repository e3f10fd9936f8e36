/* Flight recorder of one drive: what it was given since a start of its state (host/flight.h). */
#ifndef UNIT_FLIGHT_H
#define UNIT_FLIGHT_H

#include "unit.h"

/* Background: the drive stands in READY, no command that stands can start it, and its ADC words
 * leave a bit free. */
bool unit_flight_allowed(const unit_t *unit);

/* Control interrupt, while a recording is asked for or going on; `sample` and `output` of the
 * period just ended. Asked for, it puts the drive back to what unit_init made of it: BOOT, offsets
 * to be measured, gates off. The overload models keep their heat; what heating and m_tracking have
 * found begins anew, and the motor counts as cold. Then it records. */
COLD void unit_flight_period(unit_t *unit, const hal_sample_t *sample, const hal_output_t *output);

/* Digest of what the drive puts out: equal drives have equal ones. */
uint32_t unit_flight_digest(const unit_t *unit, const hal_output_t *output, uint32_t before);

#endif
