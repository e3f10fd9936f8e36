#include "sil.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>
#include <string>

#include "board.hpp"
#include "c_boundary.hpp"
#include "firmware.hpp"
#include "firmware_setup.hpp"
#include "live_parameter.hpp"
#include "sil_handle.hpp"

// The firmware's own numbers are the interface's.
constexpr bool same(std::uint32_t ours, std::uint32_t firmware)
{
    return ours == firmware;
}
static_assert(same(ZH_STATE_BOOT, SEQUENCE_BOOT) && same(ZH_STATE_READY, SEQUENCE_READY));
static_assert(same(ZH_STATE_RUN, SEQUENCE_RUN) && same(ZH_STATE_FAULT, SEQUENCE_FAULT));
static_assert(same(ZH_STATE_TORQUE_OFF, SEQUENCE_TORQUE_OFF));
static_assert(same(ZH_SIL_RUN, SEQUENCE_CMD_RUN));
static_assert(same(ZH_SIL_FAULT_RESET, SEQUENCE_CMD_FAULT_RESET));
static_assert(same(ZH_SIL_TORQUE_OFF, SEQUENCE_CMD_TORQUE_OFF));
static_assert(same(ZH_STATE_RAMP_DOWN, SEQUENCE_RAMP_DOWN));
static_assert(same(ZH_STATE_COAST, SEQUENCE_COAST));
static_assert(same(ZH_FAULT_OVER_CURRENT, FAULT_OVER_CURRENT));
static_assert(same(ZH_FAULT_NON_FINITE, FAULT_NON_FINITE));
static_assert(same(ZH_FAULT_CONFIG, FAULT_CONFIG));
static_assert(same(ZH_FAULT_TABLE_CRC, FAULT_TABLE_CRC));
static_assert(same(ZH_SIL_COMMISSION, SEQUENCE_CMD_COMMISSION));
static_assert(same(ZH_CONFIDENCE_DEGRADED, SUPERVISOR_DEGRADED));
static_assert(same(ZH_CONFIDENCE_LOST, SUPERVISOR_IMPRESSED));
static_assert(same(ZH_REASON_UNSURE, SUPERVISOR_UNSURE));
static_assert(same(ZH_REASON_RESIDUAL, SUPERVISOR_RESIDUAL));
static_assert(same(ZH_REASON_FLUX, SUPERVISOR_FLUX));
static_assert(same(ZH_REASON_LOST, SUPERVISOR_LOST));
static_assert(same(ZH_REASON_STILL, SUPERVISOR_STILL));

