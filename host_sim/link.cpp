#include "link.h"

#include <array>
#include <bit>
#include <fstream>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "c_boundary.hpp"
#include "can_line.hpp"
#include "firmware.hpp"
#include "hal_development_key.h"
#include "modbus_line.hpp"
#include "plant.hpp"
#include "sim_job.hpp"
#include "simulate.hpp"

namespace {

using zh::fail;

constexpr double rpm_per_rad_s = 30.0 / std::numbers::pi;
constexpr std::size_t trace_words = 32768;  // 4096 rows of 8 signals, .8 s
constexpr std::size_t flight_words = 49152; // 16384 rows, 3.2 s

// FNV-1a, word by word.
class Digest {
public:
    void add(std::uint32_t word)
    {
        value_ = (value_ ^ word) * 0x100000001b3U;
    }
    std::uint64_t value() const
    {
        return value_;
    }

private:
    std::uint64_t value_ = 0xcbf29ce484222325U;
};

constexpr std::uint8_t access_key[SIPHASH_KEY_BYTES] = HAL_DEVELOPMENT_KEY;

// Nobody is to foresee a nonce, the tests included: nothing of it reaches a duty.
bool entropy(void * /*context*/, std::uint64_t *bits)
{
    std::random_device device;
    *bits = (std::uint64_t{device()} << 32U) | device();
    return true;
}

// What outlives the power, plain bytes of one build.
struct Kept {
    ram_flash_t flash{};
    fault_memory_t faults{};
};

class KeptFile {
public:
    explicit KeptFile(const char *path) : path_(path != nullptr ? path : "")
    {
        if (!path_.empty()) {
            std::ifstream file(path_, std::ios::binary);
            if (file && !file.read(reinterpret_cast<char *>(&kept), sizeof kept)) {
                throw zh::ConfigError(path_ + ": is not what a drive keeps; delete it");
            }
        }
        ram_flash_start(&kept.flash);
        saved_ = kept.flash.changes;
    }
    // After the flash has changed, or `always`.
    void save(bool always)
    {
        if (path_.empty() || (!always && kept.flash.changes == saved_)) {
            return;
        }
        saved_ = kept.flash.changes;
        std::ofstream file(path_, std::ios::binary);
        if (!file.write(reinterpret_cast<const char *>(&kept), sizeof kept)) {
            throw zh::ConfigError(path_ + ": cannot be written");
        }
    }

    Kept kept;

private:
    std::string path_;
    std::uint32_t saved_ = 0;
};

} // namespace

// One drive, its rig, and the memory it records in.
struct zh_link {
    zh_link(zh::Run r, bool commands_from_link, const char *keep)
        : file(keep), run(std::move(r)), from_link(commands_from_link),
          firmware(run.params, run.gain),
          plant(run.rig, run.board, run.scenario.disturbances, run.seed)
    {
        firmware.serve_link(
            {trace.data(), trace_words, &file.kept.faults, flight.data(), flight_words},
            {&flash, access_key, entropy});
    }

    void period()
    {
        const double t_s = plant.time_s();
        const hal_sample_t sample = zh::sample_of(plant.sample(), plant.broken());
        const hal_output_t output =
            from_link
                ? firmware.step_on_link(sample)
                : firmware.step(sample, zh::command_at(run.scenario, t_s,
                                                       static_cast<float>(
                                                           run.scenario.speed_ref_rpm.value(t_s)),
                                                       static_cast<std::uint32_t>(periods)));
        const zh::Duty acting = timer.exchange({output.duty_u, output.duty_v, output.duty_w});
        plant.advance(acting, output.gates_on, output.brake_on);
        for (const float duty : {output.duty_u, output.duty_v, output.duty_w}) {
            digest.add(std::bit_cast<std::uint32_t>(duty));
        }
        digest.add(output.gates_on ? 1U : 0U);
        gates_on = output.gates_on;
        ++periods;
        modbus.serve(firmware);
        can.serve(firmware);
        file.save(false);
    }

    KeptFile file;
    hal_flash_t flash = RAM_FLASH(&file.kept.flash);
    zh::Run run;
    bool from_link;
    std::array<std::uint32_t, trace_words> trace{};
    std::array<std::uint32_t, flight_words> flight{};
    zh::Firmware firmware;
    zh::ModbusLine modbus;
    zh::CanLine can;
    zh::Plant plant;
    zh::PreloadedTimer timer;
    Digest digest;
    std::uint64_t periods = 0;
    bool gates_on = false;
};

