// Wrong wiring: crossed cables, crossed gates, a switch that never turns on.
#include "check.hpp"
#include "machines.hpp"
#include "plant.hpp"

#include <algorithm>

using namespace machines;
using zh::Board;
using zh::Disturbances;
using zh::Duty;
using zh::Faults;
using zh::Phases;
using zh::Plant;
using zh::Rig;
using zh::Words;

namespace {

Rig ideal()
{
    Rig rig;
    rig.motor = table1();
    return rig;
}

Plant plant_with(const Faults &faults)
{
    Disturbances what;
    what.faults = faults;
    return Plant(ideal(), Board{}, what, 1);
}

// A field that turns forward, some volts long, as three legs get it.
Duty turning(int period)
{
    const double angle = 0.02 * period;
    const double third = 2.0943951023931953;
    return {0.5 + 0.05 * std::cos(angle), 0.5 + 0.05 * std::cos(angle - third),
            0.5 + 0.05 * std::cos(angle + third)};
}

// Crossed cables are a motor that gets its phases crossed; at the legs each current stays with the
// leg that drives it.
void crossed_cables_turn_the_motor_backwards()
{
    Faults faults;
    faults.cables = {1, 0, 2};
    Plant crossed = plant_with(faults);
    Plant plain = plant_with({});
    for (int k = 0; k < 2000; ++k) {
        const Duty d = turning(k);
        crossed.advance(d, true);
        plain.advance({d[1], d[0], d[2]}, true);
        const Words c = crossed.sample();
        const Words p = plain.sample();
        CHECK(c.i_u == p.i_v && c.i_v == p.i_u && c.i_w == p.i_w);
        CHECK(std::abs(c.u_uv + p.u_uv - 2 * 8192) <= 1);
        CHECK(std::abs((c.u_vw - 8192) - (p.u_uv - 8192) - (p.u_vw - 8192)) <= 2);
    }
    CHECK_NEAR(crossed.state().omega_m_rad_s, plain.state().omega_m_rad_s, 0.0);
    CHECK(crossed.state().omega_m_rad_s < -1.0);
    CHECK_NEAR(crossed.currents_at_legs()[0], plain.currents_at_legs()[1], 0.0);
}

void crossed_gates_exchange_the_duties()
{
    Faults faults;
    faults.gates = {0, 2, 1};
    Plant crossed = plant_with(faults);
    Plant plain = plant_with({});
    for (int k = 0; k < 500; ++k) {
        const Duty d = turning(k);
        crossed.advance(d, true);
        plain.advance({d[0], d[2], d[1]}, true);
        const Words c = crossed.sample();
        const Words p = plain.sample();
        CHECK(c.i_u == p.i_u && c.i_v == p.i_v && c.i_w == p.i_w && c.u_uv == p.u_uv);
    }
}

// Direct current in phase x at the end, for this switch dead, or none.
double direct_A(std::size_t x, double more, std::size_t dead_leg, bool upper, bool crossed)
{
    Faults faults;
    faults.dead_leg = dead_leg;
    faults.dead_upper = upper;
    faults.cables = crossed ? zh::Crossing{2, 1, 0} : zh::straight;
    Plant plant = plant_with(faults);
    Duty duty{0.5, 0.5, 0.5};
    duty[x] += more;
    for (int k = 0; k < 3000; ++k) {
        plant.advance(duty, true);
    }
    return plant.currents_at_legs()[x];
}

void a_dead_switch_leaves_the_other_direction()
{
    for (const bool crossed : {false, true}) {
        for (std::size_t x = 0; x < 3; ++x) {
            const double healthy_A = direct_A(x, 0.02, zh::no_leg, false, crossed);
            CHECK(healthy_A > 2.0);
            CHECK(std::abs(direct_A(x, 0.02, x, true, crossed)) < 0.05 * healthy_A);
            CHECK_RELATIVE(direct_A(x, -0.02, x, true, crossed), -healthy_A, 0.03);
            CHECK(std::abs(direct_A(x, -0.02, x, false, crossed)) < 0.05 * healthy_A);
            CHECK_RELATIVE(direct_A(x, 0.02, x, false, crossed), healthy_A, 0.03);
        }
    }
}

void wiring_is_read()
{
    const auto read = [](const std::string &text) {
        const zh::TomlDocument document = zh::TomlDocument::from_text(text, "faults");
        zh::TomlReader in(document);
        const Faults faults = zh::read_faults(in);
        in.finish();
        return faults;
    };
    const Faults none = read("");
    CHECK(none.cables == zh::straight && none.gates == zh::straight);
    CHECK(none.dead_leg == zh::no_leg);
    const Faults f = read("[faults]\ncables = \"vw\"\ngates = \"wu\"\ndead_switch = \"v_upper\"\n");
    CHECK((f.cables == zh::Crossing{0, 2, 1} && f.gates == zh::Crossing{2, 1, 0}));
    CHECK(f.dead_leg == 1 && f.dead_upper);
    const Faults lower = read("[faults]\ndead_switch = \"w_lower\"\n");
    CHECK(lower.dead_leg == 2 && !lower.dead_upper);
    const Faults inverted = read("[faults]\nsensor = \"i_u\"\nkind = \"gain\"\nseverity = -1\n");
    CHECK_NEAR(inverted.sensors[0].severity, -1.0, 0.0);
}

} // namespace

int main()
{
    return check::run({
        {"crossed cables turn the motor backwards", crossed_cables_turn_the_motor_backwards},
        {"crossed gates exchange the duties", crossed_gates_exchange_the_duties},
        {"a dead switch leaves the other direction", a_dead_switch_leaves_the_other_direction},
        {"wiring is read", wiring_is_read},
    });
}
