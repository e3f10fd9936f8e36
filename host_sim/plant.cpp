#include "plant.hpp"

#include <algorithm>
#include <cmath>

namespace zh {
namespace {

// Terminal voltages fall by `slope` ohm times the current inside the threshold; an explicit step of
// h through the transient inductance needs slope h / L < 1, or the model would chatter.
void check_threshold(double threshold_A, double slope_V, double h_s, double transient_H)
{
    const double least_A = slope_V * h_s / transient_H;
    if (threshold_A < least_A) {
        throw ConfigError("rig: inverter.i_threshold_A: " + std::to_string(threshold_A) +
                          " is too steep for this motor and dead time; give at least " +
                          std::to_string(least_A) + ", or a larger inverter.leg_F");
    }
}

// The dead-time error's slope at no current is that of a curve which ends at this current.
double dead_threshold_A(const InverterParameters &inverter)
{
    return inverter.leg_F > 0.0 && inverter.dead_time_s > 0.0
               ? 2.0 * inverter.leg_F * inverter.u_dc_V / inverter.dead_time_s
               : inverter.i_threshold_A;
}

double transient_H(const MotorParameters &m)
{
    return m.Ls_H - m.M_H * m.M_H / m.Lr_H;
}

void check_fit(const Rig &rig, const Board &board)
{
    const InverterParameters &inverter = rig.inverter;
    if (std::abs(inverter.carrier_Hz * board.period_s - 1.0) > 1e-9) {
        throw ConfigError(
            "rig: inverter.carrier_Hz: one carrier period must be one control period; "
            "make it 1 / control.period_s of the board");
    }
    const double step_s =
        board.period_s / (rig.integration.substeps > 0 ? rig.integration.substeps : 2);
    const double dead_V = inverter.dead_time_s * inverter.carrier_Hz * inverter.u_dc_V;
    if (inverter.model == InverterModel::averaged) {
        const double alone_V = inverter.leg_F > 0.0 ? 0.0 : dead_V;
        check_threshold(inverter.i_threshold_A, alone_V + inverter.drop_V, step_s,
                        transient_H(rig.motor));
        check_threshold(dead_threshold_A(inverter), dead_V, step_s, transient_H(rig.motor));
    } else {
        check_threshold(dead_threshold_A(inverter), 0.5 * inverter.u_dc_V, inverter.dead_time_s,
                        transient_H(rig.motor));
        check_threshold(inverter.i_threshold_A, inverter.drop_V, step_s, transient_H(rig.motor));
    }
}

bool never_in_parts(const Faults &faults, double comparator_A)
{
    return !(comparator_A > 0.0) && !(faults.open_s < never_s) && !(faults.short_s < never_s) &&
           !(faults.earth_s < never_s) && faults.dead_leg == no_leg;
}

// One step per averaged period, its dead time at the current expected in the middle: z^2 - (1 - 1.5
// a) z - a/2 = 0, a = slope h / (L i_threshold), is well damped up to here (|z| = 1 at a = 1).
constexpr double whole_step_share = 0.6;

bool whole_step_fits(const Rig &rig, double period_s)
{
    const InverterParameters &inverter = rig.inverter;
    const double slope_V =
        inverter.dead_time_s * inverter.carrier_Hz * inverter.u_dc_V + inverter.drop_V;
    const double steepest_A = std::min(inverter.i_threshold_A, dead_threshold_A(inverter));
    return slope_V * period_s < whole_step_share * transient_H(rig.motor) * steepest_A;
}

} // namespace

Plant::Plant(const Rig &rig, const Board &board, const Disturbances &disturbances,
             std::uint64_t seed)
    : period_s_(board.period_s), motor_(rig.motor, rig.integration.method), shaft_(rig.mechanics),
      elastic_(rig.mechanics), inverter_(rig.inverter), sensors_(rig.sensors, board, seed),
      filter_(board.filter_cutoff_Hz, board.filter_damping, board.period_s),
      whole_period_(filter_.transition(board.period_s)),
      half_period_(filter_.transition(0.5 * board.period_s)),
      blocked_step_(filter_.transition(board.period_s / blocked_steps)),
      part_step_(filter_.transition(board.period_s / fine_parts)), disturbances_(disturbances),
      drop_V_(rig.inverter.drop_V), substeps_(rig.integration.substeps),
      whole_steps_(whole_step_fits(rig, board.period_s)),
      substep_(filter_.transition(board.period_s / std::max(substeps_, 1))),
      link_(rig.dc_link, rig.inverter.u_dc_V), u_dc_V_(rig.inverter.u_dc_V),
      faulty_sensors_(disturbances.faults.sensors, board.adc_bits, seed), adc_bits_(board.adc_bits),
      seed_(seed), comparator_A_(board.comparator_A),
      comparator_near_A_(board.comparator_A -
                         rig.inverter.u_dc_V * board.period_s / transient_H(rig.motor)),
      never_in_parts_(never_in_parts(disturbances.faults, comparator_A_))
{
    check_fit(rig, board);
    inverter_.block();
    follow_disturbances();
    const MotorParameters &m = rig.motor;
    x_.omega_m_rad_s = disturbances.initial_speed_rpm * rad_s_per_rpm;
    elastic_.turn_with(x_.omega_m_rad_s);
    x_.psi_r_Wb = {disturbances.initial_flux_Wb, 0.0};
    x_.psi_s_Wb = (m.M_H / m.Lr_H) * x_.psi_r_Wb; // no stator current
}

void Plant::set_state(const MotorState &state)
{
    x_ = state;
    elastic_.turn_with(state.omega_m_rad_s);
    open_ = {false, false, false};
    blocked_ = false;
    i_s_before_A_ = motor_.stator_current(x_);
}

void Plant::disturb(const Disturbances &disturbances)
{
    const Faults &faults = disturbances.faults;
    if (faults.sensors != disturbances_.faults.sensors) {
        faulty_sensors_ = FaultySensors(faults.sensors, adc_bits_, seed_);
    }
    disturbances_ = disturbances;
    never_in_parts_ = never_in_parts(faults, comparator_A_);
    quiet_until_s_ = slope_until_s_ = 0.0;
    load_cursor_ = rs_cursor_ = rr_cursor_ = u_dc_cursor_ = 0;
    short_A_ = time_s() >= faults.short_s ? short_A_ : 0.0;
    earth_A_ = time_s() >= faults.earth_s ? earth_A_ : 0.0;
}

Words Plant::sample()
{
    const auto [uv_V, vw_V] = lines_at_legs();
    const Codes codes = sensors_.sample(currents_at_legs(), uv_V, vw_V, u_dc_V_);
    return faulty_sensors_.apply(codes, time_s());
}

// Profiles are read in the middle of the interval, which is the mean of a straight line over it.
void Plant::follow_disturbances()
{
    const double t_s = time_s() + 0.5 * period_s_;
    const bool quiet = t_s < quiet_until_s_;
    if (!quiet) {
        if (!(t_s < slope_until_s_)) {
            quiet_until_s_ = disturbances_.holds_until(t_s);
            slope_until_s_ = disturbances_.slopes_until(t_s);
        }
        profile_load_Nm_ = disturbances_.load_torque_Nm.value(t_s, load_cursor_);
        load_torque_Nm_ = profile_load_Nm_;
        motor_.set_stator_resistance_factor(disturbances_.rs_factor.value(t_s, rs_cursor_));
        motor_.set_rotor_resistance_factor(disturbances_.rr_factor.value(t_s, rr_cursor_));
        source_V_ = disturbances_.u_dc_V ? disturbances_.u_dc_V->value(t_s, u_dc_cursor_)
                                         : inverter_.parameters().u_dc_V;
    }
    if (!quiet || link_.ripples()) {
        const double sine =
            link_.ripples() ? ripple_sine_(steps_, link_.ripple_Hz(), period_s_) : 0.0;
        link_.follow(source_V_, sine);
        u_dc_V_ = link_.u_dc_V();
    }
    const LoadLaw &load = disturbances_.load;
    if (!load.constant()) {
        const double omega_rad_s = elastic_.present() ? elastic_.omega_rad_s() : x_.omega_m_rad_s;
        load_torque_Nm_ = load.torque_Nm(profile_load_Nm_, omega_rad_s, t_s) -
                          load.servo_Nm_per_turn * flux_turns_.turns();
    }
}

void Plant::advance(const Duty &duty, bool gates_on, bool brake_on)
{
    step_interval(begin_interval(gates_on), duty);
    end_interval(brake_on);
}

Plant::Interval Plant::begin_interval(bool gates_on)
{
    if (diverged_) {
        return Interval::none;
    }
    follow_disturbances();
    if (!jammed_ && time_s() >= disturbances_.faults.jam_s) {
        jammed_ = true;
        shaft_.add_friction(disturbances_.faults.jam_Nm);
    }
    shaft_load_Nm_ = elastic_.present()
                         ? elastic_.advance(x_.omega_m_rad_s, load_torque_Nm_, period_s_)
                         : load_torque_Nm_;
    u_s_V_s_ = {};
    energy_J_ = 0.0;
    i_peak_A_ = 0.0;
    broken_ = broken_ && gates_on;
    if (!gates_on || broken_) {
        return Interval::blocked;
    }
    if (needs_parts()) {
        return Interval::in_parts;
    }
    return inverter_.parameters().model == InverterModel::averaged ? Interval::averaged
                                                                   : Interval::switched;
}

void Plant::step_interval(Interval interval, const Duty &legs)
{
    const Duty duty = crossed() ? duty_of_terminals(legs) : legs;
    switch (interval) {
    case Interval::none:
        break;
    case Interval::blocked:
        short_A_ = 0.0;
        earth_A_ = 0.0;
        advance_blocked();
        break;
    case Interval::in_parts:
        advance_in_parts(duty);
        break;
    case Interval::averaged:
        advance_averaged(duty);
        break;
    case Interval::switched:
        blocked_ = false;
        advance_switched(duty);
        break;
    }
}

void Plant::follow_flux()
{
    const LoadLaw &load = disturbances_.load;
    if (!load.servo()) {
        return;
    }
    if (time_s() < load.servo_from_s) {
        flux_turns_.start(x_.psi_r_Wb);
    } else {
        flux_turns_.follow(x_.psi_r_Wb);
    }
}

void Plant::end_interval(bool brake_on)
{
    if (!diverged_) {
        follow_flux();
        link_.advance(energy_J_ / period_s_, brake_on, period_s_);
        u_dc_V_ = link_.u_dc_V();
        // Generous bounds in Wb and rad/s; the comparison is false for NaN as well.
        const double size = dot(x_.psi_s_Wb, x_.psi_s_Wb) + dot(x_.psi_r_Wb, x_.psi_r_Wb) +
                            1e-6 * x_.omega_m_rad_s * x_.omega_m_rad_s;
        diverged_ = !(size < 1e6);
    }
    ++steps_;
}

// What PlantLanes can do: one step of the linear motor per averaged period or switched segment, and
// no current that does not flow through the motor, and a friction that stays.
bool Plant::fits_lanes() const
{
    const bool averaged = inverter_.parameters().model == InverterModel::averaged;
    const Faults &f = disturbances_.faults;
    const bool plain = !(f.short_s < never_s) && !(f.earth_s < never_s) && !(f.jam_s < never_s) &&
                       !crossed() && f.dead_leg == no_leg;
    return motor_.is_linear() && substeps_ == 0 && plain && inverter_.ideal_devices() &&
           disturbances_.rr_factor.constant() && (averaged ? whole_steps_ : filter_.series_fits());
}

// One step over the whole period: against 64 steps per period four times closer than two half steps
// with the current at their starts, and half the work. A steep dead-time curve needs the half
// steps.
void Plant::advance_averaged(const Duty &duty)
{
    const Segment half = inverter_.averaged_half(duty);
    if (substeps_ > 0) {
        blocked_ = false;
        for (int n = 0; n < substeps_; ++n) {
            integrate(half, period_s_ / substeps_, substep_);
        }
        return;
    }
    const Vec i_s = motor_.stator_current(x_);
    const Vec i_mid = blocked_ ? i_s : i_s + 0.5 * (i_s - i_s_before_A_);
    blocked_ = false;
    i_s_before_A_ = i_s;
    if (!whole_steps_) {
        integrate(half, half.h_s, half_period_);
        integrate(half, half.h_s, half_period_);
        return;
    }
    const Phases v = inverter_.leg_voltages(half, phases_from_vec(i_mid), u_dc_V_);
    apply(vec_from_phases(v), i_s, period_s_);
    filter_.advance(whole_period_, v[0] - v[1], v[1] - v[2]);
}

int Plant::parts_of(double segment_s) const
{
    if (substeps_ > 0) {
        return std::max(1, static_cast<int>(std::ceil(segment_s / period_s_ * substeps_ - 1e-9)));
    }
    return segment_s > 0.51 * period_s_ ? 2 : 1;
}

void Plant::advance_switched(const Duty &duty)
{
    for (const Segment &segment : inverter_.schedule(duty)) {
        const int parts = parts_of(segment.h_s);
        const double h_s = segment.h_s / parts;
        const Transition transition = filter_.part_of_period(h_s);
        for (int part = 0; part < parts; ++part) {
            integrate(segment, h_s, transition);
        }
    }
}

void Plant::integrate(const Segment &segment, double h_s, const Transition &transition)
{
    const Vec i_s = motor_.stator_current(x_);
    const Phases v = inverter_.leg_voltages(segment, phases_from_vec(i_s), u_dc_V_);
    apply(vec_from_phases(v), i_s, h_s);
    filter_.advance(transition, v[0] - v[1], v[1] - v[2]);
}

void Plant::apply(Vec u_s_V, Vec i_s_A, double h_s)
{
    const double omega_before = x_.omega_m_rad_s;
    const ShaftDrive shaft =
        shaft_.begin(omega_before, motor_.torque_Nm(x_, i_s_A), shaft_load_Nm_);
    motor_.step(x_, u_s_V, shaft, h_s);
    settle_shaft(omega_before, h_s);
    u_s_V_s_ = u_s_V_s_ + h_s * u_s_V;
    // The mean current: that of the start lags by w h/2, and reactive power would feed the link.
    energy_J_ += 0.5 * h_s * dot(u_s_V, i_s_A + motor_.stator_current(x_));
}

void Plant::settle_shaft(double omega_before_rad_s, double h_s)
{
    if (shaft_.reversed(x_.omega_m_rad_s)) {
        x_.omega_m_rad_s = shaft_.settle(omega_before_rad_s, x_.omega_m_rad_s, motor_.torque_Nm(x_),
                                         shaft_load_Nm_, h_s);
    }
}

Truth Plant::truth() const
{
    const Vec i_s = motor_.stator_current(x_);
    return {time_s(),
            x_.omega_m_rad_s,
            motor_.torque_Nm(x_),
            load_torque_Nm_,
            i_s,
            x_.psi_s_Wb,
            x_.psi_r_Wb,
            phases_from_vec(i_s),
            std::max(i_peak_A_, largest(leg_currents())),
            (1.0 / period_s_) * u_s_V_s_,
            u_dc_V_};
}

} // namespace zh
