// From files and overrides to the firmware's parameters. Every complaint names file, key, remedy.
//
// Order, later wins: defaults of param_list.def, scaled to the motor's nameplate and the board;
// machine data of motor.toml and scaling of the board; overrides.
#ifndef ZH_FIRMWARE_SETUP_HPP
#define ZH_FIRMWARE_SETUP_HPP

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "board.hpp"
#include "gain_file.hpp"
#include "law_headers.hpp"

namespace zh {

// motor.toml as far as the firmware needs it.
struct MotorFile {
    std::string name;
    Circuit circuit;
    double pole_pairs = 0.0;
    double voltage_V = 0.0; // line to line, rms
    double current_A = 0.0; // phase, rms
    double frequency_Hz = 0.0;
    double J_kg_m2 = 0.0;
};

// Both files of a motor's folder; they must belong together.
struct MotorDir {
    MotorFile motor;
    std::shared_ptr<const GainFile> gain;

    static MotorDir load(const std::string &folder);
};

// board may be missing: the observer core alone has none.
params_t nominal_params(const MotorFile &motor, const std::optional<Board> &board);

// One parameter; `where` opens the complaint. Text: a number, true or false.
void set_param(params_t &params, std::string_view name, float value, const std::string &where);
void set_param_text(params_t &params, std::string_view name, std::string_view value,
                    const std::string &where);

// Lines "name=value"; empty ones and what follows '#' are skipped.
void apply_overrides(params_t &params, std::string_view lines, const std::string &where);

// Why the application does not take a set whose single values are all in range.
std::string refusal_reason(const params_t &params);

} // namespace zh

#endif
