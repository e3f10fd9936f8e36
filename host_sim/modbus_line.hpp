// The drive's serial line to a Modbus master: bytes with their times, both ways.
#ifndef ZH_MODBUS_LINE_HPP
#define ZH_MODBUS_LINE_HPP

#include <cstdint>
#include <deque>
#include <vector>

#include "firmware.hpp"

namespace zh {

// Points into itself: not copyable.
class ModbusLine {
public:
    ModbusLine();
    ModbusLine(const ModbusLine &) = delete;
    ModbusLine &operator=(const ModbusLine &) = delete;

    // Bytes behind one another from now on, or behind those that are still to come.
    void put(const std::uint8_t *byte, std::uint32_t n, std::uint32_t now_us);
    // What the drive has said, as much as there is room for.
    std::uint32_t take(std::uint8_t *byte, std::uint32_t room);
    // One slice of the drive's background.
    void serve(Firmware &firmware);

private:
    struct Timed {
        std::uint8_t byte;
        std::uint32_t at_us;
    };
    static bool read(void *context, std::uint8_t *byte, std::uint32_t *at_us);
    static std::uint32_t write(void *context, const std::uint8_t *data, std::uint32_t n);
    static std::uint32_t clock(void *context);

    modbus_t modbus_{};
    hal_serial_t line_{};
    std::deque<Timed> received_;
    std::vector<std::uint8_t> sent_;
    std::uint32_t now_us_ = 0;
    std::uint32_t busy_until_us_ = 0; // of the received bytes
    bool used_ = false;
};

} // namespace zh

#endif
