#include "terminal_board.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string>

#include "firmware_setup.hpp"
#include "gain_file.hpp"

namespace zh {
namespace {

constexpr const char *where = "terminals";

void set_one(terminal_params_t &params, std::string_view item)
{
    const std::size_t equals = std::min(item.find('='), item.size());
    const std::string name(item.substr(0, equals));
    const std::uint32_t index = terminal_params_find(name.c_str());
    const std::string_view text = item.substr(std::min(equals + 1, item.size()));
    double value = 0.0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
    if (index == terminal_params_count()) {
        throw ConfigError(std::string(where) + ": " + name +
                          ": no such parameter; tools/docs/terminals.md lists them");
    }
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size() ||
        !terminal_params_set(&params, index, static_cast<float>(value))) {
        throw ConfigError(std::string(where) + ": " + name + ": '" + std::string(text) +
                          "': is no number in its range; tools/docs/terminals.md has it");
    }
}

const char *reason(terminals_status_t status)
{
    static constexpr const char *said[] = {
        "",
        "",
        "start_control: needs full_speed_rad_s, and that at most speed_max_rad_s of the shaft",
        "analog_*: are refused",
        "brake_*: brake_torque_Nm and brake_close_rad_s must be positive",
        "*_sensor: derate below trip, both within -40 to 250 degC",
        "precharge_*: precharge_ready_V must be positive",
        "chopper_*: chopper_W must be positive"};
    return said[status];
}

std::uint16_t word(double share)
{
    constexpr double full = 65536.0;
    return static_cast<std::uint16_t>(std::clamp(std::floor(full * share), 0.0, full - 1.0));
}

// Of the lower resistor of a divider; an open one takes all.
double divided(double ohm, double above_ohm)
{
    return std::isfinite(ohm) ? ohm / (ohm + above_ohm) : 1.0;
}

} // namespace

void TerminalBoard::fit(std::string_view parameters, const params_t &drive)
{
    terminal_params_t params;
    terminal_params_default(&params);
    std::istringstream lines{std::string(parameters)};
    for (std::string line; std::getline(lines, line);) {
        if (!line.empty()) {
            set_one(params, line);
        }
    }
    TerminalBoard made;
    if (params.analog_reference == ANALOG_REFERENCE_CURRENT) {
        made.analog_full_scale_ = current_full_scale_A;
    }
    const hal_terminals_t hal = made.hal();
    const terminals_status_t status = terminals_init(&made.config_, &params, &hal, &drive);
    if (status != TERMINALS_OK) {
        throw ConfigError(std::string(where) + ": " + reason(status));
    }
    made.fitted_ = true;
    *this = made;
}

hal_terminals_t TerminalBoard::hal()
{
    constexpr std::uint32_t everything = 0xFFFFFFFFU;
    return {this, everything, analog_full_scale_, pullup_ohm, pullup_ohm, read, write};
}

bool TerminalBoard::read(void *context, hal_terminal_in_t *in)
{
    const auto &board = *static_cast<const TerminalBoard *>(context);
    const Wiring &w = board.wiring_;
    if (w.unreadable) {
        return false;
    }
    const bool current = board.config_.analog.on && board.config_.analog.low > 0.0F;
    const double share = (current ? w.analog_A : w.analog_V) / double{board.analog_full_scale_};
    *in = {w.inputs, word(share), word(divided(w.sink_ohm, double{pullup_ohm})),
           word(divided(w.motor_ohm, double{pullup_ohm}))};
    return true;
}

// The state has them.
void TerminalBoard::write(void *, std::uint32_t)
{
}

unit_command_t TerminalBoard::command(unit_t &unit, const unit_command_t &posted)
{
    if (!fitted_) {
        return posted;
    }
    const hal_terminals_t here = hal();
    return terminals_command(&config_, &state_, &unit, &here, posted);
}

} // namespace zh
