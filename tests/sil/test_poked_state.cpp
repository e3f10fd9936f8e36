// A word of the control law's state becomes a NaN or an infinity while the drive runs: by a flipped
// bit, or by arithmetic that nobody thought of. Either it heals within HEAL_PERIODS and the drive
// goes on, or a fault opens the gates; the duties are numbers in 0..1 all the while, and no leg
// carries more than 22.5 A for more than two periods.
//
// Every word of drive_state_t is poked, floats and all others, in each of the drive's modes and, as
// its state is looked at in slots (slots.h), before each slot of a quarter.
#include "check.hpp"
#include "config_params.hpp"
#include "firmware.hpp"
#include "plant.hpp"
#include "sim_job.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

using namespace zh;

namespace {

constexpr std::size_t word_count = sizeof(drive_state_t) / sizeof(std::uint32_t);
constexpr std::array<std::uint32_t, 3> patterns{0x7fc00000, 0x7f800000, 0xff800000};
constexpr int watched_periods = 1500; // .3 s
constexpr int heal_periods = 50;
constexpr int poked_slots = 16;
constexpr double over_A = 22.5;
constexpr double astray_rpm = 60.0; // the speed may be disturbed while it heals

// Words that are no floats: counts, flags and enumerations, whose bits are never a NaN.
bool is_float(std::size_t word)
{
    struct Block {
        std::size_t at;
        std::size_t size;
    };
#define BLOCK(member)                                                                              \
    Block                                                                                          \
    {                                                                                              \
        offsetof(drive_state_t, member), sizeof(drive_state_t::member)                             \
    }
    constexpr Block others[] = {
        BLOCK(mode),
        BLOCK(asked),
        BLOCK(slot),
        BLOCK(estimator.adaptation.near_zero),
        BLOCK(estimator.adaptation.steps),
        BLOCK(limits.link.acting),
        BLOCK(limits.overload.derating),
        BLOCK(guard.monitor),
        BLOCK(guard.plausibility.voltage),
        BLOCK(guard.plausibility.phase),
        BLOCK(guard.plausibility.estimate),
        BLOCK(guard.plausibility.stall),
        BLOCK(guard.plausibility.mirrored),
        BLOCK(supervisor.started),
        BLOCK(supervisor.judged),
        BLOCK(supervisor.found.flux_high),
        BLOCK(supervisor.suspect_schedules),
        BLOCK(supervisor.quiet_schedules),
        BLOCK(supervisor.reasons),
        BLOCK(supervisor.confidence),
        BLOCK(rs_tracking.periods),
        BLOCK(dwell.standing),
        BLOCK(dwell.active),
        BLOCK(dwell.flux),
        BLOCK(dwell.inside_steps),
        BLOCK(modes.vector.steering.steering),
        BLOCK(modes.vector.steer.moving),
        BLOCK(modes.vector.pull_out_near),
        BLOCK(modes.vector.planned),
        BLOCK(modes.vector.plan.torque),
        BLOCK(modes.vector.plan.window),
        BLOCK(modes.vector.mains.active),
        BLOCK(modes.vector.mains.back_periods),
        BLOCK(modes.i_f.active),
        BLOCK(modes.i_f.lost_periods),
        BLOCK(modes.premagnetise.measurement.periods),
        BLOCK(modes.premagnetise.leg_loss_found),
        BLOCK(modes.flying.phase),
        BLOCK(modes.flying.current_on),
        BLOCK(modes.flying.periods),
        BLOCK(modes.brake.periods),
    };
#undef BLOCK
    return std::none_of(std::begin(others), std::end(others), [word](const Block &b) {
        return 4 * word >= b.at / 4 * 4 && 4 * word < b.at + b.size;
    });
}

using Words32 = std::array<std::uint32_t, word_count>;

// A float of these bits all set is no number; of a word that is no float none is looked at.
constexpr std::uint32_t exponent_bits = 0x7f800000;
const Words32 looked_at = [] {
    Words32 out{};
    for (std::size_t n = 0; n < word_count; ++n) {
        out[n] = is_float(n) ? exponent_bits : 0;
    }
    return out;
}();

struct Point {
    const char *name;
    const char *config;
    const char *motor;
    const char *more; // overrides
    const char *profiles;
    double at_s;
    drive_mode_t mode;
};

Run run_of_point(const Point &p)
{
    const std::string root = ZH_ROOT;
    const std::string scenario = "[scenario]\nname = \"poked\"\nduration_s = 10.0\nrun_on_s = 0.1\n"
                                 "[profiles]\n" +
                                 std::string(p.profiles);
    const std::string rig = root + "/host_sim/rigs/hasegawa2005.toml";
    const std::string board = root + "/host_sim/boards/paper.toml";
    const std::string motor = root + "/gain_tables/" + p.motor;
    const std::string config = params_of(p.config);
    zh_sim_job job{};
    job.struct_size = sizeof job;
    job.scenario = scenario.c_str();
    job.rig = rig.c_str();
    job.board = board.c_str();
    job.motor_dir = motor.c_str();
    job.firmware_config = config.c_str();
    job.firmware = p.more;
    return run_of(job);
}

// What came of one poke.
struct Fate {
    std::uint32_t faults = 0;
    bool duties = true;   // in 0..1 throughout
    bool gates_on = true; // at the end
    int over = 0;         // most periods on end beyond over_A
    int sick = 0;         // last period with a word that is no number
    bool same = true;     // duties of the undisturbed run
    double error_rpm = 0.0;
};

// The run without a poke: by periods what the drive put out and what it was then, and its end.
struct Undisturbed {
    std::vector<hal_output_t> outputs;
    std::vector<std::vector<unsigned char>> units;
    Fate fate;
};

bool same_duties(const hal_output_t &a, const hal_output_t &b)
{
    const Duty x{a.duty_u, a.duty_v, a.duty_w}, y{b.duty_u, b.duty_v, b.duty_w};
    return std::memcmp(&x, &y, sizeof x) == 0;
}

// Drive and rig, which can be brought back to one moment.
class Bench {
public:
    Bench(const Point &p, int later)
        : run_(run_of_point(p)), firmware_(run_.params, run_.gain),
          plant_(run_.rig, run_.board, run_.scenario.disturbances, run_.seed),
          timer_(run_.board.delay_periods)
    {
        while (plant_.time_s() < p.at_s) {
            (void)period();
        }
        for (int k = 0; k < later; ++k) {
            (void)period();
        }
        CHECK(unit().asked.mode == p.mode && unit().machine.faults == 0);
        std::memcpy(kept_app_.data(), &unit(), sizeof(unit_t));
        kept_plant_ = std::make_unique<Plant>(plant_);
        kept_timer_ = timer_;
        kept_count_ = count_;
    }

