#include "modbus_line.hpp"

#include <algorithm>

#include "link.h"

namespace zh {
namespace {

constexpr std::uint32_t character_us = 11U * 1000000U / ZH_LINK_MODBUS_BAUD + 1U;

// Whether a time of a clock that wraps has come.
bool reached(std::uint32_t now_us, std::uint32_t at_us)
{
    return static_cast<std::int32_t>(now_us - at_us) >= 0;
}

} // namespace

ModbusLine::ModbusLine()
{
    line_ = {this, modbus_rtu_silence_us(ZH_LINK_MODBUS_BAUD), read, write, clock};
}

void ModbusLine::put(const std::uint8_t *byte, std::uint32_t n, std::uint32_t now_us)
{
    used_ = used_ || n > 0;
    std::uint32_t at_us = reached(now_us, busy_until_us_) ? now_us : busy_until_us_;
    for (std::uint32_t k = 0; k < n; ++k) {
        at_us += character_us;
        received_.push_back({byte[k], at_us});
    }
    busy_until_us_ = at_us;
}

std::uint32_t ModbusLine::take(std::uint8_t *byte, std::uint32_t room)
{
    const auto n = std::min<std::size_t>(room, sent_.size());
    std::copy_n(sent_.begin(), n, byte);
    sent_.erase(sent_.begin(), sent_.begin() + static_cast<std::ptrdiff_t>(n));
    return static_cast<std::uint32_t>(n);
}

void ModbusLine::serve(Firmware &firmware)
{
    now_us_ = firmware.clock_us();
    if (used_) {
        firmware.step_modbus(modbus_, line_);
    }
}

bool ModbusLine::read(void *context, std::uint8_t *byte, std::uint32_t *at_us)
{
    auto &line = *static_cast<ModbusLine *>(context);
    if (line.received_.empty() || !reached(line.now_us_, line.received_.front().at_us)) {
        return false;
    }
    *byte = line.received_.front().byte;
    *at_us = line.received_.front().at_us;
    line.received_.pop_front();
    return true;
}

std::uint32_t ModbusLine::write(void *context, const std::uint8_t *data, std::uint32_t n)
{
    auto &line = *static_cast<ModbusLine *>(context);
    line.sent_.insert(line.sent_.end(), data, data + n);
    return n;
}

std::uint32_t ModbusLine::clock(void *context)
{
    return static_cast<const ModbusLine *>(context)->now_us_;
}

} // namespace zh
