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

struct zh_sil {
    zh::Firmware firmware;
    std::uint32_t steps = 0;
};

namespace {

using zh::fail;

constexpr std::uint32_t all_commands = ZH_SIL_RUN | ZH_SIL_FAULT_RESET | ZH_SIL_TORQUE_OFF;
constexpr float rpm_per_rad_s = 30.0F / NUM_PI;

// Writes what the caller's struct has room for, its struct_size untouched.
template <typename T> void hand_out(const T &value, T *out)
{
    const std::size_t size = std::min<std::size_t>(out->struct_size, sizeof value);
    constexpr std::size_t head = sizeof value.struct_size;
    std::memcpy(reinterpret_cast<std::byte *>(out) + head,
                reinterpret_cast<const std::byte *>(&value) + head, size - head);
}

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
        return new zh_sil{.firmware = zh::Firmware(params, dir.gain)};
    });
}

void zh_sil_close(zh_sil *handle)
{
    delete handle;
}

int zh_sil_step(zh_sil *handle, const zh_sil_in *in, zh_sil_out *out)
{
    if (out == nullptr || out->struct_size < offsetof(zh_sil_out, speed_unknown)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_step: out: is NULL or its struct_size too small; set "
                                     "it to sizeof(zh_sil_out)");
    }
    if (handle == nullptr || in == nullptr || in->struct_size < sizeof(zh_sil_in)) {
        hand_out(gates_off(), out);
        return fail(ZH_BAD_ARGUMENT, "zh_sil_step: handle or in: is NULL or in's struct_size too "
                                     "small; set it to sizeof(zh_sil_in)");
    }
    const unit_command_t command = command_of(*in, ++handle->steps);
    const hal_sample_t sample{in->i_u, in->i_v, in->i_w, in->u_uv, in->u_vw, in->u_dc, 0, 0};
    const hal_output_t output = handle->firmware.step(sample, command);
    hand_out(output_of(handle->firmware, output), out);
    return input_status(*in);
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
