// Up to four plants stepped at once, one number of a vector each, to the same bits as alone: motors
// with saturation or iron loss, and devices that are not ideal, which PlantLanes' own steps leave
// out.
//
//   pack.clear(); pack.add(plant, interval, duty) for up to `width` plants;
//   pack.step();                     // Plant::step_interval of each
#ifndef ZH_PLANT_PACK_HPP
#define ZH_PLANT_PACK_HPP

#include <array>
#include <cstddef>

#include "four.hpp"
#include "plant.hpp"

namespace zh {

class PlantPack {
public:
    static constexpr std::size_t width = 4;

    // Whether all its averaged or switched periods can be done here.
    static bool fits(const Plant &plant);

    void clear()
    {
        count_ = 0;
        steps_ = 0;
    }
    bool full() const
    {
        return count_ == width;
    }
    bool empty() const
    {
        return count_ == 0;
    }
    // interval: averaged or switched.
    void add(Plant &plant, Plant::Interval interval, const Duty &duty);
    void step();

private:
    // A stretch of constant switches.
    struct Stretch {
        std::array<Four, 3> level, dead;
        Four h_s, p, q, r;
        Four taken; // 0: this plant has no such stretch
    };
    struct Constants {
        Four Rs, Rr, pole_pairs, y_ss, y_sr, y_rr;
        Four iron_siemens, rotor_share;
        Four leak_r, inv_M, inv_knee2, inv_leak_s, ratio, start;
        Four law, exponent; // law: as a number
        Four coulomb, static_friction, viscous, inv_J;
        Four inv_threshold, drop, drop_difference, on_ohm, dead_s_per_F;
        Four load, u_dc;
    };
    struct State {
        FourVec psi_s, psi_r;
        Four omega;
        Four uv, uv_slope, vw, vw_slope;
        FourVec u_s;
        Four energy, direction, stuck;
        FourVec i_s, i_r, psi_m; // at these fluxes
    };
    struct Kernel;

    void add_constants(std::size_t k, const Plant &plant);
    void add_state(std::size_t k, const Plant &plant);
    Stretch &stretch(std::size_t k, std::size_t n, const Segment &segment, double h_s);
    void give(std::size_t k, Plant &plant) const;
    // Vector code.
    void step_all();

    // Every segment of a switched period, one of them in two parts.
    static constexpr std::size_t most_stretches = 24;

    std::size_t count_ = 0;
    std::size_t steps_ = 0;
    bool switched_ = false; // some of them: the transitions are to be found
    bool soft_ = false;     // some of them
    std::array<Plant *, width> plants_{};
    Constants c_{};
    State s_{};
    FourVec i_legs_{}; // what decides the legs' voltages in the first stretch
    std::array<Four, 9> series_p_{}, series_q_{};
    Four twice_damping_{};
    std::array<Stretch, most_stretches> stretch_{};
};

} // namespace zh

#endif
