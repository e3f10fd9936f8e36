/* What the temperature sensors change of the drive's configuration: the limit of the torque current
 * (derating), and Rs while the gates are off.
 *
 * The drive's parameters stay as the owner set them; only the configuration made of them differs.
 * It is made anew when somebody else has changed it. A hoist is not derated: it would drop its
 * load.
 */
#ifndef TERMINALS_ADAPT_H
#define TERMINALS_ADAPT_H

#include "terminals.h"

void terminals_adapt(const terminals_config_t *cfg, terminals_state_t *st, unit_t *unit);

#endif
