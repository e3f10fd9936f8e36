#include "sil_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <string>

#include "c_boundary.hpp"
#include "firmware_setup.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wold-style-cast"
extern "C" {
#include "estimator.h"
}
#pragma GCC diagnostic pop

struct zh_estimator {
    estimator_config_t cfg{};
    estimator_state_t st{};
    std::shared_ptr<const zh::GainFile> gain;
};

namespace {

using zh::fail;

enum Status {
    done = 0,
    bad_argument = 1,
    bad_input = 2
};

estimator_in_t input_of(const zh_estimator_event &e)
{
    return {.u_s_V = {e.u_alpha_V, e.u_beta_V},
            .i_s_A = {e.i_alpha_A, e.i_beta_A},
            .expected_step_rad_s = e.expected_step_rad_s,
            .frame_imposed = e.frame_imposed != 0,
            .omega_frame_rad_s = e.omega_frame_rad_s,
            .dwell = e.dwell,
            .slip_extra_rad_s = e.slip_extra_rad_s,
            .tau_extra_per_s = e.tau_extra_per_s};
}

bool finite(const zh_estimator_event &e)
{
    const std::array values{e.u_alpha_V,           e.u_beta_V,
                            e.i_alpha_A,           e.i_beta_A,
                            e.expected_step_rad_s, e.omega_frame_rad_s,
                            e.omega_e_rad_s,       e.lambda_alpha_Wb,
                            e.lambda_beta_Wb,      e.dwell,
                            e.slip_extra_rad_s,    e.tau_extra_per_s};
    float sum = 0.0F;
    for (const float value : values) {
        sum += value * 0.0F;
    }
    return std::isfinite(sum);
}

void act(zh_estimator &o, const zh_estimator_event &e)
{
    const estimator_in_t in = input_of(e);
    if (e.verb == ZH_ESTIMATOR_STEP) {
        estimator_step(&o.cfg, &o.st, &in);
    } else if (e.verb == ZH_ESTIMATOR_HOLD) {
        estimator_hold(&o.cfg, &o.st, &in, e.omega_e_rad_s);
    } else if (e.verb == ZH_ESTIMATOR_OFF) {
        estimator_off(&o.st, in.i_s_A, e.omega_e_rad_s);
    } else if (e.verb == ZH_ESTIMATOR_SEED) {
        const estimator_seed_t seed{.i_s_A = in.i_s_A,
                                    .lambda_r_Wb = {e.lambda_alpha_Wb, e.lambda_beta_Wb},
                                    .omega_e_rad_s = e.omega_e_rad_s};
        estimator_seed(&o.cfg, &o.st, &seed);
    } else {
        o.st = estimator_state_t{};
    }
}

zh_estimate estimate_of(const estimate_t &e)
{
    return {e.omega_e_rad_s,           e.omega_s_rad_s,         e.lambda_r_hat_Wb.alpha,
            e.lambda_r_hat_Wb.beta,    e.i_residual_A.alpha,    e.i_residual_A.beta,
            e.flux_correction_V.alpha, e.flux_correction_V.beta};
}

constexpr const char *signal_names[] = {
#define SIGNAL_F(name, path, text) #name,
#define SIGNAL_U(name, path, text) #name,
#include "estimator_signals.def"
#undef SIGNAL_F
#undef SIGNAL_U
    nullptr};
constexpr std::uint32_t signal_count = std::size(signal_names) - 1;

} // namespace

zh_estimator *zh_estimator_open(const char *motor_dir, const char *overrides, float period_s)
{
    return zh::guarded<zh_estimator *>(nullptr, [&]() -> zh_estimator * {
        if (motor_dir == nullptr) {
            fail(bad_argument, "zh_estimator_open: motor_dir: is NULL; give a folder");
            return nullptr;
        }
        const zh::MotorDir dir = zh::MotorDir::load(motor_dir);
        params_t p = zh::nominal_params(dir.motor, std::nullopt);
        zh::set_param(p, "period_s", period_s, "zh_estimator_open");
        zh::apply_overrides(p, overrides != nullptr ? overrides : "", "overrides");
        const motor_t machine{p.Rs_ohm, p.Rr_ohm, p.Ls_H, p.Lr_H, p.M_H, p.pole_pairs};
        motor_model_t motor{};
        auto estimator = std::make_unique<zh_estimator>();
        estimator->gain = dir.gain;
        if (!motor_derive(&motor, &machine) ||
            !estimator_init(&estimator->cfg, &p, &motor, &dir.gain->table())) {
            throw zh::ConfigError("overrides: " + zh::refusal_reason(p));
        }
        return estimator.release();
    });
}

void zh_estimator_close(zh_estimator *handle)
{
    delete handle;
}

int zh_estimator_run(zh_estimator *handle, std::size_t count, const zh_estimator_event *event,
                     zh_estimate *estimate)
{
    if (handle == nullptr || event == nullptr || estimate == nullptr) {
        return fail(bad_argument, "zh_estimator_run: handle, event or estimate: is NULL");
    }
    for (std::size_t k = 0; k < count; ++k) {
        const auto row = [k] { return "zh_estimator_run: row " + std::to_string(k); };
        if (event[k].verb >= ZH_ESTIMATOR_VERBS) {
            return fail(bad_input, row() + ": verb: no such one; sil_estimator.h lists them");
        }
        if (!finite(event[k])) {
            return fail(bad_input, row() + ": is not finite; clean the log first");
        }
        act(*handle, event[k]);
        estimate[k] = estimate_of(handle->st.estimate);
    }
    return done;
}

const char *zh_estimator_signal_name(std::uint32_t index)
{
    return signal_names[std::min(index, signal_count)];
}

float zh_estimator_signal(const zh_estimator *handle, std::uint32_t index)
{
    if (handle == nullptr) {
        return 0.0F;
    }
    [[maybe_unused]] const estimator_state_t &st = handle->st;
    const float values[] = {
#define ESTIMATOR_STATE            st
#define SIGNAL_F(name, path, text) path,
#define SIGNAL_U(name, path, text) static_cast<float>(path),
#include "estimator_signals.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef ESTIMATOR_STATE
        0.0F};
    return values[std::min(index, signal_count)];
}

const char *zh_estimator_error(void)
{
    return zh::last_error().c_str();
}
