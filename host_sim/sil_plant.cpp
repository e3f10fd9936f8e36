#include "sil_plant.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

#include "c_boundary.hpp"
#include "elementary.hpp"
#include "plant.hpp"
#include "sil_array.hpp"
#include "sil_handle.hpp"
#include "sim_job.hpp"

struct zh_plant {
    zh::Plant plant;
    zh::PreloadedTimer timer;
    zh::Disturbances disturbances;
    std::string opened; // with these files
};

namespace {

using zh::fail;

// Quantities that a caller sets while the plant runs.
struct Setting {
    std::string_view name;
    double minimum;
    double maximum;
};
constexpr std::array settings{Setting{"load_torque_Nm", -1e5, 1e5}, Setting{"rs_factor", 0.1, 10.0},
                              Setting{"rr_factor", 0.1, 10.0}, Setting{"u_dc_V", 0.0, 1e5}};

void set(zh::Disturbances &disturbances, std::size_t index, double value)
{
    const zh::Profile constant(value);
    switch (index) {
    case 0:
        disturbances.load_torque_Nm = constant;
        break;
    case 1:
        disturbances.rs_factor = constant;
        break;
    case 2:
        disturbances.rr_factor = constant;
        break;
    default:
        disturbances.u_dc_V = constant;
        break;
    }
}

bool is_duty(double duty)
{
    return duty >= 0.0 && duty <= 1.0;
}

void advance(zh_plant &p, const zh::Duty &duty, bool gates_on, bool brake_on)
{
    p.plant.advance(p.timer.exchange(duty), gates_on, brake_on);
}

zh_plant_truth truth_of(const zh_plant &p)
{
    const zh::Truth t = p.plant.truth();
    return {.struct_size = sizeof(zh_plant_truth),
            .diverged = p.plant.diverged() ? 1U : 0U,
            .t_s = t.t_s,
            .speed_rpm = t.omega_m_rad_s / zh::rad_s_per_rpm,
            .torque_Nm = t.torque_Nm,
            .load_torque_Nm = t.load_torque_Nm,
            .i_s_alpha_A = t.i_s_A.alpha,
            .i_s_beta_A = t.i_s_A.beta,
            .psi_s_alpha_Wb = t.psi_s_Wb.alpha,
            .psi_s_beta_Wb = t.psi_s_Wb.beta,
            .psi_r_alpha_Wb = t.psi_r_Wb.alpha,
            .psi_r_beta_Wb = t.psi_r_Wb.beta,
            .u_s_alpha_V = t.u_s_V.alpha,
            .u_s_beta_V = t.u_s_V.beta,
            .i_peak_A = t.i_peak_A,
            .u_dc_V = t.u_dc_V};
}

zh_sil_in with_words(const zh_sil_in &command, const zh::Words &w)
{
    zh_sil_in in = command;
    in.struct_size = sizeof in;
    in.i_u = w.i_u;
    in.i_v = w.i_v;
    in.i_w = w.i_w;
    in.u_uv = w.u_uv;
    in.u_vw = w.u_vw;
    in.u_dc = w.u_dc;
    return in;
}

// One period of both; the status is the drive's.
int period(zh_plant &plant, zh_sil &drive, const zh_sil_in &command, zh_sil_out &out)
{
    const bool broken = plant.plant.broken();
    const zh_sil_in in = with_words(command, plant.plant.sample());
    const int status = zh::step(drive, in, broken, out);
    const zh::Duty duty{static_cast<double>(out.duty_u), static_cast<double>(out.duty_v),
                        static_cast<double>(out.duty_w)};
    advance(plant, duty, out.gates_on != 0, out.brake_on != 0);
    return status;
}

template <typename T> bool fits(const T *first)
{
    return first == nullptr || first->struct_size % alignof(T) == 0;
}

} // namespace

zh_plant *zh_plant_open(const char *rig, const char *board, const char *scenario,
                        const char *rig_overrides, std::uint64_t seed)
{
    if (rig == nullptr || board == nullptr) {
        fail(ZH_BAD_ARGUMENT, "zh_plant_open: rig or board: is NULL; give both");
        return nullptr;
    }
    return zh::guarded<zh_plant *>(nullptr, [&]() -> zh_plant * {
        const zh::Rig of_rig = zh::rig_of(rig, rig_overrides);
        const zh::Board of_board = zh::board_of(board, nullptr);
        zh::Disturbances disturbances;
        if (scenario != nullptr) {
            disturbances = zh::scenario_of(scenario, nullptr).disturbances;
        }
        std::string opened = std::string(rig) + '\0' + board + '\0';
        opened += rig_overrides != nullptr ? rig_overrides : "";
        return new zh_plant{zh::Plant(of_rig, of_board, disturbances, seed),
                            zh::PreloadedTimer(of_board.delay_periods), disturbances,
                            std::move(opened)};
    });
}