namespace {

using zh::fail;

using zh::hand_out;

constexpr std::uint32_t all_commands =
    ZH_SIL_RUN | ZH_SIL_FAULT_RESET | ZH_SIL_TORQUE_OFF | ZH_SIL_COMMISSION;
constexpr float rpm_per_rad_s = 30.0F / NUM_PI;

zh_sil_out gates_off()
{
    zh_sil_out o{};
    o.duty_u = o.duty_v = o.duty_w = 0.5F;
    return o;
}

// What only some estimators have.
void show_estimator(const unit_t &unit, zh_sil_out &o)
{
    static const zh::NamedSignal l1_re("l1_re_per_s");
    static const zh::NamedSignal l1_im("l1_im_per_s");
    static const zh::NamedSignal l2_re("l2_re_ohm");
    static const zh::NamedSignal l2_im("l2_im_ohm");
    static const zh::NamedSignal x("x_rad_s");
    o.l1_re = l1_re.value(unit);
    o.l1_im = l1_im.value(unit);
    o.l2_re = l2_re.value(unit);
    o.l2_im = l2_im.value(unit);
    o.x_rad_s = x.value(unit);
}

std::uint32_t commissioning_of(const unit_t &unit)
{
    switch (unit.commissioned.status) {
    case COMMISSIONING_DONE:
        return ZH_COMMISSIONING_DONE;
    case COMMISSIONING_REFUSED:
        return ZH_COMMISSIONING_REFUSED;
    case COMMISSIONING_BUSY:
    default:
        return unit.machine.id == SEQUENCE_COMMISSIONING ? ZH_COMMISSIONING_BUSY
                                                         : ZH_COMMISSIONING_NONE;
    }
}

// What came with version 4.
void show_rest(const unit_t &unit, const unit_telemetry_t &t, bool brake_on, zh_sil_out &o)
{
    const drive_config_t &cfg = unit_config(&unit)->drive;
    const vector_state_t &vector = unit.drive.modes.vector;
    o.confidence = t.confidence;
    o.reasons = t.supervisor_reasons;
    o.commissioning = commissioning_of(unit);
    o.speed_bound_rpm = rpm_per_rad_s * t.omega_m_bound_rad_s;
    o.speed_ref_rpm = rpm_per_rad_s * vector.speed.omega_ref_rad_s / cfg.motor.pole_pairs;
    o.i_d_ref_A = unit.last.i_ref_A.d;
    o.lambda_ref_Wb = cfg.modes.vector.flux.lambda_ref_Wb - vector.flux_reduction_Wb;
    o.Rs_hat_ohm = t.Rs_hat_ohm;
    o.leg_loss_pu = unit.drive.modes.premagnetise.leg_loss_pu;
    o.u_s_alpha_V = unit.last.u_s_V.alpha;
    o.u_s_beta_V = unit.last.u_s_V.beta;
    o.i_s_alpha_A = unit.last.meas.i_s_A.alpha;
    o.i_s_beta_A = unit.last.meas.i_s_A.beta;
    o.u_dc_V = unit.last.meas.u_dc_V;
    o.brake_on = brake_on ? 1U : 0U;
}

zh_sil_out output_of(const zh::Firmware &firmware, const hal_output_t &output)
{
    const unit_telemetry_t t = firmware.telemetry();
    zh_sil_out o{};
    o.duty_u = output.duty_u;
    o.duty_v = output.duty_v;
    o.duty_w = output.duty_w;
    o.gates_on = output.gates_on ? 1U : 0U;
    o.state = t.state;
    o.faults = t.faults;
    o.speed_hat_rpm = rpm_per_rad_s * t.omega_m_hat_rad_s;
    o.lambda_Wb = t.lambda_hat_Wb;
    o.lambda_angle_rad = t.lambda_angle_rad;
    o.i_d_A = t.i_d_A;
    o.i_q_A = t.i_q_A;
    o.i_q_ref_A = t.i_q_ref_A;
    o.e1_alpha_A = t.e1_alpha_A;
    o.e1_beta_A = t.e1_beta_A;
    o.stator_frequency_Hz = t.stator_frequency_Hz;
    show_estimator(firmware.unit(), o);
    o.speed_unknown = t.speed_unknown;
    show_rest(firmware.unit(), t, output.brake_on, o);
    return o;
}

bool mode_known(const zh_sil_in &in)
{
    return in.mode == ZH_SIL_SPEED || in.mode == ZH_SIL_TORQUE;
}

unit_command_t command_of(const zh_sil_in &in, std::uint32_t sequence)
{
    // Nobody knows what an unknown mode means: no torque until it is gone and run was seen low.
    unit_command_t command{ZH_SIL_TORQUE_OFF, 0.0F, 0.0F, sequence};
    if (mode_known(in)) {
        const bool torque_mode = in.mode == ZH_SIL_TORQUE;
        // A reference that is no number goes in as well: the firmware itself has to trip on it.
        command.command =
            (in.command & all_commands) | (torque_mode ? SEQUENCE_CMD_TORQUE_MODE : 0U);
        command.omega_m_ref_rad_s = zh::rad_s_from_rpm(in.speed_ref_rpm);
        command.torque_ref_Nm = torque_mode ? in.torque_ref_Nm : 0.0F;
    }
    return command;
}

// Version 1's struct at least.
bool writable(const zh_sil_out *out)
{
    return out != nullptr && out->struct_size >= offsetof(zh_sil_out, speed_unknown);
}

// What of the input the drive could not take; it has seen it all the same.
int input_status(const zh_sil_in &in)
{
    if (!mode_known(in)) {
        return fail(ZH_BAD_INPUT, "zh_sil_step: mode: only 0 (speed) and 1 (torque) are known");
    }
    if (in.mode == ZH_SIL_TORQUE && !std::isfinite(in.torque_ref_Nm)) {
        return fail(ZH_BAD_INPUT, "zh_sil_step: torque_ref_Nm: is not a finite number; the drive "
                                  "has tripped, give a number and reset the fault");
    }
    if (!std::isfinite(in.speed_ref_rpm)) {
        return fail(ZH_BAD_INPUT, "zh_sil_step: speed_ref_rpm: is not a finite number; the drive "
                                  "has tripped, give a number and reset the fault");
    }
    return ZH_OK;
}

} // namespace

std::uint32_t zh_sil_version(void)
{
    return ZH_SIL_VERSION;
}

