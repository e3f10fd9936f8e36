// The assembled plant: timing, steady state through the words, blocked gates, disturbances.
#include "check.hpp"
#include "machines.hpp"
#include "plant.hpp"

#include <algorithm>
#include <numbers>

using namespace machines;
using zh::Board;
using zh::Disturbances;
using zh::Phases;
using zh::Plant;
using zh::Profile;
using zh::Rig;
using zh::Truth;
using zh::Words;

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr zh::Duty half{0.5, 0.5, 0.5};

Rig ideal()
{
    Rig rig;
    rig.motor = table1();
    return rig;
}

double amps(int code)
{
    return (code - 8192) * 25.0 / 8192;
}

zh::Duty duty_of(Complex u_over_udc)
{
    const Phases v = zh::phases_from_vec(as_vec(u_over_udc));
    return {0.5 + v[0], 0.5 + v[1], 0.5 + v[2]};
}

// Everything in the chain, duty to words, against the equivalent circuit: 25 Hz, 20 % slip. The
// duty is held for a period, which takes (w T/2)^2/6 = 4e-5 of the fundamental.
void the_words_show_the_steady_state_of_the_circuit()
{
    for (const auto model : {zh::InverterModel::averaged, zh::InverterModel::switched}) {
        Rig rig = ideal();
        rig.motor = four_kw();
        rig.mechanics.J_kg_m2 = 1e4;
        rig.inverter.model = model;
        const double omega = two_pi * 25.0;
        constexpr double slip = 0.2;
        constexpr double u_V = 80.0;
        const Circuit truth = circuit(rig.motor, rig.motor.M_H, u_V, omega, slip);
        Plant plant(rig, Board{}, {}, 1);
        plant.set_state({{}, {}, (1.0 - slip) * omega / 2.0});
        constexpr long settle = 10000;
        constexpr long count = 2000;
        Complex current = 0.0, line = 0.0;
        double torque = 0.0;
        for (long k = 0; k < settle + count; ++k) {
            const double angle = std::fmod(omega * static_cast<double>(k) * 200e-6, two_pi);
            if (k >= settle) {
                const Words w = plant.sample();
                const zh::Vec i = zh::vec_from_phases({amps(w.i_u), amps(w.i_v), amps(w.i_w)});
                current += as_complex(i) * std::polar(1.0 / count, -angle);
                line += (w.u_uv - 8192) * 400.0 / 8192 * std::polar(2.0 / count, -angle);
                torque += plant.truth().torque_Nm / count;
            }
            // The middle of the interval carries the phase of the fundamental.
            plant.advance(duty_of(std::polar(u_V / 283.0, angle + 0.5 * omega * 200e-6)), true);
        }
        CHECK_NEAR(std::abs(current - truth.i_s), 0.0, 1e-3 * std::abs(truth.i_s));
        CHECK_RELATIVE(torque, truth.torque_Nm, 1e-3);
        // u_uv = u_u - u_v has sqrt2 the vector's length and leads it by 30 degrees; then the
        // filter.
        const Complex s(0.0, 25.0 / 800.0);
        const Complex expected = std::polar(std::sqrt(2.0) * u_V, std::numbers::pi / 6.0) /
                                 (s * s + std::numbers::sqrt2 * s + 1.0);
        // Switched, a crest sample also sees the filtered pulses (tested by themselves below).
        const double share = model == zh::InverterModel::averaged ? 1e-3 : 1e-2;
        CHECK_NEAR(std::abs(line - expected), 0.0, share * std::abs(expected));
    }
}

// Filtered pulses at a crest, from the step response of the filter and the switching instants by
// hand: duties .6 and .5 put u_uv = 283 V on 40..50 us and 150..160 us of every period.
void the_filter_sees_the_pulses()
{
    Rig rig = ideal();
    rig.inverter.model = zh::InverterModel::switched;
    Plant plant(rig, Board{}, {}, 1);
    const auto step_response = [](double t_s) {
        const double a = two_pi * 800.0 * std::sqrt(0.5);
        return 1.0 - std::exp(-a * t_s) * (std::cos(a * t_s) + std::sin(a * t_s));
    };
    for (int k = 1; k <= 30; ++k) {
        plant.advance({0.6, 0.5, 0.4}, true);
        double truth_V = 0.0;
        for (int n = 0; n < k; ++n) {
            const double age_s = (k - n) * 200e-6;
            truth_V += 283.0 * (step_response(age_s - 40e-6) - step_response(age_s - 50e-6) +
                                step_response(age_s - 150e-6) - step_response(age_s - 160e-6));
        }
        CHECK_NEAR((plant.sample().u_uv - 8192) * 400.0 / 8192, truth_V, 0.51 * 400.0 / 8192);
    }
}

