// An experiment: what is asked of the drive and done to the rig over time.
// Its file is host_sim/scenarios/<name>.toml.
#ifndef ZH_SCENARIO_HPP
#define ZH_SCENARIO_HPP

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "faults.hpp"
#include "load.hpp"
#include "profile.hpp"
#include "toml_reader.hpp"

namespace zh {

// Command bits of the firmware (host_sim/sil.h).
inline constexpr std::uint32_t command_run = 1U;
inline constexpr std::uint32_t command_fault_reset = 2U;
inline constexpr std::uint32_t command_torque_off = 4U;
inline constexpr std::uint32_t command_torque_mode = 16U;
inline constexpr std::uint32_t command_commission = 8U;

// What acts on the plant.
struct Disturbances {
    Profile load_torque_Nm{0.0};    // > 0 opposes positive rotation
    LoadLaw load;                   // how it depends on speed and time
    Profile rs_factor{1.0};         // true Rs over the rig's
    Profile rr_factor{1.0};         // true Rr over the rig's
    std::optional<Profile> u_dc_V;  // what feeds the dc link, instead of the rig's constant
    double initial_speed_rpm = 0.0; // of a shaft that turns already
    double initial_flux_Wb = 0.0;   // residual rotor flux, along alpha, without stator current
    Faults faults;

    // Of the profiles of load, resistances and dc link.
    double holds_until(double t_s) const;
    // At least one of them is on a slope until then; t_s: none is.
    double slopes_until(double t_s) const;
};

// Nominal motor data handed to the controller, times these.
struct ControllerMotor {
    double Rs_factor = 1.0;
    double Rr_factor = 1.0;
    double Ls_factor = 1.0;
    double Lr_factor = 1.0;
    double M_factor = 1.0;
};

struct Scenario {
    std::string name;
    std::string title;
    int figure = 0;       // of the paper; 0: none
    std::string protocol; // "S", "R" of PAPER_OUTCOMES, or "none"
    double duration_s = 0.0;
    double step_time_s = never_s;  // protocol S: t0
    double ramp_start_s = never_s; // protocol R: start of the load ramp
    std::uint64_t noise_seed = 1;

    double run_on_s = never_s;  // run command from here ...
    double run_off_s = never_s; // ... to here
    double run_again_s = never_s;
    double fault_reset_s = never_s;
    double torque_off_s = never_s;     // from here ...
    double torque_off_end_s = never_s; // ... to here
    double torque_mode_on_s = never_s;
    double torque_mode_off_s = never_s;
    double silent_from_s = never_s; // the operator says nothing new any more
    double commission_s = never_s;  // the run ends when the drive is done with it

    Profile speed_ref_rpm{0.0};
    Profile torque_ref_Nm{0.0};
    Disturbances disturbances;
    ControllerMotor controller_motor;
    std::vector<std::pair<std::string, std::string>> firmware; // parameter overrides, name = value

    std::uint32_t command(double t_s) const; // bits of the command word
    // Until when neither these nor the references change.
    double command_holds_until(double t_s) const;
};

Scenario read_scenario(const TomlDocument &document);
Scenario load_scenario(const std::string &path);

} // namespace zh

#endif
