/* The parameter set as a struct and as a list: groups, names, units, ranges, choices, defaults.
 *
 * Generated from param_list.def by the preprocessor; one source for firmware, SIL and tools.
 */
#ifndef PARAMS_H
#define PARAMS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "num.h"

typedef struct {
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text) float name;
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text) uint32_t name;
#define PARAM_E(group, name, choices, initial, access, text)                uint32_t name;
#include "param_list.def"
} params_t;

typedef enum {
    PARAM_FLOAT = 0,
    PARAM_UINT = 1,  /* whole number */
    PARAM_CHOICE = 2 /* one of its choices, a whole number */
} param_type_t;

typedef enum {
    PARAM_ACCESS_RUN = 0,
    PARAM_ACCESS_READY = 1,
    PARAM_ACCESS_PROTECTED = 2
} param_access_t;

typedef enum {
#define PARAM_GROUP(group, name, text) PARAM_GROUP_##group,
#include "param_groups.def"
    PARAM_GROUPS
} param_group_t;

/* An image has more than a hundred: packed. */
typedef struct {
    union {
        const char *unit;
        const char *const *choices; /* names of the values 0 .. maximum */
    } says;
    float minimum;
    float maximum;
    uint32_t name_at : 16; /* in the list of names */
    uint32_t type : 2;     /* param_type_t */
    uint32_t access : 2;   /* param_access_t */
    uint32_t group : 8;    /* param_group_t */
} param_info_t;

/* Empty for a choice. */
static inline const char *param_unit(const param_info_t *info)
{
    return (info->type == (uint32_t)PARAM_CHOICE) ? "" : info->says.unit;
}

/* NULL for a number. */
static inline const char *const *param_choices(const param_info_t *info)
{
    return (info->type == (uint32_t)PARAM_CHOICE) ? info->says.choices : NULL;
}

typedef enum {
    PARAMS_OK = 0,
    PARAMS_NOT_FINITE = 1,
    PARAMS_OUT_OF_RANGE = 2,
    PARAMS_NOT_WHOLE = 3, /* an integer parameter was given a fraction */
    PARAMS_NO_SUCH = 4,
    PARAMS_GATES_ON = 5, /* its class needs the gates off */
    PARAMS_LOCKED = 6    /* its class needs an unlocked drive */
} params_status_t;

size_t params_count(void);

/* index < params_count(), else NULL. */
const param_info_t *params_info(size_t index);

/* Empty for an index or a group that does not exist. */
const char *params_name(size_t index);
const char *params_group_name(size_t group);

/* Description of the parameter or the group; empty for an index that does not exist. Separate from
 * the rest, so that an image that never asks does not contain the texts. */
const char *params_text(size_t index);
const char *params_group_text(size_t group);

/* Its default; 0 for an index that does not exist. Separate for the same reason. */
float params_initial(size_t index);

/* Index of the name, params_count() when there is none. */
size_t params_find(const char *name);

void params_default(params_t *params);

/* 0 for an index that does not exist. */
float params_get(const params_t *params, size_t index);

/* Whether a value is within the parameter's own range. */
CHECKED params_status_t params_allows(size_t index, float value);

/* Range-checked; *params changes only with PARAMS_OK. */
CHECKED params_status_t params_set(params_t *params, size_t index, float value);

#endif