// A phase voltage positive for u drives current out of the inverter: words above the middle.
void signs_are_positive_into_the_motor()
{
    Plant plant(ideal(), Board{}, {}, 1);
    for (int k = 0; k < 10; ++k) {
        plant.advance({0.6, 0.45, 0.45}, true);
    }
    const Words w = plant.sample();
    CHECK(w.i_u > 8300 && w.i_v < 8100 && w.i_w < 8100);
    CHECK(w.u_uv > 8700 && std::abs(int{w.u_vw} - 8192) <= 1);
    Plant other(ideal(), Board{}, {}, 1);
    for (int k = 0; k < 10; ++k) {
        other.advance({0.45, 0.6, 0.45}, true);
    }
    CHECK(other.sample().u_uv < 7700 && other.sample().u_vw > 8700);
    CHECK_NEAR(plant.truth().u_s_V.alpha, zh::sqrt_2_3 * 283.0 * 0.15, 1e-9);
}

void a_sample_knows_nothing_of_the_coming_duty()
{
    Plant a(ideal(), Board{}, {}, 1);
    Plant b(ideal(), Board{}, {}, 1);
    a.advance({0.7, 0.4, 0.4}, true);
    b.advance({0.7, 0.4, 0.4}, true);
    CHECK(a.sample().i_u == b.sample().i_u);
    a.advance({0.9, 0.1, 0.1}, true);
    b.advance({0.1, 0.9, 0.9}, true);
    CHECK(a.sample().i_u != b.sample().i_u);
    CHECK_NEAR(a.time_s(), 400e-6, 1e-15);
}

void the_timer_delays_duties_by_one_period()
{
    zh::PreloadedTimer timer;
    CHECK(timer.exchange({0.1, 0.2, 0.3}) == half);
    CHECK((timer.exchange({0.4, 0.5, 0.6}) == zh::Duty{0.1, 0.2, 0.3}));
    CHECK((timer.exchange({0.7, 0.8, 0.9}) == zh::Duty{0.4, 0.5, 0.6}));
    zh::PreloadedTimer slow(2);
    CHECK(slow.exchange({0.1, 0.2, 0.3}) == half);
    CHECK(slow.exchange({0.4, 0.5, 0.6}) == half);
    CHECK((slow.exchange({0.7, 0.8, 0.9}) == zh::Duty{0.1, 0.2, 0.3}));
    CHECK((slow.exchange(half) == zh::Duty{0.4, 0.5, 0.6}));
}

// Substeps look at the dead time's current at each start: of first order where that acts, while an
// ideal inverter leaves nothing but the integrator. Both methods, both inverters, one motion.
void finer_steps_converge_to_one_motion()
{
    const auto end_of = [](const Rig &rig) {
        Plant plant(rig, Board{}, {}, 1);
        for (int k = 0; k < 1500; ++k) {
            plant.advance(duty_of(std::polar(0.12, 60.0 * k * 200e-6)), true);
        }
        return plant.state();
    };
    const auto distance = [](const zh::MotorState &a, const zh::MotorState &b) {
        return std::hypot(zh::magnitude(a.psi_s_Wb - b.psi_s_Wb),
                          zh::magnitude(a.psi_r_Wb - b.psi_r_Wb),
                          0.01 * (a.omega_m_rad_s - b.omega_m_rad_s));
    };
    for (const auto model : {zh::InverterModel::averaged, zh::InverterModel::switched}) {
        Rig rig = ideal();
        rig.inverter.model = model;
        rig.inverter.dead_time_s = model == zh::InverterModel::averaged ? 3e-6 : 0.0;
        rig.inverter.i_threshold_A = 0.5;
        rig.motor.iron_loss_ohm = 400.0;
        const auto stepped = [&](int substeps, zh::IntegrationMethod method) {
            Rig finer = rig;
            finer.integration = {method, substeps};
            return end_of(finer);
        };
        const zh::MotorState truth = stepped(256, zh::IntegrationMethod::rk4);
        const double coarse = distance(stepped(8, zh::IntegrationMethod::rk4), truth);
        const double finer = distance(stepped(32, zh::IntegrationMethod::rk4), truth);
        const double heun = distance(stepped(32, zh::IntegrationMethod::heun), truth);
        const double usual = distance(end_of(rig), truth);
        if (model == zh::InverterModel::averaged) {
            // First order against 256 steps: (1/8 - 1/256) / (1/32 - 1/256) = 4.4.
            CHECK_NEAR(coarse / finer, 4.4, 0.3);
            CHECK_NEAR(heun / finer, 1.0, 0.05);
            CHECK(usual < coarse); // the current expected in the middle of the period
        } else {
            CHECK(finer < 1e-12 && usual < 1e-9);
            CHECK(heun < 1e-7 && heun > 1e3 * finer);
        }
    }
}

