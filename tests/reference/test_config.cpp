// Files: what is committed loads and says what PAPER_OUTCOMES asks; what is wrong gets one clear
// line.
#include "check.hpp"
#include "experiment.hpp"
#include "noise.hpp"
#include "plant.hpp"
#include "recorder.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

namespace {

const std::string folder = ZH_HOST_SIM_DIR;

const std::string rig_text = R"(
[motor]
Rs_ohm = 0.93
Rr_ohm = 0.50
Ls_H = 0.110
Lr_H = 0.102
M_H = 0.102
pole_pairs = 2
[mechanics]
J_kg_m2 = 0.015
[inverter]
model = "averaged"
u_dc_V = 283.0
carrier_Hz = 5000.0
[sensors]
current_gain = [1.0, 1.0, 1.0]
)";

bool has(const std::string &text, const std::string &part)
{
    const bool found = text.find(part) != std::string::npos;
    if (!found) {
        std::printf("'%s' lacks '%s'\n", text.c_str(), part.c_str());
    }
    return found;
}

std::string rig_error(const std::string &text)
{
    return check::message_of<zh::ConfigError>(
        [&] { zh::read_rig(zh::TomlDocument::from_text(text, "rig.toml")); });
}

std::string replaced(const std::string &from, const std::string &to)
{
    std::string text = rig_text;
    const std::size_t at = text.find(from);
    CHECK(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

void a_good_rig_is_read()
{
    const zh::Rig rig = zh::read_rig(zh::TomlDocument::from_text(rig_text, "rig.toml"));
    CHECK_NEAR(rig.motor.Rs_ohm, 0.93, 0.0);
    CHECK_NEAR(rig.motor.Ls_H, 0.110, 0.0);
    CHECK(rig.motor.pole_pairs == 2);
    CHECK_NEAR(rig.inverter.u_dc_V, 283.0, 0.0);
    CHECK(rig.inverter.model == zh::InverterModel::averaged);
    CHECK_NEAR(rig.inverter.dead_time_s, 0.0, 0.0);
}

void mistakes_in_a_rig_are_named_with_file_line_and_key()
{
    struct Mistake {
        const char *from, *to;
        std::vector<std::string> parts;
    };
    const Mistake mistakes[] = {
        {"Rs_ohm = 0.93", "Rs_ohm = -0.93", {"rig.toml:3: motor.Rs_ohm: ", "out of range", "; "}},
        {"Rs_ohm = 0.93", "Rs_ohm = 0", {"rig.toml:3: motor.Rs_ohm: ", "out of range"}},
        {"Rs_ohm = 0.93", "Rs_ohm = nan", {"rig.toml:3: motor.Rs_ohm: ", "not a finite number"}},
        {"Rs_ohm = 0.93", "Rs_ohm = inf", {"rig.toml:3: motor.Rs_ohm: ", "not a finite number"}},
        {"Rs_ohm = 0.93", "Rs_ohm = \"0.93\"", {"rig.toml:3: motor.Rs_ohm: is text", "number"}},
        {"Rs_ohm = 0.93", "Rs_ohm = true", {"motor.Rs_ohm: is a truth value"}},
        {"Rs_ohm = 0.93", "Rs_ohm = [1]", {"motor.Rs_ohm: is a list of 1 numbers"}},
        {"Rs_ohm = 0.93", "Rs_ohm = 1979-05-27", {"motor.Rs_ohm: is a date"}},
        {"Rs_ohm = 0.93", "", {"rig.toml:2: motor.Rs_ohm: missing", "[motor]"}},
        {"Rs_ohm = 0.93",
         "Rs_ohm = 0.93\nRz_ohm = 1",
         {"rig.toml:4: motor.Rz_ohm: unknown key", "known here: ", "motor.Rs_ohm"}},
        {"Rs_ohm = 0.93", "Rs_ohm = 0.93\nRs_ohm = 0.93", {"rig.toml:4: not valid TOML"}},
        {"Rs_ohm = 0.93", "Rs_ohm 0.93", {"rig.toml:3: not valid TOML"}},
        {"pole_pairs = 2", "pole_pairs = 2.5", {"motor.pole_pairs: 2.5 is not a whole number"}},
        {"pole_pairs = 2", "pole_pairs = 0", {"motor.pole_pairs: 0 is out of range"}},
        {"M_H = 0.102", "M_H = 0.110", {"motor.M_H: leaves no leakage"}},
        {"J_kg_m2 = 0.015",
         "J_kg_m2 = 0.015\ncoulomb_Nm = 1\nstatic_Nm = 0.5",
         {"mechanics.static_Nm: is below"}},
        {"\"averaged\"", "\"average\"", {"inverter.model: \"average\" is unknown", "switched"}},
        {"[mechanics]", "[mechanic]", {"mechanics.J_kg_m2: missing"}},
        {"[sensors]", "[sensor]", {"sensor.current_gain: unknown key", "no section [sensor]"}},
        {"carrier_Hz = 5000.0",
         "carrier_Hz = 5000.0\n[integration]\nmethod = \"euler\"",
         {"integration.method: \"euler\" is unknown", "heun"}},
        {"carrier_Hz = 5000.0",
         "carrier_Hz = 5000.0\n[integration]\nsubsteps = -1",
         {"integration.substeps: -1 is out of range"}},
        {"pole_pairs = 2",
         "pole_pairs = 2\niron_loss_ohm = -1",
         {"motor.iron_loss_ohm: -1 is out"}},
        {"[1.0, 1.0, 1.0]", "[1.0, 1.0]", {"sensors.current_gain: is a list of 2 numbers", "3"}},
        {"[1.0, 1.0, 1.0]", "[1.0, 1.0, nan]", {"sensors.current_gain: is not a finite"}},
        {"[1.0, 1.0, 1.0]", "[1.0, 1.0, 0.0]", {"sensors.current_gain: 0 is out of range"}},
        {"[1.0, 1.0, 1.0]", "[1.0, [1.0, 2.0]]", {"sensors.current_gain: is a list that mixes"}},
        {"carrier_Hz = 5000.0", "carrier_Hz = 5000.0\ndead_time_s = 3.0", {"dead_time_s"}},
        {"pole_pairs = 2",
         "pole_pairs = 2\n[motor.saturation]\nflux_knee_Wb = 1\nexponent = 3",
         {"motor.saturation.exponent: is odd"}},
    };
    CHECK(rig_error(rig_text).empty());
    for (const Mistake &mistake : mistakes) {
        const std::string error = rig_error(replaced(mistake.from, mistake.to));
        for (const std::string &part : mistake.parts) {
            CHECK(has(error, part));
        }
        CHECK(error.find('\n') == std::string::npos);
    }
}

void garbage_is_a_clear_error()
{
    zh::NoiseSource random(1);
    for (int n = 0; n < 2000; ++n) {
        std::string text = n % 2 == 0 ? rig_text : std::string(200, ' ');
        const std::size_t hits = n % 2 == 0 ? 1 + random.bits() % 8 : text.size();
        for (std::size_t k = 0; k < hits; ++k) {
            text[random.bits() % text.size()] = static_cast<char>(random.bits() % 256);
        }
        const std::string error = rig_error(text); // anything but ConfigError ends the program
        if (n % 2 != 0) {
            CHECK(has(error, "rig.toml"));
        }
    }
    CHECK(has(rig_error(""), "rig.toml: motor.Rs_ohm: missing"));
    CHECK(has(rig_error(std::string(1000, '[')), "not valid TOML"));
    CHECK(has(rig_error("motor = 3"), "motor"));
}

void unreadable_files_are_named()
{
    const auto error = [](const std::string &path) {
        return check::message_of<zh::ConfigError>([&] { zh::load_rig(path); });
    };
    CHECK(has(error("/nowhere/rig.toml"), "/nowhere/rig.toml: cannot be read"));
    CHECK(has(error("/"), "/: "));
}

void overrides_replace_values_without_the_file()
{
    const auto original = zh::TomlDocument::from_text(rig_text, "rig.toml");
    zh::TomlDocument document = original;
    document.set("motor.Rs_ohm=1.1");
    document.set(" inverter.model = switched ");
    document.set("inverter.dead_time_s=2e-6");
    document.set("sensors.current_gain.1=1.05");
    document.set("sensors.voltage_offset_V=[0.5, -0.5]");
    const zh::Rig rig = zh::read_rig(document);
    CHECK_NEAR(rig.motor.Rs_ohm, 1.1, 0.0);
    CHECK(rig.inverter.model == zh::InverterModel::switched);
    CHECK_NEAR(rig.inverter.dead_time_s, 2e-6, 0.0);
    CHECK_NEAR(rig.sensors.current_gain[0], 1.0, 0.0);
    CHECK_NEAR(rig.sensors.current_gain[1], 1.05, 0.0);
    CHECK_NEAR(rig.sensors.voltage_offset_V[1], -0.5, 0.0);
    CHECK_NEAR(zh::read_rig(original).motor.Rs_ohm, 0.93, 0.0);
}

void wrong_overrides_are_named()
{
    const auto error = [](const std::string &assignment) {
        return check::message_of<zh::ConfigError>([&] {
            auto document = zh::TomlDocument::from_text(rig_text, "rig.toml");
            document.set(assignment);
            zh::read_rig(document);
        });
    };
    CHECK(has(error("motor.Rz_ohm=1"), "override of rig.toml: motor.Rz_ohm: unknown key"));
    CHECK(has(error("motor.Rs_ohm=-1"), "override of rig.toml: motor.Rs_ohm: -1 is out of range"));
    CHECK(has(error("motor.Rs_ohm=nan"), "motor.Rs_ohm: is not a finite number"));
    CHECK(has(error("motor.Rs_ohm=many"), "motor.Rs_ohm: is text"));
    CHECK(has(error("motor.Rs_ohm=true"), "motor.Rs_ohm: is a truth value"));
    CHECK(has(error("motor.Rs_ohm"), "no key=value"));
    CHECK(has(error("=3"), "no key=value"));
    CHECK(has(error(""), "no key=value"));
    CHECK(has(error("motor.Rs_ohm="), "not TOML"));
    CHECK(has(error("motor.Rs_ohm=1 2"), "not TOML"));
    CHECK(has(error("motor.Rs_ohm=1\nx=2"), "not TOML"));
    CHECK(has(error("sensors.current_gain.3=1"), "no such list element"));
    CHECK(has(error("motor.Rs_ohm.0=1"), "no such list element"));
}

void an_experiment_routes_overrides_to_its_files()
{
    auto files =
        zh::ExperimentFiles::load(folder + "/rigs/hasegawa2005.toml", folder + "/boards/paper.toml",
                                  folder + "/scenarios/fig12.toml");
    files.set("motor.Rs_ohm=1.1");
    files.set("board.adc.bits=12");
    files.set("board.control.delay_periods=2");
    files.set("integration.substeps=8");
    files.set("integration.method=heun");
    files.set("scenario.duration_s=20");
    files.set("profiles.load_torque_Nm=[[0, 0], [5, 2.5]]");
    files.set("firmware.eps1=7.31");
    files.set("controller_motor.Rs_factor=0.9");
    CHECK_NEAR(zh::read_rig(files.rig).motor.Rs_ohm, 1.1, 0.0);
    CHECK(zh::read_board(files.board).adc_bits == 12);
    CHECK(zh::read_board(files.board).delay_periods == 2);
    CHECK(zh::read_rig(files.rig).integration.substeps == 8);
    CHECK(zh::read_rig(files.rig).integration.method == zh::IntegrationMethod::heun);
    const zh::Scenario scenario = zh::read_scenario(files.scenario);
    CHECK_NEAR(scenario.duration_s, 20.0, 0.0);
    CHECK_NEAR(scenario.disturbances.load_torque_Nm.value(9.0), 2.5, 0.0);
    CHECK_NEAR(scenario.controller_motor.Rs_factor, 0.9, 0.0);
    CHECK(scenario.firmware.size() == 3);
    CHECK(scenario.firmware[0].first == "eps1" && scenario.firmware[0].second == "7.31");
    CHECK(scenario.firmware[1].first == "eps1_mode" && scenario.firmware[1].second == "2");
    CHECK(has(check::message_of<zh::ConfigError>([&] { files.set("engine.Rs_ohm=1"); }),
              "belongs to no file"));
}

void every_committed_file_loads()
{
    int files = 0;
    for (const auto &entry : std::filesystem::recursive_directory_iterator(folder + "/rigs")) {
        if (entry.is_directory()) {
            continue; // rigs/motors
        }
        const zh::Rig rig = zh::load_rig(entry.path().string());
        CHECK(rig.name == entry.path().stem().string());
        const auto board =
            zh::load_board(folder + (rig.inverter.u_dc_V > 400.0 ? "/boards/board_540V.toml"
                                                                 : "/boards/paper.toml"));
        for (const auto model : {zh::InverterModel::averaged, zh::InverterModel::switched}) {
            zh::Rig either = rig;
            either.inverter.model = model;
            zh::Plant plant(either, board, {}, 1); // they fit
            ++files;
        }
    }
    CHECK(files >= 24);
    for (const auto &entry : std::filesystem::directory_iterator(folder + "/scenarios")) {
        const zh::Scenario scenario = zh::load_scenario(entry.path().string());
        CHECK(scenario.name == entry.path().stem().string());
        CHECK(scenario.run_on_s < 1.0);
        ++files;
    }
    CHECK(files >= 38);
    const zh::Board paper = zh::load_board(folder + "/boards/paper.toml");
    CHECK(paper.adc_bits == 14);
    CHECK_NEAR(paper.current_full_scale_A, 25.0, 0.0);
    CHECK_NEAR(paper.line_voltage_full_scale_V, 400.0, 0.0);
    CHECK_NEAR(paper.dc_link_full_scale_V, 400.0, 0.0);
    CHECK_NEAR(paper.filter_cutoff_Hz, 800.0, 0.0);
    CHECK_NEAR(paper.period_s, 200e-6, 0.0);
    CHECK_NEAR(paper.u_dc_V, 283.0, 0.0);
}

// The table of PAPER_OUTCOMES, typed in a second time.
void the_thirteen_experiments_are_those_of_the_protocol()
{
    struct Figure {
        int number, gain, eps1;
        bool loaded, wrong_Rs;
    };
    constexpr Figure figures[] = {
        {6, 0, 0, false, false}, {7, 1, 0, false, false}, {8, 0, 0, true, false},
        {9, 1, 0, true, false},  {10, 0, 1, true, false}, {11, 1, 1, true, false},
        {12, 1, 2, true, false}, {13, 0, 0, true, true},  {14, 0, 1, true, true},
        {15, 1, 0, true, true},  {16, 1, 1, true, true},  {17, 1, 0, true, false},
        {18, 1, 1, true, false},
    };
    for (const Figure &figure : figures) {
        const std::string number = (figure.number < 10 ? "0" : "") + std::to_string(figure.number);
        const zh::Scenario s = zh::load_scenario(folder + "/scenarios/fig" + number + ".toml");
        CHECK(s.figure == figure.number);
        CHECK(s.firmware.size() == 2);
        CHECK(s.firmware[0].second == std::to_string(figure.eps1));
        CHECK(s.firmware[1].first == "observer_gain_enable" &&
              s.firmware[1].second == std::to_string(figure.gain));
        CHECK_NEAR(s.controller_motor.Rs_factor, figure.wrong_Rs ? 1 / 1.5 : 1.0, 1e-12);
        const zh::Profile &load = s.disturbances.load_torque_Nm;
        CHECK_NEAR(load.value(4.0), 0.0, 0.0);
        if (figure.number >= 17) {
            const double start = s.ramp_start_s;
            CHECK(s.protocol == "R" && start >= 5.0 && s.duration_s >= start + 80.0);
            CHECK_NEAR(load.value(start), 0.0, 0.0);
            CHECK_NEAR(load.value(start + 20.0), -4.2, 1e-12);
            CHECK_NEAR(load.value(start + 40.0), -8.4, 1e-12);
            CHECK_NEAR(load.value(start + 80.0), -8.4, 1e-12);
            CHECK_NEAR(s.speed_ref_rpm.value(start), 60.0, 0.0);
            CHECK_NEAR(s.speed_ref_rpm.value(start + 80.0), 60.0, 0.0);
            continue;
        }
        const double t0 = s.step_time_s;
        CHECK(s.protocol == "S" && s.duration_s >= t0 + 30.0);
        CHECK_NEAR(s.speed_ref_rpm.value(t0 - 1e-9), 300.0, 1e-9);
        CHECK_NEAR(s.speed_ref_rpm.value(t0), 0.0, 0.0);
        CHECK_NEAR(s.speed_ref_rpm.value(t0 + 30.0), 0.0, 0.0);
        CHECK_NEAR(s.speed_ref_rpm.value(1.9), 0.0, 0.0);
        CHECK_NEAR(s.speed_ref_rpm.value(t0 - 4.0), 300.0, 0.0);
        CHECK_NEAR(load.value(t0 - 4.0), figure.loaded ? 4.2 : 0.0, 1e-12);
        CHECK_NEAR(load.value(t0 + 30.0), figure.loaded ? 4.2 : 0.0, 1e-12);
    }
}

void mistakes_in_a_scenario_are_named()
{
    const std::string good = "[scenario]\nname = \"x\"\nduration_s = 3\nrun_on_s = 0.1\n"
                             "[profiles]\nspeed_ref_rpm = [[0, 0], [1, 300]]\n";
    const auto error = [](const std::string &text) {
        return check::message_of<zh::ConfigError>(
            [&] { zh::read_scenario(zh::TomlDocument::from_text(text, "s.toml")); });
    };
    CHECK(error(good).empty());
    CHECK(has(error(good + "load_torque_Nm = [[1, 0], [0, 1]]\n"),
              "s.toml:7: profiles.load_torque_Nm: time 0 is negative or goes back"));
    CHECK(has(error(good + "load_torque_Nm = [[-1, 0]]\n"), "negative or goes back"));
    CHECK(has(error(good + "load_torque_Nm = [[nan, 0]]\n"), "negative or goes back"));
    CHECK(has(error(good + "load_torque_Nm = [[0, inf]]\n"), "not a finite number"));
    CHECK(has(error(good + "load_torque_Nm = []\n"), "list of 0 numbers"));
    CHECK(has(error(good + "load_torque_Nm = [[0, 1, 2]]\n"), "something else"));
    CHECK(has(error(good + "load_torque_Nm = 4.2\n"), "give a list of [time, value]"));
    CHECK(has(error(good + "rs_factor = [[0, -1]]\n"), "out of range"));
    CHECK(has(error(good + "[firmware]\neps1 = [1, 2]\n"), "firmware.eps1: is a list"));
    CHECK(has(error(good + "[firmware]\neps1 = nan\n"), "firmware.eps1: is not a finite"));
    CHECK(has(error(good + "[firmwares]\neps1 = 1\n"), "firmwares.eps1: unknown key"));
    CHECK(has(error("[scenario]\nprotocol = \"S\"\n" + good.substr(11)), "step_time_s"));
    CHECK(has(error("[scenario]\nprotocol = \"T\"\n" + good.substr(11)), "protocol"));
    CHECK(has(error("[scenario]\nduration_s = 0\n"), "scenario"));
}

void mistakes_in_a_board_are_named()
{
    std::ifstream file(folder + "/boards/paper.toml");
    std::stringstream text;
    text << file.rdbuf();
    const auto error = [&](const std::string &override) {
        return check::message_of<zh::ConfigError>([&] {
            auto document = zh::TomlDocument::from_text(text.str(), "board.toml");
            document.set(override);
            zh::read_board(document);
        });
    };
    CHECK(error("adc.bits=12").empty());
    CHECK(has(error("adc.bits=20"), "adc.bits: 20 is out of range"));
    CHECK(has(error("control.delay_periods=3"), "control.delay_periods: 3 is out of range"));
    CHECK(has(error("filter.order=3"), "filter.order: 3 is out of range"));
    CHECK(has(error("full_scale.current_A=-1"), "full_scale.current_A: -1 is out of range"));
    CHECK(has(error("inverter.u_dc_V=500"), "inverter.u_dc_V: is above full_scale.dc_link_V"));
    CHECK(has(error("adc.bitz=12"), "adc.bitz: unknown key"));
}

void profiles_are_polylines_with_steps()
{
    const zh::Profile p({{1.0, 2.0}, {2.0, 4.0}, {2.0, -1.0}, {4.0, 3.0}});
    std::size_t cursor = 0;
    const double t[] = {0.0, 1.0, 1.5, 1.999999, 2.0, 3.0, 4.0, 9.0, 1.25, 0.0};
    const double v[] = {2.0, 2.0, 3.0, 3.999998, -1.0, 1.0, 3.0, 3.0, 2.5, 2.0};
    for (std::size_t n = 0; n < std::size(t); ++n) {
        CHECK_NEAR(p.value(t[n]), v[n], 1e-12);
        CHECK_NEAR(p.value(t[n], cursor), v[n], 1e-12); // forward and back
    }
    // On a slope it changes at once, else at the next point where it does.
    CHECK_NEAR(p.holds_until(0.0), 1.0, 0.0);
    CHECK_NEAR(p.holds_until(1.5), 1.5, 0.0);
    CHECK(std::isinf(p.holds_until(4.0)));
    const zh::Profile level({{0.0, 3.0}, {1.0, 3.0}, {2.0, 3.0}, {2.0, 5.0}});
    CHECK_NEAR(level.holds_until(0.5), 2.0, 0.0);
    CHECK_NEAR(level.holds_until(2.0 - 1e-9), 2.0, 0.0);
    CHECK(std::isinf(level.holds_until(2.0)));
    CHECK(std::isinf(zh::Profile(7.0).holds_until(0.0)));
    const auto refused = [](std::vector<zh::ProfilePoint> points) {
        return !check::message_of<std::invalid_argument>([&] {
                    zh::Profile profile(std::move(points));
                }).empty();
    };
    CHECK(refused({}));
    CHECK(refused({{1.0, 0.0}, {0.5, 0.0}}));
    CHECK(refused({{0.0, 0.0}, {std::nan(""), 0.0}}));
}

void commands_come_and_go_in_time()
{
    zh::Scenario s;
    s.run_on_s = 1.0;
    s.run_off_s = 2.0;
    s.fault_reset_s = 3.0;
    s.torque_off_s = 4.0;
    CHECK(s.command(0.9) == 0U);
    CHECK(s.command(1.0) == zh::command_run);
    CHECK(s.command(2.0) == 0U);
    CHECK(s.command(3.01) == zh::command_fault_reset);
    CHECK(s.command(3.5) == 0U);
    CHECK(s.command(9.0) == zh::command_torque_off);
}

void a_recorder_keeps_every_nth_row()
{
    zh::Recorder recorder({"t_s", "x"}, 3, 10);
    for (int k = 0; k < 10; ++k) {
        if (recorder.due()) {
            recorder.push(std::vector<double>{0.1 * k, 1.0 * k});
        }
    }
    CHECK(recorder.rows() == 4);
    CHECK((recorder.column("x") == std::vector<double>{0.0, 3.0, 6.0, 9.0}));
    std::ostringstream csv;
    recorder.write_csv(csv);
    CHECK(csv.str().starts_with("t_s,x\n0,0\n0.30000000000000004,3\n"));
    CHECK(has(check::message_of<std::invalid_argument>([&] { recorder.column("y"); }), "'y'"));
    CHECK(!check::message_of<std::invalid_argument>([&] {
               recorder.push(std::vector<double>{1.0});
           }).empty());
}

} // namespace

int main()
{
    return check::run({
        {"a good rig is read", a_good_rig_is_read},
        {"mistakes in a rig are named with file, line and key",
         mistakes_in_a_rig_are_named_with_file_line_and_key},
        {"garbage is a clear error", garbage_is_a_clear_error},
        {"unreadable files are named", unreadable_files_are_named},
        {"overrides replace values without the file", overrides_replace_values_without_the_file},
        {"wrong overrides are named", wrong_overrides_are_named},
        {"an experiment routes overrides to its files",
         an_experiment_routes_overrides_to_its_files},
        {"every committed file loads", every_committed_file_loads},
        {"the thirteen experiments are those of the protocol",
         the_thirteen_experiments_are_those_of_the_protocol},
        {"mistakes in a scenario are named", mistakes_in_a_scenario_are_named},
        {"mistakes in a board are named", mistakes_in_a_board_are_named},
        {"profiles are polylines with steps", profiles_are_polylines_with_steps},
        {"commands come and go in time", commands_come_and_go_in_time},
        {"a recorder keeps every nth row", a_recorder_keeps_every_nth_row},
    });
}
