// Control periods with the gates off: the diodes conduct until the currents have gone out, then the
// terminals are open.
#include "plant.hpp"

#include <algorithm>
#include <cmath>

namespace zh {
namespace {

// A current this small at the moment of blocking is no current.
constexpr double extinct_A = 1e-3;

} // namespace

void Plant::advance_blocked()
{
    enter_blocked();
    const Phases emf_V = phases_from_vec(motor_.transient_emf(x_));
    const auto [lowest, highest] = std::minmax_element(emf_V.begin(), emf_V.end());
    const bool all_open = open_[0] && open_[1] && open_[2];
    // The margin is far more than the EMF can grow in one period.
    if (all_open && *highest - *lowest < 0.9 * (u_dc_V_ + 2.0 * drop_V_)) {
        step_open(0.5 * period_s_);
        step_open(0.5 * period_s_);
        return;
    }
    for (int n = 0; n < blocked_steps; ++n) {
        step_blocked(period_s_ / blocked_steps, blocked_step_);
    }
}

void Plant::enter_blocked()
{
    if (blocked_) {
        return;
    }
    blocked_ = true;
    inverter_.block();
    const Phases i_A = phases_from_vec(motor_.stator_current(x_));
    for (std::size_t x = 0; x < 3; ++x) {
        open_[x] = std::abs(i_A[x]) < extinct_A;
    }
    extinguish(i_A);
}

// Phase-to-neutral voltages of the diode bridge. `sign` is the direction of the current each diode
// allows: +1 lower, -1 upper, 0 none conducts. An open phase floats on its EMF until that leaves
// the rails; with no phase conducting the largest line EMF decides.
Phases Plant::blocked_voltages(const Phases &i_A, Phases &sign) const
{
    const double rail_V = 0.5 * u_dc_V_ + drop_V_;
    const Phases emf_V = phases_from_vec(motor_.transient_emf(x_));
    Phases v{};
    int open_count = 0;
    std::size_t floating = 0;
    for (std::size_t x = 0; x < 3; ++x) {
        sign[x] = open_[x] ? 0.0 : (i_A[x] > 0.0 ? 1.0 : -1.0);
        v[x] = -rail_V * sign[x];
        if (open_[x]) {
            ++open_count;
            floating = x;
        }
    }
    if (open_count > 1) {
        const auto high =
            static_cast<std::size_t>(std::max_element(emf_V.begin(), emf_V.end()) - emf_V.begin());
        const auto low =
            static_cast<std::size_t>(std::min_element(emf_V.begin(), emf_V.end()) - emf_V.begin());
        if (emf_V[high] - emf_V[low] <= 2.0 * rail_V) {
            return emf_V;
        }
        sign[high] = -1.0;
        sign[low] = 1.0;
        v[high] = rail_V;
        v[low] = -rail_V;
        floating = 3 - high - low;
        open_count = 1;
    }
    if (open_count == 0) {
        return without_common_mode(v);
    }
    const std::size_t y = (floating + 1) % 3;
    const std::size_t z = (floating + 2) % 3;
    const double neutral_V = 0.5 * (v[y] + v[z] + emf_V[floating]);
    v[floating] = neutral_V + emf_V[floating];
    if (std::abs(v[floating]) > rail_V) {
        sign[floating] = v[floating] > 0.0 ? -1.0 : 1.0;
        v[floating] = -rail_V * sign[floating];
        return without_common_mode(v);
    }
    return {v[0] - neutral_V, v[1] - neutral_V, v[2] - neutral_V};
}

void Plant::step_blocked(double h_s, const Transition &transition)
{
    Phases sign{};
    const Vec i_before = motor_.stator_current(x_);
    const Phases u = blocked_voltages(phases_from_vec(i_before), sign);
    apply(vec_from_phases(u), i_before, h_s);
    filter_.advance(transition, u[0] - u[1], u[1] - u[2]);
    const Phases i_A = phases_from_vec(motor_.stator_current(x_));
    for (std::size_t x = 0; x < 3; ++x) {
        open_[x] = !(i_A[x] * sign[x] > 0.0);
    }
    extinguish(i_A);
}

// Holds the current of open phases at zero; the other two then carry the same one.
void Plant::extinguish(const Phases &i_A)
{
    const int open_count = open_[0] + open_[1] + open_[2];
    if (open_count == 0) {
        return;
    }
    Phases i{};
    if (open_count == 1) {
        const std::size_t x = open_[0] ? 0 : (open_[1] ? 1 : 2);
        const std::size_t y = (x + 1) % 3;
        const std::size_t z = (x + 2) % 3;
        i[y] = 0.5 * (i_A[y] - i_A[z]);
        i[z] = -i[y];
    } else {
        open_ = {true, true, true};
    }
    x_.psi_s_Wb = motor_.stator_flux(x_.psi_r_Wb, vec_from_phases(i));
}

// No phase conducts: only the rotor flux is left; the terminals show its induced voltage.
void Plant::step_open(double h_s)
{
    const double omega_before = x_.omega_m_rad_s;
    const Vec flux_before = x_.psi_s_Wb;
    motor_.step_open(x_, shaft_.begin(omega_before, 0.0, shaft_load_Nm_), h_s);
    settle_shaft(omega_before, h_s);
    const Vec flux_change = x_.psi_s_Wb - flux_before;
    const Phases u = phases_from_vec((1.0 / h_s) * flux_change);
    filter_.advance(half_period_, u[0] - u[1], u[1] - u[2]);
    u_s_V_s_ = u_s_V_s_ + flux_change;
}

} // namespace zh
