#include "params.h"

static const param_info_t param_table[] = {
#define PARAM_F(name, unit, minimum, maximum, initial, access, text)                               \
    {#name,                                                                                        \
     unit,                                                                                         \
     (minimum),                                                                                    \
     (maximum),                                                                                    \
     offsetof(params_t, name),                                                                     \
     PARAM_FLOAT,                                                                                  \
     PARAM_ACCESS_##access},
#define PARAM_U(name, unit, minimum, maximum, initial, access, text)                               \
    {#name,                                                                                        \
     unit,                                                                                         \
     (float)(minimum),                                                                             \
     (float)(maximum),                                                                             \
     offsetof(params_t, name),                                                                     \
     PARAM_UINT,                                                                                   \
     PARAM_ACCESS_##access},
#include "param_list.def"
#undef PARAM_F
#undef PARAM_U
};

#define PARAMS_COUNT (sizeof(param_table) / sizeof(param_table[0]))

size_t params_count(void)
{
    return PARAMS_COUNT;
}

const param_info_t *params_info(size_t index)
{
    return (index < PARAMS_COUNT) ? &param_table[index] : NULL;
}

const char *params_text(size_t index)
{
    static const char *const texts[] = {
#define PARAM_F(name, unit, minimum, maximum, initial, access, text) (text),
#define PARAM_U(name, unit, minimum, maximum, initial, access, text) (text),
#include "param_list.def"
#undef PARAM_F
#undef PARAM_U
    };
    return (index < PARAMS_COUNT) ? texts[index] : "";
}

float params_initial(size_t index)
{
    static const float initials[] = {
#define PARAM_F(name, unit, minimum, maximum, initial, access, text) (initial),
#define PARAM_U(name, unit, minimum, maximum, initial, access, text) (float)(initial),
#include "param_list.def"
#undef PARAM_F
#undef PARAM_U
    };
    return (index < PARAMS_COUNT) ? initials[index] : 0.0f;
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
        if (same_name(param_table[i].name, name)) {
            return i;
        }
    }
    return PARAMS_COUNT;
}

void params_default(params_t *params)
{
#define PARAM_F(name, unit, minimum, maximum, initial, access, text) params->name = (initial);
#define PARAM_U(name, unit, minimum, maximum, initial, access, text) params->name = (initial);
#include "param_list.def"
#undef PARAM_F
#undef PARAM_U
}

float params_get(const params_t *params, size_t index)
{
    if (index >= PARAMS_COUNT) {
        return 0.0f;
    }
    const unsigned char *field = (const unsigned char *)params + param_table[index].offset;
    if ((param_type_t)param_table[index].type == PARAM_UINT) {
        return (float)*(const uint32_t *)(const void *)field;
    }
    return *(const float *)(const void *)field;
}

params_status_t params_set(params_t *params, size_t index, float value)
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
    unsigned char *field = (unsigned char *)params + info->offset;
    if ((param_type_t)info->type == PARAM_UINT) {
        const uint32_t whole = (uint32_t)value;
        if (((float)whole < value) || ((float)whole > value)) {
            return PARAMS_NOT_WHOLE;
        }
        *(uint32_t *)(void *)field = whole;
    } else {
        *(float *)(void *)field = value;
    }
    return PARAMS_OK;
}
