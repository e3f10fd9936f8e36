// The motor against truths that share nothing with it: the equivalent circuit, the energy balance,
// the order of its integrator.
#include "check.hpp"
#include "induction_motor.hpp"
#include "machines.hpp"

#include <numbers>
#include <stdexcept>

using namespace machines;
using zh::InductionMotor;
using zh::MotorState;
using zh::ShaftDrive;
using zh::Vec;

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr ShaftDrive held{0.0, 0.0, 0.0};
// Around zero torque: the 100 kHz steps of the test's voltage leave some 1e-5 Nm.
constexpr double step_torque_Nm = 5e-5;

// Runs on a rotating voltage; the voltage of a step is the one of its middle, which at 10 us and
// 60 Hz misses the sine's amplitude by 6e-7.
MotorState run_on_sine(const InductionMotor &motor, MotorState x, Complex u, double omega,
                       const ShaftDrive &shaft, double duration_s)
{
    constexpr double h = 10e-6;
    const auto steps = static_cast<long>(duration_s / h);
    const Complex turn = std::polar(1.0, omega * h);
    Complex phase = std::polar(1.0, 0.5 * omega * h);
    for (long k = 0; k < steps; ++k) {
        motor.step(x, as_vec(u * phase), shaft, h);
        phase *= turn;
        if (k % 1000 == 0) {
            phase /= std::abs(phase);
        }
    }
    return x;
}

void steady_state_is_that_of_the_equivalent_circuit()
{
    struct Point {
        double f_Hz, u_V, slip;
    };
    constexpr Point points[] = {{50, 200, 0.05}, {50, 200, -0.04}, {50, 200, 1.0}, {57, 200, 0.0},
                                {10, 45, 0.2},   {2, 14, -0.5},    {-5, 25, 0.3}};
    for (const auto &m : {table1(), four_kw(), with_iron(table1()), with_iron(four_kw())}) {
        for (const Point &p : points) {
            const double omega = two_pi * p.f_Hz;
            const Circuit truth = circuit(m, m.M_H, p.u_V, omega, p.slip);
            MotorState x;
            x.omega_m_rad_s = (1.0 - p.slip) * omega / m.pole_pairs;
            const InductionMotor motor(m);
            x = run_on_sine(motor, x, p.u_V, omega, held, 4.0);
            const auto i = motor.currents(x);
            CHECK_RELATIVE(zh::magnitude(i.i_s_A), std::abs(truth.i_s), 1e-4);
            CHECK_NEAR(zh::magnitude(i.i_r_A), std::abs(truth.i_r), 1e-4 * std::abs(truth.i_s));
            CHECK_NEAR(motor.torque_Nm(x), truth.torque_Nm,
                       1e-4 * std::abs(truth.torque_Nm) + step_torque_Nm);
        }
    }
}

// Load the shaft with the circuit's torque: the slip must come out.
void a_free_shaft_settles_at_the_slip_of_the_circuit()
{
    for (const auto &m : {table1(), four_kw(), with_iron(four_kw())}) {
        for (const double slip : {0.02, 0.04, -0.03}) {
            const double omega = two_pi * 50.0;
            const Circuit truth = circuit(m, m.M_H, 200.0, omega, slip);
            const InductionMotor motor(m);
            MotorState x;
            x.omega_m_rad_s = omega / m.pole_pairs;
            const ShaftDrive shaft{-truth.torque_Nm, 0.0, 1.0 / 0.005};
            x = run_on_sine(motor, x, 200.0, omega, shaft, 6.0);
            const double found = 1.0 - x.omega_m_rad_s * m.pole_pairs / omega;
            CHECK_RELATIVE(found, slip, 1e-3);
            CHECK_RELATIVE(zh::magnitude(motor.stator_current(x)), std::abs(truth.i_s), 1e-3);
        }
    }
}

