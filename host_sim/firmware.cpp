#include "firmware.hpp"

#include <utility>

#include "firmware_setup.hpp"

namespace zh {

Firmware::Firmware(const params_t &params, std::shared_ptr<const GainFile> gain)
    : params_(params), gain_(std::move(gain))
{
    if (!host_port_init(&port_, &params_, &gain_->table())) {
        throw ConfigError("overrides: " + refusal_reason(params_));
    }
    port_.background_every = background_every;
    port_.until_background = background_every;
}

bool Firmware::reconfigure(const params_t &params)
{
    if (!app_reconfigure(&port_.app, &params)) {
        return false;
    }
    params_ = params;
    return true;
}

} // namespace zh
