#include "firmware_setup.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numbers>
#include <utility>

namespace zh {
namespace {

// Table 1 and the paper's board: what the defaults of param_list.def were chosen for.
constexpr double paper_voltage_V = 200.0;
constexpr double paper_current_A = 6.2;
constexpr double paper_frequency_Hz = 60.0;
constexpr double paper_M_H = 0.102;
constexpr double paper_J_kg_m2 = 0.015;

std::string text_of(double value)
{
    char buffer[32];
    const int n = std::snprintf(buffer, sizeof buffer, "%.7g", value);
    return {buffer, static_cast<std::size_t>(std::max(n, 0))};
}

std::string_view trimmed(std::string_view text)
{
    constexpr std::string_view blank = " \t\r";
    const std::size_t first = text.find_first_not_of(blank);
    if (first == std::string_view::npos) {
        return {};
    }
    return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

Range range_of(const char *param)
{
    const param_info_t *info = params_info(params_find(param));
    return within(info->minimum, info->maximum);
}

MotorFile read_motor(const std::string &path)
{
    const TomlDocument document = TomlDocument::from_file(path);
    TomlReader in(document);
    MotorFile m;
    m.name = in.text("motor.name");
    m.circuit = {in.number("circuit.Rs_ohm", range_of("Rs_ohm")),
                 in.number("circuit.Rr_ohm", range_of("Rr_ohm")),
                 in.number("circuit.Ls_H", range_of("Ls_H")),
                 in.number("circuit.Lr_H", range_of("Lr_H")),
                 in.number("circuit.M_H", range_of("M_H"))};
    if (m.circuit.M_H * m.circuit.M_H >= m.circuit.Ls_H * m.circuit.Lr_H) {
        in.reject("circuit.M_H", "leaves no leakage", "M_H must be below sqrt(Ls_H Lr_H)");
    }
    m.pole_pairs = in.integer("nameplate.pole_pairs", 1, 50);
    m.voltage_V = in.number("nameplate.voltage_V", positive(1e5));
    m.current_A = in.number("nameplate.current_A", positive(1e4));
    m.frequency_Hz = in.number("nameplate.frequency_Hz", positive(1e4));
    m.J_kg_m2 = in.number("mechanics.J_kg_m2", positive(1e3));
    // The rest of the file is the designer's (tools/zh design), which checks it.
    for (const char *section : {"motor", "nameplate", "mechanics", "design"}) {
        in.pass_through(section);
    }
    in.finish();
    return m;
}

void set_param(params_t &params, const char *name, double value, const std::string &where)
{
    zh::set_param(params, std::string_view(name), static_cast<float>(value), where);
}

void scale_param(params_t &params, const char *name, double factor)
{
    const std::size_t index = params_find(name);
    const param_info_t *info = params_info(index);
    const double value = factor * static_cast<double>(params_get(&params, index));
    const auto limited = std::clamp(static_cast<float>(value), info->minimum, info->maximum);
    if (params_set(&params, index, limited) != PARAMS_OK) {
        throw ConfigError(std::string(name) + ": cannot be scaled; this is a bug of the library");
    }
}

// Another motor needs other currents and flux: the defaults in proportion to the nameplates, so
// that Table 1's motor keeps them to the last bit.
void scale_to_motor(params_t &params, const MotorFile &m)
{
    const double current = m.current_A / paper_current_A;
    const double flux = (m.voltage_V / m.frequency_Hz) / (paper_voltage_V / paper_frequency_Hz);
    const double i_d = flux * paper_M_H / m.circuit.M_H;
    scale_param(params, "i_q_max_A", current);
    scale_param(params, "i_max_A", current);
    scale_param(params, "overload_motor_A", current);
    scale_param(params, "overload_inverter_A", current);
    scale_param(params, "com_rated_A", current);
    scale_param(params, "i_d_A", i_d);
    scale_param(params, "i_d_max_A", i_d);
    scale_param(params, "lambda_max_Wb", flux);
    scale_param(params, "speed_J_kg_m2", m.J_kg_m2 / paper_J_kg_m2);
}

// The largest speed is in proportion to the rated one, and the motor's own voltage then stays below
// the link's trip.
void scale_speeds(params_t &params, const MotorFile &m, double dc_scale)
{
    const double flux = (m.voltage_V / m.frequency_Hz) / (paper_voltage_V / paper_frequency_Hz);
    const double speed = std::min(m.frequency_Hz / paper_frequency_Hz, dc_scale / flux);
    for (const char *name : {"speed_max_rad_s", "over_speed_rad_s", "torque_speed_max_rad_s"}) {
        scale_param(params, name, speed);
    }
}

void scale_to_board(params_t &params, const Board &board)
{
    const Board paper;
    const double dc_scale = board.dc_link_full_scale_V / paper.dc_link_full_scale_V;
    const double current_scale = board.current_full_scale_A / paper.current_full_scale_A;
    scale_param(params, "u_dc_max_V", dc_scale);
    scale_param(params, "u_dc_min_V", board.u_dc_V / paper.u_dc_V);
    scale_param(params, "i_trip_A", current_scale);
    scale_param(params, "current_sum_max_A", current_scale);
    // The filter's group delay at low frequency, 2 D / w_c, seen from the middle of the interval
    // that just ended: half a period less.
    const auto delay_s = [](const Board &b) {
        const double cutoff_rad_s = 2.0 * std::numbers::pi * b.filter_cutoff_Hz;
        return 2.0 * b.filter_damping / cutoff_rad_s - 0.5 * b.period_s;
    };
    scale_param(params, "voltage_filter_comp_s", delay_s(board) / delay_s(paper));
}

std::string range_text(const param_info_t &info)
{
    if (const char *const *choices = param_choices(&info)) {
        std::string names = "one of";
        for (std::size_t k = 0; k <= static_cast<std::size_t>(info.maximum); ++k) {
            names += (k == 0 ? " " : ", ") + std::string(choices[k]);
        }
        return names;
    }
    const std::string unit = param_unit(&info);
    return text_of(info.minimum) + " .. " + text_of(info.maximum) +
           (unit.empty() ? "" : " " + unit);
}

std::string value_text(const param_info_t &info, float value)
{
    if (const char *const *choices = param_choices(&info)) {
        return choices[static_cast<std::size_t>(value)];
    }
    const std::string unit = param_unit(&info);
    return text_of(value) + (unit.empty() ? "" : " " + unit);
}

// Names of former lists, and what became of them.
struct Former {
    std::string_view name;
    const char *text;
};
constexpr Former former[] = {
#define PARAM_RENAMED(before, now)    {#before, "is called " #now " now; correct the name"},
#define PARAM_CONSTANT(before, value) {#before, "is a constant now, " #value "; remove it"},
#define PARAM_DROPPED(before, text)   {#before, "is derived now: " text "; remove it"},
#include "param_former.def"
};

std::string unknown_text(std::string_view name)
{
    const auto *found = std::find_if(std::begin(former), std::end(former),
                                     [&](const Former &f) { return f.name == name; });
    return found != std::end(former) ? found->text
                                     : "no such parameter; tools/docs/parameters.md lists them";
}

// Number behind the name of a choice.
std::optional<float> choice_of(std::string_view name, std::string_view value)
{
    const param_info_t *info = params_info(params_find(std::string(name).c_str()));
    const char *const *choices = info != nullptr ? param_choices(info) : nullptr;
    if (choices == nullptr) {
        return std::nullopt;
    }
    const std::string_view bare =
        value.size() >= 2 && value.starts_with('"') && value.ends_with('"')
            ? value.substr(1, value.size() - 2)
            : value;
    for (std::size_t k = 0; k <= static_cast<std::size_t>(info->maximum); ++k) {
        if (bare == choices[k]) {
            return static_cast<float>(k);
        }
    }
    return std::nullopt;
}

} // namespace

MotorDir MotorDir::load(const std::string &folder)
{
    MotorDir dir{read_motor(folder + "/motor.toml"), load_gain_file(folder + "/l_gain.json")};
    if (dir.gain->motor != dir.motor.name) {
        throw ConfigError(folder + "/l_gain.json: motor: \"" + dir.gain->motor +
                          "\" is not the \"" + dir.motor.name +
                          "\" of motor.toml; write the file anew with tools/zh design");
    }
    if (dir.gain->circuit != dir.motor.circuit) {
        throw ConfigError(folder + "/l_gain.json: inputs.circuit: differs from motor.toml; the "
                                   "table is for other machine data, write it anew with tools/zh "
                                   "design");
    }
    return dir;
}

params_t nominal_params(const MotorFile &m, const std::optional<Board> &board)
{
    params_t params;
    params_default(&params);
    scale_to_motor(params, m);
    set_param(params, "Rs_ohm", m.circuit.Rs_ohm, "motor.toml");
    set_param(params, "Rr_ohm", m.circuit.Rr_ohm, "motor.toml");
    set_param(params, "Ls_H", m.circuit.Ls_H, "motor.toml");
    set_param(params, "Lr_H", m.circuit.Lr_H, "motor.toml");
    set_param(params, "M_H", m.circuit.M_H, "motor.toml");
    set_param(params, "pole_pairs", m.pole_pairs, "motor.toml");
    if (board) {
        scale_to_board(params, *board);
        scale_speeds(params, m, board->dc_link_full_scale_V / Board{}.dc_link_full_scale_V);
        set_param(params, "adc_bits", board->adc_bits, "board");
        set_param(params, "current_full_scale_A", board->current_full_scale_A, "board");
        set_param(params, "line_voltage_full_scale_V", board->line_voltage_full_scale_V, "board");
        set_param(params, "dc_link_full_scale_V", board->dc_link_full_scale_V, "board");
        set_param(params, "period_s", board->period_s, "board");
    }
    return params;
}

void set_param(params_t &params, std::string_view name, float value, const std::string &where)
{
    const std::string named = where + ": " + std::string(name) + ": ";
    const std::size_t index = params_find(std::string(name).c_str());
    const param_info_t *info = params_info(index);
    if (info == nullptr) {
        throw ConfigError(named + unknown_text(name));
    }
    switch (params_set(&params, index, value)) {
    case PARAMS_OK:
        return;
    case PARAMS_NOT_FINITE:
        throw ConfigError(named + "is not a finite number; give " + range_text(*info));
    case PARAMS_NOT_WHOLE:
        throw ConfigError(named + text_of(value) + " is not a whole number; give " +
                          range_text(*info));
    case PARAMS_OUT_OF_RANGE:
    case PARAMS_NO_SUCH:
    case PARAMS_GATES_ON: /* these two are of access_write alone */
    case PARAMS_LOCKED:
        break;
    }
    throw ConfigError(named + text_of(value) + " is out of range; give " + range_text(*info));
}

void set_param_text(params_t &params, std::string_view name, std::string_view value,
                    const std::string &where)
{
    if (value == "true" || value == "false") {
        set_param(params, name, value == "true" ? 1.0F : 0.0F, where);
        return;
    }
    if (const auto choice = choice_of(name, value)) {
        set_param(params, name, *choice, where);
        return;
    }
    double number = 0.0;
    const char *end = value.data() + value.size();
    const std::string_view digits = value.starts_with('+') ? value.substr(1) : value;
    const auto parsed = std::from_chars(digits.data(), end, number);
    if (digits.empty() || parsed.ec != std::errc{} || parsed.ptr != end) {
        const param_info_t *info = params_info(params_find(std::string(name).c_str()));
        const bool enumerated = info != nullptr && param_choices(info) != nullptr;
        throw ConfigError(where + ": " + std::string(name) + ": '" + std::string(value) +
                          "' is not a number; " +
                          (enumerated ? "give " + range_text(*info) : "write name=value"));
    }
    set_param(params, name, static_cast<float>(number), where);
}

void apply_overrides(params_t &params, std::string_view lines, const std::string &where)
{
    while (!lines.empty()) {
        const std::size_t end = std::min(lines.find('\n'), lines.size());
        const std::string_view line = lines.substr(0, end);
        lines.remove_prefix(std::min(end + 1, lines.size()));
        const std::string_view item = trimmed(line.substr(0, line.find('#')));
        if (item.empty()) {
            continue;
        }
        const std::size_t equals = item.find('=');
        if (equals == std::string_view::npos || equals == 0) {
            throw ConfigError(where + ": '" + std::string(item) +
                              "': is not a parameter; write one name=value per line");
        }
        set_param_text(params, trimmed(item.substr(0, equals)), trimmed(item.substr(equals + 1)),
                       where);
    }
}

std::string refusal_reason(const params_t &p)
{
    params_conflict_t conflict;
    if (params_check(&p, &conflict)) {
        return "parameters: the firmware refuses them together; change one at a time to find which";
    }
    static constexpr const char *words[] = {"at most", "below", "at least", "above", "exactly"};
    const auto said = [&](std::size_t index) {
        return std::string(params_name(index)) + " = " +
               value_text(*params_info(index), params_get(&p, index));
    };
    const param_info_t *first = params_info(conflict.first);
    std::string with;
    if (conflict.second != conflict.first) {
        with = " with " + said(conflict.second);
    }
    return std::string(params_name(conflict.first)) + ": is " +
           value_text(*first, params_get(&p, conflict.first)) + "; it must be " +
           words[conflict.relation] + " " + value_text(*first, conflict.limit) + with;
}

} // namespace zh