    // As it was at that moment, without a poke.
    Undisturbed undisturbed()
    {
        restore();
        Undisturbed out;
        for (int k = 0; k < watched_periods; ++k) {
            out.outputs.push_back(watch(k, out.fate));
            const auto *const bytes = reinterpret_cast<const unsigned char *>(&unit());
            out.units.emplace_back(bytes, bytes + sizeof(unit_t));
        }
        out.fate.error_rpm = error_rpm();
        return out;
    }

    // As it was at that moment, but for one word.
    Fate poke(std::size_t word, std::uint32_t pattern, const Undisturbed &usual)
    {
        restore();
        std::memcpy(reinterpret_cast<unsigned char *>(&unit().drive) + 4 * word, &pattern, 4);
        Fate out;
        bool same_plant = true; // it was given the same up to now
        for (int k = 0; k < watched_periods; ++k) {
            const auto n = static_cast<std::size_t>(k);
            const hal_output_t o = watch(k, out), &was = usual.outputs[n];
            out.same = out.same && same_duties(o, was);
            same_plant =
                same_plant && out.same && o.gates_on == was.gates_on && o.brake_on == was.brake_on;
            if (same_plant && std::memcmp(&unit(), usual.units[n].data(), sizeof(unit_t)) == 0) {
                return same_from_here(out, usual.fate);
            }
        }
        out.error_rpm = error_rpm();
        return out;
    }

private:
    // Drive and plant are to the last bit what they were without the poke: so is what follows.
    static Fate same_from_here(Fate out, const Fate &usual)
    {
        out.duties = out.duties && usual.duties;
        out.over = std::max(out.over, usual.over);
        out.sick = std::max(out.sick, usual.sick);
        out.faults |= usual.faults;
        out.gates_on = usual.gates_on;
        out.error_rpm = usual.error_rpm;
        return out;
    }
    void restore()
    {
        std::memcpy(static_cast<void *>(&unit()), kept_app_.data(), sizeof(unit_t));
        plant_ = *kept_plant_;
        timer_ = kept_timer_;
        count_ = kept_count_;
        over_ = 0;
    }
    // One period, and what of it belongs to the fate.
    hal_output_t watch(int k, Fate &out)
    {
        const hal_output_t o = period();
        for (const float d : {o.duty_u, o.duty_v, o.duty_w}) {
            out.duties = out.duties && d >= 0.0F && d <= 1.0F;
        }
        over_ = plant_.truth().i_peak_A > over_A ? over_ + 1 : 0;
        out.over = std::max(out.over, over_);
        out.sick = sick() ? k + 1 : out.sick;
        out.faults |= unit().machine.faults;
        out.gates_on = o.gates_on;
        return o;
    }
    double error_rpm() const
    {
        return std::abs(plant_.truth().omega_m_rad_s * 60.0 / 6.283185307 - reference());
    }
    unit_t &unit()
    {
        return const_cast<unit_t &>(firmware_.unit()); // what no interface may do
    }
    double reference() const
    {
        return run_.scenario.speed_ref_rpm.value(plant_.time_s());
    }
    bool sick()
    {
        Words32 words;
        std::memcpy(words.data(), &unit().drive, sizeof words);
        int found = 0; // without a branch, as each period asks every word
        for (std::size_t n = 0; n < word_count; ++n) {
            found += (words[n] & looked_at[n]) == exponent_bits ? 1 : 0;
        }
        return found > 0;
    }
    hal_output_t period()
    {
        const double t_s = plant_.time_s();
        const float speed_rpm = static_cast<float>(reference());
        const hal_output_t o = firmware_.step(sample_of(plant_.sample(), plant_.broken()),
                                              command_at(run_.scenario, t_s, speed_rpm, ++count_));
        plant_.advance(timer_.exchange({o.duty_u, o.duty_v, o.duty_w}), o.gates_on, o.brake_on);
        return o;
    }

