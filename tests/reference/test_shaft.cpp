// Friction against closed forms: uniform deceleration, sticking, breaking away, sliding back.
#include "check.hpp"
#include "load.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

using zh::Mechanics;
using zh::Shaft;

namespace {

constexpr Mechanics rig{0.0371, 0.45, 0.67, 0.0};
constexpr double h_s = 100e-6;

// The shaft alone: what the motor does between begin and settle, for a constant torque.
double turn(Shaft &shaft, double omega, double torque_Nm, double load_Nm, long steps)
{
    for (long k = 0; k < steps; ++k) {
        const zh::ShaftDrive drive = shaft.begin(omega, torque_Nm, load_Nm);
        const double before = omega;
        omega +=
            h_s * drive.inv_J_per_kg_m2 * (torque_Nm + drive.torque_Nm - drive.viscous_Nms * omega);
        if (shaft.reversed(omega)) {
            omega = shaft.settle(before, omega, torque_Nm, load_Nm, h_s);
        }
    }
    return omega;
}

bool exactly_zero(double x)
{
    return !(x > 0.0) && !(x < 0.0);
}

void it_sticks_below_static_friction()
{
    for (const double sign : {1.0, -1.0}) {
        Shaft shaft(rig);
        CHECK(exactly_zero(turn(shaft, 0.0, sign * 0.669, 0.0, 100000)));
        CHECK(exactly_zero(turn(shaft, 0.0, 0.0, sign * 0.669, 1000)));
        CHECK(exactly_zero(turn(shaft, 0.0, sign * 5.0, sign * 4.34, 1000)));
        CHECK(shaft.stuck());
    }
}

void it_breaks_away_above_and_then_slides()
{
    for (const double sign : {1.0, -1.0}) {
        Shaft shaft(rig);
        const double omega = turn(shaft, 0.0, sign * 0.671, 0.0, 10000);
        CHECK_RELATIVE(omega, sign * (0.671 - 0.45) / rig.J_kg_m2 * 1.0, 1e-9);
        CHECK(!shaft.stuck());
        // Once it slides, torques between the two keep it going.
        CHECK_RELATIVE(turn(shaft, omega, sign * 0.5, 0.0, 10000),
                       omega + sign * 0.05 / rig.J_kg_m2, 1e-9);
    }
}

void it_coasts_to_a_stop_at_the_right_time_and_stays()
{
    for (const double sign : {1.0, -1.0}) {
        Shaft shaft(rig);
        const double start = sign * 10.0;
        const double stop_s = 10.0 * rig.J_kg_m2 / rig.coulomb_Nm;
        const auto steps = static_cast<long>(stop_s / h_s);
        const double just_before = turn(shaft, start, 0.0, 0.0, steps - 2);
        CHECK(sign * just_before > 0.0);
        CHECK(sign * just_before < 3.5 * h_s * rig.coulomb_Nm / rig.J_kg_m2);
        CHECK(exactly_zero(turn(shaft, just_before, 0.0, 0.0, 4)));
        CHECK(shaft.stuck());
        CHECK(exactly_zero(turn(shaft, 0.0, 0.0, 0.0, 100000)));
    }
}

// A load between sliding and static friction stops the shaft and cannot start it again.
void it_stops_and_stays_under_a_load_that_static_friction_holds()
{
    for (const double sign : {1.0, -1.0}) {
        Shaft shaft(rig);
        CHECK(exactly_zero(turn(shaft, sign * 5.0, 0.0, sign * 0.55, 20000)));
        CHECK(shaft.stuck());
    }
}

// A load above static friction stops the shaft and turns it back; in between friction reverses.
void it_passes_through_zero_when_friction_cannot_hold()
{
    for (const double sign : {1.0, -1.0}) {
        Shaft shaft(rig);
        const double load = sign * 2.0;
        const double stop_s = 5.0 * rig.J_kg_m2 / (2.0 + 0.45);
        const double total_s = 1.0;
        const double truth = -sign * (total_s - stop_s) * (2.0 - 0.45) / rig.J_kg_m2;
        CHECK_RELATIVE(turn(shaft, sign * 5.0, 0.0, load, 10000), truth, 1e-9);
    }
}

void viscous_drag_is_exponential()
{
    Shaft shaft({0.02, 0.0, 0.0, 0.05});
    const double omega = turn(shaft, 100.0, 0.0, 0.0, 4000);
    CHECK_RELATIVE(omega, 100.0 * std::exp(-0.4 * 0.05 / 0.02), 1e-3); // Euler in this test
    Shaft ideal({0.02, 0.0, 0.0, 0.0});
    CHECK_RELATIVE(turn(ideal, 0.0, 1e-6, 0.0, 1000), 1e-6 / 0.02 * 0.1, 1e-9);
}

void a_load_follows_its_law()
{
    const zh::LoadLaw linear{1, 20.0, 0.0, 0.0};
    CHECK_NEAR(linear.torque_Nm(8.0, 10.0, 0.0), 4.0, 1e-12);
    CHECK_NEAR(linear.torque_Nm(8.0, -10.0, 0.0), -4.0, 1e-12);
    const zh::LoadLaw square{2, 20.0, 0.0, 0.0};
    CHECK_NEAR(square.torque_Nm(8.0, 10.0, 0.0), 2.0, 1e-12);
    CHECK_NEAR(square.torque_Nm(8.0, -10.0, 0.0), -2.0, 1e-12);
    const zh::LoadLaw pulsating{0, 1.0, 0.25, 5.0};
    CHECK_NEAR(pulsating.torque_Nm(8.0, 3.0, 0.05), 10.0, 1e-12);
    CHECK_NEAR(pulsating.torque_Nm(8.0, 3.0, 0.15), 6.0, 1e-12);
    CHECK(zh::LoadLaw{}.constant() && !linear.constant() && !pulsating.constant());
}

// The motor held, the second mass swings at sqrt(k/J) = 20 rad/s for a minute.
void a_second_mass_swings_at_its_resonance_and_loses_nothing()
{
    zh::ElasticLoad load({.load_J_kg_m2 = 0.05, .stiffness_Nm = 20.0});
    load.turn_with(1.0);
    double largest = 0.0;
    int turns = 0;
    double before = load.omega_rad_s();
    for (long k = 0; k < 300000; ++k) {
        load.advance(0.0, 0.0, 200e-6);
        const double omega = load.omega_rad_s();
        turns += before < 0.0 && omega >= 0.0;
        largest = k > 290000 ? std::max(largest, omega) : largest;
        before = omega;
    }
    CHECK_NEAR(turns, 60.0 * 20.0 / (2.0 * std::numbers::pi), 1.0);
    CHECK_RELATIVE(largest, 1.0, 2e-3);
    // Damping .4 Nm s: exp(-d/(2 J) t) = exp(-4 t).
    zh::ElasticLoad damped({.load_J_kg_m2 = 0.05, .stiffness_Nm = 20.0, .damping_Nms = 0.4});
    damped.turn_with(1.0);
    for (long k = 0; k < 10000; ++k) {
        damped.advance(0.0, 0.0, 200e-6);
    }
    CHECK(std::abs(damped.omega_rad_s()) < 2.0 * std::exp(-8.0));
}

void a_second_mass_needs_a_coupling()
{
    const auto refused = [](Mechanics m) {
        return !check::message_of<std::invalid_argument>([&] { zh::ElasticLoad load(m); }).empty();
    };
    CHECK(refused({.load_J_kg_m2 = 0.05}));
    CHECK(refused({.load_J_kg_m2 = -0.05, .stiffness_Nm = 20.0}));
    CHECK(refused({.load_J_kg_m2 = 0.05, .stiffness_Nm = 20.0, .damping_Nms = -1.0}));
    CHECK(!refused({}));
}

void senseless_mechanics_are_refused()
{
    const auto refused = [](const Mechanics &m) {
        return !check::message_of<std::invalid_argument>([&] { Shaft shaft(m); }).empty();
    };
    CHECK(refused({0.0, 0.0, 0.0, 0.0}));
    CHECK(refused({0.02, 0.5, 0.4, 0.0}));
    CHECK(refused({0.02, -0.1, 0.4, 0.0}));
    CHECK(refused({0.02, 0.1, 0.4, std::nan("")}));
    CHECK(!refused(rig));
}

// What the load's servo goes by: 2.5 turns forward, one back; none without a flux.
void the_turns_of_a_flux_are_counted_either_way()
{
    zh::FluxTurns turns;
    const auto at = [](double turned) {
        const double angle = 2.0 * std::numbers::pi * turned;
        return zh::Vec{0.4 * std::cos(angle), 0.4 * std::sin(angle)};
    };
    turns.start(at(0.3));
    for (int k = 1; k <= 2500; ++k) {
        turns.follow(at(0.3 + 0.001 * k));
    }
    CHECK_RELATIVE(turns.turns(), 2.5, 1e-9);
    for (int k = 1; k <= 1000; ++k) {
        turns.follow(at(2.8 - 0.001 * k));
    }
    CHECK_RELATIVE(turns.turns(), 1.5, 1e-9);
    turns.follow({0.0, 0.0});
    turns.follow(at(0.0));
    CHECK_RELATIVE(turns.turns(), 1.5, 1e-9);
}

} // namespace

int main()
{
    return check::run({
        {"it sticks below static friction", it_sticks_below_static_friction},
        {"it breaks away above, and then slides", it_breaks_away_above_and_then_slides},
        {"it coasts to a stop at the right time and stays",
         it_coasts_to_a_stop_at_the_right_time_and_stays},
        {"it stops and stays under a load that static friction holds",
         it_stops_and_stays_under_a_load_that_static_friction_holds},
        {"it passes through zero when friction cannot hold",
         it_passes_through_zero_when_friction_cannot_hold},
        {"viscous drag is exponential", viscous_drag_is_exponential},
        {"a load follows its law", a_load_follows_its_law},
        {"a second mass swings at its resonance and loses nothing",
         a_second_mass_swings_at_its_resonance_and_loses_nothing},
        {"the turns of a flux are counted either way", the_turns_of_a_flux_are_counted_either_way},
        {"a second mass needs a coupling", a_second_mass_needs_a_coupling},
        {"senseless mechanics are refused", senseless_mechanics_are_refused},
    });
}
