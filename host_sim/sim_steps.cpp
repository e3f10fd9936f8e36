#include "sim_steps.h"

#include <limits>
#include <memory>
#include <utility>

#include "c_boundary.hpp"
#include "live_parameter.hpp"
#include "loop.hpp"
#include "sim_job.hpp"

struct zh_sim_steps {
    zh_sim_steps(zh::Run &&of_job, std::uint32_t job_flags)
        : run(std::move(of_job)), loop(run, nullptr), flags(job_flags)
    {
    }
    zh::Run run;
    zh::Loop loop;
    std::uint32_t flags;
};

namespace {

constexpr std::uint64_t endless = std::numeric_limits<std::uint64_t>::max();

// keep_rows: 0 for a run that ends.
zh_sim_steps *opened(const zh_sim_job *job, std::uint64_t keep_rows)
{
    const zh_sim_result any = zh::empty_result();
    if (!zh::sized(job, &any)) {
        zh::fail(ZH_BAD_ARGUMENT, "zh_sim_open: job: is NULL or its struct_size too small; set it "
                                  "to the size of the struct");
        return nullptr;
    }
    return zh::guarded<zh_sim_steps *>(nullptr, [&] {
        zh::Run run = zh::run_of(*job);
        run.keep_rows = keep_rows;
        run.steps = keep_rows != 0 ? endless : run.steps;
        return std::make_unique<zh_sim_steps>(std::move(run), job->flags).release();
    });
}

} // namespace

zh_sim_steps *zh_sim_open(const zh_sim_job *job)
{
    return opened(job, 0);
}

zh_sim_steps *zh_sim_open_endless(const zh_sim_job *job, std::uint64_t rows)
{
    if (rows == 0) {
        zh::fail(ZH_BAD_ARGUMENT, "zh_sim_open_endless: rows: is 0; give at least 1");
        return nullptr;
    }
    return opened(job, rows);
}

int zh_sim_change(zh_sim_steps *run, const char *scenario)
{
    if (run == nullptr || scenario == nullptr) {
        return zh::fail(ZH_BAD_ARGUMENT, "zh_sim_change: run or scenario: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        run->run.scenario = zh::scenario_of(scenario, nullptr);
        run->loop.scenario_changed();
        return int{ZH_OK};
    });
}

int zh_sim_set(zh_sim_steps *run, const char *name, float value)
{
    if (run == nullptr || name == nullptr) {
        return zh::fail(ZH_BAD_ARGUMENT, "zh_sim_set: run or name: is NULL");
    }
    return zh::set_live(run->loop.firmware(), name, value, "zh_sim_set");
}

int zh_sim_look(const zh_sim_steps *run, zh_sim_result *result)
{
    if (run == nullptr || result == nullptr || result->struct_size < sizeof(zh_sim_result)) {
        return zh::fail(ZH_BAD_ARGUMENT, "zh_sim_look: run or result: is NULL or its struct_size "
                                         "too small; set it to the size of the struct");
    }
    *result = zh::empty_result();
    zh::show(run->loop.outcome(), run->flags, *result);
    return ZH_OK;
}

int zh_sim_advance(zh_sim_steps *run, std::uint64_t steps)
{
    if (run == nullptr) {
        return zh::fail(ZH_BAD_ARGUMENT, "zh_sim_advance: run: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        zh::run_until(run->loop, steps);
        return int{ZH_OK};
    });
}

int zh_sim_flip(zh_sim_steps *run, std::uint32_t byte, std::uint32_t bit)
{
    if (run == nullptr) {
        return zh::fail(ZH_BAD_ARGUMENT, "zh_sim_flip: run: is NULL");
    }
    return run->loop.flip(byte, bit)
               ? int{ZH_OK}
               : zh::fail(ZH_OUT_OF_RANGE, "zh_sim_flip: the drive has no such bit");
}

std::uint32_t zh_sim_faults(const zh_sim_steps *run)
{
    return run != nullptr ? run->loop.drive().machine.faults : 0U;
}

std::uint32_t zh_sim_gates_on(const zh_sim_steps *run)
{
    return run != nullptr && run->loop.gates_on() ? 1U : 0U;
}

std::uint32_t zh_sim_unit_bytes(void)
{
    return sizeof(unit_t);
}

int zh_sim_take(zh_sim_steps *run, zh_sim_result *result)
{
    if (run == nullptr || result == nullptr || result->struct_size < sizeof(zh_sim_result)) {
        return zh::fail(ZH_BAD_ARGUMENT, "zh_sim_take: run or result: is NULL or its struct_size "
                                         "too small; set it to the size of the struct");
    }
    *result = zh::empty_result();
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        zh::hand_over(run->loop.take(), run->flags, *result);
        return int{ZH_OK};
    });
}

void zh_sim_close(zh_sim_steps *run)
{
    delete run;
}
