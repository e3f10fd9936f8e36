#include <array>
#include <bit>
#include <optional>
#include <string>
#include <string_view>

#include "c_boundary.hpp"
#include "sil.h"
#include "sil_handle.hpp"

namespace {

using zh::fail;

constexpr std::array texts{
#define SIGNAL_F(name, path, text)  text,
#define SIGNAL_U(name, path, text)  text,
#define SIGNAL_OF(name, path, text) text,
#define SIGNAL_OU(name, path, text) text,
#define SIGNAL_X(name, value, text) text,
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
};
static_assert(texts.size() == UNIT_SIGNALS);

struct Unit {
    std::string_view ending;
    const char *text;
};

// The unit ends the name; longer endings first.
constexpr std::array units{
    Unit{"_rad_s", "rad/s"}, Unit{"_Wb_per_s", "Wb/s"}, Unit{"_A_per_s", "A/s"},
    Unit{"_per_s", "1/s"},   Unit{"_ohm", "ohm"},       Unit{"_rad", "rad"},
    Unit{"_Nm", "Nm"},       Unit{"_Wb", "Wb"},         Unit{"_Hz", "Hz"},
    Unit{"_pu", "1"},        Unit{"_A", "A"},           Unit{"_V", "V"},
    Unit{"_s", "s"},
};

// Duties and gates are not in the unit: it keeps them only while it records.
std::optional<double> of_output(const hal_output_t &o, std::uint32_t index)
{
    switch (index) {
#define SIGNAL_F(name, path, text)
#define SIGNAL_U(name, path, text)
#define SIGNAL_OF(name, path, text)                                                                \
    case UNIT_SIGNAL_##name:                                                                       \
        return static_cast<double>(o.path);
#define SIGNAL_OU(name, path, text)                                                                \
    case UNIT_SIGNAL_##name:                                                                       \
        return o.path ? 1.0 : 0.0;
#define SIGNAL_X(name, value, text)
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
    default:
        return std::nullopt;
    }
}

const char *unit_of(std::string_view name)
{
    for (const Unit &unit : units) {
        if (name.ends_with(unit.ending)) {
            return unit.text;
        }
    }
    return "";
}

int no_such(const char *caller, std::uint32_t index)
{
    return fail(ZH_NO_SUCH_NAME, std::string(caller) + ": index " + std::to_string(index) +
                                     ": is not below zh_sil_signal_count()");
}

} // namespace

double zh::signal_value(const zh_sil &drive, std::uint32_t index)
{
    if (const std::optional<double> value = of_output(drive.output, index)) {
        return *value;
    }
    const std::uint32_t word = unit_signal(&drive.firmware.unit(), index);
    return unit_signal_is_float(index) ? static_cast<double>(std::bit_cast<float>(word))
                                       : static_cast<double>(word);
}

uint32_t zh_sil_signal_count(void)
{
    return UNIT_SIGNALS;
}

uint32_t zh_sil_signal_find(const char *name)
{
    std::uint32_t index = 0;
    while (name != nullptr && index < UNIT_SIGNALS &&
           std::string_view(unit_signal_name(index)) != name) {
        ++index;
    }
    return name != nullptr ? index : zh_sil_signal_count();
}

int zh_sil_signal_describe(uint32_t index, zh_sil_signal_info *info)
{
    if (info == nullptr || info->struct_size < sizeof(zh_sil_signal_info)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_signal_describe: info: is NULL or its struct_size too "
                                     "small; set it to sizeof(zh_sil_signal_info)");
    }
    if (index >= UNIT_SIGNALS) {
        return no_such("zh_sil_signal_describe", index);
    }
    const char *name = unit_signal_name(index);
    zh::hand_out({info->struct_size, unit_signal_is_float(index) ? 0U : 1U, name, unit_of(name),
                  texts[index]},
                 info);
    return ZH_OK;
}

int zh_sil_signals(const zh_sil *handle, const uint32_t *index, uint32_t count, double *value)
{
    if (handle == nullptr || ((index == nullptr || value == nullptr) && count > 0)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_signals: handle, index or value: is NULL");
    }
    for (std::uint32_t k = 0; k < count; ++k) {
        if (index[k] >= UNIT_SIGNALS) {
            return no_such("zh_sil_signals", index[k]);
        }
        value[k] = zh::signal_value(*handle, index[k]);
    }
    return ZH_OK;
}
