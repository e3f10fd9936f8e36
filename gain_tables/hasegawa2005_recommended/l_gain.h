/* Observer gain table of the motor hasegawa2005_recommended. Generated from l_gain.json: do not edit.
 *
 * 1801 entries of L(w), one per 2 elec. min^-1 from standstill; method closed_form.
 * Inputs (motor.toml), SHA-256:
 * 1c3b659c3d94f915a43148fa203f3502cf1d16bbd722789d37afd57f5409f926
 */
#ifndef L_GAIN_HASEGAWA2005_RECOMMENDED_H
#define L_GAIN_HASEGAWA2005_RECOMMENDED_H

#include "gain_table.h"

extern const gain_table_t l_gain_hasegawa2005_recommended;

#endif
