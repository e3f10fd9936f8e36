// The replay path is the drive's estimator: every call that the drive makes of it in a run, given
// to zh_estimator_<name> through host_sim/sil_estimator.h, makes the drive's own speed, stator
// frequency and flux, bit for bit over the whole run.
//
// The calls are the drive's, taken by the linker (--wrap), not what a test believes of its wiring.
// While the gates are off the drive zeroes the state: seen in the state itself.
#include "check.hpp"
#include "config_params.hpp"
#include "lockstep_peer.hpp"
#include "sil_estimator.h"
#include "sim_job.hpp"

#include <dlfcn.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

using namespace zh;

namespace {

using Events = std::vector<zh_estimator_event>;

Events *taken = nullptr; // where the drive's calls go

void take(std::uint32_t verb, ab_t i_s_A, float omega_e_rad_s)
{
    if (taken != nullptr) {
        zh_estimator_event e{};
        e.verb = verb;
        e.i_alpha_A = i_s_A.alpha;
        e.i_beta_A = i_s_A.beta;
        e.omega_e_rad_s = omega_e_rad_s;
        taken->push_back(e);
    }
}

void take_period(std::uint32_t verb, const estimator_in_t &in, float omega_e_rad_s)
{
    take(verb, in.i_s_A, omega_e_rad_s);
    if (taken != nullptr) {
        zh_estimator_event &e = taken->back();
        e.u_alpha_V = in.u_s_V.alpha;
        e.u_beta_V = in.u_s_V.beta;
        e.expected_step_rad_s = in.expected_step_rad_s;
        e.dwell = in.dwell;
        e.slip_extra_rad_s = in.slip_extra_rad_s;
        e.tau_extra_per_s = in.tau_extra_per_s;
        e.frame_imposed = in.frame_imposed ? 1 : 0;
        e.omega_frame_rad_s = in.omega_frame_rad_s;
    }
}

} // namespace

extern "C" {
void __real_estimator_step(const estimator_config_t *, estimator_state_t *, const estimator_in_t *);
void __real_estimator_hold(const estimator_config_t *, estimator_state_t *, const estimator_in_t *,
                           float);
void __real_estimator_off(estimator_state_t *, ab_t, float);
void __real_estimator_seed(const estimator_config_t *, estimator_state_t *,
                           const estimator_seed_t *);

void __wrap_estimator_step(const estimator_config_t *cfg, estimator_state_t *st,
                           const estimator_in_t *in)
{
    take_period(ZH_ESTIMATOR_STEP, *in, 0.0F);
    __real_estimator_step(cfg, st, in);
}

void __wrap_estimator_hold(const estimator_config_t *cfg, estimator_state_t *st,
                           const estimator_in_t *in, float omega_e_rad_s)
{
    take_period(ZH_ESTIMATOR_HOLD, *in, omega_e_rad_s);
    __real_estimator_hold(cfg, st, in, omega_e_rad_s);
}

void __wrap_estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    take(ZH_ESTIMATOR_OFF, i_s_A, omega_e_rad_s);
    __real_estimator_off(st, i_s_A, omega_e_rad_s);
}

void __wrap_estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                           const estimator_seed_t *seed)
{
    take(ZH_ESTIMATOR_SEED, seed->i_s_A, seed->omega_e_rad_s);
    if (taken != nullptr) {
        taken->back().lambda_alpha_Wb = seed->lambda_r_Wb.alpha;
        taken->back().lambda_beta_Wb = seed->lambda_r_Wb.beta;
    }
    __real_estimator_seed(cfg, st, seed);
}
}

namespace {

using Bits = std::array<float, 4>; // w, w_s, flux

// Sits beside the drive: what it asked of its estimator, and what it believed after each period.
class Recorder : public LockstepPeer {
public:
    Recorder()
    {
        taken = &events;
    }
    ~Recorder() override
    {
        taken = nullptr;
    }
    Recorder(const Recorder &) = delete;
    Recorder &operator=(const Recorder &) = delete;

