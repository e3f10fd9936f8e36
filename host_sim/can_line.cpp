#include "can_line.hpp"

#include <algorithm>

namespace zh {

CanLine::CanLine()
{
    can_ = {this, read, write, clock};
}

void CanLine::put(const zh_can_frame &frame)
{
    used_ = true;
    hal_can_frame_t received{
        static_cast<std::uint16_t>(frame.id), static_cast<std::uint8_t>(frame.length), {}};
    std::copy_n(frame.data, frame.length, received.data);
    received_.push_back(received);
}

bool CanLine::take(zh_can_frame &frame)
{
    used_ = true;
    if (sent_.empty()) {
        return false;
    }
    const hal_can_frame_t &next = sent_.front();
    frame = {next.id, next.length, {}};
    std::copy_n(next.data, next.length, frame.data);
    sent_.pop_front();
    return true;
}

void CanLine::serve(Firmware &firmware)
{
    now_us_ = firmware.clock_us();
    if (used_) {
        firmware.step_canopen(canopen_, can_);
    }
}

bool CanLine::read(void *context, hal_can_frame_t *frame)
{
    auto &line = *static_cast<CanLine *>(context);
    if (line.received_.empty()) {
        return false;
    }
    *frame = line.received_.front();
    line.received_.pop_front();
    return true;
}

bool CanLine::write(void *context, const hal_can_frame_t *frame)
{
    static_cast<CanLine *>(context)->sent_.push_back(*frame);
    return true;
}

std::uint32_t CanLine::clock(void *context)
{
    return static_cast<const CanLine *>(context)->now_us_;
}

} // namespace zh