// With saturation the circuit holds with the main inductance of the flux found; that flux is
// checked by bisection of the curve as it is documented.
void saturation_follows_its_curve()
{
    for (const auto &m : all()) {
        if (!(m.saturation.flux_knee_Wb > 0.0)) {
            continue;
        }
        for (const double slip : {0.0, 0.05}) {
            const double omega = two_pi * 50.0;
            const double knee = m.saturation.flux_knee_Wb;
            const auto inductance = [&](double flux) {
                const double q = flux * flux / (knee * knee);
                return m.M_H /
                       (1.0 + (m.saturation.soft ? 2.0 * q * q / (1.0 + q)
                                                 : std::pow(flux / knee, m.saturation.exponent)));
            };
            double low = 0.0;
            double high = 10.0;
            for (int n = 0; n < 200; ++n) {
                const double flux = 0.5 * (low + high);
                const Circuit c = circuit(m, inductance(flux), 300.0, omega, slip);
                (std::abs(c.psi_m) > flux ? low : high) = flux;
            }
            const Circuit truth = circuit(m, inductance(low), 300.0, omega, slip);
            CHECK(std::abs(truth.psi_m) > 0.5 * knee); // the point is deep enough to mean something
            const InductionMotor motor(m);
            MotorState x;
            x.omega_m_rad_s = (1.0 - slip) * omega / m.pole_pairs;
            x = run_on_sine(motor, x, 300.0, omega, held, 4.0);
            const auto i = motor.currents(x);
            CHECK_RELATIVE(zh::magnitude(i.psi_m_Wb), std::abs(truth.psi_m), 1e-4);
            CHECK_RELATIVE(zh::magnitude(i.i_s_A), std::abs(truth.i_s), 1e-3);
            CHECK_NEAR(motor.torque_Nm(x), truth.torque_Nm,
                       1e-3 * std::abs(truth.torque_Nm) + step_torque_Nm);
        }
    }
}

void currents_and_fluxes_obey_the_inductances()
{
    for (const auto &m : all()) {
        const InductionMotor motor(m);
        MotorState x{{0.9, -0.4}, {0.7, -0.5}, 0.0};
        const auto i = motor.currents(x);
        const Vec i_m = i.i_s_A + i.i_r_A;
        const Vec psi_s = i.psi_m_Wb + (m.Ls_H - m.M_H) * i.i_s_A;
        const Vec psi_r = i.psi_m_Wb + (m.Lr_H - m.M_H) * i.i_r_A;
        CHECK_NEAR(psi_s.alpha, x.psi_s_Wb.alpha, 1e-12);
        CHECK_NEAR(psi_s.beta, x.psi_s_Wb.beta, 1e-12);
        CHECK_NEAR(psi_r.alpha, x.psi_r_Wb.alpha, 1e-12);
        CHECK_NEAR(psi_r.beta, x.psi_r_Wb.beta, 1e-12);
        CHECK_NEAR(zh::cross(i_m, i.psi_m_Wb), 0.0, 1e-12); // main flux along its current
        const Vec again = motor.stator_flux(x.psi_r_Wb, i.i_s_A);
        CHECK_NEAR(again.alpha, x.psi_s_Wb.alpha, 1e-12);
        CHECK_NEAR(again.beta, x.psi_s_Wb.beta, 1e-12);
    }
}

double coenergy_free_energy_J(const zh::MotorParameters &m, const zh::MotorCurrents &i)
{
    // Leakages, and the main branch: integral of i_m d psi_m along the curve.
    const double flux2 = zh::dot(i.psi_m_Wb, i.psi_m_Wb);
    double main = 0.5 * flux2 / m.M_H;
    if (m.saturation.soft) {
        const double knee2 = m.saturation.flux_knee_Wb * m.saturation.flux_knee_Wb;
        const double q = flux2 / knee2;
        main += knee2 / m.M_H * (0.5 * q * q - q + std::log1p(q));
    } else if (m.saturation.flux_knee_Wb > 0.0) {
        const int n = m.saturation.exponent;
        main += std::pow(flux2, 0.5 * n + 1.0) /
                ((n + 2.0) * m.M_H * std::pow(m.saturation.flux_knee_Wb, n));
    }
    return main + 0.5 * (m.Ls_H - m.M_H) * zh::dot(i.i_s_A, i.i_s_A) +
           0.5 * (m.Lr_H - m.M_H) * zh::dot(i.i_r_A, i.i_r_A);
}

