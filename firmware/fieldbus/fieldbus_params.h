/* The parameters as objects of a bus: the k-th of its group, 32 bits each. */
#ifndef FIELDBUS_PARAMS_H
#define FIELDBUS_PARAMS_H

#include "fieldbus.h"

/* Index of a group's k-th parameter; params_count() when there is none. */
size_t fieldbus_param_at(uint32_t group, uint32_t k);

/* Whether a bus may write it at all: fieldbus_writable.def. */
bool fieldbus_param_writable(size_t index);

/* A float as its bits, a whole number as it is; index < params_count(). */
uint32_t fieldbus_param_bits(const unit_t *unit, size_t index);

/* As a sealed request of the host link would, with the same checks. UNIT_LINK_PROTECTED: not to be
 * written by a bus. UNIT_LINK_NOT_NOW: also without leave to command (fieldbus_allowed). */
CHECKED unit_link_status_t fieldbus_param_set(unit_t *unit, size_t index, uint32_t bits);

#endif
