// The vector code of PlantPack: Plant::integrate and what it calls, with a select for each branch.
#include "four_math.hpp"
#include "plant_pack.hpp"

// One binary, four doubles at a time where the machine can; the bits are the same without.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__OPTIMIZE__) &&    \
    !defined(__SANITIZE_ADDRESS__)
#define ZH_VECTOR_CODE __attribute__((flatten, target_clones("avx2", "default")))
#else
#define ZH_VECTOR_CODE
#endif
namespace zh {

struct PlantPack::Kernel {
    const Constants &c;
    bool soft;
    State s;

    // MainBranch::inverse_M less the factor, the law per plant.
    ZH_INLINE Four power(const Four &q) const
    {
        const Four q2 = q * q;
        Four p = c.law < 1.5 ? q : q2;
        p = c.law > 2.5 ? (c.law > 3.5 ? q2 * q2 : q2 * q) : p;
        if (soft) {
            p = c.law > 4.5 ? 2.0 * q * q / (1.0 + q) : p;
        }
        return p;
    }
    ZH_INLINE Four exponent(const Four &q) const
    {
        return soft ? (c.law > 4.5 ? 2.0 + 2.0 / (1.0 + q) : c.exponent) : c.exponent;
    }
    struct Currents {
        FourVec i_s, i_r, psi_m;
    };
    // MainBranch::main_flux.
    ZH_INLINE FourVec main_flux(const FourVec &weighted) const
    {
        const Four base = 1.0 + c.ratio;
        const Mask leaks = c.leak_r > 0.0;
        Mask goes_on = leaks & (c.law > 0.5);
        Four r = leaks ? c.start : 1.0 / base;
        if (any(goes_on)) {
            const Four flux_squared = dot(weighted, weighted);
            for (int iteration = 0; iteration < 30 && any(goes_on); ++iteration) {
                const Four q = r * r * flux_squared * c.inv_knee2;
                const Four inverse = c.inv_M * (1.0 + power(q));
                const Four excess = r * (base + c.leak_r * inverse) - 1.0;
                const Four slope = base + c.leak_r * (inverse + exponent(q) * (inverse - c.inv_M));
                r = goes_on ? r - excess / slope : r;
                goes_on = goes_on & (excess > 1e-9);
            }
        }
        return times(r, weighted);
    }
    ZH_INLINE Currents currents(const FourVec &psi_s, const FourVec &psi_r) const
    {
        const FourVec psi_m = main_flux(sum(times(c.ratio, psi_s), psi_r));
        const FourVec i_s = times(c.inv_leak_s, difference(psi_s, psi_m));
        const Four inverse = c.inv_M * (1.0 + power(dot(psi_m, psi_m) * c.inv_knee2));
        const FourVec i_r = difference(times(inverse, psi_m), i_s);
        const Mask saturates = c.law > 0.5;
        return {choose(saturates, i_s, difference(times(c.y_ss, psi_s), times(c.y_sr, psi_r))),
                choose(saturates, i_r, difference(times(c.y_rr, psi_r), times(c.y_sr, psi_s))),
                psi_m};
    }

    // InductionMotor::torque_Nm at the present state, whose currents are known.
    ZH_INLINE Four torque() const
    {
        const Four gap = c.pole_pairs * cross(s.psi_s, s.i_s);
        const Four speed = c.pole_pairs * s.omega;
        const FourVec rotation{speed * -s.psi_r.beta, speed * s.psi_r.alpha};
        const FourVec rate = times(c.rotor_share, difference(rotation, times(c.Rr, s.i_r)));
        const Four iron = c.pole_pairs * c.iron_siemens * cross(s.psi_r, rate);
        return c.iron_siemens > 0.0 ? gap - iron : gap;
    }

    ZH_INLINE Four leg_voltage(const Four &level, const Four &dead, const Four &i_A) const
    {
        const Four sign = i_A * c.inv_threshold;
        const Four clamped = sign < -1.0 ? all(-1.0) : (sign > 1.0 ? all(1.0) : sign);
        const Four x = absolute(i_A) * c.dead_s_per_F / c.u_dc;
        const Four share = with_sign(x < 1.0 ? 0.5 * x : 1.0 - 0.5 / x, i_A);
        const Four g = c.dead_s_per_F > 0.0 ? share : clamped;
        const Four drop_V =
            c.drop * clamped + (level - 0.5) * c.drop_difference * absolute(clamped);
        const Four lost = level - dead * g;
        const Four raised = lost > 0.0 ? lost : all(0.0);
        const Four bounded = raised < 1.0 ? raised : all(1.0);
        return c.u_dc * (bounded - 0.5) - drop_V - c.on_ohm * i_A;
    }

