/* Observer gain table of the motor hasegawa2005_paper. Generated from l_gain.json: do not edit.
 *
 * 1801 entries of L(w), one per 2 elec. min^-1 from standstill; method pole_shift.
 * Inputs (motor.toml), SHA-256:
 * 8ac57ae68afbc2331da9332dcc39bd1b368b6c4bc25d1aedf352f61c51c20f54
 */
#ifndef L_GAIN_HASEGAWA2005_PAPER_H
#define L_GAIN_HASEGAWA2005_PAPER_H

#include "gain_table.h"

extern const gain_table_t l_gain_hasegawa2005_paper;

#endif
