#include "sim_steps.h"

#include <memory>
#include <utility>

#include "c_boundary.hpp"
#include "loop.hpp"
#include "sim_job.hpp"

struct zh_sim_steps {
    explicit zh_sim_steps(const zh_sim_job &job)
        : run(zh::run_of(job)), loop(run, nullptr), flags(job.flags)
    {
    }
    zh::Run run;
    zh::Loop loop;
    std::uint32_t flags;
};

zh_sim_steps *zh_sim_open(const zh_sim_job *job)
{
    const zh_sim_result any = zh::empty_result();
    if (!zh::sized(job, &any)) {
        zh::fail(ZH_BAD_ARGUMENT, "zh_sim_open: job: is NULL or its struct_size too small; set it "
                                  "to the size of the struct");
        return nullptr;
    }
    return zh::guarded<zh_sim_steps *>(nullptr, [&] { return new zh_sim_steps(*job); });
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
