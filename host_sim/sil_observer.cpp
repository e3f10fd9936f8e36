// The estimator of the firmware alone, behind its contract (firmware/law/estimator/estimator.h): no
// sensor, no control, no modulator.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>

#include "c_boundary.hpp"
#include "firmware.hpp"
#include "firmware_setup.hpp"
#include "sil.h"

struct zh_observer {
    drive_config_t cfg{};
    estimator_state_t st{};
    std::shared_ptr<const zh::GainFile> gain;
};

namespace {

using zh::fail;

constexpr std::size_t in_columns = 4;
constexpr std::size_t out_columns = 9;

bool all_finite(float a, float b, float c, float d)
{
    return std::isfinite(a) && std::isfinite(b) && std::isfinite(c) && std::isfinite(d);
}

void step(zh_observer &o, ab_t u_s_V, ab_t i_s_A)
{
    const estimator_in_t in{.u_s_V = u_s_V,
                            .i_s_A = i_s_A,
                            .prior_rad_s = 0.0F,
                            .frame_imposed = false,
                            .omega_frame_rad_s = 0.0F};
    estimator_step(&o.cfg.estimator, &o.st, &in);
}

void read_out(const zh_observer &o, float *row)
{
    const observer_state_t &x = o.st.observer;
    const estimate_t &e = o.st.estimate;
    const float values[out_columns] = {
        e.omega_e_rad_s,         e.omega_s_rad_s,        x.i_s_hat_A.alpha, x.i_s_hat_A.beta,
        x.lambda_r_hat_Wb.alpha, x.lambda_r_hat_Wb.beta, x.e1_A.alpha,      x.e1_A.beta,
        o.st.adaptation.x_rad_s};
    std::copy(std::begin(values), std::end(values), row);
}

} // namespace

zh_observer *zh_observer_open(const char *motor_dir, const char *overrides, float period_s)
{
    return zh::guarded<zh_observer *>(nullptr, [&]() -> zh_observer * {
        if (motor_dir == nullptr) {
            fail(ZH_BAD_ARGUMENT, "zh_observer_open: motor_dir: is NULL; give a folder");
            return nullptr;
        }
        const zh::MotorDir dir = zh::MotorDir::load(motor_dir);
        params_t params = zh::nominal_params(dir.motor, std::nullopt);
        zh::set_param(params, "period_s", period_s, "zh_observer_open");
        zh::apply_overrides(params, overrides != nullptr ? overrides : "", "overrides");
        drive_params_t drive;
        unit_config_drive(&drive, &params);
        auto observer = std::make_unique<zh_observer>();
        observer->gain = dir.gain;
        if (!drive_init(&observer->cfg, &drive, &dir.gain->table())) {
            throw zh::ConfigError("overrides: " + zh::refusal_reason(params));
        }
        return observer.release();
    });
}

void zh_observer_close(zh_observer *handle)
{
    delete handle;
}

int zh_observer_set_speed(zh_observer *handle, float omega_e_rad_s)
{
    if (handle == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_observer_set_speed: handle: is NULL");
    }
    if (!std::isfinite(omega_e_rad_s)) {
        return fail(ZH_BAD_INPUT, "zh_observer_set_speed: omega_e_rad_s: is not a finite number");
    }
    const float limit = handle->cfg.estimator.adaptation.p.omega_max_rad_s;
    const float speed_rad_s = clampf(omega_e_rad_s, -limit, limit);
    const estimator_seed_t seed{.i_s_A = handle->st.observer.i_s_hat_A,
                                .lambda_r_Wb = handle->st.estimate.lambda_r_hat_Wb,
                                .omega_e_rad_s = speed_rad_s};
    estimator_seed(&handle->cfg.estimator, &handle->st, &seed);
    return ZH_OK;
}

int zh_observer_run(zh_observer *handle, std::size_t count, const float *in, float *out)
{
    if (handle == nullptr || in == nullptr || out == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_observer_run: handle, in or out: is NULL");
    }
    for (std::size_t k = 0; k < count; ++k) {
        const float *row = in + in_columns * k;
        if (!all_finite(row[0], row[1], row[2], row[3])) {
            return fail(ZH_BAD_INPUT, "zh_observer_run: row " + std::to_string(k) +
                                          ": is not finite; clean the log first");
        }
        step(*handle, {row[0], row[1]}, {row[2], row[3]});
        read_out(*handle, out + out_columns * k);
    }
    return ZH_OK;
}

int zh_observer_step(zh_observer *handle, float u_alpha_V, float u_beta_V, float i_alpha_A,
                     float i_beta_A, zh_observer_out *out)
{
    static_assert(sizeof(zh_observer_out) == sizeof(std::uint32_t) + out_columns * sizeof(float));
    if (handle == nullptr || out == nullptr || out->struct_size < sizeof(zh_observer_out)) {
        return fail(ZH_BAD_ARGUMENT, "zh_observer_step: handle or out: is NULL or out's "
                                     "struct_size too small; set it to sizeof(zh_observer_out)");
    }
    if (!all_finite(u_alpha_V, u_beta_V, i_alpha_A, i_beta_A)) {
        read_out(*handle, &out->omega_e_hat_rad_s);
        return fail(ZH_BAD_INPUT, "zh_observer_step: voltage or current: is not a finite number; "
                                  "the observer stands still");
    }
    step(*handle, {u_alpha_V, u_beta_V}, {i_alpha_A, i_beta_A});
    read_out(*handle, &out->omega_e_hat_rad_s);
    return ZH_OK;
}
