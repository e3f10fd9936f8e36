// Control periods in which something is broken, or a current may reach the board's comparator: in
// parts as short as the comparator takes to act.
//
// The motor sees the period's mean leg voltages as ever; a short and an earth fault are driven by
// the switched ones, for they know no inductance that would average. They end with the gates: the
// current of a short then freewheels against the dc link, that into earth stops.
#include "plant.hpp"

#include <algorithm>
#include <cmath>

namespace zh {
namespace {

double middle_of(int part)
{
    return (part + 0.5) / Plant::fine_parts;
}

// A leg at an instant of the carrier period: half the dc link, up or down.
double switched_leg_V(double duty, int part, double u_dc_V)
{
    const bool high = std::abs(middle_of(part) - 0.5) < 0.5 * duty;
    return high ? 0.5 * u_dc_V : -0.5 * u_dc_V;
}

} // namespace

Phases Plant::leg_currents() const
{
    Phases i_A = phases_from_vec(motor_.stator_current(x_));
    i_A[0] += short_A_;
    i_A[1] -= short_A_;
    i_A[disturbances_.faults.earth_phase] += earth_A_;
    return i_A;
}

bool Plant::crossed() const
{
    const Faults &f = disturbances_.faults;
    return f.cables != straight || f.gates != straight;
}

// The plant counts in motor terminals; a crossing of two is its own inverse.
Duty Plant::duty_of_terminals(const Duty &legs) const
{
    const Faults &f = disturbances_.faults;
    Duty duty{};
    for (std::size_t x = 0; x < 3; ++x) {
        duty[x] = legs[f.gates[f.cables[x]]];
    }
    return duty;
}

Phases Plant::currents_at_legs() const
{
    const Phases i_A = leg_currents();
    const Crossing &c = disturbances_.faults.cables;
    return {i_A[c[0]], i_A[c[1]], i_A[c[2]]};
}

std::array<double, 2> Plant::lines_at_legs() const
{
    const double uv_V = filter_.u_uv_V();
    const double vw_V = filter_.u_vw_V();
    const Crossing &c = disturbances_.faults.cables;
    if (c == straight) {
        return {uv_V, vw_V};
    }
    const Phases v{0.0, -uv_V, -uv_V - vw_V};
    return {v[c[0]] - v[c[1]], v[c[1]] - v[c[2]]};
}

bool Plant::over_comparator(const Phases &i_A) const
{
    return comparator_A_ > 0.0 && largest(i_A) > comparator_A_;
}

bool Plant::phase_open() const
{
    const Faults &f = disturbances_.faults;
    return time_s() >= f.open_s && time_s() < f.open_end_s;
}

bool Plant::needs_parts() const
{
    if (never_in_parts_) {
        return false;
    }
    const Faults &f = disturbances_.faults;
    const double t_s = time_s();
    return phase_open() || f.dead_leg != no_leg || t_s >= f.short_s || t_s >= f.earth_s ||
           (comparator_A_ > 0.0 && largest(leg_currents()) > comparator_near_A_);
}

void Plant::follow_leaks(const Duty &duty, int part)
{
    const Faults &f = disturbances_.faults;
    const double h_s = period_s_ / fine_parts;
    if (time_s() >= f.earth_s) {
        const double leg_V = switched_leg_V(duty[f.earth_phase], part, u_dc_V_);
        earth_A_ = broken_ ? 0.0 : leg_V / f.earth_ohm;
    }
    if (time_s() < f.short_s) {
        return;
    }
    if (broken_) {
        const double fall_A = u_dc_V_ * h_s / f.short_H;
        short_A_ = std::copysign(std::max(0.0, std::abs(short_A_) - fall_A), short_A_);
        return;
    }
    const double between_V =
        switched_leg_V(duty[0], part, u_dc_V_) - switched_leg_V(duty[1], part, u_dc_V_);
    // Implicit, so that no resistance is too large for the step.
    short_A_ = (short_A_ + between_V * h_s / f.short_H) / (1.0 + f.short_ohm * h_s / f.short_H);
}

void Plant::advance_in_parts(const Duty &duty)
{
    const Segment half = inverter_.averaged_half(duty);
    const double h_s = period_s_ / fine_parts;
    const bool open = phase_open();
    const bool dead = disturbances_.faults.dead_leg != no_leg;
    const bool contactor = disturbances_.faults.open_phase == all_phases;
    blocked_ = false;
    i_s_before_A_ = motor_.stator_current(x_);
    for (int part = 0; part < fine_parts; ++part) {
        if (broken_) {
            step_blocked(h_s, part_step_);
        } else if (open) {
            contactor ? step_open_contactor(half, h_s) : step_open_phase(half, h_s);
        } else if (dead) {
            step_dead_switch(half, h_s);
        } else {
            integrate(half, h_s, part_step_);
        }
        follow_leaks(duty, part);
        const Phases i_A = leg_currents();
        i_peak_A_ = std::max(i_peak_A_, largest(i_A));
        if (!broken_ && over_comparator(i_A)) {
            broken_ = true;
            enter_blocked();
        }
    }
    if (!broken_) {
        // Of the earth fault only what flows at the crest is sampled: the legs are low there.
        follow_leaks(duty, fine_parts - 1);
    }
}

// Two legs drive, the third phase's terminal floats on its EMF: its current stands still, at zero.
void Plant::step_open_phase(const Segment &half, double h_s)
{
    const std::size_t x = disturbances_.faults.open_phase;
    const std::size_t y = (x + 1) % 3;
    const std::size_t z = (x + 2) % 3;
    const auto without_x = [&](Phases i_A) {
        i_A[x] = 0.0;
        i_A[y] = 0.5 * (i_A[y] - i_A[z]);
        i_A[z] = -i_A[y];
        x_.psi_s_Wb = motor_.stator_flux(x_.psi_r_Wb, vec_from_phases(i_A));
    };
    without_x(phases_from_vec(motor_.stator_current(x_)));
    const Vec i_s_A = motor_.stator_current(x_);
    const Phases emf_V = phases_from_vec(motor_.transient_emf(x_));
    Phases v = inverter_.leg_voltages(half, phases_from_vec(i_s_A), u_dc_V_);
    v[x] = 0.5 * (v[y] + v[z] + emf_V[x]) + emf_V[x];
    apply(vec_from_phases(v), i_s_A, h_s);
    filter_.advance(part_step_, v[0] - v[1], v[1] - v[2]);
    without_x(phases_from_vec(motor_.stator_current(x_)));
}

// The leg of a switch that never turns on follows its duty, by the diode beside it, only while the
// current flows through that diode; the other diode holds it at the other rail.
void Plant::step_dead_switch(const Segment &half, double h_s)
{
    const Faults &f = disturbances_.faults;
    const std::size_t x = f.cables[f.dead_leg];
    const Vec i_s_A = motor_.stator_current(x_);
    const Phases i_A = phases_from_vec(i_s_A);
    Phases v = inverter_.leg_voltages(half, i_A, u_dc_V_);
    const double sign = f.dead_upper ? 1.0 : -1.0;
    const double share = clamp01(sign * i_A[x] * inverter_.leg().inv_threshold_per_A);
    v[x] += share * (-sign * (0.5 * u_dc_V_ + drop_V_) - v[x]);
    apply(vec_from_phases(v), i_s_A, h_s);
    filter_.advance(part_step_, v[0] - v[1], v[1] - v[2]);
}

// The motor turns on its rotor flux alone; the sensors see the inverter's voltages without load.
void Plant::step_open_contactor(const Segment &half, double h_s)
{
    const double omega_before = x_.omega_m_rad_s;
    const Vec flux_before_Wb = x_.psi_s_Wb;
    x_.psi_s_Wb = motor_.stator_flux(x_.psi_r_Wb, {});
    motor_.step_open(x_, shaft_.begin(omega_before, 0.0, shaft_load_Nm_), h_s);
    settle_shaft(omega_before, h_s);
    u_s_V_s_ = u_s_V_s_ + (x_.psi_s_Wb - flux_before_Wb);
    const Phases v = inverter_.leg_voltages(half, {}, u_dc_V_);
    filter_.advance(part_step_, v[0] - v[1], v[1] - v[2]);
}

} // namespace zh
