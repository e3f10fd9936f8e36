#include "sim.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "c_boundary.hpp"
#include "commissioning_of.hpp"
#include "emulated_core.hpp"
#include "experiment.hpp"
#include "firmware_setup.hpp"
#include "sim_job.hpp"
#include "simulate.hpp"

namespace {

using zh::empty_result;
using zh::fail;
using zh::hand_over;
using zh::sized;

// A path, or the text itself when it has more than one line.
zh::TomlDocument document(const char *source, const char *what)
{
    if (source == nullptr || *source == '\0') {
        throw zh::ConfigError(std::string("zh_sim_run: ") + what + ": missing; give a path");
    }
    const std::string_view text = source;
    return text.find('\n') != std::string_view::npos ? zh::TomlDocument::from_text(text, what)
                                                     : zh::TomlDocument::from_file(source);
}

// One assignment per line; a '#' may stand in a quoted value, so only a leading one is a comment.
void override_document(zh::TomlDocument &document, const char *lines)
{
    std::string_view rest = lines != nullptr ? lines : "";
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        std::string_view line = rest.substr(0, end);
        rest.remove_prefix(std::min(end + 1, rest.size()));
        line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
        if (!line.empty() && line.front() != '#') {
            document.set(line);
        }
    }
}

zh::TomlDocument read(const char *source, const char *overrides, const char *what)
{
    zh::TomlDocument d = document(source, what);
    override_document(d, overrides);
    return d;
}

void scale(params_t &params, const char *name, double factor)
{
    const double value = factor * static_cast<double>(params_get(&params, params_find(name)));
    zh::set_param(params, name, static_cast<float>(value), "scenario: controller_motor");
}

params_t firmware_params(const zh_sim_job &job, const zh::MotorDir &dir, const zh::Run &run)
{
    params_t params = zh::nominal_params(dir.motor, run.board);
    const auto text = [](const char *lines) { return lines != nullptr ? lines : ""; };
    zh::apply_overrides(params, text(job.firmware_config), "firmware_config");
    for (const auto &[name, value] : run.scenario.firmware) {
        zh::set_param_text(params, name, value, run.scenario.name + ": firmware");
    }
    zh::apply_overrides(params, text(job.firmware), "firmware");
    const zh::ControllerMotor &factor = run.scenario.controller_motor;
    scale(params, "Rs_ohm", factor.Rs_factor);
    scale(params, "Rr_ohm", factor.Rr_factor);
    scale(params, "Ls_H", factor.Ls_factor);
    scale(params, "Lr_H", factor.Lr_factor);
    scale(params, "M_H", factor.M_factor);
    return params;
}

} // namespace

bool zh::sized(const zh_sim_job *job, const zh_sim_result *result)
{
    return job != nullptr && job->struct_size >= sizeof(zh_sim_job) && result != nullptr &&
           result->struct_size >= sizeof(zh_sim_result);
}

zh_sim_result zh::empty_result()
{
    zh_sim_result result{};
    result.struct_size = sizeof(zh_sim_result);
    return result;
}

void zh::show(const zh::Outcome &outcome, std::uint32_t flags, zh_sim_result &result)
{
    result.columns = outcome.columns;
    result.rows = outcome.rows;
    result.stride = outcome.stride;
    result.data = outcome.data.data();
    result.steps = outcome.steps;
    result.period_s = outcome.period_s;
    result.trip = outcome.trip;
    result.trip_s = outcome.trip_s;
    result.first_fault = outcome.first_fault;
    result.first_fault_s = outcome.first_fault_s;
    result.loop_ns_per_step = outcome.loop_ns_per_step;
    result.controller_ns_per_step = outcome.controller_ns_per_step;
    result.plant_ns_per_step = outcome.plant_ns_per_step;
    result.commissioning =
        zh::commissioning_of(outcome.commissioned, outcome.refusal, outcome.commissioning);
    const bool hashed = (flags & ZH_SIM_HASH_SIGNALS) != 0;
    result.signal_hashes = hashed ? outcome.signal_hashes.data() : nullptr;
}

void zh::hand_over(zh::Outcome &&outcome, std::uint32_t flags, zh_sim_result &result)
{
    auto out = std::make_unique<zh::Outcome>(std::move(outcome));
    show(*out, flags, result);
    result.owner = out.release();
}

zh::Scenario zh::scenario_of(const char *source, const char *overrides)
{
    return read_scenario(read(source, overrides, "scenario"));
}

zh::Rig zh::rig_of(const char *source, const char *overrides)
{
    return read_rig(read(source, overrides, "rig"));
}

zh::Board zh::board_of(const char *source, const char *overrides)
{
    return read_board(read(source, overrides, "board"));
}

