// The saturating main branch of a motor: currents from fluxes, by a law known when compiled.
//
// This is the plant's innermost loop, so nothing in it is looked up and nothing passes memory.
#ifndef ZH_MAIN_BRANCH_HPP
#define ZH_MAIN_BRANCH_HPP

#include "motor_step.hpp"
#include "space_vector.hpp"

namespace zh {

struct MotorCurrents {
    Vec i_s_A;
    Vec i_r_A; // rotor and iron loss together: what flows into the main branch besides i_s
    Vec psi_m_Wb;
};

// How the main inductance falls with the main flux; none: it does not.
enum class SaturationLaw {
    none,
    power2,
    power4,
    power6,
    power8,
    soft
};

struct MainBranch {
    double leak_s_H, leak_r_H;
    double inv_M, inv_knee2, inv_leak_s;
    double ratio; // of the leakages, rotor over stator
    double start; // of main_flux at this ratio

    template <SaturationLaw law>
    double inverse_M(double flux_squared) const // i_m = inverse_M psi_m
    {
        const double q = flux_squared * inv_knee2;
        if constexpr (law == SaturationLaw::soft) {
            return inv_M * (1.0 + 2.0 * q * q / (1.0 + q));
        } else if constexpr (law == SaturationLaw::power4) {
            return inv_M * (1.0 + q * q);
        } else if constexpr (law == SaturationLaw::power6) {
            return inv_M * (1.0 + q * q * q);
        } else if constexpr (law == SaturationLaw::power8) {
            return inv_M * (1.0 + (q * q) * (q * q));
        } else {
            return inv_M * (1.0 + q);
        }
    }

    // d ln(inverse_M - 1/M) / d ln(flux).
    template <SaturationLaw law> double exponent(double flux_squared) const
    {
        if constexpr (law == SaturationLaw::soft) {
            return 2.0 + 2.0 / (1.0 + flux_squared * inv_knee2);
        } else if constexpr (law == SaturationLaw::power4) {
            return 4.0;
        } else if constexpr (law == SaturationLaw::power6) {
            return 6.0;
        } else if constexpr (law == SaturationLaw::power8) {
            return 8.0;
        } else {
            return 2.0;
        }
    }

    double start_at(double leakage_ratio) const
    {
        return 1.0 / (1.0 + leakage_ratio + leak_r_H * inv_M);
    }

    // Eliminating i_r leaves psi_m (1 + leakage_ratio + leak_r / M(psi_m)) = weighted flux. Both
    // have one direction; their ratio r solves r (base + leak_r / M(r)) = 1, increasing and convex
    // in r, so that Newton from above, from start_at(leakage_ratio), cannot miss. No square root:
    // the even exponent takes magnitudes squared.
    template <SaturationLaw law>
    Vec main_flux(Vec weighted_flux_Wb, double leakage_ratio, double start_r) const
    {
        const double base = 1.0 + leakage_ratio;
        if (!(leak_r_H > 0.0)) {
            return (1.0 / base) * weighted_flux_Wb;
        }
        const double flux_squared = dot(weighted_flux_Wb, weighted_flux_Wb);
        double r = start_r;
        for (int iteration = 0; iteration < 30; ++iteration) {
            const double inverse = inverse_M<law>(r * r * flux_squared);
            const double n = exponent<law>(r * r * flux_squared);
            const double excess = r * (base + leak_r_H * inverse) - 1.0;
            r -= excess / (base + leak_r_H * (inverse + n * (inverse - inv_M)));
            if (!(excess > 1e-9)) { // quadratic: the correction just made leaves about its square
                break;
            }
        }
        return r * weighted_flux_Wb;
    }

    template <SaturationLaw law> MotorCurrents currents(const MotorState &x) const
    {
        const Vec psi_m = main_flux<law>(ratio * x.psi_s_Wb + x.psi_r_Wb, ratio, start);
        const Vec i_s = inv_leak_s * (x.psi_s_Wb - psi_m);
        const Vec i_m = inverse_M<law>(dot(psi_m, psi_m)) * psi_m;
        return {i_s, i_m - i_s, psi_m};
    }
};

// task.operator()<law>() for the law at hand.
template <class Task> decltype(auto) with_law(SaturationLaw law, const Task &task)
{
    switch (law) {
    case SaturationLaw::power4:
        return task.template operator()<SaturationLaw::power4>();
    case SaturationLaw::power6:
        return task.template operator()<SaturationLaw::power6>();
    case SaturationLaw::power8:
        return task.template operator()<SaturationLaw::power8>();
    case SaturationLaw::soft:
        return task.template operator()<SaturationLaw::soft>();
    case SaturationLaw::none:
    case SaturationLaw::power2:
        break;
    }
    return task.template operator()<SaturationLaw::power2>();
}

} // namespace zh

#endif
