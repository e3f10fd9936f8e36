/* Observer gain table of the motor hasegawa2005. Generated from l_gain.json: do not edit.
 *
 * 1801 entries of L(w), one per 2 elec. min^-1 from standstill; method gamma_pr.
 * Inputs (motor.toml), SHA-256:
 * 924c44f8a097b29049a945b260e23cdf5444563f3d5be83e51ec890ad9dd26f2
 */
#ifndef L_GAIN_HASEGAWA2005_H
#define L_GAIN_HASEGAWA2005_H

#include "gain_table.h"

extern const gain_table_t l_gain_hasegawa2005;

#endif
