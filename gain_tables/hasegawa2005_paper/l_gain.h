/* Observer gain table of the motor hasegawa2005_paper. Generated from l_gain.json: do not edit.
 *
 * 1801 entries of L(w), one per 2 elec. min^-1 from standstill; method pole_shift.
 * Inputs (motor.toml), SHA-256:
 * b5aecec2828a189cb633d36e590f8a418b6bd70d60c7b1ea6ebc502f97989d3d
 */
#ifndef L_GAIN_HASEGAWA2005_PAPER_H
#define L_GAIN_HASEGAWA2005_PAPER_H

#include "gain_table.h"

extern const gain_table_t l_gain_hasegawa2005_paper;

#endif