// Nothing happens at rest with the gates off, but for the ADC's zero.
void at_rest_it_rests()
{
    Plant plant(ideal(), Board{}, {}, 1);
    for (int k = 0; k < 1000; ++k) {
        const Words w = plant.sample();
        CHECK(w.i_u == 8192 && w.i_v == 8192 && w.u_uv == 8192 && w.u_dc == 11592);
        plant.advance({0.9, 0.1, 0.5}, false);
    }
    CHECK_NEAR(zh::magnitude(plant.truth().psi_s_Wb), 0.0, 0.0);
}

Plant with_current(zh::InverterModel model, const zh::MotorParameters &motor, double angle)
{
    Rig rig = ideal();
    rig.motor = motor;
    rig.inverter.model = model;
    rig.inverter.drop_V = 1.5;
    rig.mechanics.J_kg_m2 = 1e4;
    Plant plant(rig, Board{}, {}, 1);
    plant.set_state({{}, {}, 60.0});
    const double omega = 125.0;
    for (int k = 0; k < 3000; ++k) {
        plant.advance(duty_of(std::polar(0.25, angle + omega * k * 200e-6)), true);
    }
    return plant;
}

void blocked_gates_extinguish_the_currents()
{
    const auto motors = {table1(), four_kw(), saturated(four_kw(), 0.9, 4)};
    for (const auto &motor : motors) {
        for (const auto model : {zh::InverterModel::averaged, zh::InverterModel::switched}) {
            for (int phase = 0; phase < 12; ++phase) {
                Plant plant = with_current(model, motor, phase * two_pi / 12.0);
                double last = zh::magnitude(plant.truth().i_s_A);
                CHECK(last > 2.0);
                const double flux = zh::magnitude(plant.truth().psi_r_Wb);
                for (int k = 0; k < 50; ++k) {
                    plant.advance(half, false);
                    const double now = zh::magnitude(plant.truth().i_s_A);
                    CHECK(now <= last + 1e-12);
                    last = now;
                }
                CHECK_NEAR(last, 0.0, 1e-9);
                CHECK(zh::magnitude(plant.truth().psi_r_Wb) > 0.9 * flux);
                for (int k = 0; k < 1000; ++k) {
                    plant.advance(half, false);
                }
                CHECK_NEAR(zh::magnitude(plant.truth().i_s_A), 0.0, 1e-9);
            }
        }
    }
}

// The diode bridge against its closed form: rotor without flux and at rest, current in one axis;
// three phases conduct against -2/3, 1/3, 1/3 of the dc link until all vanish together.
void blocked_current_falls_as_the_dc_link_drives_it()
{
    Rig rig = ideal();
    rig.mechanics.static_Nm = 100.0;
    Plant plant(rig, Board{}, {}, 1);
    const zh::InductionMotor motor(rig.motor);
    const double start_A = 10.0; // alpha; phase u carries sqrt(2/3) of it
    plant.set_state({motor.stator_flux({}, {start_A, 0.0}), {}, 0.0});
    plant.advance(half, false);
    // The rotor flux hardly builds up in one period, so Rs + Rr and sigma Ls = 8 mH make the curve.
    const double final_A = -zh::sqrt_2_3 * 283.0 / (0.93 + 0.50);
    const double decay = std::exp(-(0.93 + 0.50) / 8e-3 * 200e-6);
    CHECK_NEAR(plant.truth().i_s_A.alpha, final_A + (start_A - final_A) * decay, 0.02);
    plant.advance(half, false);
    plant.advance(half, false);
    CHECK_NEAR(plant.truth().i_s_A.alpha, 0.0, 1e-12);
}

