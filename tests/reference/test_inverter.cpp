// The inverter: switching instants by hand, means over a period in closed form, and the switched
// against the averaged model with the motor behind it.
#include "check.hpp"
#include "board.hpp"
#include "inverter.hpp"
#include "plant.hpp"

#include <algorithm>
#include <complex>
#include <numbers>
#include <stdexcept>

using zh::Duty;
using zh::Inverter;
using zh::InverterModel;
using zh::InverterParameters;
using zh::Phases;

namespace {

constexpr double u_dc = 283.0;
constexpr double period_s = 200e-6;

InverterParameters parameters(InverterModel model, double dead_time_s, double drop_V)
{
    return {model, u_dc, 5000.0, dead_time_s, 0.2, drop_V};
}

Phases mean_over_a_period(Inverter &inverter, const Duty &duty, const Phases &i)
{
    Phases mean{};
    double total_s = 0.0;
    for (const zh::Segment &segment : inverter.schedule(duty)) {
        CHECK(segment.h_s > 0.0);
        const Phases v = inverter.leg_voltages(segment, i, u_dc);
        for (std::size_t x = 0; x < 3; ++x) {
            mean[x] += v[x] * segment.h_s / period_s;
        }
        total_s += segment.h_s;
    }
    CHECK_NEAR(total_s, period_s, 1e-15);
    return mean;
}

// d u_dc less the dead time in the direction of the current, never beyond the rails, less the drop.
double expected(double duty, double current, double dead_time_s, double drop_V)
{
    const double sign = current > 0.0 ? 1.0 : -1.0;
    const bool switches = duty > 0.0 && duty < 1.0;
    const double lost = switches ? dead_time_s / period_s * sign : 0.0;
    return u_dc * (std::clamp(duty - lost, 0.0, 1.0) - 0.5) - drop_V * sign;
}

void means_over_a_period_are_those_of_the_dead_time_formula()
{
    constexpr double duties[] = {0.0, 1e-4, 0.01, 0.02, 0.3, 0.5, 0.7, 0.98, 0.99, 0.9999, 1.0};
    for (const auto model : {InverterModel::averaged, InverterModel::switched}) {
        for (const double dead_time_s : {0.0, 3e-6, 10e-6}) {
            for (const double d : duties) {
                for (const double i : {5.0, -5.0}) {
                    Inverter inverter(parameters(model, dead_time_s, 1.5));
                    const Duty duty{d, 0.4, 1.0 - d};
                    const Phases currents{i, -2.0, 2.0 - i};
                    mean_over_a_period(inverter, duty, currents); // dead time may reach over
                    const Phases mean = mean_over_a_period(inverter, duty, currents);
                    for (std::size_t x = 0; x < 3; ++x) {
                        CHECK_NEAR(mean[x], expected(duty[x], currents[x], dead_time_s, 1.5), 1e-9);
                    }
                }
            }
        }
    }
}

void at_zero_current_the_dead_time_takes_nothing()
{
    for (const auto model : {InverterModel::averaged, InverterModel::switched}) {
        Inverter inverter(parameters(model, 3e-6, 1.5));
        const Phases mean = mean_over_a_period(inverter, {0.3, 0.5, 0.9}, {0.0, 0.0, 0.0});
        CHECK_NEAR(mean[0], -0.2 * u_dc, 1e-9);
        CHECK_NEAR(mean[2], 0.4 * u_dc, 1e-9);
    }
}

// A period of devices by hand: while the upper one is on, a current out of the leg flows through
// the transistor, into it through the diode; while the lower one is on the other way round.
void a_leg_loses_the_drop_of_whichever_device_conducts()
{
    constexpr double transistor_V = 1.7, diode_V = 0.9, on_ohm = 0.05;
    for (const auto model : {InverterModel::averaged, InverterModel::switched}) {
        InverterParameters p = parameters(model, 0.0, 0.5 * (transistor_V + diode_V));
        p.drop_difference_V = transistor_V - diode_V;
        p.on_ohm = on_ohm;
        Inverter inverter(p);
        const Duty duty{0.7, 0.2, 0.4};
        const Phases i{5.0, -6.0, 1.0};
        mean_over_a_period(inverter, duty, i);
        const Phases mean = mean_over_a_period(inverter, duty, i);
        for (std::size_t x = 0; x < 3; ++x) {
            const double upper_V = i[x] > 0.0 ? transistor_V : -diode_V;
            const double lower_V = i[x] > 0.0 ? diode_V : -transistor_V;
            const double lost_V = duty[x] * upper_V + (1.0 - duty[x]) * lower_V;
            CHECK_NEAR(mean[x], u_dc * (duty[x] - 0.5) - lost_V - on_ohm * i[x], 1e-9);
        }
    }
}

// 2 nF and 283 V hold .566 uC: in 3 us a current of .1887 A takes them.
void a_leg_capacitance_gives_back_part_of_the_dead_time()
{
    constexpr double dead_s = 3e-6, leg_F = 2e-9;
    for (const auto model : {InverterModel::averaged, InverterModel::switched}) {
        InverterParameters p = parameters(model, dead_s, 0.0);
        p.leg_F = leg_F;
        for (const double i_A : {0.05, 0.1887, 0.5, 8.0, -0.05, -8.0}) {
            Inverter inverter(p);
            mean_over_a_period(inverter, {0.5, 0.5, 0.5}, {i_A, -i_A, 0.0});
            const Phases mean = mean_over_a_period(inverter, {0.5, 0.5, 0.5}, {i_A, -i_A, 0.0});
            // Volt-seconds lost per period: the ramp of the voltage, to the rail or to the end.
            const double charge_s = leg_F * u_dc / std::abs(i_A);
            const double lost_s =
                charge_s > dead_s ? 0.5 * dead_s * dead_s / charge_s : dead_s - 0.5 * charge_s;
            CHECK_NEAR(mean[0], std::copysign(u_dc * lost_s / period_s, -i_A), 1e-9);
            CHECK_NEAR(mean[1], -mean[0], 1e-9);
            CHECK_NEAR(mean[2], 0.0, 1e-12);
        }
    }
}

void pulses_are_centred_between_the_crests()
{
    Inverter inverter(parameters(InverterModel::switched, 0.0, 0.0));
    const auto segments = inverter.schedule({0.5, 0.2, 0.8});
    CHECK(segments.size() == 7);
    double t_s = 0.0;
    constexpr double edges_s[] = {20e-6, 50e-6, 80e-6, 120e-6, 150e-6, 180e-6, 200e-6};
    constexpr double u[] = {0, 0, 1, 1, 1, 0, 0};
    constexpr double v[] = {0, 0, 0, 1, 0, 0, 0};
    constexpr double w[] = {0, 1, 1, 1, 1, 1, 0};
    for (std::size_t n = 0; n < segments.size(); ++n) {
        t_s += segments[n].h_s;
        CHECK_NEAR(t_s, edges_s[n], 1e-15);
        CHECK_NEAR(segments[n].level[0], u[n], 0.0);
        CHECK_NEAR(segments[n].level[1], v[n], 0.0);
        CHECK_NEAR(segments[n].level[2], w[n], 0.0);
    }
}

// Both switches off for exactly the dead time after each command, also across a crest.
void the_dead_time_follows_each_command()
{
    Inverter inverter(parameters(InverterModel::switched, 4e-6, 0.0));
    inverter.schedule({0.5, 0.5, 0.5});
    double blank_s = 0.0;
    for (const zh::Segment &s : inverter.schedule({0.99, 0.5, 0.0})) {
        blank_s += s.dead[0] > 0.0 ? s.h_s : 0.0;
    }
    CHECK_NEAR(blank_s, 4e-6 + 1e-6, 1e-12); // turn-on, and the start of turn-off at 199 us
    blank_s = 0.0;
    for (const zh::Segment &s : inverter.schedule({0.0, 0.5, 0.0})) {
        blank_s += s.dead[0] > 0.0 ? s.h_s : 0.0;
    }
    CHECK_NEAR(blank_s, 3e-6, 1e-12); // the rest of it
}

void full_duty_switches_only_once()
{
    Inverter inverter(parameters(InverterModel::switched, 3e-6, 0.0));
    inverter.schedule({0.5, 0.0, 0.0});
    CHECK(inverter.schedule({1.0, 0.0, 0.0}).size() == 2); // blanked, then on
    CHECK(inverter.schedule({1.0, 0.0, 0.0}).size() == 1);
    CHECK(inverter.schedule({0.0, 0.0, 0.0}).size() == 2);
    CHECK(inverter.schedule({0.0, 0.0, 0.0}).size() == 1);
}

// Whatever was on before: after blocking, the first switch comes on a dead time later.
void blocked_legs_start_with_a_dead_time()
{
    Inverter inverter(parameters(InverterModel::switched, 3e-6, 0.0));
    inverter.schedule({1.0, 1.0, 0.0});
    inverter.block();
    const zh::Segment first = inverter.schedule({0.5, 0.5, 0.5})[0];
    CHECK_NEAR(first.h_s, 3e-6, 1e-15);
    for (std::size_t x = 0; x < 3; ++x) {
        CHECK_NEAR(first.dead[x], 0.5, 0.0);
    }
    const zh::Segment second = inverter.schedule({0.5, 0.5, 0.5})[0];
    CHECK_NEAR(second.h_s, 50e-6, 1e-15);
    CHECK_NEAR(second.level[0], 0.0, 0.0);
    inverter.block();
    CHECK_NEAR(inverter.schedule({1.0, 1.0, 1.0})[0].dead[0], 0.5, 0.0);
}

void senseless_duties_stay_within_the_rails()
{
    for (const auto model : {InverterModel::averaged, InverterModel::switched}) {
        Inverter inverter(parameters(model, 0.0, 0.0));
        const Phases mean =
            mean_over_a_period(inverter, {-3.0, 7.0, std::nan("")}, {1.0, 1.0, 1.0});
        CHECK_NEAR(mean[0], -0.5 * u_dc, 1e-9);
        CHECK_NEAR(mean[1], 0.5 * u_dc, 1e-9);
        CHECK_NEAR(mean[2], -0.5 * u_dc, 1e-9);
    }
}

void impossible_inverters_are_refused()
{
    const auto refused = [](auto change) {
        InverterParameters p = parameters(InverterModel::switched, 3e-6, 1.0);
        change(p);
        return !check::message_of<std::invalid_argument>([&] { Inverter inverter(p); }).empty();
    };
    CHECK(refused([](auto &p) { p.dead_time_s = 100e-6; }));
    CHECK(refused([](auto &p) { p.dead_time_s = -1e-6; }));
    CHECK(refused([](auto &p) { p.i_threshold_A = 0.0; }));
    CHECK(refused([](auto &p) { p.on_ohm = -0.1; }));
    CHECK(refused([](auto &p) { p.leg_F = -1e-9; }));
    CHECK(refused([](auto &p) { p.carrier_Hz = std::nan(""); }));
    CHECK(!refused([](auto &) {}));
}

struct Steady {
    double current_A, flux_Wb, torque_Nm;
    std::complex<double> current; // in the frame of the duties
};

// Open loop at 20 Hz, the shaft held at 15 Hz (25 % slip) by an enormous inertia; means over the
// last ten periods of the fundamental.
Steady run_open_loop(InverterModel model, double dead_time_s, double drop_V)
{
    zh::Rig rig;
    rig.mechanics.J_kg_m2 = 1e4;
    rig.inverter = parameters(model, dead_time_s, drop_V);
    zh::Plant plant(rig, zh::Board{}, {}, 1);
    constexpr double omega = 2.0 * std::numbers::pi * 20.0;
    plant.set_state({{}, {}, 0.75 * omega / 2.0});
    constexpr long settle = 10000;
    constexpr long count = 2500;
    Steady mean{};
    for (long k = 0; k < settle + count; ++k) {
        const auto phase = std::polar(
            1.0, std::fmod(omega * static_cast<double>(k) * period_s, 2 * std::numbers::pi));
        const Phases v = zh::phases_from_vec({0.25 * phase.real(), 0.25 * phase.imag()});
        plant.advance({0.5 + v[0], 0.5 + v[1], 0.5 + v[2]}, true);
        if (k >= settle) {
            const zh::Truth t = plant.truth();
            mean.flux_Wb += zh::magnitude(t.psi_r_Wb) / count;
            mean.torque_Nm += t.torque_Nm / count;
            mean.current += std::complex(t.i_s_A.alpha, t.i_s_A.beta) / phase / double{count};
        }
    }
    mean.current_A = std::abs(mean.current);
    return mean;
}

// Without dead time both apply the same volt-seconds per period. What differs is where within the
// period the pulse sits (the crest current misses a little of the mean) and, with dead time, the
// ripple on the current that decides the sign: bounds .02 % and .2 %.
void switched_and_averaged_agree()
{
    struct Case {
        double dead_time_s, drop_V, share;
    };
    for (const Case &c : {Case{0.0, 0.0, 2e-4}, Case{3e-6, 1.5, 2e-3}}) {
        const Steady a = run_open_loop(InverterModel::averaged, c.dead_time_s, c.drop_V);
        const Steady s = run_open_loop(InverterModel::switched, c.dead_time_s, c.drop_V);
        CHECK(a.current_A > 5.0);
        CHECK_RELATIVE(s.current_A, a.current_A, c.share);
        CHECK_RELATIVE(s.flux_Wb, a.flux_Wb, c.share);
        CHECK_RELATIVE(s.torque_Nm, a.torque_Nm, 2.0 * c.share);
        CHECK_NEAR(std::abs(s.current - a.current), 0.0, c.share * a.current_A);
        std::printf("     dead time %.0f us: current %+.3f %%, flux %+.3f %%, torque %+.3f %%\n",
                    1e6 * c.dead_time_s, 100 * (s.current_A / a.current_A - 1),
                    100 * (s.flux_Wb / a.flux_Wb - 1), 100 * (s.torque_Nm / a.torque_Nm - 1));
    }
    // The test would notice a missing dead time: it costs a good part of the current here.
    const Steady with = run_open_loop(InverterModel::averaged, 3e-6, 1.5);
    const Steady without = run_open_loop(InverterModel::averaged, 0.0, 0.0);
    CHECK(with.current_A < 0.95 * without.current_A);
}

} // namespace

int main()
{
    return check::run({
        {"means over a period are those of the dead-time formula",
         means_over_a_period_are_those_of_the_dead_time_formula},
        {"at zero current the dead time takes nothing",
         at_zero_current_the_dead_time_takes_nothing},
        {"a leg loses the drop of whichever device conducts",
         a_leg_loses_the_drop_of_whichever_device_conducts},
        {"a leg's capacitance gives back part of the dead time",
         a_leg_capacitance_gives_back_part_of_the_dead_time},
        {"pulses are centred between the crests", pulses_are_centred_between_the_crests},
        {"the dead time follows each command", the_dead_time_follows_each_command},
        {"full duty switches only once", full_duty_switches_only_once},
        {"blocked legs start with a dead time", blocked_legs_start_with_a_dead_time},
        {"senseless duties stay within the rails", senseless_duties_stay_within_the_rails},
        {"impossible inverters are refused", impossible_inverters_are_refused},
        {"switched and averaged agree", switched_and_averaged_agree},
    });
}
