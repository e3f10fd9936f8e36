// Several plants at once, one SIMD lane each: the same steps as Plant::sample and Plant::advance
// take, and the same bits.
//
//   lanes.attach(k, &plant) for some lanes;
//   each period: lanes.sample(words); lanes.advance(commands);
//
// The numbers of all lanes lie side by side, so that one loop over the lanes is vector code. A lane
// takes part while its motor is linear, its gates are on and nothing is broken; otherwise its plant
// does the period by itself. The plants keep their state between calls.
#ifndef ZH_PLANT_LANES_HPP
#define ZH_PLANT_LANES_HPP

#include <array>
#include <cstddef>
#include <cstdint>

#include "plant.hpp"
#include "plant_pack.hpp"

namespace zh {

class PlantLanes {
public:
    static constexpr std::size_t width = 8;

    template <class T> using PerLane = std::array<T, width>;

    PlantLanes();
    // From now on lane k is this plant, which belongs to the caller; null: nobody. The plant that
    // was there stands as if it had always been alone; until then its noise is out of date.
    void attach(std::size_t k, Plant *plant);
    // Every plant's words at the present crest, then every plant to the next one. Lanes without a
    // plant are left alone.
    void sample(PerLane<Words> &words);
    void advance(const PerLane<PlantCommand> &commands);

private:
    using Numbers = PerLane<double>;
    struct alignas(64) Constants {
        Numbers Rr, pole_pairs, y_ss, y_sr, y_rr;
        Numbers coulomb, static_friction, viscous, inv_J;
        Numbers dead_share, dead_time, inv_threshold, drop;
        Numbers period, whole_p, whole_q, whole_r;
        std::array<Numbers, 9> series_p, series_q;
        Numbers twice_damping;
        std::array<Numbers, 6> gain, offset, noise;
    };
    // Of one period: what it starts from and what it leaves.
    struct alignas(64) State {
        Numbers psi_s_alpha, psi_s_beta, psi_r_alpha, psi_r_beta, omega;
        Numbers uv, uv_slope, vw, vw_slope;
        Numbers u_s_alpha, u_s_beta, energy;   // integrals over the period
        Numbers direction, stuck;              // of the shaft
        Numbers i_before_alpha, i_before_beta; // at the start of the last averaged period
    };
    struct alignas(64) Inputs {
        Numbers Rs, load, u_dc;
        std::array<Numbers, 3> duty;
    };
    // The switched period: when each leg goes up, is up, goes down and is down, and the thirteen
    // stretches between these.
    static constexpr std::size_t stretches = 13;
    struct alignas(64) Switching {
        std::array<std::array<Numbers, 4>, 3> edge_s;
        std::array<Numbers, stretches> start_s, h_s;
    };
    struct Lane;

    void attach_sensors(std::size_t k, const Plant &plant);
    void load(std::size_t k, const Plant &plant);
    void store(std::size_t k, Plant &plant) const;
    void plan(std::size_t k, Plant &plant, const Duty &duty);
    void step_together(Plant::Interval kind, const PerLane<PlantCommand> &commands,
                       PerLane<Plant::Interval> &intervals);
    void step_in_packs(Plant::Interval kind, const PerLane<PlantCommand> &commands,
                       PerLane<Plant::Interval> &intervals);
    // Vector code.
    void step_averaged();
    void schedule();
    void step_switched();
    void convert();
    Lane lane(std::size_t k) const;
    void keep(std::size_t k, const Lane &d);

    PerLane<Plant *> plants_{};
    PerLane<bool> fits_{};
    PerLane<bool> packs_{};  // by pack_
    PerLane<bool> loaded_{}; // state_ is that of the plant
    Constants constants_{};
    State state_{};
    Inputs inputs_{};
    Switching switching_{};
    alignas(64) std::array<PerLane<std::uint64_t>, 4> noise_{};
    alignas(64) std::array<PerLane<std::int32_t>, 6> codes_{};
    PlantPack pack_;
};

} // namespace zh

#endif