// Direct-on-line start against a load: what went in is heat, mechanical work or stored. The powers
// are summed by the trapezoidal rule, whose own error at 5 us is below 1e-5 of the energies; the
// voltage of the iron loss is taken from the flux's own course.
void energy_is_conserved()
{
    for (const auto &m : all()) {
        const InductionMotor motor(m);
        constexpr double h = 5e-6;
        constexpr double inv_J = 1.0 / 0.02;
        constexpr double load_Nm = 3.0;
        const ShaftDrive shaft{-load_Nm, 0.004, inv_J};
        MotorState x;
        double electrical = 0.0, heat = 0.0, work = 0.0, friction = 0.0;
        const double iron_S = m.iron_loss_ohm > 0.0 ? 1.0 / m.iron_loss_ohm : 0.0;
        struct Power {
            Vec i_s, i_r, psi_r;
            double heat, load, friction;
        };
        const auto powers = [&](const MotorState &y) {
            const auto i = motor.currents(y);
            return Power{i.i_s_A,
                         i.i_r_A,
                         y.psi_r_Wb,
                         m.Rs_ohm * zh::dot(i.i_s_A, i.i_s_A),
                         load_Nm * y.omega_m_rad_s,
                         0.004 * y.omega_m_rad_s * y.omega_m_rad_s};
        };
        double iron = 0.0;
        Power before = powers(x);
        for (int k = 0; k < 60000; ++k) {
            const Vec u = as_vec(std::polar(220.0, two_pi * 50.0 * (k + 0.5) * h));
            motor.step(x, u, shaft, h);
            const Power after = powers(x);
            electrical += 0.5 * h * zh::dot(u, before.i_s + after.i_s);
            heat += 0.5 * h * (before.heat + after.heat);
            const Vec emf = (1.0 / h) * (after.psi_r - before.psi_r);
            const Vec i_rotor = 0.5 * (before.i_r + after.i_r) + iron_S * emf;
            heat += h * m.Rr_ohm * zh::dot(i_rotor, i_rotor);
            iron += h * iron_S * zh::dot(emf, emf);
            work += 0.5 * h * (before.load + after.load);
            friction += 0.5 * h * (before.friction + after.friction);
            before = after;
        }
        const double stored = coenergy_free_energy_J(m, motor.currents(x)) +
                              0.5 * x.omega_m_rad_s * x.omega_m_rad_s / inv_J;
        CHECK(electrical > 100.0);
        CHECK(x.omega_m_rad_s > 30.0);
        CHECK((iron > 0.02 * electrical) == (iron_S > 0.0));
        CHECK_NEAR(electrical - heat - iron - work - friction - stored, 0.0, 2e-5 * electrical);
    }
}

// Half the step, a sixteenth of the error; Heun's a quarter. Both converge to the same motion.
void the_integrators_are_of_fourth_and_of_second_order()
{
    for (const auto &m : all()) {
        const InductionMotor fourth(m);
        const InductionMotor second(m, zh::IntegrationMethod::heun);
        const ShaftDrive shaft{-2.0, 0.01, 1.0 / 0.015};
        const auto final_state = [&](const InductionMotor &motor, int steps) {
            MotorState x{{0.5, 0.2}, {0.45, 0.0}, 120.0};
            for (int k = 0; k < steps; ++k) {
                motor.step(x, {30.0, 80.0}, shaft, 0.04 / steps);
            }
            return x;
        };
        const MotorState truth = final_state(fourth, 12800);
        const auto error = [&](const InductionMotor &motor, int steps) {
            const MotorState x = final_state(motor, steps);
            return std::hypot(zh::magnitude(x.psi_s_Wb - truth.psi_s_Wb),
                              zh::magnitude(x.psi_r_Wb - truth.psi_r_Wb),
                              0.01 * (x.omega_m_rad_s - truth.omega_m_rad_s));
        };
        for (const int steps : {50, 100, 200}) {
            const double order = std::log2(error(fourth, steps) / error(fourth, 2 * steps));
            CHECK_NEAR(order, 4.0, 0.2);
        }
        CHECK(error(fourth, 400) < 1e-7); // 100 us, the plant's step
        for (const int steps : {800, 1600}) {
            const double order = std::log2(error(second, steps) / error(second, 2 * steps));
            CHECK_NEAR(order, 2.0, 0.1);
        }
        CHECK(error(second, 400) > 10.0 * error(fourth, 400)); // it is another method
    }
}

void an_open_stator_leaves_the_rotor_flux_to_decay()
{
    for (const auto &m : {table1(), four_kw(), with_iron(four_kw())}) {
        const double iron_S = m.iron_loss_ohm > 0.0 ? 1.0 / m.iron_loss_ohm : 0.0;
        const InductionMotor motor(m);
        const double omega_m = 30.0;
        MotorState x{{}, {0.5, 0.0}, omega_m};
        constexpr double h = 100e-6;
        for (int k = 0; k < 3000; ++k) {
            motor.step_open(x, held, h);
        }
        const Complex truth = 0.5 * std::exp(Complex(-m.Rr_ohm / m.Lr_H, m.pole_pairs * omega_m) *
                                             0.3 / (1.0 + m.Rr_ohm * iron_S));
        CHECK_NEAR(x.psi_r_Wb.alpha, truth.real(), 1e-7);
        CHECK_NEAR(x.psi_r_Wb.beta, truth.imag(), 1e-7);
        CHECK_NEAR(zh::magnitude(motor.stator_current(x)), 0.0, 1e-12);
        CHECK_RELATIVE(zh::magnitude(x.psi_s_Wb), m.M_H / m.Lr_H * std::abs(truth), 1e-6);
    }
}

