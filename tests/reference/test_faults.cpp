// What breaks: sensors, a phase, the insulation, the supply; and the board's comparator.
#include "check.hpp"
#include "machines.hpp"
#include "plant.hpp"

#include <algorithm>
#include <set>

using namespace machines;
using zh::Board;
using zh::Codes;
using zh::Disturbances;
using zh::Duty;
using zh::FaultySensors;
using zh::Plant;
using zh::Profile;
using zh::Rig;
using zh::SensorFault;
using zh::SensorFaultKind;
using zh::Words;

namespace {

constexpr Duty half{0.5, 0.5, 0.5};
constexpr double period_s = 200e-6;

Rig ideal()
{
    Rig rig;
    rig.motor = table1();
    return rig;
}

Board with_comparator()
{
    Board board;
    board.comparator_A = 25.0;
    return board;
}

// i_u counts up, the rest stands still; what i_u reads from the start of the fault on.
std::vector<int> faulty_words(SensorFault fault, int count)
{
    FaultySensors sensor({fault}, 14, 7);
    std::vector<int> read;
    for (int k = 0; k < count; ++k) {
        const Codes true_words{9000 + k, 8000, 7000, 6000, 5000, 4000};
        const Words w = sensor.apply(true_words, k * period_s);
        CHECK(w.i_v == 8000 && w.i_w == 7000 && w.u_uv == 6000 && w.u_vw == 5000 && w.u_dc == 4000);
        read.push_back(w.i_u);
    }
    return read;
}

SensorFault fault_of(SensorFaultKind kind, double severity)
{
    return {0, kind, severity, 9.5 * period_s, zh::never_s};
}

void every_kind_does_what_its_name_says()
{
    const auto off = faulty_words(fault_of(SensorFaultKind::off, 0.0), 30);
    const auto stuck = faulty_words(fault_of(SensorFaultKind::stuck, 0.0), 30);
    const auto gain = faulty_words(fault_of(SensorFaultKind::gain, 0.5), 30);
    const auto offset = faulty_words(fault_of(SensorFaultKind::offset, 0.1), 30);
    const auto late = faulty_words(fault_of(SensorFaultKind::delayed, 3), 30);
    const auto fixed = faulty_words(fault_of(SensorFaultKind::fixed, -0.5), 30);
    const auto drift = faulty_words(fault_of(SensorFaultKind::drift, 1.0), 30);
    for (int k = 0; k < 30; ++k) {
        const int right = 9000 + k;
        const bool broken = k >= 10;
        const auto n = static_cast<std::size_t>(k);
        CHECK(off[n] == (broken ? 8192 : right));
        CHECK(stuck[n] == (broken ? 9010 : right));
        CHECK(gain[n] == (broken ? 8192 + (right - 8192) / 2 : right));
        CHECK(offset[n] == (broken ? right + 819 : right));
        CHECK(late[n] == (broken ? right - 3 : right));
        CHECK(fixed[n] == (broken ? 4096 : right));
        // 8192 codes in a second.
        const double drifted = right + 8192.0 * (k - 9.5) * period_s;
        CHECK(drift[n] == (broken ? static_cast<int>(drifted) : right));
    }
}

void garbage_takes_any_word_and_a_loose_contact_its_share()
{
    const auto garbage = faulty_words(fault_of(SensorFaultKind::garbage, 0.0), 4010);
    const std::set<int> different(garbage.begin() + 10, garbage.end());
    CHECK(different.size() > 3000);
    CHECK(*different.begin() < 100 && *different.rbegin() > 16284 && *different.rbegin() < 16384);
    const auto loose = faulty_words(fault_of(SensorFaultKind::intermittent, 0.2), 4010);
    const auto zeros = std::count(loose.begin() + 10, loose.end(), 8192);
    CHECK_NEAR(static_cast<double>(zeros), 800.0, 80.0); // three standard deviations
    CHECK(std::count(loose.begin(), loose.begin() + 10, 8192) == 0);
}

void noise_spreads_about_the_right_word()
{
    const auto noisy = faulty_words(fault_of(SensorFaultKind::noise, 0.01), 4010);
    double square = 0.0;
    for (std::size_t n = 10; n < noisy.size(); ++n) {
        const double off = noisy[n] - (9000.0 + static_cast<double>(n));
        square += off * off / 4000.0;
    }
    CHECK_RELATIVE(std::sqrt(square), 81.92, 0.05);
}

// Two words of noise are not the same noise, and the second fault acts on what the first left.
void several_words_break_at_once()
{
    const SensorFault noise{0, SensorFaultKind::noise, 0.1, 0.0, zh::never_s};
    SensorFault other = noise;
    other.signal = 1;
    FaultySensors both({noise, other}, 14, 7);
    const Codes w{8192, 8192, 8192, 8192, 8192, 11592};
    int same = 0;
    for (int k = 0; k < 100; ++k) {
        const Words r = both.apply(w, k * period_s);
        same += r.i_u == r.i_v ? 1 : 0;
        CHECK(r.i_w == 8192 && r.u_dc == 11592);
    }
    CHECK(same < 5);
    FaultySensors chain({{0, SensorFaultKind::fixed, 0.5, 0.0, zh::never_s},
                         {0, SensorFaultKind::gain, 0.5, 0.0, zh::never_s}},
                        14, 7);
    CHECK(chain.apply(w, 0.0).i_u == 8192 + 2048);
    FaultySensors none({}, 14, 7);
    CHECK(none.apply(w, 0.0).i_u == 8192);
}

void a_fault_ends_and_the_dc_word_has_its_zero_at_zero()
{
    FaultySensors sensor({{5, SensorFaultKind::off, 0.0, 2 * period_s, 4 * period_s}}, 14, 1);
    const Codes w{8192, 8192, 8192, 8192, 8192, 11592};
    const int expected[] = {11592, 11592, 0, 0, 11592};
    for (int k = 0; k < 5; ++k) {
        CHECK(sensor.apply(w, k * period_s + 1e-9).u_dc == expected[k]);
    }
    FaultySensors high({{5, SensorFaultKind::offset, 0.9, 0.0, zh::never_s}}, 14, 1);
    CHECK(high.apply(w, 1.0).u_dc == 16383); // beyond the ADC's range it ends
}

// An amplifier that lost half its gain reaches the converter's end at twice the quantity.
void a_gain_acts_before_the_range_ends()
{
    const SensorFault weak{0, SensorFaultKind::gain, 0.5, 0.0, zh::never_s};
    FaultySensors sensor({weak, {5, SensorFaultKind::gain, 0.5, 0.0, zh::never_s}}, 14, 1);
    const Words within = sensor.apply({8192 + 12000, 0, 0, 0, 0, 30000}, 0.0);
    CHECK(within.i_u == 8192 + 6000 && within.u_dc == 15000);
    const Words beyond = sensor.apply({8192 - 20000, -1, 20000, 0, 0, 40000}, 0.0);
    CHECK(beyond.i_u == 0 && beyond.i_v == 0 && beyond.i_w == 16383 && beyond.u_dc == 16383);
}

void exchanged_sensors_change_places_with_the_next_of_their_kind()
{
    const Codes w{1, 2, 3, 4, 5, 6};
    const auto seen = [&w](std::size_t signal, double t_s) {
        FaultySensors sensor({{signal, SensorFaultKind::exchanged, 0.0, 1.0, 2.0}}, 14, 1);
        const Words r = sensor.apply(w, t_s);
        return std::vector<int>{r.i_u, r.i_v, r.i_w, r.u_uv, r.u_vw, r.u_dc};
    };
    CHECK(seen(0, 1.5) == (std::vector<int>{2, 1, 3, 4, 5, 6}));
    CHECK(seen(1, 1.5) == (std::vector<int>{1, 3, 2, 4, 5, 6}));
    CHECK(seen(2, 1.5) == (std::vector<int>{3, 2, 1, 4, 5, 6}));
    CHECK(seen(3, 1.5) == (std::vector<int>{1, 2, 3, 5, 4, 6}));
    CHECK(seen(4, 1.5) == seen(3, 1.5));
    CHECK(seen(0, 0.5) == seen(0, 2.5) && seen(0, 0.5)[0] == 1);
}

// A motor at standstill fed with direct current: v and w share what u does not carry.
void an_open_phase_carries_no_current()
{
    Disturbances what;
    what.faults.open_phase = 0;
    what.faults.open_s = 0.02;
    Plant plant(ideal(), Board{}, what, 1);
    const Duty duty{0.52, 0.5, 0.49};
    for (int k = 0; k < 100; ++k) {
        plant.advance(duty, true);
    }
    CHECK(plant.truth().i_A[0] > 1.0);
    for (int k = 0; k < 20000; ++k) {
        plant.advance(duty, true);
        const zh::Phases i = plant.truth().i_A;
        CHECK_NEAR(i[0], 0.0, 1e-9);
        CHECK_NEAR(i[1] + i[2], 0.0, 1e-9);
    }
    // At last Ohm's law along v-w: .01 of 283 V on two phases in series.
    CHECK_RELATIVE(plant.truth().i_A[1], 0.01 * 283.0 / (2.0 * 0.93), 1e-3);
}

// Closed again the current returns; in between the motor carries none and keeps its rotor flux.
void a_contactor_opens_and_closes_again()
{
    Disturbances what;
    what.faults.open_phase = zh::all_phases;
    what.faults.open_s = 0.2;
    what.faults.open_end_s = 0.25;
    Plant plant(ideal(), Board{}, what, 1);
    const Duty duty{0.52, 0.5, 0.49};
    const auto run_to = [&](double t_s) {
        while (plant.time_s() < t_s) {
            plant.advance(duty, true);
        }
    };
    run_to(0.2 - 0.5 * period_s);
    const double before_A = zh::magnitude(plant.truth().i_s_A);
    const double flux_Wb = zh::magnitude(plant.truth().psi_r_Wb);
    CHECK(before_A > 1.0);
    run_to(0.25 - 0.5 * period_s);
    CHECK_NEAR(zh::magnitude(plant.truth().i_s_A), 0.0, 1e-9);
    const double decay = std::exp(-0.05 * table1().Rr_ohm / table1().Lr_H);
    CHECK_RELATIVE(zh::magnitude(plant.truth().psi_r_Wb), flux_Wb * decay, 1e-2);
    const Words w = plant.sample(); // the sensors see the legs: .02 of 283 V between u and v
    CHECK_NEAR((w.u_uv - 8192) * 400.0 / 8192, 0.02 * 283.0, 0.1);
    run_to(0.5);
    CHECK(zh::magnitude(plant.truth().i_s_A) > 0.8 * before_A);
}

void a_phase_that_closes_again_carries_current()
{
    Disturbances what;
    what.faults.open_s = 0.0;
    what.faults.open_end_s = 0.02;
    Plant plant(ideal(), Board{}, what, 1);
    for (int k = 0; k < 200; ++k) {
        plant.advance({0.52, 0.5, 0.49}, true);
    }
    CHECK(plant.truth().i_A[0] > 1.0);
}

// 100 Nm on .015 kg m2 stop 100 rad/s within 15 ms; then nothing moves the shaft.
void a_jammed_shaft_stops_and_stays()
{
    Disturbances what;
    what.faults.jam_s = 0.01;
    what.load_torque_Nm = Profile(-20.0);
    Rig rig = ideal();
    rig.mechanics.J_kg_m2 = 0.015;
    Plant plant(rig, Board{}, what, 1);
    plant.set_state({{}, {}, 100.0});
    for (int k = 0; k < 50; ++k) {
        plant.advance(half, true);
    }
    CHECK(plant.truth().omega_m_rad_s > 100.0);
    double turned_ms = 0.0;
    for (int k = 0; k < 500; ++k) {
        plant.advance(half, true);
        turned_ms += plant.shaft_stuck() ? 0.0 : 1e3 * period_s;
    }
    CHECK(plant.shaft_stuck());
    CHECK_NEAR(plant.truth().omega_m_rad_s, 0.0, 0.0);
    CHECK(turned_ms > 15.0 && turned_ms < 30.0);
}

// 20 ohm from leg u to the middle of the link: at a crest every leg is low.
void an_earth_fault_adds_to_the_current_of_its_leg()
{
    Disturbances what;
    what.faults.earth_s = 0.0;
    what.faults.earth_ohm = 20.0;
    Plant plant(ideal(), Board{}, what, 1);
    plant.advance(half, true);
    const Words w = plant.sample();
    const double sum_A = (w.i_u + w.i_v + w.i_w - 3 * 8192) * 25.0 / 8192;
    CHECK_NEAR(sum_A, -0.5 * 283.0 / 20.0, 0.01);
    plant.advance(half, false);
    CHECK(plant.sample().i_u == 8192);
}

// Between two legs only a cable: 283 V on 20 uH are 14 A in a microsecond.
void the_comparator_ends_a_short_within_a_period()
{
    Disturbances what;
    what.faults.short_s = 10 * period_s;
    Plant plant(ideal(), with_comparator(), what, 1);
    const Duty duty{0.6, 0.5, 0.5};
    for (int k = 0; k < 10; ++k) {
        plant.advance(half, true);
    }
    CHECK(!plant.broken());
    plant.advance(duty, true);
    CHECK(plant.broken());
    const double peak_A = plant.truth().i_peak_A;
    CHECK(peak_A > 25.0 && peak_A < 25.0 + 2.0 * 283.0 / 20e-6 * 2e-6);
    CHECK(std::abs(plant.sample().i_u - 8192) < 20); // the current is gone at the crest
    plant.advance(duty, true);
    CHECK(plant.broken()); // it holds while the firmware wants the gates on
    plant.advance(duty, false);
    CHECK(!plant.broken());
}

void a_short_flows_freely_without_a_comparator()
{
    Disturbances what;
    what.faults.short_s = 0.0;
    what.faults.short_ohm = 1.0;
    Plant plant(ideal(), Board{}, what, 1);
    for (int k = 0; k < 50; ++k) {
        plant.advance({0.6, 0.5, 0.5}, true);
    }
    // The mean of the switched voltage on one ohm; at its peak more.
    CHECK(plant.truth().i_peak_A > 0.1 * 283.0);
}

// The largest voltage there is on the motor: the current passes 25 A and not much more.
void the_comparator_ends_a_current_of_the_motor()
{
    for (const double level_A : {0.0, 25.0}) {
        Board board;
        board.comparator_A = level_A;
        Plant plant(ideal(), board, {}, 1);
        double peak_A = 0.0;
        for (int k = 0; k < 20; ++k) {
            plant.advance({1.0, 0.0, 0.0}, true);
            peak_A = std::max(peak_A, plant.truth().i_peak_A);
        }
        CHECK(plant.broken() == (level_A > 0.0));
        CHECK(level_A > 0.0 ? peak_A > 25.0 && peak_A < 25.1 : peak_A > 60.0);
    }
}

// In parts or in one step, it is the same motor.
void parts_change_nothing_but_the_step()
{
    Disturbances what;
    what.faults.earth_s = 0.0;
    what.faults.earth_ohm = 1e9;
    Rig rig = ideal();
    rig.mechanics.J_kg_m2 = 1e4;
    Plant parts(rig, Board{}, what, 1);
    Plant whole(rig, Board{}, {}, 1);
    for (int k = 0; k < 500; ++k) {
        const Duty duty{0.5 + 0.02 * std::sin(0.03 * k), 0.5 + 0.02 * std::sin(0.03 * k - 2.1),
                        0.5};
        parts.advance(duty, true);
        whole.advance(duty, true);
    }
    const zh::Vec difference_A = parts.truth().i_s_A - whole.truth().i_s_A;
    CHECK(zh::magnitude(whole.truth().i_s_A) > 2.0);
    CHECK_NEAR(zh::magnitude(difference_A), 0.0, 1e-4);
}

Rig with_link()
{
    Rig rig = ideal();
    rig.dc_link = {1e-3, 0.5, 100.0};
    return rig;
}

void a_stiff_link_follows_its_source_at_once()
{
    Disturbances what;
    what.u_dc_V = Profile({{0.0, 283.0}, {0.1, 283.0}, {0.1, 200.0}});
    Plant plant(ideal(), Board{}, what, 1);
    plant.advance(half, false);
    CHECK_NEAR(plant.truth().u_dc_V, 283.0, 1e-9);
    for (int k = 0; k < 501; ++k) {
        plant.advance(half, false);
    }
    CHECK_NEAR(plant.truth().u_dc_V, 200.0, 1e-9);
}

// Without its supply the capacitor keeps its charge; the brake resistor takes it with R C = .1 s.
void a_capacitor_keeps_its_charge_and_the_chopper_takes_it()
{
    Disturbances what;
    what.u_dc_V = Profile(0.0);
    for (const bool chopper : {false, true}) {
        Plant plant(with_link(), Board{}, what, 1);
        for (int k = 0; k < 500; ++k) {
            plant.advance(half, false, chopper);
        }
        CHECK_RELATIVE(plant.truth().u_dc_V, chopper ? 283.0 * std::exp(-1.0) : 283.0, 1e-3);
    }
}

// What the motor takes out of a capacitor alone is what the capacitor lost: Rs and field.
void the_motor_takes_its_energy_from_the_capacitor()
{
    Disturbances what;
    what.u_dc_V = Profile(0.0);
    Rig rig = with_link();
    rig.mechanics.J_kg_m2 = 1e4;
    Plant plant(rig, Board{}, what, 1);
    double taken_J = 0.0;
    for (int k = 0; k < 300; ++k) {
        const zh::Vec before_A = plant.truth().i_s_A;
        plant.advance({0.53, 0.5, 0.5}, true);
        const zh::Vec after_A = plant.truth().i_s_A;
        taken_J += period_s * zh::dot(plant.truth().u_s_V, 0.5 * (before_A + after_A));
    }
    const double u_V = plant.truth().u_dc_V;
    CHECK(u_V < 282.0);
    CHECK_RELATIVE(0.5e-3 * (283.0 * 283.0 - u_V * u_V), taken_J, 0.02);
}

// A turning motor with a voltage slower than its rotor pumps the link up; a rectifier lets nothing
// back.
void a_braking_motor_pumps_the_link_up()
{
    const auto turning = [](bool brake) {
        Rig rig = with_link();
        rig.mechanics.J_kg_m2 = 1e4;
        Plant p(rig, Board{}, {}, 1);
        p.set_state({{}, {}, 120.0});
        for (int k = 0; k < 3000; ++k) {
            const double angle = 0.046 * k;
            p.advance({0.5 + 0.25 * std::cos(angle), 0.5 + 0.25 * std::cos(angle - 2.0944),
                       0.5 + 0.25 * std::cos(angle + 2.0944)},
                      true, brake);
        }
        return p.truth().u_dc_V;
    };
    CHECK(turning(false) > 300.0);
    CHECK(turning(true) < turning(false));
}

zh::Faults read(const std::string &text)
{
    const zh::TomlDocument document = zh::TomlDocument::from_text(text, "faults");
    zh::TomlReader in(document);
    const zh::Faults faults = zh::read_faults(in);
    in.finish();
    return faults;
}

void faults_are_read_and_checked()
{
    const zh::Faults f = read("[faults]\nsensor = \"u_vw\"\nkind = \"delayed\"\nseverity = 10\n"
                              "start_s = 3.0\nopen_phase = \"w\"\nopen_s = 4.0\n"
                              "earth_phase = \"v\"\nearth_s = 5.0\nearth_ohm = 0.5\n");
    CHECK(f.sensors.size() == 1);
    CHECK(f.sensors[0].signal == 4 && f.sensors[0].kind == SensorFaultKind::delayed);
    CHECK_NEAR(f.sensors[0].severity, 10.0, 0.0);
    CHECK_NEAR(f.sensors[0].start_s, 3.0, 0.0);
    CHECK(f.open_phase == 2 && f.earth_phase == 1);
    CHECK(!(f.short_s < zh::never_s));
    const auto refused = [](const std::string &text) {
        return check::message_of<zh::ConfigError>([&] { (void)read(text); });
    };
    CHECK(refused("[faults]\nsensor = \"i_u\"\nkind = \"gain\"\n").find("severity") !=
          std::string::npos);
    CHECK(refused("[faults]\nsensor = \"i_u\"\nkind = \"broken\"\n").find("kind") !=
          std::string::npos);
    CHECK(!refused("[faults]\nsensor = \"i_u\"\nkind = \"off\"\nseverity = 2\n").empty());
    CHECK(!refused("[faults]\nsensor = \"i_u\"\nkind = \"delayed\"\nseverity = 64\n").empty());
    CHECK(!refused("[faults]\nsensor = \"u_dc\"\nkind = \"exchanged\"\n").empty());
    CHECK(refused("[faults]\nsensor = \"u_vw\"\nkind = \"exchanged\"\n").empty());
    CHECK(!refused("[faults]\nstart_s = 1.0\n").empty());
    CHECK(!refused("[faults]\nearth_ohm = 0\n").empty());
    CHECK(!refused("[faults]\nsensor = \"all\"\nkind = \"exchanged\"\n").empty());
    CHECK(!refused("[faults.second]\nstart_s = 1.0\n").empty());
    CHECK(!refused("[faults]\nsensor = \"i_u\"\nkind = \"fixed\"\n").empty());
}

void groups_and_several_faults_are_read()
{
    const zh::Faults f = read("[faults]\nsensor = \"currents\"\nkind = \"stuck\"\nstart_s = 1\n"
                              "open_phase = \"all\"\nopen_s = 2\nopen_end_s = 3\njam_s = 4\n"
                              "hang_s = 5\nhang_periods = 2\n"
                              "[faults.second]\nsensor = \"voltages\"\nkind = \"noise\"\n"
                              "severity = 0.1\nstart_s = 2\n"
                              "[faults.third]\nsensor = \"all\"\nkind = \"drift\"\n"
                              "severity = -0.1\nstart_s = 3\nend_s = 4\n");
    const std::vector<std::size_t> expected{0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 5};
    CHECK(f.sensors.size() == expected.size());
    for (std::size_t n = 0; n < std::min(f.sensors.size(), expected.size()); ++n) {
        const SensorFault &s = f.sensors[n];
        CHECK(s.signal == expected[n]);
        CHECK(s.kind == (n < 3   ? SensorFaultKind::stuck
                         : n < 5 ? SensorFaultKind::noise
                                 : SensorFaultKind::drift));
        CHECK_NEAR(s.start_s, n < 3 ? 1.0 : (n < 5 ? 2.0 : 3.0), 0.0);
    }
    CHECK(f.open_phase == zh::all_phases);
    CHECK_NEAR(f.open_end_s, 3.0, 0.0);
    CHECK_NEAR(f.jam_s, 4.0, 0.0);
    CHECK_NEAR(f.hang_s, 5.0, 0.0);
    CHECK(f.hang_periods == 2);
    CHECK(read("").hang_periods == 3);
}

} // namespace

