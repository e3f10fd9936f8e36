// The closed loop: firmware and rig, crest by crest, with a record of named columns.
#ifndef ZH_SIMULATE_HPP
#define ZH_SIMULATE_HPP

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "board.hpp"
#include "firmware.hpp"
#include "rig.hpp"
#include "scenario.hpp"
#include "signal_hash.hpp"
#include "lockstep_peer.hpp"

namespace zh {

// What a port hands over; no period is late here.
constexpr hal_sample_t sample_of(const Words &w, bool broken)
{
    const std::uint16_t inputs = broken ? HAL_INPUT_BREAK : 0U;
    return {w.i_u, w.i_v, w.i_w, w.u_uv, w.u_vw, w.u_dc, 0, inputs};
}

// What a scenario's operator asks for at this time, as the mailbox carries it.
inline unit_command_t command_at(const Scenario &scenario, double t_s, float speed_ref_rpm,
                                 std::uint32_t count)
{
    return {scenario.command(t_s), rad_s_from_rpm(speed_ref_rpm),
            static_cast<float>(scenario.torque_ref_Nm.value(t_s)), count};
}

inline constexpr std::uint64_t every_column = ~std::uint64_t{0};

// Everything a run depends on: data, no files.
struct Run {
    Scenario scenario;
    Rig rig;
    Board board;
    params_t params{};
    std::shared_ptr<const GainFile> gain;
    std::uint64_t seed = 1;
    std::uint64_t steps = 0;
    std::uint32_t decimate = 1;
    std::uint64_t columns = every_column;
    std::uint64_t keep_rows = 0; // of the record, the last ones; 0: all
    bool stop_at_trip = false;
    bool time_split = false;
    bool hash_signals = false;
    bool guard_recorded = false; // Firmware::record_guard
};

struct Column {
    const char *name;
    const char *text;
};
std::size_t column_count();
Column column(std::size_t index); // index < column_count()

// Of a choice, bit c for column c, those that there are; all of them for 0.
std::uint64_t columns_of(std::uint64_t chosen);

struct Outcome {
    std::vector<float> data; // column-major, stride rows per column
    std::uint32_t columns = 0;
    std::uint64_t stride = 0;
    std::uint64_t rows = 0; // recorded; with Run::keep_rows the last `stride` of them are kept
    std::uint64_t steps = 0;
    double period_s = 0.0;
    std::uint32_t trip = 0; // ZH_TRIP_*
    double trip_s = -1.0;
    std::uint32_t first_fault = 0;
    double first_fault_s = -1.0;
    SignalHashes signal_hashes{}; // with Run::hash_signals
    double loop_ns_per_step = 0.0;
    double controller_ns_per_step = 0.0;
    double plant_ns_per_step = 0.0;
    bool commissioned = false;
    commissioning_refusal_t refusal = COMMISSIONING_NOT_REFUSED;
    commissioning_result_t commissioning{};
};

// Throws ConfigError when firmware or plant refuse what they are given. With a peer the plant
// gets the peer's duties.
Outcome simulate(const Run &run, LockstepPeer *peer = nullptr);

// Period by period until so many are done in all, or the loop ends.
class Loop;
void run_until(Loop &loop, std::uint64_t steps);

// The same for many runs, several at once in this thread: every outcome to the bit that of
// simulate(). Their loop_ns_per_step is the mean of all.
std::vector<Outcome> simulate_together(std::span<const Run> runs);

} // namespace zh

#endif
