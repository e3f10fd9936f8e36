// The drive's CAN line: two queues of frames.
#ifndef ZH_CAN_LINE_HPP
#define ZH_CAN_LINE_HPP

#include <cstdint>
#include <deque>

#include "firmware.hpp"
#include "link.h"

namespace zh {

// Points into itself: not copyable.
class CanLine {
public:
    CanLine();
    CanLine(const CanLine &) = delete;
    CanLine &operator=(const CanLine &) = delete;

    void put(const zh_can_frame &frame);
    // False: nothing waits.
    bool take(zh_can_frame &frame);
    // One slice of the drive's background.
    void serve(Firmware &firmware);

private:
    static bool read(void *context, hal_can_frame_t *frame);
    static bool write(void *context, const hal_can_frame_t *frame);
    static std::uint32_t clock(void *context);

    canopen_t canopen_{};
    hal_can_t can_{};
    std::deque<hal_can_frame_t> received_;
    std::deque<hal_can_frame_t> sent_;
    std::uint32_t now_us_ = 0;
    bool used_ = false;
};

} // namespace zh

#endif
