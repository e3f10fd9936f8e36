// The vector code of PlantLanes: one pass of each loop over k does several drives at once, so what
// is in it has no branch on a number and no call.
#include "plant_lanes.hpp"

#include <algorithm>
#include <cmath>

// One binary, eight or four doubles at a time where the machine can; the bits are the same without.
// Valgrind knows no AVX-512 and counts the code for AVX2.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__OPTIMIZE__) &&    \
    !defined(__SANITIZE_ADDRESS__)
#define ZH_VECTOR_CODE __attribute__((flatten, target_clones("avx512f", "avx2", "default")))
#else
#define ZH_VECTOR_CODE
#endif

namespace zh {

// One lane's numbers as the values that the steps work on.
struct PlantLanes::Lane {
    LinearMotor motor;
    Friction friction;
    LegConstants leg;
    double load_Nm, u_dc_V;
    MotorState x;
    LineVoltages y;
    Vec u_s_V_s;
    double energy_J;
    double direction, stuck;

    // Plant::apply and the filter's step: constant leg voltages for h.
    void integrate(const Phases &v, Vec i_s_A, double h_s, const FilterTransition &e)
    {
        const Vec u_s_V = vec_from_phases(v);
        const double omega_before = x.omega_m_rad_s;
        const ShaftMotion motion =
            begin_motion(friction, omega_before, motor.torque_Nm(x, i_s_A), load_Nm);
        x = runge_kutta(x, LinearIncrement(motor, u_s_V, motion.drive, h_s));
        const Vec i_after_A = motor.stator_current(x);
        const double net_Nm = motor.torque_Nm(x, i_after_A) - load_Nm;
        const double omega_passed =
            passed_zero(friction, motion.direction, omega_before, x.omega_m_rad_s, net_Nm, h_s);
        const bool reversed = motion.direction * x.omega_m_rad_s < 0.0;
        const double held = std::abs(motion.direction) > 0.0 ? 0.0 : 1.0;
        const double stopped = friction_holds(friction, net_Nm) ? 1.0 : 0.0;
        x.omega_m_rad_s = reversed ? omega_passed : x.omega_m_rad_s;
        direction = motion.direction;
        stuck = reversed ? stopped : held;
        u_s_V_s = u_s_V_s + h_s * u_s_V;
        energy_J = energy_J + 0.5 * h_s * dot(u_s_V, i_s_A + i_after_A);
        y = filtered(y, e, v[0] - v[1], v[1] - v[2]);
    }
    // In vector code a lane without this step takes it as well, and then forgets it.
    void hold_unless(bool steps, const Lane &before)
    {
        const auto choose = [steps](double &after, double old) { after = steps ? after : old; };
        choose(x.psi_s_Wb.alpha, before.x.psi_s_Wb.alpha);
        choose(x.psi_s_Wb.beta, before.x.psi_s_Wb.beta);
        choose(x.psi_r_Wb.alpha, before.x.psi_r_Wb.alpha);
        choose(x.psi_r_Wb.beta, before.x.psi_r_Wb.beta);
        choose(x.omega_m_rad_s, before.x.omega_m_rad_s);
        choose(y.uv_V, before.y.uv_V);
        choose(y.uv_slope_V, before.y.uv_slope_V);
        choose(y.vw_V, before.y.vw_V);
        choose(y.vw_slope_V, before.y.vw_slope_V);
        choose(u_s_V_s.alpha, before.u_s_V_s.alpha);
        choose(u_s_V_s.beta, before.u_s_V_s.beta);
        choose(energy_J, before.energy_J);
        choose(direction, before.direction);
        choose(stuck, before.stuck);
    }
    Phases leg_voltages(const Phases &level, const Phases &dead, Vec i_s_A) const
    {
        const Phases i_A = phases_from_vec(i_s_A);
        return {leg_voltage(leg, level[0], dead[0], i_A[0], u_dc_V),
                leg_voltage(leg, level[1], dead[1], i_A[1], u_dc_V),
                leg_voltage(leg, level[2], dead[2], i_A[2], u_dc_V)};
    }
};

[[gnu::always_inline]] inline PlantLanes::Lane PlantLanes::lane(std::size_t k) const
{
    const Constants &c = constants_;
    const State &s = state_;
    const Inputs &in = inputs_;
    return {{in.Rs[k], c.Rr[k], c.pole_pairs[k], c.y_ss[k], c.y_sr[k], c.y_rr[k]},
            {c.coulomb[k], c.static_friction[k], c.viscous[k], c.inv_J[k]},
            {c.inv_threshold[k], c.drop[k]},
            in.load[k],
            in.u_dc[k],
            {{s.psi_s_alpha[k], s.psi_s_beta[k]}, {s.psi_r_alpha[k], s.psi_r_beta[k]}, s.omega[k]},
            {s.uv[k], s.uv_slope[k], s.vw[k], s.vw_slope[k]},
            {s.u_s_alpha[k], s.u_s_beta[k]},
            s.energy[k],
            s.direction[k],
            s.stuck[k]};
}

[[gnu::always_inline]] inline void PlantLanes::keep(std::size_t k, const Lane &d)
{
    State &s = state_;
    s.psi_s_alpha[k] = d.x.psi_s_Wb.alpha;
    s.psi_s_beta[k] = d.x.psi_s_Wb.beta;
    s.psi_r_alpha[k] = d.x.psi_r_Wb.alpha;
    s.psi_r_beta[k] = d.x.psi_r_Wb.beta;
    s.omega[k] = d.x.omega_m_rad_s;
    s.uv[k] = d.y.uv_V;
    s.uv_slope[k] = d.y.uv_slope_V;
    s.vw[k] = d.y.vw_V;
    s.vw_slope[k] = d.y.vw_slope_V;
    s.u_s_alpha[k] = d.u_s_V_s.alpha;
    s.u_s_beta[k] = d.u_s_V_s.beta;
    s.energy[k] = d.energy_J;
    s.direction[k] = d.direction;
    s.stuck[k] = d.stuck;
}

// Plant::advance_averaged, one step over the period.
ZH_VECTOR_CODE void PlantLanes::step_averaged()
{
    const Constants &c = constants_;
    const Inputs &in = inputs_;
    for (std::size_t k = 0; k < width; ++k) {
        Lane d = lane(k);
        const Vec i_s_A = d.motor.stator_current(d.x);
        const Vec i_before_A{state_.i_before_alpha[k], state_.i_before_beta[k]};
        const Vec i_mid_A = i_s_A + 0.5 * (i_s_A - i_before_A);
        const Phases level{clamp01(in.duty[0][k]), clamp01(in.duty[1][k]), clamp01(in.duty[2][k])};
        const Phases dead{averaged_dead(level[0], c.dead_share[k]),
                          averaged_dead(level[1], c.dead_share[k]),
                          averaged_dead(level[2], c.dead_share[k])};
        d.integrate(d.leg_voltages(level, dead, i_mid_A), i_s_A, c.period[k],
                    {c.whole_p[k], c.whole_q[k], c.whole_r[k]});
        state_.i_before_alpha[k] = i_s_A.alpha;
        state_.i_before_beta[k] = i_s_A.beta;
        keep(k, d);
    }
}

// Inverter::schedule of a plain period (Inverter::plain): three legs go up and are up, three go
// down and are down, each group in order; of two neighbouring groups only the middle ones can
// overlap.
ZH_VECTOR_CODE void PlantLanes::schedule()
{
    Switching &s = switching_;
    for (std::size_t k = 0; k < width; ++k) {
        const double period_s = constants_.period[k];
        const double dead_s = constants_.dead_time[k];
        std::array<double, stretches - 1> t{};
        for (const std::size_t edge : {0U, 2U}) {
            const double sign = edge == 0 ? -1.0 : 1.0;
            const double u_s = 0.5 * period_s * (1.0 + sign * inputs_.duty[0][k]);
            const double v_s = 0.5 * period_s * (1.0 + sign * inputs_.duty[1][k]);
            const double w_s = 0.5 * period_s * (1.0 + sign * inputs_.duty[2][k]);
            s.edge_s[0][edge][k] = u_s;
            s.edge_s[1][edge][k] = v_s;
            s.edge_s[2][edge][k] = w_s;
            s.edge_s[0][edge + 1][k] = u_s + dead_s;
            s.edge_s[1][edge + 1][k] = v_s + dead_s;
            s.edge_s[2][edge + 1][k] = w_s + dead_s;
            // Three in order.
            const double low_s = std::min(u_s, v_s);
            const double high_s = std::max(u_s, v_s);
            const double first_s = std::min(low_s, w_s);
            const double rest_s = std::max(low_s, w_s);
            const double second_s = std::min(high_s, rest_s);
            const double third_s = std::max(high_s, rest_s);
            // first, {second, third} merged with {first, second} + dead, third + dead
            const double later_s = std::max(second_s, first_s + dead_s);
            const double earlier_s = std::min(third_s, second_s + dead_s);
            const std::size_t n = 3 * edge;
            t[n] = first_s;
            t[n + 1] = std::min(second_s, first_s + dead_s);
            t[n + 2] = std::min(later_s, earlier_s);
            t[n + 3] = std::max(later_s, earlier_s);
            t[n + 4] = std::max(third_s, second_s + dead_s);
            t[n + 5] = third_s + dead_s;
        }
        s.start_s[0][k] = 0.0;
        s.h_s[0][k] = t[0];
        for (std::size_t n = 1; n + 1 < stretches; ++n) {
            s.start_s[n][k] = t[n - 1];
            s.h_s[n][k] = t[n] - t[n - 1];
        }
        s.start_s[stretches - 1][k] = t[stretches - 2];
        s.h_s[stretches - 1][k] = period_s - t[stretches - 2];
    }
}

// Plant::integrate over one stretch after the other.
ZH_VECTOR_CODE void PlantLanes::step_switched()
{
    const Constants &c = constants_;
    for (std::size_t n = 0; n < stretches; ++n) {
        for (std::size_t k = 0; k < width; ++k) {
            const TransitionSeries series{{c.series_p[0][k], c.series_p[1][k], c.series_p[2][k],
                                           c.series_p[3][k], c.series_p[4][k], c.series_p[5][k],
                                           c.series_p[6][k], c.series_p[7][k], c.series_p[8][k]},
                                          {c.series_q[0][k], c.series_q[1][k], c.series_q[2][k],
                                           c.series_q[3][k], c.series_q[4][k], c.series_q[5][k],
                                           c.series_q[6][k], c.series_q[7][k], c.series_q[8][k]},
                                          c.twice_damping[k]};
            const double t_s = switching_.start_s[n][k];
            const double h_s = switching_.h_s[n][k];
            const auto &[u, v, w] = switching_.edge_s;
            const auto level = [t_s, k](const std::array<Numbers, 4> &edge) {
                const double up = t_s < edge[0][k] ? 0.0 : 0.5;
                const double on = t_s < edge[1][k] ? up : 1.0;
                const double down = t_s < edge[2][k] ? on : 0.5;
                return t_s < edge[3][k] ? down : 0.0;
            };
            const Phases levels{level(u), level(v), level(w)};
            const auto dead = [](double x) { return std::abs(x - 0.5) > 0.0 ? 0.0 : 0.5; };
            const Lane before = lane(k);
            Lane d = before;
            const Vec i_s_A = d.motor.stator_current(d.x);
            const Phases deads{dead(levels[0]), dead(levels[1]), dead(levels[2])};
            d.integrate(d.leg_voltages(levels, deads, i_s_A), i_s_A, h_s, series(h_s));
            d.hold_unless(h_s > 0.0, before);
            keep(k, d);
        }
    }
}

// Sensors::sample with the noise of every lane's own source.
ZH_VECTOR_CODE void PlantLanes::convert()
{
    const Constants &c = constants_;
    const State &s = state_;
    const auto code = [&c](std::size_t channel, std::size_t k, double value, double draw) {
        return wide_code({c.gain[channel][k], c.offset[channel][k], c.noise[channel][k]}, value,
                         draw);
    };
    for (std::size_t k = 0; k < width; ++k) {
        NoiseSource source({noise_[0][k], noise_[1][k], noise_[2][k], noise_[3][k]});
        const Phases i_A = phases_from_vec(lane(k).motor.stator_current(lane(k).x));
        codes_[0][k] = code(0, k, i_A[0], source.gaussian());
        codes_[1][k] = code(1, k, i_A[1], source.gaussian());
        codes_[2][k] = code(2, k, i_A[2], source.gaussian());
        codes_[3][k] = code(3, k, s.uv[k], source.gaussian());
        codes_[4][k] = code(4, k, s.vw[k], source.gaussian());
        codes_[5][k] = code(5, k, inputs_.u_dc[k], source.gaussian());
        noise_[0][k] = source.state()[0];
        noise_[1][k] = source.state()[1];
        noise_[2][k] = source.state()[2];
        noise_[3][k] = source.state()[3];
    }
}

} // namespace zh