    struct Rate {
        FourVec psi_s, psi_r;
        Four omega;
    };
    // InductionMotor::GeneralIncrement.
    struct Increment {
        FourVec h_u;
        Four h_Rs, h_Rr, h_p, h_inv_J, inv_J, torque, viscous;
    };
    ZH_INLINE Rate increment(const Increment &d, const Rate &x, const FourVec &i_s,
                             const FourVec &i_r) const
    {
        const Four speed = d.h_p * x.omega;
        const FourVec rotation{speed * -x.psi_r.beta, speed * x.psi_r.alpha};
        const Four drag = d.torque - d.viscous * x.omega;
        const FourVec h_psi_r = times(c.rotor_share, difference(rotation, times(d.h_Rr, i_r)));
        const Four h_iron = c.pole_pairs * c.iron_siemens * cross(x.psi_r, h_psi_r);
        return {difference(d.h_u, times(d.h_Rs, i_s)), h_psi_r,
                d.h_inv_J * c.pole_pairs * cross(x.psi_s, i_s) + drag - d.inv_J * h_iron};
    }
    ZH_INLINE Rate along(const Rate &y, double share, const Rate &k) const
    {
        const Four by = all(share);
        return {sum(y.psi_s, times(by, k.psi_s)), sum(y.psi_r, times(by, k.psi_r)),
                y.omega + by * k.omega};
    }
    ZH_INLINE Rate increment_at(const Increment &d, const Rate &x) const
    {
        const Currents i = currents(x.psi_s, x.psi_r);
        return increment(d, x, i.i_s, i.i_r);
    }
    ZH_INLINE static FourVec mean(const FourVec &y, const FourVec &k1, const FourVec &k2,
                                  const FourVec &k3, const FourVec &k4)
    {
        const Four w = all(1.0 / 6.0);
        const Four two = all(2.0);
        return sum(y, times(w, sum(sum(k1, times(two, sum(k2, k3))), k4)));
    }
    ZH_INLINE void runge_kutta(const Increment &d)
    {
        const Rate y{s.psi_s, s.psi_r, s.omega};
        const Rate k1 = increment(d, y, s.i_s, s.i_r);
        const Rate k2 = increment_at(d, along(y, 0.5, k1));
        const Rate k3 = increment_at(d, along(y, 0.5, k2));
        const Rate k4 = increment_at(d, along(y, 1.0, k3));
        s.psi_s = mean(y.psi_s, k1.psi_s, k2.psi_s, k3.psi_s, k4.psi_s);
        s.psi_r = mean(y.psi_r, k1.psi_r, k2.psi_r, k3.psi_r, k4.psi_r);
        s.omega = y.omega + (1.0 / 6.0) * (k1.omega + 2.0 * (k2.omega + k3.omega) + k4.omega);
        const Currents i = currents(s.psi_s, s.psi_r);
        s.i_s = i.i_s;
        s.i_r = i.i_r;
        s.psi_m = i.psi_m;
    }

    // begin_motion of motor_step.hpp.
    ZH_INLINE Increment begin(const FourVec &u_s_V, const Four &h_s)
    {
        const Four zero = all(0.0);
        const Four net = torque() - c.load;
        const Four pushed = net > 0.0 ? all(1.0) : all(-1.0);
        const Four starts = absolute(net) <= c.static_friction ? zero : pushed;
        const Four turns = s.omega > 0.0 ? all(1.0) : all(-1.0);
        s.direction = absolute(s.omega) > 0.0 ? turns : starts;
        const Mask moves = absolute(s.direction) > 0.0;
        s.stuck = moves ? zero : all(1.0);
        const Four torque_Nm = -c.load - s.direction * c.coulomb;
        Increment d;
        d.inv_J = moves ? c.inv_J : zero;
        d.h_u = times(h_s, u_s_V);
        d.h_Rs = h_s * c.Rs;
        d.h_Rr = h_s * c.Rr;
        d.h_p = h_s * c.pole_pairs;
        d.h_inv_J = h_s * d.inv_J;
        d.torque = d.h_inv_J * (moves ? torque_Nm : zero);
        d.viscous = d.h_inv_J * (moves ? c.viscous : zero);
        return d;
    }
    // Plant::settle_shaft.
    ZH_INLINE void settle(const Four &omega_before, const Four &h_s)
    {
        const Mask reversed = s.direction * s.omega < 0.0;
        if (!any(reversed)) {
            return;
        }
        const Four net = torque() - c.load;
        const Mask holds = absolute(net) <= c.static_friction;
        const Four after = absolute(s.omega);
        const Four share = after / (after + absolute(omega_before));
        const Four omega = s.omega + s.direction * 2.0 * c.coulomb * c.inv_J * h_s * share;
        const Four passes = s.direction * omega < 0.0 ? omega : all(0.0);
        const Four not_back = s.direction * net > 0.0 ? all(0.0) : passes;
        s.omega = reversed ? (holds ? all(0.0) : not_back) : s.omega;
        s.stuck = reversed ? (holds ? all(1.0) : all(0.0)) : s.stuck;
    }