    Run run_;
    Firmware firmware_;
    Plant plant_;
    PreloadedTimer timer_;
    std::uint32_t count_ = 0, kept_count_ = 0;
    int over_ = 0; // periods on end beyond over_A
    std::vector<unsigned char> kept_app_ = std::vector<unsigned char>(sizeof(unit_t));
    std::unique_ptr<Plant> kept_plant_;
    PreloadedTimer kept_timer_;
};

void poke_all(const Point &p, int later)
{
    Bench bench(p, later);
    const Undisturbed undisturbed = bench.undisturbed();
    CHECK(undisturbed.fate.faults == 0 && undisturbed.fate.sick == 0);
    int stopped = 0, healed = 0, unused = 0, longest = 0;
    std::map<std::uint32_t, int> said;
    for (std::size_t word = 0; word < word_count; ++word) {
        for (const std::uint32_t pattern : patterns) {
            const Fate o = bench.poke(word, pattern, undisturbed);
            const bool off = o.faults != 0 && !o.gates_on;
            const bool well = o.gates_on && o.sick <= heal_periods && o.error_rpm < astray_rpm;
            const bool good = o.duties && o.over <= 2 && (off || well || o.same || !is_float(word));
            if (!good) {
                std::printf("%s: byte %zu, %08x, %d later: faults %x gates %d over %d sick %d off "
                            "by %.0f\n",
                            p.name, 4 * word, pattern, later, o.faults, o.gates_on, o.over, o.sick,
                            o.error_rpm);
            }
            CHECK(good);
            stopped += off ? 1 : 0;
            unused += !off && o.same ? 1 : 0;
            healed += !off && !o.same ? 1 : 0;
            longest = off || o.same ? longest : std::max(longest, o.sick);
            ++said[o.faults];
        }
    }
    std::printf("%s, slot %d: %d stopped, %d healed within %d periods, %d without effect;", p.name,
                later, stopped, healed, longest, unused);
    for (const auto &[bits, count] : said) {
        std::printf(" %x: %d", bits, count);
    }
    std::printf("\n");
    CHECK(said[FAULT_NON_FINITE] > 0);
}

void poke_in_all_slots(const Point &p)
{
    for (int later = 0; later < poked_slots; ++later) {
        poke_all(p, later);
    }
}

constexpr Point points[] = {
    {"recommended, 900 min^-1, half load", "recommended", "hasegawa2005_recommended", "",
     "speed_ref_rpm = [[0.0, 0.0], [4.2, 0.0], [5.2, 900.0]]\n"
     "load_torque_Nm = [[0.0, 0.0], [5.2, 0.0], [5.3, 4.0]]\n",
     6.0, DRIVE_RUN},
    {"paper, 300 min^-1, half load", "paper", "hasegawa2005", "",
     "speed_ref_rpm = [[0.0, 0.0], [2.0, 0.0], [2.5, 300.0]]\n"
     "load_torque_Nm = [[0.0, 0.0], [2.5, 0.0], [2.6, 4.0]]\n",
     3.5, DRIVE_RUN},
    {"recommended, resistance being measured", "recommended", "hasegawa2005_recommended", "",
     "speed_ref_rpm = [[0.0, 0.0]]\n", 3.95, DRIVE_PREMAGNETISE},
    {"recommended, gates off", "recommended", "hasegawa2005_recommended", "",
     "speed_ref_rpm = [[0.0, 0.0]]\n", 0.08, DRIVE_OFF},
    {"V/f, 600 min^-1", "recommended", "hasegawa2005_recommended", "control_mode=1",
     "speed_ref_rpm = [[0.0, 0.0], [4.3, 0.0], [5.3, 600.0]]\n", 6.0, DRIVE_RUN},
    {"I-f, 300 min^-1", "recommended", "hasegawa2005_recommended", "control_mode=2",
     "speed_ref_rpm = [[0.0, 0.0], [4.3, 0.0], [5.3, 300.0]]\n", 6.0, DRIVE_RUN},
};

} // namespace

int main()
{
    return check::run({
        {"in RUN with all means", [] { poke_in_all_slots(points[0]); }},
        {"in RUN as the paper has it", [] { poke_in_all_slots(points[1]); }},
        {"while the resistance is measured", [] { poke_in_all_slots(points[2]); }},
        {"before the gates go on", [] { poke_in_all_slots(points[3]); }},
        {"in V/f", [] { poke_in_all_slots(points[4]); }},
        {"in I-f", [] { poke_in_all_slots(points[5]); }},
    });
}
