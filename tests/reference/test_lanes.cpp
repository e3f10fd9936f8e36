// Plants side by side: every lane gives the bits of a plant of its own.
#include "check.hpp"
#include "machines.hpp"
#include "plant_lanes.hpp"

#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

using zh::Board;
using zh::Disturbances;
using zh::InverterModel;
using zh::NoiseSource;
using zh::Plant;
using zh::PlantCommand;
using zh::PlantLanes;
using zh::Rig;
using zh::Words;

namespace {

constexpr std::size_t width = PlantLanes::width;

Rig noisy(InverterModel model)
{
    Rig rig;
    rig.motor = machines::table1();
    rig.mechanics = {0.02, 0.3, 0.4, 1e-3};
    rig.inverter.model = model;
    rig.inverter.dead_time_s = 3e-6;
    rig.inverter.i_threshold_A = 0.5;
    rig.inverter.drop_V = 1.0;
    rig.sensors.current_noise_A = 0.01;
    rig.sensors.voltage_noise_V = 0.1;
    return rig;
}

struct Bench {
    Rig rig;
    Board board;
    Disturbances disturbances;
};

// What lanes can do and what they leave to the plant, next to each other.
std::vector<Bench> benches(InverterModel model)
{
    std::vector<Bench> all(width - 1, {noisy(model), Board{}, Disturbances{}});
    all[1].rig.inverter.dead_time_s = 0.0;
    all[1].rig.mechanics = {0.02, 0.0, 0.0, 0.0};
    all[2].rig.motor.saturation.flux_knee_Wb = 0.5;
    all[0].rig.dc_link.ripple_pu = 0.05;
    all[0].rig.dc_link.ripple_Hz = 300.0;
    all[0].disturbances.load = {2, 20.0, 0.2, 10.0};
    all[0].disturbances.load_torque_Nm = zh::Profile(2.0);
    all[1].rig.mechanics.load_J_kg_m2 = 0.05;
    all[1].rig.mechanics.stiffness_Nm = 40.0;
    all[3].rig.dc_link.capacitance_F = 1e-3;
    all[5].rig.inverter.leg_F = 2e-9;
    all[3].disturbances.load_torque_Nm = zh::Profile({{0.0, 0.0}, {0.1, 3.0}});
    all[4].rig.integration.substeps = 3;
    all[4].board.period_s = 100e-6;
    all[4].rig.inverter.carrier_Hz = 10e3;
    all[5].rig.inverter.model =
        model == InverterModel::averaged ? InverterModel::switched : InverterModel::averaged;
    all[5].board.filter_cutoff_Hz = 300.0;
    all[6].board.filter_cutoff_Hz = 5000.0; // no series for that
    all[6].disturbances.faults.sensors = {{.kind = zh::SensorFaultKind::stuck, .start_s = 0.05}};
    return all;
}

// Saturation by every law, iron loss and devices: PlantPack's part, more of them than a pack holds.
std::vector<Bench> general_benches(InverterModel model)
{
    std::vector<Bench> all(width - 1, {noisy(model), Board{}, Disturbances{}});
    for (std::size_t k = 0; k < all.size(); ++k) {
        zh::MotorParameters &motor = all[k].rig.motor;
        motor = k % 2 == 0 ? machines::table1() : machines::four_kw();
        motor.saturation = {0.45, 2 + 2 * static_cast<int>(k % 4), k > 4};
        motor.iron_loss_ohm = 200.0 + 100.0 * static_cast<double>(k);
        all[k].rig.inverter.on_ohm = 0.05;
        all[k].rig.inverter.drop_difference_V = 0.2;
        all[k].rig.inverter.leg_F = k % 3 == 0 ? 0.0 : 2e-9;
        all[k].rig.inverter.i_threshold_A = 1.0;
        all[k].rig.dc_link.ripple_pu = 0.02;
        all[k].rig.dc_link.ripple_Hz = 100.0 * static_cast<double>(1 + k);
    }
    all[1].rig.motor.iron_loss_ohm = 0.0;
    all[2].rig.motor.saturation.flux_knee_Wb = 0.0;
    all[2].disturbances.rr_factor = zh::Profile({{0.0, 1.0}, {0.3, 1.2}});
    all[3].disturbances.rs_factor = zh::Profile({{0.1, 1.0}, {0.2, 1.4}, {0.2, 1.1}, {0.4, 1.1}});
    all[3].rig.inverter.dead_time_s = 1e-6; // one step fits an averaged period
    all[4].rig.mechanics.load_J_kg_m2 = 0.05;
    all[4].rig.mechanics.stiffness_Nm = 40.0;
    all[4].disturbances.faults.jam_s = 0.35;
    all[5].disturbances.load = {1, 20.0, 0.0, 0.0};
    all[5].disturbances.load_torque_Nm = zh::Profile(2.0);
    all[6].rig.dc_link.capacitance_F = 1e-3;
    return all;
}

// A turning voltage, now and then too large, at times with the gates off.
PlantCommand command(long step, std::size_t lane, NoiseSource &chance)
{
    const double angle = 0.06 * static_cast<double>(step) + static_cast<double>(lane);
    const double size = step % 400 < 300 ? 0.3 : 0.9;
    PlantCommand c;
    for (std::size_t x = 0; x < 3; ++x) {
        const double turned = angle - 2.0944 * static_cast<double>(x);
        c.duty[x] = 0.5 + size * std::sin(turned) + 0.01 * chance.gaussian();
    }
    c.gates_on = (step + 50 * static_cast<long>(lane)) % 700 > 60;
    return c;
}

bool same_bits(double a, double b)
{
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same_words(const Words &a, const Words &b)
{
    return a.i_u == b.i_u && a.i_v == b.i_v && a.i_w == b.i_w && a.u_uv == b.u_uv &&
           a.u_vw == b.u_vw && a.u_dc == b.u_dc;
}

bool same_plants(const Plant &a, const Plant &b)
{
    const zh::Truth s = a.truth();
    const zh::Truth t = b.truth();
    return same_bits(s.omega_m_rad_s, t.omega_m_rad_s) && same_bits(s.torque_Nm, t.torque_Nm) &&
           same_bits(s.psi_s_Wb.alpha, t.psi_s_Wb.alpha) &&
           same_bits(s.psi_s_Wb.beta, t.psi_s_Wb.beta) &&
           same_bits(s.psi_r_Wb.alpha, t.psi_r_Wb.alpha) &&
           same_bits(s.psi_r_Wb.beta, t.psi_r_Wb.beta) && same_bits(s.u_s_V.alpha, t.u_s_V.alpha) &&
           same_bits(s.u_s_V.beta, t.u_s_V.beta) && same_bits(s.u_dc_V, t.u_dc_V) &&
           a.shaft_stuck() == b.shaft_stuck();
}

using Benches = std::vector<Bench> (*)(InverterModel);

void give_the_bits_of_single_plants(Benches benches_of)
{
    for (const InverterModel model : {InverterModel::averaged, InverterModel::switched}) {
        std::vector<std::unique_ptr<Plant>> alone;
        std::vector<std::unique_ptr<Plant>> together;
        PlantLanes lanes;
        for (const Bench &b : benches_of(model)) {
            alone.push_back(std::make_unique<Plant>(b.rig, b.board, b.disturbances, 7));
            together.push_back(std::make_unique<Plant>(b.rig, b.board, b.disturbances, 7));
            lanes.attach(together.size(), together.back().get()); // lane 0 stays empty
        }
        NoiseSource chance(3);
        PlantLanes::PerLane<Words> words{};
        PlantLanes::PerLane<PlantCommand> commands{};
        long different = 0;
        for (long step = 0; step < 3000; ++step) {
            lanes.sample(words);
            for (std::size_t k = 0; k < alone.size(); ++k) {
                different += same_words(alone[k]->sample(), words[k + 1]) ? 0 : 1;
                commands[k + 1] = command(step, k, chance);
                alone[k]->advance(commands[k + 1]);
            }
            lanes.advance(commands);
            for (std::size_t k = 0; k < alone.size(); ++k) {
                different += same_plants(*alone[k], *together[k]) ? 0 : 1;
            }
        }
        CHECK(different == 0);
    }
}

void lanes_give_the_bits_of_single_plants()
{
    give_the_bits_of_single_plants(benches);
}

void packs_give_the_bits_of_single_plants()
{
    give_the_bits_of_single_plants(general_benches);
}

void a_lane_can_change_its_plant()
{
    const Bench b = benches(InverterModel::averaged)[0];
    Plant first(b.rig, b.board, b.disturbances, 1);
    Plant second(b.rig, b.board, b.disturbances, 2);
    Plant alone(b.rig, b.board, b.disturbances, 2);
    PlantLanes lanes;
    PlantLanes::PerLane<Words> words{};
    PlantLanes::PerLane<PlantCommand> commands{};
    commands[3] = {{0.6, 0.5, 0.4}, true, false};
    lanes.attach(3, &first);
    for (int step = 0; step < 10; ++step) {
        lanes.sample(words);
        lanes.advance(commands);
    }
    lanes.attach(3, &second);
    for (int step = 0; step < 10; ++step) {
        lanes.sample(words);
        lanes.advance(commands);
        CHECK(same_words(alone.sample(), words[3]));
        alone.advance(commands[3]);
    }
    CHECK(same_plants(alone, second));
    CHECK_NEAR(first.time_s(), 10 * b.board.period_s, 1e-12);
}

} // namespace

int main()
{
    return check::run({
        {"lanes give the bits of single plants", lanes_give_the_bits_of_single_plants},
        {"packs give the bits of single plants", packs_give_the_bits_of_single_plants},
        {"a lane can change its plant", a_lane_can_change_its_plant},
    });
}
