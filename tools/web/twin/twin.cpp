// What the page's worker calls: runs of sim_steps.h and the link of link.h as functions of numbers
// and texts, which a JavaScript program passes without knowing the layout of a C struct.
#include <emscripten/emscripten.h>

#include <array>
#include <string>

#include "link.h"
#include "sim_steps.h"

namespace {

// What `look` hands over: numbers in this order.
enum Seen : std::size_t {
    rows,
    stride,
    columns,
    data,   // address of the floats: column c, row r at c * stride + r % stride
    hashes, // address of the 64-bit hashes, 0: none
    steps,
    period_s,
    trip,
    trip_s,
    first_fault,
    first_fault_s,
    seen_numbers
};

zh_sim_job job{};
std::array<double, seen_numbers> seen{};

double address(const void *place)
{
    return static_cast<double>(reinterpret_cast<std::uintptr_t>(place));
}

template <typename Name> const char *joined(std::string &all, Name name)
{
    all.clear();
    for (std::uint32_t k = 0; name(k) != nullptr; ++k) {
        all += name(k);
        all += '\n';
    }
    return all.c_str();
}

} // namespace

extern "C" {

// The job of the next open: texts of files (with a line break) or their paths, overrides or "".
EMSCRIPTEN_KEEPALIVE void twin_files(const char *scenario, const char *rig, const char *board,
                                     const char *motor_dir)
{
    static std::array<std::string, 4> kept;
    kept = {scenario, rig, board, motor_dir};
    job.scenario = kept[0].c_str();
    job.rig = kept[1].c_str();
    job.board = kept[2].c_str();
    job.motor_dir = kept[3].c_str();
}

EMSCRIPTEN_KEEPALIVE void twin_overrides(const char *scenario, const char *rig, const char *board,
                                         const char *config, const char *firmware)
{
    static std::array<std::string, 5> kept;
    kept = {scenario, rig, board, config, firmware};
    job.scenario_overrides = kept[0].c_str();
    job.rig_overrides = kept[1].c_str();
    job.board_overrides = kept[2].c_str();
    job.firmware_config = kept[3].c_str();
    job.firmware = kept[4].c_str();
}

// keep_rows: 0 for a run that ends with its scenario.
EMSCRIPTEN_KEEPALIVE zh_sim_steps *twin_open(std::uint32_t flags, std::uint32_t decimate,
                                             std::uint32_t seed, std::uint32_t keep_rows)
{
    job.struct_size = sizeof job;
    job.flags = flags;
    job.decimate = decimate;
    job.seed = seed;
    return keep_rows != 0 ? zh_sim_open_endless(&job, keep_rows) : zh_sim_open(&job);
}

EMSCRIPTEN_KEEPALIVE int twin_advance(zh_sim_steps *run, double steps_in_all)
{
    return zh_sim_advance(run, static_cast<std::uint64_t>(steps_in_all));
}

EMSCRIPTEN_KEEPALIVE int twin_change(zh_sim_steps *run, const char *scenario)
{
    return zh_sim_change(run, scenario);
}

EMSCRIPTEN_KEEPALIVE int twin_set(zh_sim_steps *run, const char *name, float value)
{
    return zh_sim_set(run, name, value);
}

// Address of the numbers of Seen, good until the next call; 0 when refused.
EMSCRIPTEN_KEEPALIVE const double *twin_look(const zh_sim_steps *run)
{
    zh_sim_result r{};
    r.struct_size = sizeof r;
    if (zh_sim_look(run, &r) != ZH_OK) {
        return nullptr;
    }
    seen[rows] = static_cast<double>(r.rows);
    seen[stride] = static_cast<double>(r.stride);
    seen[columns] = r.columns;
    seen[data] = address(r.data);
    seen[hashes] = address(r.signal_hashes);
    seen[steps] = static_cast<double>(r.steps);
    seen[period_s] = r.period_s;
    seen[trip] = r.trip;
    seen[trip_s] = r.trip_s;
    seen[first_fault] = r.first_fault;
    seen[first_fault_s] = r.first_fault_s;
    return seen.data();
}

EMSCRIPTEN_KEEPALIVE std::uint32_t twin_faults(const zh_sim_steps *run)
{
    return zh_sim_faults(run);
}

EMSCRIPTEN_KEEPALIVE void twin_close(zh_sim_steps *run)
{
    zh_sim_close(run);
}

EMSCRIPTEN_KEEPALIVE const char *twin_error(void)
{
    return zh_sil_error();
}

// One name per line.
EMSCRIPTEN_KEEPALIVE const char *twin_columns(void)
{
    static std::string all;
    return joined(all, zh_sim_column_name);
}

EMSCRIPTEN_KEEPALIVE const char *twin_signals(void)
{
    static std::string all;
    return joined(all, zh_sim_signal_name);
}

// The drive at the end of a line, operated over the link; job as above.
EMSCRIPTEN_KEEPALIVE zh_link *twin_link_open(std::uint32_t seed)
{
    job.struct_size = sizeof job;
    job.flags = 0;
    job.decimate = 1;
    job.seed = seed;
    return zh_link_open(&job, 1, nullptr);
}

// *received_n and *sent_n as in link.h.
EMSCRIPTEN_KEEPALIVE int twin_link_run(zh_link *link, std::uint32_t periods,
                                       const std::uint8_t *received, std::uint32_t *received_n,
                                       std::uint8_t *sent, std::uint32_t *sent_n)
{
    return zh_link_run(link, periods, received, received_n, sent, sent_n);
}

EMSCRIPTEN_KEEPALIVE int twin_link_change(zh_link *link, const char *scenario)
{
    return zh_link_change(link, scenario);
}

EMSCRIPTEN_KEEPALIVE double twin_link_speed_rpm(const zh_link *link)
{
    zh_link_state state{};
    state.struct_size = sizeof state;
    (void)zh_link_get_state(link, &state);
    return state.speed_rpm;
}

EMSCRIPTEN_KEEPALIVE void twin_link_close(zh_link *link)
{
    zh_link_close(link);
}
}
