#include "scenario.hpp"

#include <limits>

namespace zh {
namespace {

// The command is a level sampled once per period: a pulse has to be longer than any period.
constexpr double fault_reset_pulse_s = 0.02;
constexpr double longest_s = 36000.0;

double time_or_never(TomlReader &in, std::string_view key)
{
    return in.number_or(key, never_s, not_negative(longest_s));
}

LoadLaw read_load(TomlReader &in)
{
    LoadLaw law;
    if (in.has("load.law")) {
        law.exponent = static_cast<int>(in.choice("load.law", {"constant", "linear", "square"}));
    }
    if (law.exponent > 0) {
        law.reference_rad_s = in.number("load.reference_rpm", positive(1e5)) * rad_s_per_rpm;
    }
    law.pulse_pu = in.number_or("load.pulse_pu", 0.0, within(0.0, 1.0));
    law.pulse_Hz = in.number_or("load.pulse_Hz", 0.0, not_negative(1e3));
    law.servo_Nm_per_turn = in.number_or("load.servo_Nm_per_turn", 0.0, not_negative(1e3));
    law.servo_from_s = in.number_or("load.servo_from_s", 0.0, not_negative(longest_s));
    return law;
}

void read_disturbances(TomlReader &in, Disturbances &disturbances)
{
    disturbances.load_torque_Nm = in.profile_or("profiles.load_torque_Nm", 0.0, within(-1e5, 1e5));
    disturbances.load = read_load(in);
    disturbances.rs_factor = in.profile_or("profiles.rs_factor", 1.0, within(0.1, 10.0));
    disturbances.rr_factor = in.profile_or("profiles.rr_factor", 1.0, within(0.1, 10.0));
    if (in.has("profiles.u_dc_V")) {
        disturbances.u_dc_V = in.profile("profiles.u_dc_V", not_negative(1e5));
    }
    disturbances.faults = read_faults(in);
    disturbances.initial_speed_rpm =
        in.number_or("scenario.initial_speed_rpm", 0.0, within(-1e5, 1e5));
    disturbances.initial_flux_Wb =
        in.number_or("scenario.initial_flux_Wb", 0.0, not_negative(100.0));
}

ControllerMotor read_controller_motor(TomlReader &in)
{
    const Range factor = within(0.1, 10.0);
    ControllerMotor motor;
    motor.Rs_factor = in.number_or("controller_motor.Rs_factor", 1.0, factor);
    motor.Rr_factor = in.number_or("controller_motor.Rr_factor", 1.0, factor);
    motor.Ls_factor = in.number_or("controller_motor.Ls_factor", 1.0, factor);
    motor.Lr_factor = in.number_or("controller_motor.Lr_factor", 1.0, factor);
    motor.M_factor = in.number_or("controller_motor.M_factor", 1.0, factor);
    return motor;
}

} // namespace

double Disturbances::holds_until(double t_s) const
{
    const double motor_s = std::min(
        {load_torque_Nm.holds_until(t_s), rs_factor.holds_until(t_s), rr_factor.holds_until(t_s)});
    return u_dc_V ? std::min(motor_s, u_dc_V->holds_until(t_s)) : motor_s;
}

double Disturbances::slopes_until(double t_s) const
{
    const double motor_s = std::max({load_torque_Nm.slopes_until(t_s), rs_factor.slopes_until(t_s),
                                     rr_factor.slopes_until(t_s)});
    return u_dc_V ? std::max(motor_s, u_dc_V->slopes_until(t_s)) : motor_s;
}

std::uint32_t Scenario::command(double t_s) const
{
    std::uint32_t bits = 0;
    if ((t_s >= run_on_s && t_s < run_off_s) || t_s >= run_again_s) {
        bits |= command_run;
    }
    if (t_s >= fault_reset_s && t_s < fault_reset_s + fault_reset_pulse_s) {
        bits |= command_fault_reset;
    }
    if (t_s >= torque_off_s && t_s < torque_off_end_s) {
        bits |= command_torque_off;
    }
    if (t_s >= torque_mode_on_s && t_s < torque_mode_off_s) {
        bits |= command_torque_mode;
    }
    if (t_s >= commission_s) {
        bits |= command_commission;
    }
    return bits;
}

double Scenario::command_holds_until(double t_s) const
{
    double until_s = std::min(speed_ref_rpm.holds_until(t_s), torque_ref_Nm.holds_until(t_s));
    for (const double change_s :
         {run_on_s, run_off_s, run_again_s, fault_reset_s, fault_reset_s + fault_reset_pulse_s,
          torque_off_s, torque_off_end_s, torque_mode_on_s, torque_mode_off_s, commission_s}) {
        until_s = change_s > t_s ? std::min(until_s, change_s) : until_s;
    }
    return until_s;
}

Scenario read_scenario(const TomlDocument &document)
{
    TomlReader in(document);
    Scenario s;
    s.name = in.text("scenario.name");
    s.title = in.text_or("scenario.title", "");
    s.figure = in.integer_or("scenario.figure", 0, 0, 99);
    s.protocol = "none";
    if (in.has("scenario.protocol")) {
        constexpr std::array<const char *, 3> words{"S", "R", "none"};
        s.protocol = words[in.choice("scenario.protocol", {"S", "R", "none"})];
    }
    s.duration_s = in.number("scenario.duration_s", positive(longest_s));
    s.step_time_s = time_or_never(in, "scenario.step_time_s");
    s.ramp_start_s = time_or_never(in, "scenario.ramp_start_s");
    s.noise_seed = static_cast<std::uint64_t>(
        in.integer_or("scenario.noise_seed", 1, 0, std::numeric_limits<int>::max()));
    s.run_on_s = time_or_never(in, "scenario.run_on_s");
    s.run_off_s = time_or_never(in, "scenario.run_off_s");
    s.run_again_s = time_or_never(in, "scenario.run_again_s");
    s.fault_reset_s = time_or_never(in, "scenario.fault_reset_s");
    s.torque_off_s = time_or_never(in, "scenario.torque_off_s");
    s.torque_off_end_s = time_or_never(in, "scenario.torque_off_end_s");
    s.torque_mode_on_s = time_or_never(in, "scenario.torque_mode_on_s");
    s.torque_mode_off_s = time_or_never(in, "scenario.torque_mode_off_s");
    s.silent_from_s = time_or_never(in, "scenario.silent_from_s");
    s.commission_s = time_or_never(in, "scenario.commission_s");
    s.speed_ref_rpm = in.profile("profiles.speed_ref_rpm", within(-1e5, 1e5));
    s.torque_ref_Nm = in.profile_or("profiles.torque_ref_Nm", 0.0, within(-1e5, 1e5));
    read_disturbances(in, s.disturbances);
    s.controller_motor = read_controller_motor(in);
    s.firmware = in.pass_through("firmware");
    if (s.protocol == "S" && s.step_time_s >= s.duration_s) {
        in.reject("scenario.step_time_s", "protocol S needs the time of the speed step",
                  "give a time below scenario.duration_s");
    }
    if (s.protocol == "R" && s.ramp_start_s >= s.duration_s) {
        in.reject("scenario.ramp_start_s", "protocol R needs the start of the load ramp",
                  "give a time below scenario.duration_s");
    }
    in.finish();
    return s;
}

Scenario load_scenario(const std::string &path)
{
    return read_scenario(TomlDocument::from_file(path));
}

} // namespace zh
