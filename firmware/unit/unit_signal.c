#include "unit_signal.h"

uint32_t unit_signal(const unit_t *a, const hal_output_t *o, uint32_t number)
{
    return unit_signal_value(a, o, number);
}

bool unit_signal_is_float(uint32_t number)
{
    switch (number) {
#define SIGNAL_F(name, value, text) case UNIT_SIGNAL_##name:
#define SIGNAL_U(name, value, text)
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
        return true;
    default:
        return false;
    }
}

/* One text, the names one behind the other: pointers to each would take as much flash again. */
const char *unit_signal_name(uint32_t number)
{
    static const char names[] = {
#define SIGNAL_F(name, value, text) #name "\0"
#define SIGNAL_U(name, value, text) #name "\0"
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
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
