#include "rig.hpp"

namespace zh {
namespace {

MotorParameters read_motor(TomlReader &in)
{
    MotorParameters motor;
    motor.Rs_ohm = in.number("motor.Rs_ohm", positive(1e3));
    motor.Rr_ohm = in.number("motor.Rr_ohm", positive(1e3));
    motor.Ls_H = in.number("motor.Ls_H", positive(1e2));
    motor.Lr_H = in.number("motor.Lr_H", positive(1e2));
    motor.M_H = in.number("motor.M_H", positive(1e2));
    motor.pole_pairs = in.integer("motor.pole_pairs", 1, 64);
    if (motor.M_H * motor.M_H >= motor.Ls_H * motor.Lr_H) {
        in.reject("motor.M_H", "leaves no leakage", "M_H must be below sqrt(Ls_H Lr_H)");
    }
    motor.saturation.flux_knee_Wb =
        in.number_or("motor.saturation.flux_knee_Wb", 0.0, not_negative(1e3));
    motor.saturation.exponent =
        in.integer_or("motor.saturation.exponent", motor.saturation.exponent, 2, 8);
    if (in.has("motor.saturation.law")) {
        motor.saturation.soft = in.choice("motor.saturation.law", {"power", "soft"}) == 1;
    }
    if (motor.saturation.exponent % 2 != 0) {
        in.reject("motor.saturation.exponent", "is odd", "give 2, 4, 6 or 8");
    }
    motor.iron_loss_ohm = in.number_or("motor.iron_loss_ohm", 0.0, not_negative(1e6));
    const bool saturated = motor.saturation.flux_knee_Wb > 0.0;
    if (saturated && (motor.Ls_H <= motor.M_H || motor.Lr_H < motor.M_H)) {
        in.reject("motor.M_H", "saturation needs leakages Ls_H - M_H > 0 and Lr_H - M_H >= 0",
                  "lower M_H or set motor.saturation.flux_knee_Wb = 0");
    }
    return motor;
}

Mechanics read_mechanics(TomlReader &in)
{
    Mechanics mechanics;
    mechanics.J_kg_m2 = in.number("mechanics.J_kg_m2", positive(1e4));
    mechanics.coulomb_Nm = in.number_or("mechanics.coulomb_Nm", 0.0, not_negative(1e5));
    mechanics.static_Nm =
        in.number_or("mechanics.static_Nm", mechanics.coulomb_Nm, not_negative(1e5));
    mechanics.viscous_Nms = in.number_or("mechanics.viscous_Nms", 0.0, not_negative(1e3));
    mechanics.load_J_kg_m2 = in.number_or("mechanics.load_J_kg_m2", 0.0, not_negative(1e4));
    mechanics.stiffness_Nm = in.number_or("mechanics.stiffness_Nm", 0.0, not_negative(1e9));
    mechanics.damping_Nms = in.number_or("mechanics.damping_Nms", 0.0, not_negative(1e5));
    if (mechanics.load_J_kg_m2 > 0.0 && !(mechanics.stiffness_Nm > 0.0)) {
        in.reject("mechanics.stiffness_Nm", "is missing beside mechanics.load_J_kg_m2",
                  "give the coupling's torque per rad");
    }
    if (mechanics.static_Nm < mechanics.coulomb_Nm) {
        in.reject("mechanics.static_Nm", "is below mechanics.coulomb_Nm",
                  "static friction is at least the sliding one");
    }
    return mechanics;
}

InverterParameters read_inverter(TomlReader &in)
{
    InverterParameters inverter;
    inverter.model = in.choice("inverter.model", {"averaged", "switched"}) == 0
                         ? InverterModel::averaged
                         : InverterModel::switched;
    inverter.u_dc_V = in.number("inverter.u_dc_V", positive(1e5));
    inverter.carrier_Hz = in.number("inverter.carrier_Hz", within(100.0, 1e6));
    inverter.dead_time_s = in.number_or("inverter.dead_time_s", 0.0, not_negative(1e-3));
    inverter.i_threshold_A =
        in.number_or("inverter.i_threshold_A", inverter.i_threshold_A, positive(1e3));
    inverter.drop_V = in.number_or("inverter.drop_V", 0.0, not_negative(100.0));
    inverter.drop_difference_V =
        in.number_or("inverter.drop_difference_V", 0.0, within(-100.0, 100.0));
    inverter.on_ohm = in.number_or("inverter.on_ohm", 0.0, not_negative(100.0));
    inverter.leg_F = in.number_or("inverter.leg_F", 0.0, not_negative(1e-6));
    if (inverter.dead_time_s * inverter.carrier_Hz > 0.25) {
        in.reject("inverter.dead_time_s", "is more than a quarter of the carrier period",
                  "give seconds, for example 3e-6");
    }
    return inverter;
}

DcLinkParameters read_dc_link(TomlReader &in)
{
    DcLinkParameters link;
    link.capacitance_F = in.number_or("dc_link.capacitance_F", 0.0, not_negative(1.0));
    link.source_ohm = in.number_or("dc_link.source_ohm", link.source_ohm, positive(1e3));
    link.chopper_ohm = in.number_or("dc_link.chopper_ohm", 0.0, not_negative(1e5));
    link.ripple_pu = in.number_or("dc_link.ripple_pu", 0.0, within(0.0, 0.5));
    link.ripple_Hz = in.number_or("dc_link.ripple_Hz", 0.0, not_negative(1e4));
    return link;
}

Integration read_integration(TomlReader &in)
{
    Integration integration;
    if (in.has("integration.method")) {
        integration.method = in.choice("integration.method", {"rk4", "heun"}) == 0
                                 ? IntegrationMethod::rk4
                                 : IntegrationMethod::heun;
    }
    integration.substeps = in.integer_or("integration.substeps", 0, 0, 1000);
    return integration;
}

SensorParameters read_sensors(TomlReader &in)
{
    const Range gain = within(0.5, 2.0);
    const Range offset_A = within(-1e3, 1e3);
    const Range offset_V = within(-1e3, 1e3);
    SensorParameters s;
    s.current_offset_A = in.numbers_or("sensors.current_offset_A", s.current_offset_A, offset_A);
    s.current_gain = in.numbers_or("sensors.current_gain", s.current_gain, gain);
    s.current_noise_A = in.number_or("sensors.current_noise_A", 0.0, not_negative(1e3));
    s.voltage_offset_V = in.numbers_or("sensors.voltage_offset_V", s.voltage_offset_V, offset_V);
    s.voltage_gain = in.numbers_or("sensors.voltage_gain", s.voltage_gain, gain);
    s.voltage_noise_V = in.number_or("sensors.voltage_noise_V", 0.0, not_negative(1e3));
    s.dc_gain = in.number_or("sensors.dc_gain", 1.0, gain);
    s.dc_offset_V = in.number_or("sensors.dc_offset_V", 0.0, offset_V);
    s.dc_noise_V = in.number_or("sensors.dc_noise_V", 0.0, not_negative(1e3));
    return s;
}

} // namespace

Rig read_rig(const TomlDocument &document)
{
    TomlReader in(document);
    Rig rig;
    rig.name = in.text_or("rig.name", "");
    rig.motor = read_motor(in);
    rig.mechanics = read_mechanics(in);
    rig.inverter = read_inverter(in);
    rig.dc_link = read_dc_link(in);
    rig.sensors = read_sensors(in);
    rig.integration = read_integration(in);
    in.pass_through("nameplate"); // all that the tools may know of this motor
    in.finish();
    return rig;
}

Rig load_rig(const std::string &path)
{
    return read_rig(TomlDocument::from_file(path));
}

} // namespace zh
