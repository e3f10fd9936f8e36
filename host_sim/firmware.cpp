#include "firmware.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "firmware_setup.hpp"

namespace zh {
namespace {

// float of a board against the decimals of motor.toml
constexpr double same_period = 1.0 + 1e-6;

void check_period(const params_t &params, const GainFile &gain)
{
    const auto period_s = static_cast<double>(params.period_s);
    if (params.observer_gain_enable != 0 && period_s > gain.period_s * same_period) {
        throw ConfigError("l_gain.json: inputs.design.period_s: the table of " + gain.motor +
                          " is for " + std::to_string(1e6 * gain.period_s) +
                          " us at most, the board's period is " + std::to_string(1e6 * period_s) +
                          " us; design it for that period with tools/zh design");
    }
}

} // namespace

NamedSignal::NamedSignal(std::string_view name) : number_(0)
{
    while (number_ < UNIT_SIGNALS && unit_signal_name(number_) != name) {
        ++number_;
    }
}

Firmware::Firmware(const params_t &params, std::shared_ptr<const GainFile> gain)
    : params_(params), gain_(std::move(gain))
{
    restart(params);
    check_period(params_, *gain_);
}

void Firmware::restart(const params_t &params)
{
    if (!host_port_init(&port_, &params, &gain_->table())) {
        throw ConfigError("overrides: " + refusal_reason(params));
    }
    params_ = params;
    terminals_.unfit();
    port_.background_every = background_every;
    port_.until_background = background_every;
}

void Firmware::serve_link(const unit_memory_t &memory, const host_port_store_t &store)
{
    // Refused, it stands in FAULT and tells why over the link.
    (void)!host_port_start(&port_, &params_, &gain_->table(), &store);
    identity_ = "ZeroHertz port=sil motor=" + gain_->motor;
    port_.devices.identity = identity_.c_str();
    host_port_record(&port_, &memory);
    port_.background_every = 1;
    port_.until_background = 1;
}

bool Firmware::flip(std::uint32_t byte, std::uint32_t bit)
{
    if (byte >= sizeof(unit_t) || bit > 7U) {
        return false;
    }
    reinterpret_cast<unsigned char *>(&port_.unit)[byte] ^= static_cast<unsigned char>(1U << bit);
    port_.background_every = background_beside_flips;
    port_.until_background = std::min(port_.until_background, background_beside_flips);
    return true;
}

bool Firmware::reconfigure(const params_t &params)
{
    if (!port_.unit.change_ready) {
        before_ = params_;
    }
    if (!unit_reconfigure(&port_.unit, &params)) {
        return false;
    }
    params_ = params;
    return true;
}

void Firmware::record_guard()
{
    constexpr float nowhere = std::numeric_limits<float>::infinity();
    unit_config_t &config = port_.unit.config[port_.unit.in_force];
    guard_config_t &guard = config.drive.guard;
    guard.speed.deviation_s = nowhere;
    guard.speed.unexplained_s = nowhere;
    guard.speed.warning_s = nowhere;
    guard.speed.unknown_s = nowhere;
    guard.speed.over_speed_rad_s = nowhere;
    guard.monitor.omega_max_rad_s = nowhere;
    guard.speed.rotor.start_V = nowhere;
    // Else the running check would find a configuration that has changed.
    port_.unit.config_crc[port_.unit.in_force] = crc32c(&config, sizeof config);
}

} // namespace zh
