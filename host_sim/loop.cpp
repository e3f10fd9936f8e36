#include "loop.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "sim.h"

namespace zh {
namespace {

constexpr double trip_speed_rad_s = 3000.0 * rad_s_per_rpm;
constexpr double trip_current_A = 60.0;

constexpr std::array columns{
#define COLUMN(name, value, text) Column{#name, text},
#include "sim_columns.def"
#undef COLUMN
};

// Everything one row is made of; the columns pick from it (sim_columns.def).
struct Row {
    Truth truth;
    unit_telemetry_t t;
    hal_output_t duty;
    double speed_ref_rpm = 0.0;
    double omega_hat_rad_s = 0.0;
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

bool finite(const estimate_t &e)
{
    return std::isfinite(e.lambda_r_hat_Wb.alpha + e.lambda_r_hat_Wb.beta + e.lambda_Wb +
                         e.omega_e_rad_s + e.omega_s_rad_s);
}

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

} // namespace

std::size_t column_count()
{
    return columns.size();
}

std::uint64_t columns_of(std::uint64_t chosen)
{
    static_assert(columns.size() < 64);
    constexpr std::uint64_t known = (std::uint64_t{1} << columns.size()) - 1;
    return (chosen != 0 ? chosen : every_column) & known;
}

Column column(std::size_t index)
{
    return columns[index];
}

Loop::Loop(const Run &run, LockstepPeer *peer)
    : run_(run), peer_(peer), firmware_(run.params, run.gain),
      plant_(run.rig, run.board, run.scenario.disturbances, run.seed),
      timer_(run.board.delay_periods), operator_(run.scenario), f_s_(run.board.period_s)
{
    if (run.guard_recorded) {
        firmware_.record_guard();
    }
    operator_.speak(plant_.time_s());
    out_.period_s = run.board.period_s;
    out_.stride =
        run.keep_rows != 0 ? run.keep_rows : (run.steps + run.decimate - 1) / run.decimate;
    out_.columns = static_cast<std::uint32_t>(std::popcount(columns_of(run.columns)));
    out_.data.resize(static_cast<std::size_t>(out_.stride) * out_.columns);
}

void Loop::control(const Words &words, PlantCommand &command)
{
    const double t_s = plant_.time_s();
    if (!hangs(t_s) && !period(words)) {
        ended_ = true;
        return;
    }
    ++out_.steps;
    if (run_.hash_signals) {
        fold_signals(firmware_.unit(), output_, out_.signal_hashes);
    }
    if (--until_row_ == 0) {
        until_row_ = run_.decimate;
        record();
    }
    watch(t_s);
    timer_.exchange(output_.duty_u, output_.duty_v, output_.duty_w, command.duty);
    command.gates_on = output_.gates_on;
    command.brake_on = output_.brake_on;
}

// Nothing is computed any more: the output stays as it is, until somebody else opens the gates.
bool Loop::hangs(double t_s)
{
    const Faults &f = run_.scenario.disturbances.faults;
    if (t_s < f.hang_s) {
        return false;
    }
    output_.gates_on = output_.gates_on && hung_periods_ < f.hang_periods;
    ++hung_periods_;
    return true;
}

void Loop::follow()
{
    f_s_.follow(plant_.state().psi_r_Wb);
    operator_.speak(plant_.time_s());
    if (plant_.diverged() || (run_.stop_at_trip && out_.trip != 0)) {
        watch(plant_.time_s());
        ended_ = true;
    }
    // Elsewhere the word is nobody's, and may be a flipped one.
    const bool commissions = run_.scenario.commission_s < never_s;
    if (commissions && firmware_.unit().commissioned.status != COMMISSIONING_BUSY) {
        ended_ = true;
    }
}

void Loop::too_slow()
{
    out_.trip_s = out_.trip == 0 ? plant_.time_s() : out_.trip_s;
    out_.trip |= ZH_TRIP_SLOW;
    ended_ = true;
}

void Loop::scenario_changed()
{
    plant_.disturb(run_.scenario.disturbances);
    operator_.start_again();
    operator_.speak(plant_.time_s());
}

Outcome Loop::take()
{
    const unit_t &unit = firmware_.unit();
    out_.commissioned = unit.commissioned.status == COMMISSIONING_DONE;
    out_.refusal = unit.commissioning.refusal;
    out_.commissioning = unit.commissioning.result;
    return std::move(out_);
}

// False when a peer ends the run.
bool Loop::period(const Words &words)
{
    hal_sample_t sample = sample_of(words, plant_.broken());
    if (peer_ == nullptr) {
        output_ = firmware_.step(sample, operator_.said());
        return true;
    }
    unit_command_t command = operator_.said();
    peer_->ask(sample, command);
    output_ = firmware_.step(sample, command);
    return peer_->answer(firmware_.unit(), output_);
}

void Loop::record()
{
    const unit_t &unit = firmware_.unit();
    Row r{.truth = plant_.truth(), .t = firmware_.telemetry(), .duty = output_};
    const Vec flux_Wb = r.truth.psi_r_Wb;
    r.speed_ref_rpm = static_cast<double>(operator_.speed_ref_rpm(r.truth.t_s));
    r.omega_hat_rad_s = static_cast<double>(unit.drive.estimator.estimate.omega_e_rad_s /
                                            firmware_.params().pole_pairs);
    r.omega_ref_rad_s = static_cast<double>(unit.drive.modes.vector.speed.omega_ref_rad_s) /
                        static_cast<double>(firmware_.params().pole_pairs);
    r.f_s_Hz = f_s_.f_Hz();
    r.lambda_Wb = magnitude(flux_Wb);
    r.flux_angle_rad = portable_atan2(flux_Wb.beta, flux_Wb.alpha);
    r.flux_angle_err_deg = angle_error_deg(r);
    r.i_abs_A = magnitude(r.truth.i_s_A);
    r.e1_abs_A = magnitude({r.t.e1_alpha_A, r.t.e1_beta_A});
    r.gates_on = output_.gates_on ? 1.0 : 0.0;
    r.Rs_true_ohm = run_.rig.motor.Rs_ohm * run_.scenario.disturbances.rs_factor.value(r.truth.t_s);
    static const NamedSignal x_rad_s("x_rad_s");
    r.x_rad_s = static_cast<double>(x_rad_s.value(unit));
    const std::array values{
#define COLUMN(name, value, text) static_cast<float>(value),
#include "sim_columns.def"
#undef COLUMN
    };
    float *cell = out_.data.data() + out_.rows % out_.stride;
    std::uint64_t wanted = columns_of(run_.columns);
    for (const float value : values) {
        if ((wanted & 1U) != 0) {
            *cell = value;
            cell += out_.stride;
        }
        wanted >>= 1U;
    }
    ++out_.rows;
}

void Loop::watch(double t_s)
{
    const MotorState &x = plant_.state();
    const Vec i_A = plant_.motor().stator_current(x);
    std::uint32_t trip = 0;
    if (!finite(firmware_.unit().drive.estimator.estimate)) {
        trip |= ZH_TRIP_NAN;
    }
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

} // namespace zh