// Gates on again, without current: for the dead time the legs float together, then the duty counts.
void gates_come_back_after_a_dead_time()
{
    Rig rig = ideal();
    rig.inverter.model = zh::InverterModel::switched;
    rig.inverter.dead_time_s = 3e-6;
    Plant plant(rig, Board{}, {}, 1);
    constexpr zh::Duty full{1.0, 0.0, 0.0};
    plant.advance(full, true);
    plant.advance(full, false);
    plant.set_state({});
    plant.advance(full, false);
    plant.advance(full, true);
    CHECK_NEAR(plant.truth().u_s_V.alpha, zh::sqrt_2_3 * 283.0 * (1.0 - 3.0 / 200.0), 1e-9);
    plant.advance(full, true);
    CHECK_NEAR(plant.truth().u_s_V.alpha, zh::sqrt_2_3 * 283.0, 1e-9);
}

// With no current in u and some from v to w, the open terminal u floats on its EMF.
void an_open_phase_floats_on_its_emf()
{
    Rig rig = ideal();
    rig.mechanics.J_kg_m2 = 1e5;
    Plant plant(rig, Board{}, {}, 1);
    const zh::InductionMotor motor(rig.motor);
    const zh::Vec psi_r{0.0, -0.4}; // at 80 rad/s electrical: 32 V on alpha
    plant.set_state({motor.stator_flux(psi_r, {0.0, 10.0}), psi_r, 40.0});
    plant.advance(half, false);
    const Truth t = plant.truth();
    CHECK_NEAR(t.u_s_V.alpha, 32.0, 0.4);
    CHECK_NEAR(t.u_s_V.beta, -zh::inv_sqrt2 * 283.0, 1e-9);
    CHECK_NEAR(t.i_A[0], 0.0, 1e-12);
    CHECK(t.i_s_A.beta > 2.0);
}

// The flux that is left decays with tau and induces a line voltage that the sensors see.
void the_blocked_machine_shows_its_decaying_emf()
{
    Rig rig = ideal();
    rig.mechanics.J_kg_m2 = 1e5;
    Plant plant(rig, Board{}, {}, 1);
    const double tau = rig.motor.Lr_H / rig.motor.Rr_ohm;
    const zh::InductionMotor motor(rig.motor);
    plant.set_state({motor.stator_flux({0.4, 0.0}, {}), {0.4, 0.0}, 40.0});
    for (int k = 0; k < 1000; ++k) {
        plant.advance(half, false);
    }
    const Truth t = plant.truth();
    CHECK_RELATIVE(zh::magnitude(t.psi_r_Wb), 0.4 * std::exp(-0.2 / tau), 1e-6);
    CHECK_RELATIVE(zh::magnitude(t.u_s_V), 0.4 * std::exp(-0.2 / tau) * std::hypot(80.0, 1.0 / tau),
                   1e-3);
    // d/dt psi_s for an exponential of s = -1/tau + j w, through the filter, phase by phase.
    const Complex s(-1.0 / tau, 80.0);
    const Complex x = s / (two_pi * 800.0);
    const Complex u = s * 0.4 * std::exp(s * t.t_s) / (x * x + std::numbers::sqrt2 * x + 1.0);
    const Phases phases = zh::phases_from_vec(as_vec(u));
    const Words w = plant.sample();
    CHECK(std::abs(phases[0] - phases[1]) > 5.0);
    CHECK_NEAR((w.u_uv - 8192) * 400.0 / 8192, phases[0] - phases[1], 0.1);
    CHECK_NEAR((w.u_vw - 8192) * 400.0 / 8192, phases[1] - phases[2], 0.1);
}

// An EMF above the dc link charges it through the diodes: the machine brakes, and nothing runs
// away.
void overspeed_feeds_the_dc_link()
{
    Rig rig = ideal();
    rig.mechanics.J_kg_m2 = 1e4;
    Plant plant(rig, Board{}, {}, 1);
    const zh::InductionMotor motor(rig.motor);
    plant.set_state({motor.stator_flux({0.5, 0.0}, {}), {0.5, 0.0}, 400.0});
    double least_Nm = 0.0, most_A = 0.0;
    for (int k = 0; k < 500; ++k) {
        plant.advance(half, false);
        least_Nm = std::min(least_Nm, plant.truth().torque_Nm);
        most_A = std::max(most_A, zh::magnitude(plant.truth().i_s_A));
    }
    CHECK(least_Nm < -1.0);
    CHECK(most_A > 2.0 && most_A < 100.0);
    CHECK(!plant.diverged());
}