// Open terminals, a spinning shaft: flux and speed feed the iron and the rotor, and nothing else.
void iron_loss_brakes_the_magnetised_rotor()
{
    const zh::MotorParameters m = with_iron(table1());
    const InductionMotor motor(m);
    constexpr double J = 0.015;
    constexpr double h = 5e-6;
    const auto stored_J = [&](const MotorState &y) {
        return 0.5 * zh::dot(y.psi_r_Wb, y.psi_r_Wb) / m.Lr_H +
               0.5 * J * y.omega_m_rad_s * y.omega_m_rad_s;
    };
    MotorState x{{}, {0.5, 0.0}, 150.0};
    const double start_J = stored_J(x);
    double lost_J = 0.0;
    for (int k = 0; k < 40000; ++k) {
        const Vec before = x.psi_r_Wb;
        motor.step_open(x, {0.0, 0.0, 1.0 / J}, h);
        const Vec emf = (1.0 / h) * (x.psi_r_Wb - before);
        const Vec i_rotor = (0.5 / m.Lr_H) * (before + x.psi_r_Wb) + (1.0 / m.iron_loss_ohm) * emf;
        lost_J += h * (m.Rr_ohm * zh::dot(i_rotor, i_rotor) + zh::dot(emf, emf) / m.iron_loss_ohm);
    }
    CHECK(x.omega_m_rad_s < 140.0);
    CHECK_NEAR(start_J - stored_J(x), lost_J, 1e-5 * start_J);
}

void torque_turns_with_the_frame_and_flips_with_the_mirror()
{
    for (const auto &m : all()) {
        const InductionMotor motor(m);
        const MotorState x{{0.6, 0.3}, {0.5, 0.1}, 10.0};
        const Complex turn = std::polar(1.0, 0.7);
        const MotorState turned{as_vec(turn * as_complex(x.psi_s_Wb)),
                                as_vec(turn * as_complex(x.psi_r_Wb)), 10.0};
        const MotorState mirrored{{0.6, -0.3}, {0.5, -0.1}, -10.0};
        CHECK_RELATIVE(motor.torque_Nm(turned), motor.torque_Nm(x), 1e-12);
        CHECK_RELATIVE(motor.torque_Nm(mirrored), -motor.torque_Nm(x), 1e-12);
    }
}

void heating_raises_the_stator_resistance()
{
    InductionMotor motor(table1());
    motor.set_stator_resistance_factor(1.5);
    MotorState x;
    for (int k = 0; k < 50000; ++k) {
        motor.step(x, {9.3, 0.0}, held, 100e-6);
    }
    CHECK_RELATIVE(motor.stator_current(x).alpha, 9.3 / (1.5 * 0.93), 1e-6);
}

void impossible_machines_are_refused()
{
    const auto refused = [](auto change) {
        zh::MotorParameters m = four_kw();
        change(m);
        return !check::message_of<std::invalid_argument>([&] { InductionMotor motor(m); }).empty();
    };
    CHECK(refused([](auto &m) { m.Rs_ohm = 0.0; }));
    CHECK(refused([](auto &m) { m.Rr_ohm = -1.0; }));
    CHECK(refused([](auto &m) { m.M_H = 0.178039; }));
    CHECK(refused([](auto &m) { m.Ls_H = std::nan(""); }));
    CHECK(refused([](auto &m) { m.pole_pairs = 0; }));
    CHECK(refused([](auto &m) { m.iron_loss_ohm = -1.0; }));
    CHECK(!refused([](auto &) {}));
}

} // namespace

int main()
{
    return check::run({
        {"steady state is that of the equivalent circuit",
         steady_state_is_that_of_the_equivalent_circuit},
        {"a free shaft settles at the slip of the circuit",
         a_free_shaft_settles_at_the_slip_of_the_circuit},
        {"saturation follows its curve", saturation_follows_its_curve},
        {"currents and fluxes obey the inductances", currents_and_fluxes_obey_the_inductances},
        {"energy is conserved", energy_is_conserved},
        {"the integrators are of fourth and of second order",
         the_integrators_are_of_fourth_and_of_second_order},
        {"an open stator leaves the rotor flux to decay",
         an_open_stator_leaves_the_rotor_flux_to_decay},
        {"iron loss brakes the magnetised rotor", iron_loss_brakes_the_magnetised_rotor},
        {"torque turns with the frame and flips with the mirror",
         torque_turns_with_the_frame_and_flips_with_the_mirror},
        {"heating raises the stator resistance", heating_raises_the_stator_resistance},
        {"impossible machines are refused", impossible_machines_are_refused},
    });
}