void zh_plant_close(zh_plant *plant)
{
    delete plant;
}

int zh_plant_sample(zh_plant *plant, std::uint16_t words[6])
{
    if (plant == nullptr || words == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_plant_sample: plant or words: is NULL");
    }
    const zh::Words w = plant->plant.sample();
    const std::array in_order{w.i_u, w.i_v, w.i_w, w.u_uv, w.u_vw, w.u_dc};
    std::copy(in_order.begin(), in_order.end(), words);
    return ZH_OK;
}

int zh_plant_advance(zh_plant *plant, const double duty[3], std::uint32_t gates_on,
                     std::uint32_t brake_on)
{
    if (plant == nullptr || duty == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_plant_advance: plant or duty: is NULL");
    }
    if (!is_duty(duty[0]) || !is_duty(duty[1]) || !is_duty(duty[2])) {
        return fail(ZH_OUT_OF_RANGE, "zh_plant_advance: duty: is not in 0 .. 1");
    }
    advance(*plant, {duty[0], duty[1], duty[2]}, gates_on != 0, brake_on != 0);
    return ZH_OK;
}

int zh_plant_look(const zh_plant *plant, zh_plant_truth *truth)
{
    if (plant == nullptr || truth == nullptr || truth->struct_size < sizeof(zh_plant_truth)) {
        return fail(ZH_BAD_ARGUMENT, "zh_plant_look: plant or truth: is NULL or its struct_size "
                                     "too small; set it to sizeof(zh_plant_truth)");
    }
    zh::hand_out(truth_of(*plant), truth);
    return ZH_OK;
}

int zh_plant_set(zh_plant *plant, const char *name, double value)
{
    if (plant == nullptr || name == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_plant_set: plant or name: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        const auto found = std::find_if(settings.begin(), settings.end(),
                                        [&](const Setting &s) { return s.name == name; });
        const std::string named = "zh_plant_set: " + std::string(name) + ": ";
        if (found == settings.end()) {
            return fail(ZH_NO_SUCH_NAME, named + "no such quantity; load_torque_Nm, rs_factor, "
                                                 "rr_factor and u_dc_V exist");
        }
        if (!(value >= found->minimum && value <= found->maximum)) {
            return fail(ZH_OUT_OF_RANGE, named + "is not in " + std::to_string(found->minimum) +
                                             " .. " + std::to_string(found->maximum));
        }
        set(plant->disturbances, static_cast<std::size_t>(found - settings.begin()), value);
        plant->plant.disturb(plant->disturbances);
        return int{ZH_OK};
    });
}

int zh_plant_reseed(zh_plant *plant, std::uint64_t seed)
{
    if (plant == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_plant_reseed: plant: is NULL");
    }
    plant->plant.reseed(seed);
    return ZH_OK;
}

int zh_plant_run(zh_plant *plant, zh_sil *drive, const zh_sil_in *in, zh_sil_out *out,
                 zh_plant_truth *truth, std::uint32_t count, const zh_sil_record *record)
{
    if (plant == nullptr || drive == nullptr || in == nullptr ||
        in->struct_size < sizeof(zh_sil_in) || !fits(in) || !fits(out) || !fits(truth)) {
        return fail(ZH_BAD_ARGUMENT, "zh_plant_run: plant, drive or in: is NULL, or a struct_size "
                                     "is wrong; set each to the size of the struct");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        int status = zh::record_status("zh_plant_run", record);
        for (std::uint32_t k = 0; k < count && status == ZH_OK; ++k) {
            if (truth != nullptr) {
                zh::hand_out(truth_of(*plant), zh::element(truth, k));
            }
            zh_sil_out now{};
            status = period(*plant, *drive, *zh::element(in, k), now);
            if (out != nullptr) {
                zh::hand_out(now, zh::element(out, k));
            }
            zh::note(*drive, record, k);
        }
        return status;
    });
}

zh_plant *zh_plant_copy(const zh_plant *plant)
{
    if (plant == nullptr) {
        fail(ZH_BAD_ARGUMENT, "zh_plant_copy: plant: is NULL");
        return nullptr;
    }
    return zh::guarded<zh_plant *>(nullptr, [&] { return new zh_plant(*plant); });
}

int zh_plant_restore(zh_plant *plant, const zh_plant *from)
{
    if (plant == nullptr || from == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_plant_restore: plant or from: is NULL");
    }
    if (plant->opened != from->opened) {
        return fail(ZH_REFUSED, "zh_plant_restore: from: was opened with another rig, board or "
                                "overrides; open this one alike");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        *plant = *from;
        return int{ZH_OK};
    });
}
