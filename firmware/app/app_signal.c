#include "app_signal.h"

uint32_t app_signal(const app_t *a, const hal_output_t *o, uint32_t number)
{
    switch (number) {
#define SIGNAL_F(name, value, text)                                                                \
    case APP_SIGNAL_##name:                                                                        \
        return float_bits(value);
#define SIGNAL_U(name, value, text)                                                                \
    case APP_SIGNAL_##name:                                                                        \
        return (value);
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
    default:
        return 0u;
    }
}

bool app_signal_is_float(uint32_t number)
{
    switch (number) {
#define SIGNAL_F(name, value, text) case APP_SIGNAL_##name:
#define SIGNAL_U(name, value, text)
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
        return true;
    default:
        return false;
    }
}

const char *app_signal_name(uint32_t number)
{
    static const char *const names[] = {
#define SIGNAL_F(name, value, text) #name,
#define SIGNAL_U(name, value, text) #name,
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
    };
    return (number < (uint32_t)APP_SIGNALS) ? names[number] : "";
}
