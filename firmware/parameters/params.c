#include "params.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

#define PARAM_CHOICES(list, ...)                                                                   \
    static const char *const choices_##list[] = {__VA_ARGS__};                                     \
    enum last_of_##list##_tag{last_of_##list = (int)COUNT(choices_##list) - 1};
#include "param_choices.def"

/* One text, the names one behind the other: pointers and padding would take half as much again. */
typedef struct {
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text) char name[sizeof #name];
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text) char name[sizeof #name];
#define PARAM_E(group, name, choices, initial, access, text)                char name[sizeof #name];
#include "param_list.def"
} param_names_t;

static const param_names_t param_names = {
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text) #name,
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text) #name,
#define PARAM_E(group, name, choices, initial, access, text)                #name,
#include "param_list.def"
};

#define NUMBER(group, name, symbol, minimum, maximum, type, access)                                \
    {{.unit = (symbol)},    (minimum),          (maximum), offsetof(param_names_t, name), type,    \
     PARAM_ACCESS_##access, PARAM_GROUP_##group},

static const param_info_t param_table[] = {
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text)                        \
    NUMBER(group, name, unit, minimum, maximum, PARAM_FLOAT, access)
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text)                        \
    NUMBER(group, name, unit, (float)(minimum), (float)(maximum), PARAM_UINT, access)
#define PARAM_E(group, name, list, initial, access, text)                                          \
    {{.choices = choices_##list},                                                                  \
     0.0f,                                                                                         \
     (float)last_of_##list,                                                                        \
     offsetof(param_names_t, name),                                                                \
     PARAM_CHOICE,                                                                                 \
     PARAM_ACCESS_##access,                                                                        \
     PARAM_GROUP_##group},
#include "param_list.def"
};

#define PARAMS_COUNT COUNT(param_table)

/* All members of params_t are 32 bits wide, in the order of the list. */
#define MEMBER_BYTES sizeof(uint32_t)
_Static_assert(sizeof(params_t) == PARAMS_COUNT * MEMBER_BYTES, "no padding between members");

size_t params_count(void)
{
    return PARAMS_COUNT;
}

const param_info_t *params_info(size_t index)
{
    return (index < PARAMS_COUNT) ? &param_table[index] : NULL;
}

const char *params_name(size_t index)
{
    if (index >= PARAMS_COUNT) {
        return "";
    }
    return (const char *)&param_names + param_table[index].name_at;
}

const char *params_text(size_t index)
{
    static const char *const texts[] = {
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text) (text),
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text) (text),
#define PARAM_E(group, name, choices, initial, access, text)                (text),
#include "param_list.def"
    };
    return (index < PARAMS_COUNT) ? texts[index] : "";
}

float params_initial(size_t index)
{
    static const float initials[] = {
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text) (initial),
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text) (float)(initial),
#define PARAM_E(group, name, choices, initial, access, text)                (float)(initial),
#include "param_list.def"
    };
    return (index < PARAMS_COUNT) ? initials[index] : 0.0f;
}

const char *params_group_name(size_t group)
{
    static const char *const names[] = {
#define PARAM_GROUP(group, name, text) (name),
#include "param_groups.def"
    };
    return (group < COUNT(names)) ? names[group] : "";
}

const char *params_group_text(size_t group)
{
    static const char *const texts[] = {
#define PARAM_GROUP(group, name, text) (text),
#include "param_groups.def"
    };
    return (group < COUNT(texts)) ? texts[group] : "";
}

static bool same_name(const char *a, const char *b)
{
    size_t i = 0u;
    while ((a[i] != '\0') && (a[i] == b[i])) {
        i++;
    }
    return a[i] == b[i];
}

size_t params_find(const char *name)
{
    for (size_t i = 0u; i < PARAMS_COUNT; i++) {
        if (same_name(params_name(i), name)) {
            return i;
        }
    }
    return PARAMS_COUNT;
}

void params_default(params_t *params)
{
#define PARAM_F(group, name, unit, minimum, maximum, initial, access, text)                        \
    params->name = (initial);
#define PARAM_U(group, name, unit, minimum, maximum, initial, access, text)                        \
    params->name = (initial);
#define PARAM_E(group, name, choices, initial, access, text) params->name = (initial);
#include "param_list.def"
}

float params_get(const params_t *params, size_t index)
{
    if (index >= PARAMS_COUNT) {
        return 0.0f;
    }
    const unsigned char *field = (const unsigned char *)params + index * MEMBER_BYTES;
    if ((param_type_t)param_table[index].type == PARAM_FLOAT) {
        return *(const float *)(const void *)field;
    }
    return (float)*(const uint32_t *)(const void *)field;
}

params_status_t params_allows(size_t index, float value)
{
    if (index >= PARAMS_COUNT) {
        return PARAMS_NO_SUCH;
    }
    const param_info_t *info = &param_table[index];
    if (!is_finite(value)) {
        return PARAMS_NOT_FINITE;
    }
    if ((value < info->minimum) || (value > info->maximum)) {
        return PARAMS_OUT_OF_RANGE;
    }
    if ((param_type_t)info->type != PARAM_FLOAT) {
        if ((float)(uint32_t)value < value) {
            return PARAMS_NOT_WHOLE;
        }
    }
    return PARAMS_OK;
}

params_status_t params_set(params_t *params, size_t index, float value)
{
    const params_status_t status = params_allows(index, value);
    if (status != PARAMS_OK) {
        return status;
    }
    unsigned char *field = (unsigned char *)params + index * MEMBER_BYTES;
    if ((param_type_t)param_table[index].type == PARAM_FLOAT) {
        *(float *)(void *)field = value;
    } else {
        *(uint32_t *)(void *)field = (uint32_t)value;
    }
    return PARAMS_OK;
}
