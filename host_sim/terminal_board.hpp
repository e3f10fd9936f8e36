// A board with every terminal of the firmware, and the terminals of one drive.
#ifndef ZH_TERMINAL_BOARD_HPP
#define ZH_TERMINAL_BOARD_HPP

#include <cstdint>
#include <string_view>

#include "firmware_headers.hpp"

namespace zh {

// What is wired to it.
struct Wiring {
    std::uint32_t inputs = 0;
    double analog_V = 0.0;
    double analog_A = 0.0;
    double sink_ohm = 0.0;
    double motor_ohm = 0.0;
    bool unreadable = false;
};

// Not fitted, it passes every command as it is.
class TerminalBoard {
public:
    static constexpr float voltage_full_scale_V = 12.5F;
    static constexpr float current_full_scale_A = 25e-3F;
    static constexpr float pullup_ohm = 2200.0F;

    // Lines "name=value" of terminal_params.def. Throws ConfigError, and nothing changed.
    void fit(std::string_view parameters, const params_t &drive);
    void unfit()
    {
        *this = TerminalBoard();
    }
    bool fitted() const
    {
        return fitted_;
    }
    Wiring &wiring()
    {
        return wiring_;
    }
    const terminals_state_t &state() const
    {
        return state_;
    }
    // The command for the drive, instead of the posted one.
    unit_command_t command(unit_t &unit, const unit_command_t &posted);

private:
    static bool read(void *context, hal_terminal_in_t *in);
    static void write(void *context, std::uint32_t outputs);
    hal_terminals_t hal();

    bool fitted_ = false;
    float analog_full_scale_ = voltage_full_scale_V;
    terminals_config_t config_{};
    terminals_state_t state_{};
    Wiring wiring_{};
};

} // namespace zh

#endif
