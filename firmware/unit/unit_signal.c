#include "unit_signal.h"

#include <stddef.h>

/* How a signal is read. */
typedef enum {
    SIGNAL_FLOAT,
    SIGNAL_WORD,
    SIGNAL_BYTE, /* a bool, or an enumeration where the compiler packs them */
    SIGNAL_EXPRESSION
} kind_t;

/* And where it lies in unit_t. */
typedef struct {
    uint16_t at : 14;
    uint16_t kind : 2; /* kind_t */
} place_t;

#define KIND(path)                                                                                 \
    ((sizeof(((const unit_t *)NULL)->path) == sizeof(uint32_t)) ? SIGNAL_WORD : SIGNAL_BYTE)

static const place_t places[] = {
#define SIGNAL_F(name, path, text)  {offsetof(unit_t, path), SIGNAL_FLOAT},
#define SIGNAL_U(name, path, text)  {offsetof(unit_t, path), KIND(path)},
#define SIGNAL_OF(name, path, text) {offsetof(unit_t, output.path), SIGNAL_FLOAT},
#define SIGNAL_OU(name, path, text) {offsetof(unit_t, output.path), SIGNAL_BYTE},
#define SIGNAL_X(name, value, text) {0u, SIGNAL_EXPRESSION},
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
};

_Static_assert(sizeof(unit_t) <= (1u << 14u), "an offset has 14 bits");

COLD static uint32_t expression(const unit_t *a, uint32_t number)
{
    switch (number) {
#define SIGNAL_F(name, path, text)
#define SIGNAL_U(name, path, text)
#define SIGNAL_OF(name, path, text)
#define SIGNAL_OU(name, path, text)
#define SIGNAL_X(name, value, text)                                                                \
    case UNIT_SIGNAL_##name:                                                                       \
        return (value);
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
    default:
        return 0u;
    }
}

uint32_t unit_signal(const unit_t *a, uint32_t number)
{
    const place_t place =
        (number < (uint32_t)UNIT_SIGNALS) ? places[number] : (place_t){0u, SIGNAL_EXPRESSION};
    const unsigned char *at = (const unsigned char *)a + place.at;
    switch ((kind_t)place.kind) {
    case SIGNAL_FLOAT:
        return float_bits(*(const float *)(const void *)at);
    case SIGNAL_WORD:
        return *(const uint32_t *)(const void *)at;
    case SIGNAL_BYTE:
        return *at;
    case SIGNAL_EXPRESSION:
    default:
        return expression(a, number);
    }
}

bool unit_signal_is_float(uint32_t number)
{
    return (number < (uint32_t)UNIT_SIGNALS) && ((kind_t)places[number].kind == SIGNAL_FLOAT);
}

/* One text, the names one behind the other: pointers to each would take as much flash again. */
const char *unit_signal_name(uint32_t number)
{
    static const char names[] = {
#define SIGNAL_F(name, path, text)  #name "\0"
#define SIGNAL_U(name, path, text)  #name "\0"
#define SIGNAL_OF(name, path, text) #name "\0"
#define SIGNAL_OU(name, path, text) #name "\0"
#define SIGNAL_X(name, value, text) #name "\0"
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
    };
    const char *at = names;
    uint32_t left = (number < (uint32_t)UNIT_SIGNALS) ? number : (uint32_t)UNIT_SIGNALS;
    while (left > 0u) {
        while (*at != '\0') {
            at++;
        }
        at++;
        left--;
    }
    return at; /* behind the last name stands an empty one */
}