// At no load and 111 Hz the link pays for what Rs turns into heat, 5 W of 400 VA; whole steps and
// finer ones.
void the_dc_link_pays_for_the_heat_alone()
{
    for (const double threshold_A : {0.3, 0.03}) {
        Rig rig = ideal();
        rig.inverter.i_threshold_A = threshold_A;
        rig.mechanics.J_kg_m2 = 1e6;
        rig.dc_link.capacitance_F = 1.0;
        Disturbances mains;
        mains.u_dc_V = Profile(0.0);
        Plant plant(rig, Board{}, mains, 1);
        const double omega = 700.0;
        plant.set_state({{}, {}, omega / 2.0});
        double heat_J = 0.0, before_V = 0.0;
        for (long k = 0; k < 22000; ++k) {
            const Truth t = plant.truth();
            const double angle = std::fmod(omega * static_cast<double>(k) * 200e-6, two_pi);
            if (k == 20000) {
                before_V = t.u_dc_V;
                heat_J = 0.0;
            }
            heat_J += 200e-6 * rig.motor.Rs_ohm * zh::dot(t.i_s_A, t.i_s_A);
            plant.advance(duty_of(std::polar(180.0 / t.u_dc_V, angle + 0.5 * omega * 200e-6)),
                          true);
        }
        const double after_V = plant.truth().u_dc_V;
        CHECK_RELATIVE(0.5 * (before_V * before_V - after_V * after_V), heat_J, 0.1);
    }
}

void load_and_friction_act_on_the_shaft()
{
    Rig rig = ideal();
    rig.mechanics = {0.02, 0.3, 0.5, 0.0};
    Disturbances disturbances;
    disturbances.load_torque_Nm = Profile({{0.0, 0.0}, {0.1, 0.0}, {0.2, 1.0}});
    Plant plant(rig, Board{}, disturbances, 1);
    // The ramp passes .5 Nm static friction at .15 s; a positive load drives backwards.
    while (plant.time_s() < 0.1498) {
        plant.advance(half, false);
    }
    CHECK(plant.shaft_stuck());
    CHECK_NEAR(plant.truth().load_torque_Nm, 10.0 * (plant.time_s() - 100e-6 - 0.1), 1e-9);
    while (plant.time_s() < 0.29995) {
        plant.advance(half, false);
    }
    CHECK(!plant.shaft_stuck());
    // integral of (T - .3)/J from .15 s to .3 s: ramp .5 -> 1, then 1.
    const double truth = -((0.75 - 0.3) * 0.05 + 0.7 * 0.1) / 0.02;
    CHECK_RELATIVE(plant.truth().omega_m_rad_s, truth, 2e-3);
    CHECK_NEAR(plant.truth().load_torque_Nm, 1.0, 1e-12);
}

void resistance_and_dc_link_follow_their_profiles()
{
    Disturbances disturbances;
    disturbances.rs_factor = Profile({{0.0, 1.0}, {4.0, 1.0}, {4.0, 2.0}});
    disturbances.u_dc_V = Profile({{0.0, 283.0}, {8.0, 283.0}, {8.0, 200.0}});
    Rig rig = ideal();
    rig.mechanics.static_Nm = 100.0;
    Plant plant(rig, Board{}, disturbances, 1);
    const auto settled_A = [&](double until_s) {
        while (plant.time_s() < until_s) {
            plant.advance({0.5 + 0.01, 0.5 - 0.005, 0.5 - 0.005}, true);
        }
        return plant.truth().i_A[0];
    };
    CHECK_RELATIVE(settled_A(4.0), 283.0 * 0.01 / 0.93, 1e-3);
    CHECK_RELATIVE(settled_A(8.0), 283.0 * 0.01 / 1.86, 1e-3);
    CHECK_RELATIVE(settled_A(12.0), 200.0 * 0.01 / 1.86, 1e-3);
    CHECK(plant.sample().u_dc == 8192);
}