const char *zh_sil_error(void)
{
    return zh::last_error().c_str();
}

zh_sil *zh_sil_open(const char *motor_dir, const char *board_toml, const char *overrides)
{
    return zh::guarded<zh_sil *>(nullptr, [&]() -> zh_sil * {
        if (motor_dir == nullptr || board_toml == nullptr) {
            fail(ZH_BAD_ARGUMENT, "zh_sil_open: motor_dir or board_toml: is NULL; give both paths");
            return nullptr;
        }
        const zh::MotorDir dir = zh::MotorDir::load(motor_dir);
        params_t params = zh::nominal_params(dir.motor, zh::load_board(board_toml));
        zh::apply_overrides(params, overrides != nullptr ? overrides : "", "overrides");
        return new zh_sil{.firmware = zh::Firmware(params, dir.gain), .opened = params};
    });
}

void zh_sil_close(zh_sil *handle)
{
    delete handle;
}

int zh::step(zh_sil &drive, const zh_sil_in &in, bool broken, zh_sil_out &out)
{
    const unit_command_t command = command_of(in, ++drive.steps);
    const std::uint16_t inputs = broken ? HAL_INPUT_BREAK : 0U;
    const hal_sample_t sample{in.i_u, in.i_v, in.i_w, in.u_uv, in.u_vw, in.u_dc, 0, inputs};
    drive.output = drive.firmware.step(sample, command);
    out = output_of(drive.firmware, drive.output);
    return input_status(in);
}

int zh_sil_step(zh_sil *handle, const zh_sil_in *in, zh_sil_out *out)
{
    if (!writable(out)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_step: out: is NULL or its struct_size too small; set "
                                     "it to sizeof(zh_sil_out)");
    }
    if (handle == nullptr || in == nullptr || in->struct_size < sizeof(zh_sil_in)) {
        hand_out(gates_off(), out);
        return fail(ZH_BAD_ARGUMENT, "zh_sil_step: handle or in: is NULL or in's struct_size too "
                                     "small; set it to sizeof(zh_sil_in)");
    }
    zh_sil_out now;
    const int status = zh::step(*handle, *in, false, now);
    hand_out(now, out);
    return status;
}

int zh_sil_look(const zh_sil *handle, zh_sil_out *out)
{
    if (handle == nullptr || !writable(out)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_look: handle or out: is NULL or out's struct_size too "
                                     "small; set it to sizeof(zh_sil_out)");
    }
    hand_out(output_of(handle->firmware, handle->output), out);
    return ZH_OK;
}

int zh_sil_get(const zh_sil *handle, const char *name, float *value)
{
    if (handle == nullptr || name == nullptr || value == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_get: handle, name or value: is NULL");
    }
    const std::size_t index = params_find(name);
    if (index == params_count()) {
        return fail(ZH_NO_SUCH_NAME, "zh_sil_get: " + std::string(name) +
                                         ": no such parameter; zh_sil_name lists them");
    }
    *value = params_get(&handle->firmware.params(), index);
    return ZH_OK;
}

int zh_sil_set(zh_sil *handle, const char *name, float value)
{
    if (handle == nullptr || name == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_set: handle or name: is NULL");
    }
    return zh::set_live(handle->firmware, name, value, "zh_sil_set");
}

std::uint32_t zh_sil_name_count(void)
{
    return static_cast<std::uint32_t>(params_count());
}

const char *zh_sil_name(std::uint32_t index)
{
    return index < params_count() ? params_name(index) : nullptr;
}

int zh_sil_describe(std::uint32_t index, zh_sil_name_info *info)
{
    const param_info_t *p = params_info(index);
    if (info == nullptr || info->struct_size < offsetof(zh_sil_name_info, group)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_describe: info: is NULL or its struct_size too small; "
                                     "set it to sizeof(zh_sil_name_info)");
    }
    if (p == nullptr) {
        return fail(ZH_NO_SUCH_NAME, "zh_sil_describe: index " + std::to_string(index) +
                                         ": is not below zh_sil_name_count()");
    }
    const zh_sil_name_info value{info->struct_size,
                                 static_cast<std::uint32_t>(p->access),
                                 p->type == PARAM_FLOAT ? 0U : 1U,
                                 p->minimum,
                                 p->maximum,
                                 params_initial(index),
                                 param_unit(p),
                                 params_text(index),
                                 params_group_name(p->group),
                                 param_choices(p)};
    hand_out(value, info);
    return ZH_OK;
}