    void ask(hal_sample_t &, unit_command_t &) override
    {
    }
    bool answer(const unit_t &unit, hal_output_t &) override
    {
        const estimator_state_t &st = unit.drive.estimator;
        const estimator_state_t zero{};
        const bool rests = std::memcmp(&st, &zero, sizeof st) == 0;
        if (rests && !rested_ && events.size() == asked_) {
            take(ZH_ESTIMATOR_RESET, ab_t{}, 0.0F);
        }
        rested_ = rests;
        asked_ = events.size();
        const estimate_t &e = st.estimate;
        believed.push_back(
            {e.omega_e_rad_s, e.omega_s_rad_s, e.lambda_r_hat_Wb.alpha, e.lambda_r_hat_Wb.beta});
        until.push_back(asked_);
        return true;
    }

    Events events;
    std::vector<Bits> believed;     // after each period
    std::vector<std::size_t> until; // events so far

private:
    std::size_t asked_ = 0;
    bool rested_ = true;
};

// The library of one estimator, as any process loads it.
class Library {
public:
    Library() : handle_(dlopen(ZH_ESTIMATOR_LIBRARY, RTLD_NOW | RTLD_LOCAL))
    {
        CHECK(handle_ != nullptr);
    }
    ~Library()
    {
        dlclose(handle_);
    }
    Library(const Library &) = delete;
    Library &operator=(const Library &) = delete;

