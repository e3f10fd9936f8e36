/* Values that exclude each other although each is within its own range.
 *
 * One table of rules, param_rules.def, for the drive, the host link, the simulation and the build.
 * The init functions of the law check the same again; what they alone refuse has no rule and no
 * names.
 */
#ifndef PARAMS_CHECK_H
#define PARAMS_CHECK_H

#include "params.h"

typedef enum {
    PARAMS_AT_MOST = 0,
    PARAMS_BELOW = 1,
    PARAMS_AT_LEAST = 2,
    PARAMS_ABOVE = 3,
    PARAMS_FIXED = 4 /* fixed by the image */
} params_relation_t;

typedef struct {
    size_t first; /* params_count(): no rule applies */
    size_t second;
    params_relation_t relation; /* relation of first ... */
    float limit;                /* ... to this limit, for the present second */
} params_conflict_t;

/* False: *conflict is the first rule that is broken. True: it names no parameter. */
bool params_check(const params_t *params, params_conflict_t *conflict);

#endif
