/* The signals of signal_list.def by number, for trace and link. */
#ifndef UNIT_SIGNAL_H
#define UNIT_SIGNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "unit.h"

enum {
#define SIGNAL_F(name, path, text)  UNIT_SIGNAL_##name,
#define SIGNAL_U(name, path, text)  UNIT_SIGNAL_##name,
#define SIGNAL_OF(name, path, text) UNIT_SIGNAL_##name,
#define SIGNAL_OU(name, path, text) UNIT_SIGNAL_##name,
#define SIGNAL_X(name, value, text) UNIT_SIGNAL_##name,
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
    UNIT_SIGNALS
};

/* In the period that was recorded last; a float as its bits; 0 for an unknown number. */
uint32_t unit_signal(const unit_t *a, uint32_t number);

bool unit_signal_is_float(uint32_t number);

/* Empty for an unknown number. */
const char *unit_signal_name(uint32_t number);

#endif
