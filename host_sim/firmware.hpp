// One drive of the firmware, as a C++ object.
#ifndef ZH_FIRMWARE_HPP
#define ZH_FIRMWARE_HPP

#include <bit>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "firmware_headers.hpp"
#include "gain_file.hpp"
#include "terminal_board.hpp"

namespace zh {

// Periods between two background calls. Its running check of the table costs more than a control
// period; every thousandth (200 ms) still meets every word within 6 s.
inline constexpr std::uint32_t background_every = 1000;

// On a board it comes in every period; every 25th is 5 ms.
inline constexpr std::uint32_t background_beside_flips = 25;

// Reference at the edge: mechanical min^-1 to rad/s.
constexpr float rad_s_from_rpm(float speed_rpm)
{
    return speed_rpm * (NUM_PI / 30.0F);
}

// A float among the traced signals, by its name; 0 where the estimator linked has no such signal.
class NamedSignal {
public:
    explicit NamedSignal(std::string_view name);
    float value(const unit_t &unit) const
    {
        return std::bit_cast<float>(unit_signal(&unit, number_));
    }

private:
    std::uint32_t number_;
};

// One drive: application, host port and the table it reads. Not copyable: the port points into
// itself.
class Firmware {
public:
    // Throws ConfigError, with the likeliest reason, when the application refuses the parameters.
    Firmware(const params_t &params, std::shared_ptr<const GainFile> gain);
    Firmware(const Firmware &) = delete;
    Firmware &operator=(const Firmware &) = delete;

    hal_output_t step(const hal_sample_t &sample, const unit_command_t &command)
    {
        const unit_command_t posted = terminals_.command(port_.unit, command);
        hal_output_t output;
        host_port_period(&port_, &posted, &sample, &output);
        return output;
    }
    // From here on the host link is served and the drive records, in memory of the caller, whose
    // flash says which parameters are in force: a slice of the background behind every period.
    void serve_link(const unit_memory_t &memory, const host_port_store_t &store);
    host_port_line_t &line()
    {
        return port_.line;
    }
    // One period at the command of the link or a fieldbus.
    hal_output_t step_on_link(const hal_sample_t &sample)
    {
        const unit_command_t posted = fieldbus_command(&fieldbus_, &port_.unit);
        hal_output_t output;
        host_port_period(&port_, &posted, &sample, &output);
        return output;
    }
    // A slice of the Modbus slave, behind a period.
    void step_modbus(modbus_t &modbus, const hal_serial_t &line)
    {
        modbus_background(&modbus, &fieldbus_, &port_.unit, &line);
    }
    // A slice of the CANopen slave, likewise.
    void step_canopen(canopen_t &canopen, const hal_can_t &can)
    {
        const canopen_drive_t drive{&fieldbus_, &port_.unit};
        canopen_background(&canopen, &drive, &can);
    }
    // The drive's own clock.
    std::uint32_t clock_us() const
    {
        return port_.clock_us;
    }
    TerminalBoard &terminals()
    {
        return terminals_;
    }
    const TerminalBoard &terminals() const
    {
        return terminals_;
    }
    // False, and nothing changed, when the application refuses the new set.
    bool reconfigure(const params_t &params);

    // As constructed, with these parameters; for one that serves no link. Throws ConfigError.
    void restart(const params_t &params);

    // All that a restart does not give, for one that serves no link. No addresses: what is restored
    // may come from another process.
    struct State {
        params_t newest;
        params_t in_force; // others when the last change was not stepped yet
        host_port_t port;
    };
    void save(State &state) const;
    // False, and nothing changed, for a state that never was one.
    bool load(const State &state);

    // From here on the guard of the speed counts and does not act; a reconfiguration ends it.
    void record_guard();

    const unit_t &unit() const
    {
        return port_.unit;
    }
    const params_t &params() const
    {
        return params_;
    }
    const GainFile &gain() const
    {
        return *gain_;
    }
    // A bit of the drive's RAM flips, by radiation or a supply that is none; false: it owns no such
    // byte. From here on the background comes as often as its checks of memory need.
    bool flip(std::uint32_t byte, std::uint32_t bit);
    bool gates_on() const
    {
        return port_.unit.asked.mode != DRIVE_OFF;
    }
    unit_telemetry_t telemetry() const
    {
        unit_telemetry_t t;
        unit_telemetry(&port_.unit, &t);
        return t;
    }

private:
    params_t params_;
    params_t before_{}; // those in force while the next period has yet to take params_
    std::shared_ptr<const GainFile> gain_;
    host_port_t port_{};
    fieldbus_t fieldbus_{};
    TerminalBoard terminals_{};
    std::string identity_;
};

} // namespace zh

#endif
