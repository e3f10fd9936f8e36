// A flight that is run again: one drive, and what of it was recorded.
#ifndef ZH_FLIGHT_REPLAY_HPP
#define ZH_FLIGHT_REPLAY_HPP

#include <array>
#include <cstdint>
#include <memory>

#include "firmware_headers.hpp"
#include "flight_replay.h"
#include "gain_file.hpp"

struct zh_flight {
    using RowWords = std::array<std::uint32_t, FLIGHT_ROW_WORDS>;

    zh_flight(const params_t &params, std::shared_ptr<const zh::GainFile> gain_file);

    // True when the row was a period.
    bool take(const RowWords &row);

    // All that the rows made of the drive, no addresses in it.
    struct State {
        unit_t unit; // without its configurations, which the parameters make again
        hal_output_t output;
        std::uint32_t samples;
        std::uint32_t changes;
        std::uint32_t digest;
        std::uint16_t late_periods;
    };
    void save(State &to) const;
    void load(const State &from);

    std::shared_ptr<const zh::GainFile> gain;
    unit_t unit{};
    hal_output_t output{};
    zh_flight_state state{sizeof(zh_flight_state), ZH_FLIGHT_GOES_ON, 0, 0, 0, 0, 0, 0};
    bool started = false;

private:
    bool end(std::uint32_t why);
    bool start(const RowWords &row);
    bool command(const RowWords &row);
    bool parameter(const RowWords &row);
    bool check(const RowWords &row);
    bool period(const RowWords &row);

    std::uint32_t samples = 0; // since the recording's start
    std::uint32_t changes = 0;
    std::uint32_t digest = 0;
    std::uint16_t late_periods = 0;
};

#endif