    template <typename Function> Function *find(const char *name) const
    {
        return reinterpret_cast<Function *>(dlsym(handle_, name));
    }

private:
    void *handle_;
};

// Every parameter of the run, so that the estimator is configured as the drive's.
std::string all_params(const params_t &params)
{
    std::string lines;
    for (std::size_t k = 0; k < params_count(); ++k) {
        char line[96];
        std::snprintf(line, sizeof line, "%s=%.9g\n", params_name(k),
                      static_cast<double>(params_get(&params, k)));
        lines += line;
    }
    return lines;
}

struct Case {
    const char *scenario;
    const char *config;
    const char *motor;
    const char *firmware; // overrides
    std::uint32_t verbs;  // a bit each: these have to occur
};

constexpr std::uint32_t STEPS = 1U << ZH_ESTIMATOR_STEP;
constexpr std::uint32_t HOLDS = 1U << ZH_ESTIMATOR_HOLD;
constexpr std::uint32_t OFFS = 1U << ZH_ESTIMATOR_OFF;
constexpr std::uint32_t SEEDS = 1U << ZH_ESTIMATOR_SEED;
constexpr std::uint32_t RESETS = 1U << ZH_ESTIMATOR_RESET;

std::string motor_dir(const Case &c)
{
    return std::string(ZH_ROOT) + "/gain_tables/" + c.motor;
}

Run run_of_case(const Case &c)
{
    const std::string root = ZH_ROOT;
    const std::string scenario =
        c.scenario[0] == '[' ? c.scenario : root + "/host_sim/scenarios/" + c.scenario + ".toml";
    const std::string rig = root + "/host_sim/rigs/hasegawa2005.toml";
    const std::string board = root + "/host_sim/boards/paper.toml";
    const std::string motor = motor_dir(c);
    const std::string config = params_of(c.config);
    zh_sim_job job{};
    job.struct_size = sizeof job;
    job.seed = 1;
    job.scenario = scenario.c_str();
    job.rig = rig.c_str();
    job.board = board.c_str();
    job.motor_dir = motor.c_str();
    job.firmware_config = config.c_str();
    job.firmware = c.firmware;
    Run run = run_of(job);
    run.decimate = 1000000; // nothing of the record is looked at
    return run;
}

std::vector<zh_estimate> replayed(const Case &c, const Run &run, const Events &events)
{
    const Library library;
    const auto open = library.find<decltype(zh_estimator_open)>("zh_estimator_open");
    const auto step = library.find<decltype(zh_estimator_run)>("zh_estimator_run");
    const auto close = library.find<decltype(zh_estimator_close)>("zh_estimator_close");
    const std::string params = all_params(run.params);
    zh_estimator *estimator = open(motor_dir(c).c_str(), params.c_str(), run.params.period_s);
    CHECK(estimator != nullptr);
    std::vector<zh_estimate> estimates(events.size());
    CHECK(step(estimator, events.size(), events.data(), estimates.data()) == 0);
    close(estimator);
    return estimates;
}

void replay(const Case &c)
{
    const Run run = run_of_case(c);
    Recorder recorder;
    const Outcome outcome = simulate(run, &recorder);
    CHECK(outcome.steps == recorder.believed.size() && outcome.steps > 10000);
    const std::vector<zh_estimate> out = replayed(c, run, recorder.events);
    std::size_t differ = 0;
    Bits now{};
    for (std::size_t k = 0, event = 0; k < recorder.believed.size(); ++k) {
        for (; event < recorder.until[k]; ++event) {
            now = {out[event].omega_e_rad_s, out[event].omega_s_rad_s, out[event].lambda_alpha_Wb,
                   out[event].lambda_beta_Wb};
        }
        differ += std::memcmp(&now, &recorder.believed[k], sizeof now) != 0 ? 1 : 0;
    }
    CHECK(differ == 0);
    std::array<std::size_t, ZH_ESTIMATOR_VERBS> count{};
    for (const zh_estimator_event &e : recorder.events) {
        ++count[e.verb];
    }
    std::printf(
        "%s, %s: %zu periods, %zu differ; step %zu, hold %zu, off %zu, seed %zu, reset %zu\n",
        c.scenario[0] == '[' ? "stop and go" : c.scenario, c.config, recorder.believed.size(),
        differ, count[0], count[1], count[2], count[3], count[4]);
    for (std::uint32_t verb = 0; verb < ZH_ESTIMATOR_VERBS; ++verb) {
        CHECK((c.verbs >> verb & 1U) == 0 || count[verb] > 0);
    }
}

// What the figures do not have: a search for a turning motor, and I-f when the estimate is lost.
constexpr const char *stop_and_go =
    "[scenario]\nname = \"stop and go\"\nduration_s = 18.0\n"
    "run_on_s = 0.1\nrun_off_s = 7.5\nrun_again_s = 8.2\n"
    "[profiles]\n"
    "speed_ref_rpm = [[0.0, 0.0], [4.2, 0.0], [5.2, 600.0], [12.0, 600.0], [13.0, 0.0]]\n"
    "load_torque_Nm = [[0.0, 0.0], [5.5, 0.0], [6.0, 6.0]]\n";

constexpr Case cases[] = {
    {"fig16", "paper", "hasegawa2005_paper", "", STEPS | HOLDS},
    {"fig18", "paper", "hasegawa2005_paper", "", STEPS | HOLDS},
    {"fig16", "recommended", "hasegawa2005_recommended", "", STEPS | HOLDS},
    {"fig18", "recommended", "hasegawa2005_recommended", "", STEPS | HOLDS},
    {stop_and_go, "recommended", "hasegawa2005_recommended", "flying_start=1",
     STEPS | HOLDS | OFFS | SEEDS | RESETS},
    {"fig18", "paper", "hasegawa2005_paper", "lost_action=2\ni_f_A=12\nobserver_gain_enable=0",
     STEPS | HOLDS | SEEDS},
};

} // namespace

int main()
{
    return check::run({
        {"Fig. 16, paper", [] { replay(cases[0]); }},
        {"Fig. 18, paper", [] { replay(cases[1]); }},
        {"Fig. 16, recommended", [] { replay(cases[2]); }},
        {"Fig. 18, recommended", [] { replay(cases[3]); }},
        {"search, seed and run", [] { replay(cases[4]); }},
        {"lost and taken over by I-f", [] { replay(cases[5]); }},
    });
}