// A rotor whose resistance is 1.5 times the rig's, by its profile or by its rig.
void the_rotor_heats_by_its_profile()
{
    for (const double iron_ohm : {0.0, 500.0}) {
        Rig rig = ideal();
        rig.motor.iron_loss_ohm = iron_ohm;
        Rig hot = rig;
        hot.motor.Rr_ohm = 1.5 * rig.motor.Rr_ohm;
        Disturbances heated;
        heated.rr_factor = Profile({{0.0, 1.0}, {0.0, 1.5}, {9.0, 1.5}});
        Plant a(rig, Board{}, heated, 1);
        Plant b(hot, Board{}, {}, 1);
        for (int k = 0; k < 500; ++k) {
            const double angle = 0.05 * k;
            const zh::Duty duty{0.5 + 0.2 * std::sin(angle), 0.5 + 0.2 * std::sin(angle - 2.0944),
                                0.5 + 0.2 * std::sin(angle + 2.0944)};
            a.advance(duty, true);
            b.advance(duty, true);
        }
        CHECK(b.truth().torque_Nm > 0.01);
        CHECK_NEAR(a.truth().torque_Nm, b.truth().torque_Nm, 1e-12);
        CHECK_NEAR(a.truth().omega_m_rad_s, b.truth().omega_m_rad_s, 1e-12);
    }
}

void the_source_of_the_dc_link_ripples()
{
    Rig rig = ideal();
    rig.dc_link.ripple_pu = 0.05;
    rig.dc_link.ripple_Hz = 100.0;
    Plant plant(rig, Board{}, {}, 1);
    double lowest = 1e9, highest = 0.0, mean = 0.0;
    for (int k = 0; k < 500; ++k) {
        plant.advance({0.5, 0.5, 0.5}, false);
        lowest = std::min(lowest, plant.truth().u_dc_V);
        highest = std::max(highest, plant.truth().u_dc_V);
        mean += plant.truth().u_dc_V / 500.0;
    }
    CHECK_RELATIVE(highest, 283.0 * 1.05, 1e-3);
    CHECK_RELATIVE(lowest, 283.0 * 0.95, 1e-3);
    CHECK_RELATIVE(mean, 283.0, 1e-9);
}

// No flux, gates off: the load alone brakes, exp(-T t / (w_ref J)).
void a_load_in_proportion_to_speed_brakes_exponentially()
{
    Rig rig = ideal();
    Disturbances disturbances;
    disturbances.load_torque_Nm = Profile(0.5);
    disturbances.load.exponent = 1;
    disturbances.load.reference_rad_s = 100.0;
    disturbances.initial_speed_rpm = 1000.0;
    Plant plant(rig, Board{}, disturbances, 1);
    const double start = plant.truth().omega_m_rad_s;
    while (plant.time_s() < 2.0) {
        plant.advance({0.5, 0.5, 0.5}, false);
    }
    CHECK_RELATIVE(plant.truth().omega_m_rad_s,
                   start * std::exp(-0.5 / 100.0 / rig.mechanics.J_kg_m2 * 2.0), 1e-3);
    CHECK_RELATIVE(plant.truth().load_torque_Nm, 0.5 * plant.truth().omega_m_rad_s / 100.0, 1e-3);
}

// Both masses together take the load's torque; the truth shows the load, not the coupling.
void a_second_mass_shares_the_load()
{
    Rig rig = ideal();
    rig.mechanics.load_J_kg_m2 = 3.0 * rig.mechanics.J_kg_m2;
    rig.mechanics.stiffness_Nm = 50.0;
    rig.mechanics.damping_Nms = 0.3;
    Disturbances disturbances;
    disturbances.load_torque_Nm = Profile(-0.6);
    Plant plant(rig, Board{}, disturbances, 1);
    while (plant.time_s() < 3.0) {
        plant.advance({0.5, 0.5, 0.5}, false);
    }
    CHECK_RELATIVE(plant.truth().omega_m_rad_s, 0.6 * 3.0 / (4.0 * rig.mechanics.J_kg_m2), 2e-3);
    CHECK_NEAR(plant.truth().load_torque_Nm, -0.6, 1e-12);
}

void runs_repeat_and_seeds_differ()
{
    Rig rig = ideal();
    rig.sensors.current_noise_A = 0.02;
    Plant a(rig, Board{}, {}, 5);
    Plant b(rig, Board{}, {}, 5);
    Plant c(rig, Board{}, {}, 6);
    int different = 0;
    for (int k = 0; k < 1000; ++k) {
        const Words x = a.sample();
        const Words y = b.sample();
        CHECK(x.i_u == y.i_u && x.i_v == y.i_v && x.u_uv == y.u_uv);
        different += x.i_u != c.sample().i_u;
        for (Plant *plant : {&a, &b, &c}) {
            plant->advance({0.52, 0.49, 0.49}, true);
        }
    }
    CHECK(different > 500);
}

