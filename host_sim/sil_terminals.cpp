#include <cmath>
#include <cstddef>
#include <string>

#include "c_boundary.hpp"
#include "sil.h"
#include "sil_handle.hpp"

namespace {

/** As a function: where two macros have one text, the linter takes == for a mistake. */
constexpr bool same(unsigned ours, unsigned firmware)
{
    return ours == firmware;
}

// The firmware's own numbers are the interface's.
static_assert(same(ZH_TERMINAL_START, HAL_TERMINAL_START));
static_assert(same(ZH_TERMINAL_STOP, HAL_TERMINAL_STOP));
static_assert(same(ZH_TERMINAL_REVERSE, HAL_TERMINAL_REVERSE));
static_assert(same(ZH_TERMINAL_RESET, HAL_TERMINAL_RESET));
static_assert(same(ZH_TERMINAL_BRAKE_RELEASED, HAL_TERMINAL_BRAKE_RELEASED));
static_assert(same(ZH_TERMINAL_CONTACTOR_ON, HAL_TERMINAL_CONTACTOR_ON));
static_assert(same(ZH_TERMINAL_CHOPPER_LEADS, HAL_TERMINAL_CHOPPER_LEADS));
static_assert(same(ZH_TERMINAL_READY, HAL_TERMINAL_READY));
static_assert(same(ZH_TERMINAL_NO_FAULT, HAL_TERMINAL_NO_FAULT));
static_assert(same(ZH_TERMINAL_BRAKE_RELEASE, HAL_TERMINAL_BRAKE_RELEASE));
static_assert(same(ZH_TERMINAL_CONTACTOR, HAL_TERMINAL_CONTACTOR));
static_assert(same(ZH_TERMINAL_CHOPPER, HAL_TERMINAL_CHOPPER));

using zh::fail;

int none_fitted(const std::string &caller)
{
    return fail(ZH_NOT_NOW, caller + ": no terminals are fitted; zh_sil_terminals_fit does that");
}

} // namespace

int zh_sil_terminals_fit(zh_sil *handle, const char *parameters)
{
    if (handle == nullptr || parameters == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_terminals_fit: handle or parameters: is NULL");
    }
    if (handle->firmware.gates_on()) {
        return fail(ZH_NOT_NOW, "zh_sil_terminals_fit: only with the gates off");
    }
    return zh::guarded<int>(ZH_REFUSED, [&] {
        handle->firmware.terminals().fit(parameters, handle->firmware.params());
        return int{ZH_OK};
    });
}

int zh_sil_terminals_set(zh_sil *handle, const zh_sil_terminal_in *in)
{
    if (handle == nullptr || in == nullptr || in->struct_size < sizeof(zh_sil_terminal_in)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_terminals_set: handle or in: is NULL or in's "
                                     "struct_size too small; set it to sizeof(zh_sil_terminal_in)");
    }
    zh::TerminalBoard &board = handle->firmware.terminals();
    if (!board.fitted()) {
        return none_fitted("zh_sil_terminals_set");
    }
    const double values[] = {in->analog_V, in->analog_A, in->sink_ohm, in->motor_ohm};
    for (const double value : values) {
        if (std::isnan(value) || value < 0.0) {
            return fail(ZH_BAD_INPUT, "zh_sil_terminals_set: in: a value is no number or negative");
        }
    }
    board.wiring() = {in->inputs,   in->analog_V,  in->analog_A,
                      in->sink_ohm, in->motor_ohm, in->unreadable != 0U};
    return ZH_OK;
}

int zh_sil_terminals_look(const zh_sil *handle, zh_sil_terminal_out *out)
{
    if (handle == nullptr || out == nullptr || out->struct_size < sizeof(zh_sil_terminal_out)) {
        return fail(ZH_BAD_ARGUMENT,
                    "zh_sil_terminals_look: handle or out: is NULL or out's "
                    "struct_size too small; set it to sizeof(zh_sil_terminal_out)");
    }
    const zh::TerminalBoard &board = handle->firmware.terminals();
    if (!board.fitted()) {
        return none_fitted("zh_sil_terminals_look");
    }
    const terminals_state_t &t = board.state();
    const float unknown = std::nanf("");
    const zh_sil_terminal_out now{out->struct_size,
                                  t.outputs,
                                  t.faults,
                                  static_cast<std::uint32_t>(t.brake.id),
                                  static_cast<std::uint32_t>(t.precharge.id),
                                  t.analog.share_pu,
                                  t.sink.known ? t.sink.degC : unknown,
                                  t.motor.known ? t.motor.degC : unknown,
                                  1.0F - t.adapted_cut_pu,
                                  1.0F + t.adapted_rise_pu,
                                  t.chopper.heat_pu};
    zh::hand_out(now, out);
    return ZH_OK;
}