zh_link *zh_link_open(const zh_sim_job *job, std::uint32_t from_link, const char *keep)
{
    return zh::guarded<zh_link *>(nullptr, [&]() -> zh_link * {
        if (job == nullptr || job->struct_size < sizeof(zh_sim_job)) {
            fail(ZH_BAD_ARGUMENT, "zh_link_open: job: is NULL or its struct_size too small; set it "
                                  "to sizeof(zh_sim_job)");
            return nullptr;
        }
        return std::make_unique<zh_link>(zh::run_of(*job), from_link != 0, keep).release();
    });
}

int zh_link_run(zh_link *handle, std::uint32_t periods, const std::uint8_t *received,
                std::uint32_t *received_n, std::uint8_t *sent, std::uint32_t *sent_n)
{
    if (handle == nullptr || received_n == nullptr || sent_n == nullptr ||
        (received == nullptr && *received_n > 0) || (sent == nullptr && *sent_n > 0)) {
        return fail(ZH_BAD_ARGUMENT, "zh_link_run: handle, a buffer or its count: is NULL");
    }
    host_port_line_t &line = handle->firmware.line();
    line = {received, *received_n, 0, sent, *sent_n, 0};
    const int status = zh::guarded<int>(ZH_BAD_INPUT, [&] {
        for (std::uint32_t k = 0; k < periods; ++k) {
            handle->period();
        }
        return int{ZH_OK};
    });
    *received_n = line.taken;
    *sent_n = line.sent_n;
    line = {};
    return status;
}

int zh_link_modbus_put(zh_link *handle, const std::uint8_t *received, std::uint32_t n)
{
    if (handle == nullptr || (received == nullptr && n > 0)) {
        return fail(ZH_BAD_ARGUMENT, "zh_link_modbus_put: handle or received: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        handle->modbus.put(received, n, handle->firmware.clock_us());
        return int{ZH_OK};
    });
}

int zh_link_modbus_take(zh_link *handle, std::uint8_t *sent, std::uint32_t *sent_n)
{
    if (handle == nullptr || sent_n == nullptr || (sent == nullptr && *sent_n > 0)) {
        return fail(ZH_BAD_ARGUMENT, "zh_link_modbus_take: handle, sent or its count: is NULL");
    }
    *sent_n = handle->modbus.take(sent, *sent_n);
    return ZH_OK;
}

int zh_link_can_put(zh_link *handle, const zh_can_frame *frame)
{
    if (handle == nullptr || frame == nullptr || frame->length > 8 || frame->id > 0x7FF) {
        return fail(ZH_BAD_ARGUMENT,
                    "zh_link_can_put: handle or frame: is NULL, or no classic frame of 11 bits");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        handle->can.put(*frame);
        return int{ZH_OK};
    });
}

int zh_link_can_take(zh_link *handle, zh_can_frame *frame, std::uint32_t *taken)
{
    if (handle == nullptr || frame == nullptr || taken == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_link_can_take: handle, frame or taken: is NULL");
    }
    *taken = handle->can.take(*frame) ? 1U : 0U;
    return ZH_OK;
}

int zh_link_change(zh_link *handle, const char *scenario)
{
    if (handle == nullptr || scenario == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_link_change: handle or scenario: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        handle->plant.disturb(zh::scenario_of(scenario, nullptr).disturbances);
        return int{ZH_OK};
    });
}

int zh_link_get_state(const zh_link *handle, zh_link_state *state)
{
    if (handle == nullptr || state == nullptr || state->struct_size < sizeof(zh_link_state)) {
        return fail(ZH_BAD_ARGUMENT, "zh_link_get_state: handle or state: is NULL or its "
                                     "struct_size too small; set it to sizeof(zh_link_state)");
    }
    const zh::Plant &plant = handle->plant;
    const zh::Phases i_A = plant.currents_at_legs();
    *state = {.struct_size = state->struct_size,
              .gates_on = handle->gates_on ? 1U : 0U,
              .periods = handle->periods,
              .digest = handle->digest.value(),
              .time_s = plant.time_s(),
              .speed_rpm = rpm_per_rad_s * plant.state().omega_m_rad_s,
              .u_dc_V = plant.truth().u_dc_V,
              .i_u_A = i_A[0],
              .i_v_A = i_A[1],
              .i_w_A = i_A[2]};
    return ZH_OK;
}

void zh_link_close(zh_link *handle)
{
    if (handle != nullptr) {
        (void)zh::guarded<int>(ZH_BAD_INPUT, [&] {
            handle->file.save(true);
            return int{ZH_OK};
        });
    }
    delete handle;
}
