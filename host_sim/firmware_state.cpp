#include <cstring>
#include <memory>

#include "firmware.hpp"

// What is not taken along: configurations, made of the parameters again, and all that has addresses
// in it and serves only link, store and recorders.

namespace zh {
namespace {

// Byte for byte: checksums are of the padding as well, and a mailbox cannot be assigned.
void copy(void *to, const void *from, std::size_t bytes)
{
    std::memcpy(to, from, bytes);
}

void clear(void *at, std::size_t bytes)
{
    std::memset(at, 0, bytes);
}

} // namespace

void Firmware::save(State &state) const
{
    state.newest = params_;
    state.in_force = port_.unit.change_ready ? before_ : params_;
    copy(&state.port, &port_, sizeof port_);
    clear(&state.port.devices, sizeof port_.devices);
    clear(&state.port.line, sizeof port_.line);
    unit_t &unit = state.port.unit;
    clear(&unit.config, sizeof unit.config);
    clear(&unit.config_crc, sizeof unit.config_crc);
    unit.config_at = 0; // of a check that begins again
    unit.config_sum = 0;
    clear(&unit.fault_recorder, sizeof unit.fault_recorder);
    clear(&unit.trace, sizeof unit.trace);
    clear(&unit.flight, sizeof unit.flight);
    clear(&unit.refused, sizeof unit.refused);
    clear(&unit.link, sizeof unit.link);
    clear(&unit.store, sizeof unit.store);
    unit.table = nullptr;
    unit.image = nullptr;
}

bool Firmware::load(const State &state)
{
    const auto made = std::make_unique<host_port_t>();
    const bool pending = state.port.unit.change_ready;
    if (state.port.unit.in_force > 1U ||
        !host_port_init(made.get(), &state.in_force, &gain_->table()) ||
        (pending && !unit_reconfigure(&made->unit, &state.newest))) {
        return false;
    }
    const auto next = std::make_unique<host_port_t>();
    copy(next.get(), &state.port, sizeof state.port);
    next->devices = port_.devices;
    unit_t &unit = next->unit;
    const std::uint32_t at = unit.in_force;
    for (std::uint32_t k = 0; k < 2; ++k) {
        copy(&unit.config[at ^ k], &made->unit.config[k], sizeof unit.config[k]);
        unit.config_crc[at ^ k] = made->unit.config_crc[k];
    }
    unit.table = port_.unit.table;
    unit.image = port_.unit.image;
    copy(&unit.store, &port_.unit.store, sizeof unit.store);
    copy(&port_, next.get(), sizeof port_);
    params_ = state.newest;
    before_ = state.in_force;
    return true;
}

} // namespace zh