int main()
{
    return check::run({
        {"every kind does what its name says", every_kind_does_what_its_name_says},
        {"garbage takes any word and a loose contact its share",
         garbage_takes_any_word_and_a_loose_contact_its_share},
        {"noise spreads about the right word", noise_spreads_about_the_right_word},
        {"several words break at once", several_words_break_at_once},
        {"a gain acts before the range ends", a_gain_acts_before_the_range_ends},
        {"exchanged sensors change places with the next of their kind",
         exchanged_sensors_change_places_with_the_next_of_their_kind},
        {"a fault ends and the dc word has its zero at zero",
         a_fault_ends_and_the_dc_word_has_its_zero_at_zero},
        {"an open phase carries no current", an_open_phase_carries_no_current},
        {"a contactor opens and closes again", a_contactor_opens_and_closes_again},
        {"a phase that closes again carries current", a_phase_that_closes_again_carries_current},
        {"a jammed shaft stops and stays", a_jammed_shaft_stops_and_stays},
        {"an earth fault adds to the current of its leg",
         an_earth_fault_adds_to_the_current_of_its_leg},
        {"the comparator ends a short within a period",
         the_comparator_ends_a_short_within_a_period},
        {"a short flows freely without a comparator", a_short_flows_freely_without_a_comparator},
        {"the comparator ends a current of the motor", the_comparator_ends_a_current_of_the_motor},
        {"parts change nothing but the step", parts_change_nothing_but_the_step},
        {"a stiff link follows its source at once", a_stiff_link_follows_its_source_at_once},
        {"a capacitor keeps its charge and the chopper takes it",
         a_capacitor_keeps_its_charge_and_the_chopper_takes_it},
        {"the motor takes its energy from the capacitor",
         the_motor_takes_its_energy_from_the_capacitor},
        {"a braking motor pumps the link up", a_braking_motor_pumps_the_link_up},
        {"faults are read and checked", faults_are_read_and_checked},
        {"groups and several faults are read", groups_and_several_faults_are_read},
    });
}