zh::Run zh::run_of(const zh_sim_job &job)
{
    if (job.motor_dir == nullptr) {
        throw zh::ConfigError("zh_sim_run: motor_dir: missing; give the folder of a motor");
    }
    zh::Run run;
    run.scenario = zh::scenario_of(job.scenario, job.scenario_overrides);
    run.rig = zh::rig_of(job.rig, job.rig_overrides);
    run.board = zh::board_of(job.board, job.board_overrides);
    const zh::MotorDir dir = zh::MotorDir::load(job.motor_dir);
    run.gain = job.gain != nullptr && job.gain_entries > 0
                   ? zh::gain_from_floats({job.gain, 4 * std::size_t{job.gain_entries}})
                   : dir.gain;
    run.params = firmware_params(job, dir, run);
    run.seed = job.seed != 0 ? job.seed : run.scenario.noise_seed;
    run.columns = zh::columns_of(job.columns);
    run.decimate = std::max<std::uint32_t>(job.decimate, 1);
    run.steps =
        static_cast<std::uint64_t>(std::ceil(run.scenario.duration_s / run.board.period_s - 1e-6));
    if (job.max_steps != 0) {
        run.steps = std::min(run.steps, job.max_steps);
    }
    run.stop_at_trip = (job.flags & ZH_SIM_STOP_AT_TRIP) != 0;
    run.time_split = (job.flags & ZH_SIM_TIME_SPLIT) != 0;
    run.guard_recorded = (job.flags & ZH_SIM_GUARD_RECORDED) != 0;
    run.hash_signals = (job.flags & ZH_SIM_HASH_SIGNALS) != 0;
    return run;
}

int zh_pil_run(const zh_sim_job *job, const zh_pil_job *pil, zh_pil_result *result)
{
    if (job == nullptr || job->struct_size < sizeof(zh_sim_job) || pil == nullptr ||
        pil->struct_size < sizeof(zh_pil_job) || result == nullptr ||
        result->struct_size < sizeof(zh_pil_result)) {
        return fail(ZH_BAD_ARGUMENT, "zh_pil_run: job, pil or result: is NULL or its struct_size "
                                     "too small; set it to the size of the struct");
    }
    *result = zh_pil_result{};
    result->struct_size = sizeof(zh_pil_result);
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        const zh::Run run = zh::run_of(*job);
        zh::EmulatedCore core(*pil, run.params, *run.gain, *result);
        const auto start = std::chrono::steady_clock::now();
        zh::Outcome outcome = zh::simulate(run, &core);
        result->loop_s =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (result->end == ZH_PIL_EQUAL || pil->inject != 0) {
            core.finish();
        }
        if (pil->record != nullptr) {
            *pil->record = empty_result();
            hand_over(std::move(outcome), job->flags, *pil->record);
        }
        auto counted = std::make_unique<std::vector<zh_pil_period>>(core.take_periods());
        result->answered = counted->size();
        result->period = counted->data();
        result->owner = counted.release();
        return int{ZH_OK};
    });
}

void zh_pil_free(zh_pil_result *result)
{
    if (result == nullptr) {
        return;
    }
    delete static_cast<std::vector<zh_pil_period> *>(result->owner);
    result->owner = nullptr;
    result->period = nullptr;
    result->answered = 0;
}

int zh_sim_run(const zh_sim_job *job, zh_sim_result *result)
{
    if (!sized(job, result)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sim_run: job or result: is NULL or its struct_size too "
                                     "small; set it to the size of the struct");
    }
    *result = empty_result();
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        hand_over(zh::simulate(zh::run_of(*job)), job->flags, *result);
        return int{ZH_OK};
    });
}

int zh_sim_run_batch(const zh_sim_job *jobs, zh_sim_result *results, std::uint32_t count)
{
    for (std::uint32_t k = 0; k < count; ++k) {
        if (jobs == nullptr || results == nullptr || !sized(&jobs[k], &results[k])) {
            return fail(
                ZH_BAD_ARGUMENT,
                "zh_sim_run_batch: jobs or results: is NULL or a struct_size too small; set "
                "each to the size of the struct");
        }
    }
    std::for_each_n(results, count, [](zh_sim_result &r) { r = empty_result(); });
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        std::vector<zh::Run> runs;
        runs.reserve(count);
        for (std::uint32_t k = 0; k < count; ++k) {
            try {
                runs.push_back(zh::run_of(jobs[k]));
            } catch (const zh::ConfigError &error) {
                throw zh::ConfigError("job " + std::to_string(k) + ": " + error.what());
            }
        }
        std::vector<zh::Outcome> outcomes = zh::simulate_together(runs);
        for (std::uint32_t k = 0; k < count; ++k) {
            hand_over(std::move(outcomes[k]), jobs[k].flags, results[k]);
        }
        return int{ZH_OK};
    });
}

void zh_sim_free(zh_sim_result *result)
{
    if (result == nullptr) {
        return;
    }
    delete static_cast<zh::Outcome *>(result->owner);
    result->owner = nullptr;
    result->data = nullptr;
    result->signal_hashes = nullptr;
    result->rows = 0;
}

std::uint32_t zh_sim_column_count(void)
{
    return static_cast<std::uint32_t>(zh::column_count());
}

const char *zh_sim_column_name(std::uint32_t index)
{
    return index < zh::column_count() ? zh::column(index).name : nullptr;
}

const char *zh_sim_column_text(std::uint32_t index)
{
    return index < zh::column_count() ? zh::column(index).text : nullptr;
}

const char *zh_sim_signal_name(std::uint32_t index)
{
    return index < zh::signal_count ? unit_signal_name(index) : nullptr;
}