// Whatever the duties, the state stays finite or is declared lost, and the words stay words.
void senseless_duties_do_no_harm()
{
    zh::NoiseSource random(9);
    for (const auto model : {zh::InverterModel::averaged, zh::InverterModel::switched}) {
        Rig rig = ideal();
        rig.inverter.model = model;
        rig.inverter.dead_time_s = 3e-6;
        Plant plant(rig, Board{}, {}, 1);
        for (int k = 0; k < 20000; ++k) {
            const auto wild = [&] {
                const auto kind = random.bits() % 16;
                return kind == 0 ? std::nan("") : kind == 1 ? INFINITY : random.gaussian();
            };
            plant.advance({wild(), wild(), wild()}, random.bits() % 8 != 0);
            CHECK(plant.sample().i_u <= 16383);
        }
        CHECK(!plant.diverged());
        CHECK(std::isfinite(plant.truth().omega_m_rad_s));
    }
    Plant lost(ideal(), Board{}, {}, 1);
    lost.set_state({{std::nan(""), 0.0}, {}, 0.0});
    lost.advance(half, true);
    CHECK(lost.diverged());
    CHECK(lost.sample().i_u == 0);
    CHECK_NEAR(lost.time_s(), 200e-6, 1e-15);
}

void misfits_of_rig_and_board_are_refused()
{
    const auto message = [](auto change) {
        Rig rig = ideal();
        rig.inverter.dead_time_s = 3e-6;
        change(rig);
        return check::message_of<zh::ConfigError>([&] { Plant plant(rig, Board{}, {}, 1); });
    };
    CHECK(message([](Rig &) {}).empty());
    CHECK(message([](Rig &r) { r.inverter.carrier_Hz = 10000.0; }).find("carrier_Hz") !=
          std::string::npos);
    CHECK(message([](Rig &r) { r.inverter.i_threshold_A = 0.01; }).find("i_threshold_A") !=
          std::string::npos);
    CHECK(message([](Rig &r) {
              r.inverter.model = zh::InverterModel::switched;
              r.inverter.i_threshold_A = 0.01;
          }).find("i_threshold_A") != std::string::npos);
}

} // namespace

int main()
{
    return check::run({
        {"the words show the steady state of the circuit",
         the_words_show_the_steady_state_of_the_circuit},
        {"the filter sees the pulses", the_filter_sees_the_pulses},
        {"signs are positive into the motor", signs_are_positive_into_the_motor},
        {"a sample knows nothing of the coming duty", a_sample_knows_nothing_of_the_coming_duty},
        {"the timer delays duties by one period", the_timer_delays_duties_by_one_period},
        {"finer steps converge to one motion", finer_steps_converge_to_one_motion},
        {"at rest it rests", at_rest_it_rests},
        {"blocked gates extinguish the currents", blocked_gates_extinguish_the_currents},
        {"blocked current falls as the dc link drives it",
         blocked_current_falls_as_the_dc_link_drives_it},
        {"gates come back after a dead time", gates_come_back_after_a_dead_time},
        {"an open phase floats on its EMF", an_open_phase_floats_on_its_emf},
        {"the blocked machine shows its decaying EMF", the_blocked_machine_shows_its_decaying_emf},
        {"overspeed feeds the dc link", overspeed_feeds_the_dc_link},
        {"the dc link pays for the heat alone", the_dc_link_pays_for_the_heat_alone},
        {"load and friction act on the shaft", load_and_friction_act_on_the_shaft},
        {"resistance and dc link follow their profiles",
         resistance_and_dc_link_follow_their_profiles},
        {"the rotor heats by its profile", the_rotor_heats_by_its_profile},
        {"the source of the dc link ripples", the_source_of_the_dc_link_ripples},
        {"a load in proportion to speed brakes exponentially",
         a_load_in_proportion_to_speed_brakes_exponentially},
        {"a second mass shares the load", a_second_mass_shares_the_load},
        {"runs repeat and seeds differ", runs_repeat_and_seeds_differ},
        {"senseless duties do no harm", senseless_duties_do_no_harm},
        {"misfits of rig and board are refused", misfits_of_rig_and_board_are_refused},
    });
}
