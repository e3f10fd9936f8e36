/* Observer gain table of the motor hasegawa2005_recommended. Generated from l_gain.json: do not edit.
 *
 * 1801 entries of L(w), one per 2 elec. min^-1 from standstill; method closed_form.
 * Inputs (motor.toml), SHA-256:
 * d475d7f4948a90be4ce74d25307094fd0afaa09f92940be05929d24781f02c1d
 */
#ifndef L_GAIN_HASEGAWA2005_RECOMMENDED_H
#define L_GAIN_HASEGAWA2005_RECOMMENDED_H

#include "gain_table.h"

extern const gain_table_t l_gain_hasegawa2005_recommended;

#endif
