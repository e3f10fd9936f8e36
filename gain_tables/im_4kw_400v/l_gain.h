/* Observer gain table of the motor im_4kw_400v. Generated from l_gain.json: do not edit.
 *
 * 1801 entries of L(w), one per 2 elec. min^-1 from standstill; method gamma_pr.
 * Inputs (motor.toml), SHA-256:
 * 735f3ab183a10c54210c0eb63b604c53a664fe2c7a2d2a3abef6930f7df2275d
 */
#ifndef L_GAIN_IM_4KW_400V_H
#define L_GAIN_IM_4KW_400V_H

#include "gain_table.h"

extern const gain_table_t l_gain_im_4kw_400v;

#endif
