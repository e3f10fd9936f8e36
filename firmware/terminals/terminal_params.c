#include "terminal_params.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

typedef struct {
    const char *name;
    float minimum;
    float maximum;
    bool whole;
} terminal_param_t;

static const terminal_param_t param_table[] = {
#define TERMINAL_F(name, unit, minimum, maximum, initial, text) {#name, minimum, maximum, false},
#define TERMINAL_E(name, highest, choices, text)                {#name, 0.0f, (float)(highest), true},
#include "terminal_params.def"
};

#define PARAMS ((uint32_t)COUNT(param_table))

/* All members are 32 bits wide, in the order of the list. */
_Static_assert(sizeof(terminal_params_t) == COUNT(param_table) * sizeof(uint32_t), "no padding");

void terminal_params_default(terminal_params_t *params)
{
#define TERMINAL_F(name, unit, minimum, maximum, initial, text) params->name = (initial);
#define TERMINAL_E(name, highest, choices, text)                params->name = 0u;
#include "terminal_params.def"
}

uint32_t terminal_params_count(void)
{
    return PARAMS;
}

const char *terminal_params_name(uint32_t index)
{
    return (index < PARAMS) ? param_table[index].name : "";
}

static bool same_name(const char *a, const char *b)
{
    uint32_t i = 0u;
    while ((a[i] != '\0') && (a[i] == b[i])) {
        i++;
    }
    return a[i] == b[i];
}

uint32_t terminal_params_find(const char *name)
{
    uint32_t index = 0u;
    while ((index < PARAMS) && !same_name(param_table[index].name, name)) {
        index++;
    }
    return index;
}

float terminal_params_get(const terminal_params_t *params, uint32_t index)
{
    if (index >= PARAMS) {
        return 0.0f;
    }
    const void *field = (const uint32_t *)(const void *)params + index;
    return param_table[index].whole ? (float)*(const uint32_t *)field : *(const float *)field;
}

bool terminal_params_set(terminal_params_t *params, uint32_t index, float value)
{
    if ((index >= PARAMS) || !is_finite(value)) {
        return false;
    }
    const terminal_param_t *p = &param_table[index];
    if ((value < p->minimum) || (value > p->maximum)) {
        return false;
    }
    void *field = (uint32_t *)(void *)params + index;
    if (!p->whole) {
        *(float *)field = value;
        return true;
    }
    const uint32_t whole = (uint32_t)value;
    if ((float)whole < value) {
        return false;
    }
    *(uint32_t *)field = whole;
    return true;
}
