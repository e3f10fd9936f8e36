#include "simulate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <numbers>
#include <utility>

#include "elementary.hpp"
#include "plant.hpp"
#include "sim.h"

namespace zh {
namespace {

constexpr double trip_speed_rad_s = 3000.0 * rad_s_per_rpm;
constexpr double trip_current_A = 60.0;
constexpr double f_s_filter_s = 10e-3;
// Below this there is no flux whose angle means anything.
constexpr double no_flux_Wb = 1e-4;

constexpr std::array columns{
#define COLUMN(name, value, text) Column{#name, text},
#include "sim_columns.def"
#undef COLUMN
};

double cpu_time_s()
{
    std::timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// What the operator does, followed forward in time.
class Operator {
public:
    explicit Operator(const Scenario &scenario) : scenario_(scenario)
    {
    }
    float speed_ref_rpm(double t_s)
    {
        return static_cast<float>(scenario_.speed_ref_rpm.value(t_s, cursor_));
    }
    unit_command_t command(double t_s, float speed_ref_rpm)
    {
        // Who has fallen silent repeats the last word for ever: that is what a mailbox shows.
        if (t_s < scenario_.silent_from_s) {
            last_ = command_at(scenario_, t_s, speed_ref_rpm, last_.count + 1);
        }
        return last_;
    }

private:
    const Scenario &scenario_;
    std::size_t cursor_ = 0;
    unit_command_t last_{};
};

// Frequency of the true rotor flux: how far it turned since the last crest, low-passed.
class FluxFrequency {
public:
    explicit FluxFrequency(double period_s)
        : Hz_per_rad_(0.5 / (std::numbers::pi * period_s)),
          share_(1.0 - portable_exp(-period_s / f_s_filter_s))
    {
    }
    void follow(Vec flux_Wb)
    {
        const double sine = cross(last_Wb_, flux_Wb);
        const double cosine = dot(last_Wb_, flux_Wb);
        const bool flux = dot(flux_Wb, flux_Wb) > no_flux_Wb * no_flux_Wb && cosine > 0.0;
        // The angle per period is small; its tangent's series replaces the arctangent.
        const double tangent = flux ? sine / cosine : 0.0;
        const double turned_rad = tangent * (1.0 - tangent * tangent * (1.0 / 3.0));
        f_Hz_ += share_ * (Hz_per_rad_ * turned_rad - f_Hz_);
        last_Wb_ = flux_Wb;
    }
    double f_Hz() const
    {
        return f_Hz_;
    }

private:
    double Hz_per_rad_;
    double share_;
    double f_Hz_ = 0.0;
    Vec last_Wb_;
};

// Everything one row is made of; the columns pick from it (sim_columns.def).
struct Row {
    Truth truth;
    unit_telemetry_t t;
    hal_output_t duty;
    double speed_ref_rpm = 0.0;
    double omega_ref_rad_s = 0.0;
    double f_s_Hz = 0.0;
    double lambda_Wb = 0.0;
    double flux_angle_rad = 0.0;
    double flux_angle_err_deg = 0.0;
    double i_abs_A = 0.0;
    double e1_abs_A = 0.0;
    double gates_on = 0.0;
    double Rs_true_ohm = 0.0;
    double x_rad_s = 0.0;
};

// Estimated minus true angle, -180..180; 0 without flux. The angles are recorded anyway.
double angle_error_deg(const Row &r)
{
    if (r.lambda_Wb < no_flux_Wb || static_cast<double>(r.t.lambda_hat_Wb) < no_flux_Wb) {
        return 0.0;
    }
    const double turns =
        (static_cast<double>(r.t.lambda_angle_rad) - r.flux_angle_rad) * (0.5 / std::numbers::pi);
    return 360.0 * (turns - std::round(turns));
}

class Loop {
public:
    Loop(const Run &run, Witness *witness)
        : run_(run), witness_(witness), firmware_(run.params, run.gain),
          plant_(run.rig, run.board, run.scenario.disturbances, run.seed),
          timer_(run.board.delay_periods), operator_(run.scenario), f_s_(run.board.period_s)
    {
        out_.period_s = run.board.period_s;
        out_.stride = (run.steps + run.decimate - 1) / run.decimate;
        out_.data.resize(out_.stride * columns.size());
    }

    Outcome finish()
    {
        const double start_s = cpu_time_s();
        std::uint32_t until_row = 1;
        while (out_.steps < run_.steps) {
            const double t_s = plant_.time_s();
            speed_ref_rpm_ = operator_.speed_ref_rpm(t_s);
            hal_output_t output{};
            if (!period(sample_of(plant_.sample(), plant_.broken()),
                        operator_.command(t_s, speed_ref_rpm_), output)) {
                break;
            }
            ++out_.steps;
            if (run_.hash_signals) {
                fold_signals(firmware_.unit(), output, out_.signal_hashes);
            }
            if (--until_row == 0) {
                until_row = run_.decimate;
                record(output);
            }
            watch(t_s);
            const Duty acting = timer_.exchange({output.duty_u, output.duty_v, output.duty_w});
            plant_.advance(acting, output.gates_on, output.brake_on);
            f_s_.follow(plant_.state().psi_r_Wb);
            if (plant_.diverged() || (run_.stop_at_trip && out_.trip != 0)) {
                watch(plant_.time_s());
                break;
            }
            if (firmware_.unit().commissioned.status != COMMISSIONING_BUSY) {
                break;
            }
        }
        const unit_t &unit = firmware_.unit();
        out_.commissioned = unit.commissioned.status == COMMISSIONING_DONE;
        out_.refusal = unit.commissioning.refusal;
        out_.commissioning = unit.commissioning.result;
        out_.loop_ns_per_step = 1e9 * (cpu_time_s() - start_s) /
                                static_cast<double>(std::max<std::uint64_t>(out_.steps, 1));
        return std::move(out_);
    }

private:
    // False when a witness ends the run.
    bool period(hal_sample_t sample, const unit_command_t &command, hal_output_t &output)
    {
        if (witness_ == nullptr) {
            output = firmware_.step(sample, command);
            return true;
        }
        witness_->ask(sample, command);
        output = firmware_.step(sample, command);
        return witness_->answer(firmware_.unit(), output);
    }

    void record(const hal_output_t &output)
    {
        const unit_t &unit = firmware_.unit();
        Row r{.truth = plant_.truth(), .t = firmware_.telemetry(), .duty = output};
        const Vec flux_Wb = r.truth.psi_r_Wb;
        r.speed_ref_rpm = static_cast<double>(speed_ref_rpm_);
        r.omega_ref_rad_s = static_cast<double>(unit.drive.modes.vector.speed.omega_ref_rad_s) /
                            static_cast<double>(firmware_.params().pole_pairs);
        r.f_s_Hz = f_s_.f_Hz();
        r.lambda_Wb = magnitude(flux_Wb);
        r.flux_angle_rad = portable_atan2(flux_Wb.beta, flux_Wb.alpha);
        r.flux_angle_err_deg = angle_error_deg(r);
        r.i_abs_A = magnitude(r.truth.i_s_A);
        r.e1_abs_A = magnitude({r.t.e1_alpha_A, r.t.e1_beta_A});
        r.gates_on = output.gates_on ? 1.0 : 0.0;
        r.Rs_true_ohm =
            run_.rig.motor.Rs_ohm * run_.scenario.disturbances.rs_factor.value(r.truth.t_s);
        r.x_rad_s = static_cast<double>(unit.drive.estimator.adaptation.x_rad_s);
        float *cell = out_.data.data() + out_.rows;
#define COLUMN(name, value, text)                                                                  \
    *cell = static_cast<float>(value);                                                             \
    cell += out_.stride;
#include "sim_columns.def"
#undef COLUMN
        ++out_.rows;
    }

    void watch(double t_s)
    {
        const MotorState &x = plant_.state();
        const Vec i_A = plant_.motor().stator_current(x);
        std::uint32_t trip = 0;
        if (const std::uint32_t faults = firmware_.unit().machine.faults; faults != 0) {
            trip |= ZH_TRIP_FIRMWARE;
            if (out_.first_fault == 0) {
                out_.first_fault = faults;
                out_.first_fault_s = t_s;
            }
        }
        if (std::abs(x.omega_m_rad_s) > trip_speed_rad_s) {
            trip |= ZH_TRIP_SPEED;
        }
        if (dot(i_A, i_A) > trip_current_A * trip_current_A) {
            trip |= ZH_TRIP_CURRENT;
        }
        if (plant_.diverged()) {
            trip |= ZH_TRIP_DIVERGED;
        }
        if (trip != 0 && out_.trip == 0) {
            out_.trip_s = t_s;
        }
        out_.trip |= trip;
    }

    const Run &run_;
    Witness *witness_;
    Firmware firmware_;
    Plant plant_;
    PreloadedTimer timer_;
    Operator operator_;
    FluxFrequency f_s_;
    Outcome out_;
    float speed_ref_rpm_ = 0.0F;
};

// One period as firmware and plant saw it, for timing them one at a time.
struct Exchange {
    hal_sample_t sample;
    unit_command_t command;
    hal_output_t output;
    Duty acting;
};

std::vector<Exchange> exchanges(const Run &run, std::uint64_t steps)
{
    std::vector<Exchange> log;
    log.reserve(steps);
    Firmware firmware(run.params, run.gain);
    Plant plant(run.rig, run.board, run.scenario.disturbances, run.seed);
    Operator op(run.scenario);
    PreloadedTimer timer(run.board.delay_periods);
    for (std::uint64_t k = 0; k < steps; ++k) {
        const double t_s = plant.time_s();
        Exchange e{};
        e.sample = sample_of(plant.sample(), plant.broken());
        e.command = op.command(t_s, op.speed_ref_rpm(t_s));
        e.output = firmware.step(e.sample, e.command);
        e.acting = timer.exchange({e.output.duty_u, e.output.duty_v, e.output.duty_w});
        plant.advance(e.acting, e.output.gates_on, e.output.brake_on);
        log.push_back(e);
    }
    return log;
}

bool same(const hal_output_t &a, const hal_output_t &b)
{
    return a.gates_on == b.gates_on && !(a.duty_u < b.duty_u) && !(a.duty_u > b.duty_u) &&
           !(a.duty_v < b.duty_v) && !(a.duty_v > b.duty_v) && !(a.duty_w < b.duty_w) &&
           !(a.duty_w > b.duty_w);
}

// Each half alone on what the other gave it, no clock inside; both must repeat the run to the bit,
// or the time would be that of something else.
void time_split(const Run &run, Outcome &out)
{
    const std::vector<Exchange> log = exchanges(run, out.steps);
    const double per_step = 1e9 / static_cast<double>(std::max<std::size_t>(log.size(), 1));
    Firmware firmware(run.params, run.gain);
    bool repeated = true;
    const double controller_s = cpu_time_s();
    for (const Exchange &e : log) {
        repeated &= same(firmware.step(e.sample, e.command), e.output);
    }
    out.controller_ns_per_step = per_step * (cpu_time_s() - controller_s);

    Plant plant(run.rig, run.board, run.scenario.disturbances, run.seed);
    const double plant_s = cpu_time_s();
    for (const Exchange &e : log) {
        const Words w = plant.sample();
        repeated &= w.i_u == e.sample.i_u_counts && w.i_v == e.sample.i_v_counts &&
                    w.u_uv == e.sample.u_uv_counts;
        plant.advance(e.acting, e.output.gates_on, e.output.brake_on);
    }
    out.plant_ns_per_step = per_step * (cpu_time_s() - plant_s);
    if (!repeated) {
        throw ConfigError("timing: firmware or plant did not repeat the run; this is a bug");
    }
}

} // namespace

std::size_t column_count()
{
    return columns.size();
}

Column column(std::size_t index)
{
    return columns[index];
}

Outcome simulate(const Run &run, Witness *witness)
{
    Outcome out = Loop(run, witness).finish();
    if (run.time_split) {
        time_split(run, out);
    }
    return out;
}

} // namespace zh
