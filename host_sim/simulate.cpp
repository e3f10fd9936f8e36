#include "simulate.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <limits>
#include <memory>
#include <utility>

#include "loop.hpp"
#include "plant_lanes.hpp"

namespace zh {
namespace {

double cpu_time_s()
{
    std::timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double ns_per_step(double cpu_s, std::uint64_t steps)
{
    return 1e9 * cpu_s / static_cast<double>(std::max<std::uint64_t>(steps, 1));
}

// One period as firmware and plant saw it, for timing them one at a time.
struct Exchange {
    hal_sample_t sample;
    unit_command_t command;
    hal_output_t output;
    PlantCommand acting;
};

std::vector<Exchange> exchanges(const Run &run, std::uint64_t steps)
{
    std::vector<Exchange> log;
    log.reserve(static_cast<std::size_t>(steps));
    Firmware firmware(run.params, run.gain);
    Plant plant(run.rig, run.board, run.scenario.disturbances, run.seed);
    Operator op(run.scenario);
    PreloadedTimer timer(run.board.delay_periods);
    for (std::uint64_t k = 0; k < steps; ++k) {
        const double t_s = plant.time_s();
        Exchange e{};
        e.sample = sample_of(plant.sample(), plant.broken());
        op.speak(t_s);
        e.command = op.said();
        e.output = firmware.step(e.sample, e.command);
        e.acting = {timer.exchange({e.output.duty_u, e.output.duty_v, e.output.duty_w}),
                    e.output.gates_on, e.output.brake_on};
        plant.advance(e.acting);
        log.push_back(e);
    }
    return log;
}

bool same(const hal_output_t &a, const hal_output_t &b)
{
    return a.gates_on == b.gates_on && !(a.duty_u < b.duty_u) && !(a.duty_u > b.duty_u) &&
           !(a.duty_v < b.duty_v) && !(a.duty_v > b.duty_v) && !(a.duty_w < b.duty_w) &&
           !(a.duty_w > b.duty_w);
}

// Each half alone on what the other gave it, no clock inside; both must repeat the run to the bit,
// or the time would be that of something else.
void time_split(const Run &run, Outcome &out)
{
    const std::vector<Exchange> log = exchanges(run, out.steps);
    Firmware firmware(run.params, run.gain);
    bool repeated = true;
    const double controller_s = cpu_time_s();
    for (const Exchange &e : log) {
        repeated &= same(firmware.step(e.sample, e.command), e.output);
    }
    out.controller_ns_per_step = ns_per_step(cpu_time_s() - controller_s, log.size());

    Plant plant(run.rig, run.board, run.scenario.disturbances, run.seed);
    const double plant_s = cpu_time_s();
    for (const Exchange &e : log) {
        const Words w = plant.sample();
        repeated &= w.i_u == e.sample.i_u_counts && w.i_v == e.sample.i_v_counts &&
                    w.u_uv == e.sample.u_uv_counts;
        plant.advance(e.acting);
    }
    out.plant_ns_per_step = ns_per_step(cpu_time_s() - plant_s, log.size());
    if (!repeated) {
        throw ConfigError("timing: firmware or plant did not repeat the run; this is a bug");
    }
}

// An estimator of somebody else's may take any time: a run that would take hours ends.
class Patience {
public:
    explicit Patience(std::uint64_t steps) : from_steps_(steps), looked_at_(steps)
    {
    }
    bool over(std::uint64_t steps)
    {
        if (steps - looked_at_ < look_every) {
            return false;
        }
        looked_at_ = steps;
        const double used_s = cpu_time_s() - from_s_;
        return used_s > hiccup_s + most_s * static_cast<double>(steps - from_steps_);
    }

private:
    static constexpr std::uint64_t look_every = 256;
    static constexpr double most_s = 250e-6; // of CPU time for a period
    static constexpr double hiccup_s = 2.0;  // on top: others use the machine too

    std::uint64_t from_steps_;
    std::uint64_t looked_at_;
    double from_s_ = cpu_time_s();
};

void run_to_end(Loop &loop)
{
    run_until(loop, std::numeric_limits<std::uint64_t>::max());
}

// Many runs, one per lane; when one ends the next takes its lane.
class Together {
public:
    explicit Together(std::span<const Run> runs) : runs_(runs), outcomes_(runs.size())
    {
    }

    std::vector<Outcome> finish()
    {
        while (fill() >= fewest) {
            step();
        }
        for (std::size_t k = 0; k < PlantLanes::width; ++k) {
            if (loops_[k] != nullptr) {
                lanes_.attach(k, nullptr);
                run_to_end(*loops_[k]);
                outcomes_[index_[k]] = loops_[k]->take();
            }
        }
        return std::move(outcomes_);
    }

private:
    // Fewer drives are done sooner one after the other (measured).
    static constexpr std::size_t fewest = 4;

    // How many lanes are busy.
    std::size_t fill()
    {
        std::size_t busy = 0;
        for (std::size_t k = 0; k < PlantLanes::width; ++k) {
            while (loops_[k] == nullptr || !loops_[k]->goes_on()) {
                if (loops_[k] != nullptr) {
                    outcomes_[index_[k]] = loops_[k]->take();
                    lanes_.attach(k, nullptr);
                    loops_[k].reset();
                }
                if (next_ == runs_.size()) {
                    break;
                }
                index_[k] = next_;
                loops_[k] = std::make_unique<Loop>(runs_[next_++], nullptr);
                lanes_.attach(k, &loops_[k]->plant());
            }
            busy += loops_[k] != nullptr ? 1U : 0U;
        }
        return busy;
    }
    // One control period of every lane.
    void step()
    {
        lanes_.sample(words_);
        for (std::size_t k = 0; k < PlantLanes::width; ++k) {
            if (loops_[k] != nullptr) {
                loops_[k]->control(words_[k], commands_[k]);
            }
        }
        lanes_.advance(commands_);
        for (const std::unique_ptr<Loop> &loop : loops_) {
            if (loop != nullptr) {
                loop->follow();
            }
        }
    }

    std::span<const Run> runs_;
    std::vector<Outcome> outcomes_;
    std::size_t next_ = 0;
    PlantLanes lanes_;
    PlantLanes::PerLane<std::unique_ptr<Loop>> loops_;
    PlantLanes::PerLane<std::size_t> index_{}; // of the run
    PlantLanes::PerLane<Words> words_{};
    PlantLanes::PerLane<PlantCommand> commands_{};
};

} // namespace

void run_until(Loop &loop, std::uint64_t steps)
{
    PlantCommand command;
    Patience patience(loop.steps());
    while (loop.steps() < steps && loop.goes_on()) {
        if (patience.over(loop.steps())) {
            loop.too_slow();
            break;
        }
        loop.control(loop.plant().sample(), command);
        if (loop.ended()) {
            break;
        }
        loop.plant().advance(command);
        loop.follow();
    }
}

Outcome simulate(const Run &run, LockstepPeer *peer)
{
    Loop loop(run, peer);
    const double start_s = cpu_time_s();
    run_to_end(loop);
    Outcome out = loop.take();
    out.loop_ns_per_step = ns_per_step(cpu_time_s() - start_s, out.steps);
    if (run.time_split) {
        time_split(run, out);
    }
    return out;
}

std::vector<Outcome> simulate_together(std::span<const Run> runs)
{
    const double start_s = cpu_time_s();
    std::vector<Outcome> outcomes = Together(runs).finish();
    const double cpu_s = cpu_time_s() - start_s;
    std::uint64_t steps = 0;
    for (const Outcome &out : outcomes) {
        steps += out.steps;
    }
    for (std::size_t k = 0; k < runs.size(); ++k) {
        outcomes[k].loop_ns_per_step = ns_per_step(cpu_s, steps);
        if (runs[k].time_split) {
            time_split(runs[k], outcomes[k]);
        }
    }
    return outcomes;
}

} // namespace zh