    // Plant::integrate; i_legs decides the legs' voltages.
    ZH_INLINE void step(const Stretch &t, const FourVec &i_legs)
    {
        const Four half_alpha = (-0.5 * sqrt_2_3) * i_legs.alpha;
        const Four vu = leg_voltage(t.level[0], t.dead[0], sqrt_2_3 * i_legs.alpha);
        const Four vv = leg_voltage(t.level[1], t.dead[1], half_alpha + inv_sqrt2 * i_legs.beta);
        const Four vw = leg_voltage(t.level[2], t.dead[2], half_alpha - inv_sqrt2 * i_legs.beta);
        const FourVec u_s_V{sqrt_2_3 * (vu - 0.5 * (vv + vw)), inv_sqrt2 * (vv - vw)};
        const Four omega_before = s.omega;
        const FourVec i_before = s.i_s;
        runge_kutta(begin(u_s_V, t.h_s));
        settle(omega_before, t.h_s);
        s.u_s = sum(s.u_s, times(t.h_s, u_s_V));
        s.energy = s.energy + 0.5 * t.h_s * dot(u_s_V, sum(i_before, s.i_s));
        const Four uv = vu - vv;
        const Four vw_line = vv - vw;
        const Four a = s.uv - uv;
        const Four b = s.vw - vw_line;
        const Four uv_slope = t.r * s.uv_slope - t.q * a;
        const Four vw_slope = t.r * s.vw_slope - t.q * b;
        s.uv = uv + t.p * a + t.q * s.uv_slope;
        s.vw = vw_line + t.p * b + t.q * s.vw_slope;
        s.uv_slope = uv_slope;
        s.vw_slope = vw_slope;
    }
    ZH_INLINE void hold_unless(const Mask &m, const State &before)
    {
        s.psi_s = choose(m, s.psi_s, before.psi_s);
        s.psi_r = choose(m, s.psi_r, before.psi_r);
        s.omega = m ? s.omega : before.omega;
        s.uv = m ? s.uv : before.uv;
        s.uv_slope = m ? s.uv_slope : before.uv_slope;
        s.vw = m ? s.vw : before.vw;
        s.vw_slope = m ? s.vw_slope : before.vw_slope;
        s.u_s = choose(m, s.u_s, before.u_s);
        s.energy = m ? s.energy : before.energy;
        s.direction = m ? s.direction : before.direction;
        s.stuck = m ? s.stuck : before.stuck;
        s.i_s = choose(m, s.i_s, before.i_s);
        s.i_r = choose(m, s.i_r, before.i_r);
        s.psi_m = choose(m, s.psi_m, before.psi_m);
    }
};

// As TransitionSeries sums it.
ZH_INLINE static Four series_at(const std::array<Four, 9> &a, const Four &x)
{
    const Four upper = a[4] + x * (a[5] + x * (a[6] + x * (a[7] + x * a[8])));
    return a[0] + x * (a[1] + x * (a[2] + x * (a[3] + x * upper)));
}

ZH_VECTOR_CODE void PlantPack::step_all()
{
    if (switched_) {
        for (std::size_t n = 0; n < steps_; ++n) {
            const Four x = stretch_[n].h_s;
            Four p = series_at(series_p_, x);
            Four q = series_at(series_q_, x);
            for (int doubling = 0; doubling < 4; ++doubling) {
                const Four p2 = p * p - q * q;
                q = q * (2.0 * p - twice_damping_ * q);
                p = p2;
            }
            stretch_[n].p = p;
            stretch_[n].q = q;
            stretch_[n].r = p - twice_damping_ * q;
        }
    }
    Kernel kernel{c_, soft_, s_};
    for (std::size_t n = 0; n < steps_; ++n) {
        const Mask taken = stretch_[n].taken > 0.0;
        const bool some = any(~taken);
        if (some) {
            s_ = kernel.s;
        }
        kernel.step(stretch_[n], n == 0 ? i_legs_ : kernel.s.i_s);
        if (some) {
            kernel.hold_unless(taken, s_);
        }
    }
    s_ = kernel.s;
}

} // namespace zh
