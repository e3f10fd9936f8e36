#include "emulated_core.hpp"

#include <bit>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "toml_reader.hpp"

namespace zh {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 120s; // an update over the line comes first, on a slow machine
constexpr int patience_ms = 120000;

// The counter of the schedule.
constexpr auto slot_signal = PIL_SIGNAL_slot;

constexpr const char *signal_names[] = {
#define SIGNAL_F(name, path, text)  #name,
#define SIGNAL_U(name, path, text)  #name,
#define SIGNAL_OF(name, path, text) #name,
#define SIGNAL_OU(name, path, text) #name,
#define SIGNAL_X(name, value, text) #name,
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
};
static_assert(std::size(signal_names) == PIL_SIGNALS);

void gather(const unit_t *a, const hal_output_t *o, std::uint32_t (&words)[PIL_SIGNALS])
{
#define SIGNAL_F(name, path, text)  words[PIL_SIGNAL_##name] = float_bits(a->path);
#define SIGNAL_U(name, path, text)  words[PIL_SIGNAL_##name] = a->path;
#define SIGNAL_OF(name, path, text) words[PIL_SIGNAL_##name] = float_bits(o->path);
#define SIGNAL_OU(name, path, text) words[PIL_SIGNAL_##name] = o->path ? 1u : 0u;
#define SIGNAL_X(name, value, text) words[PIL_SIGNAL_##name] = (value);
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
}

// A FIFO's write end opens only once somebody reads; one who never comes must not hang the run.
int open_for_writing(const std::string &path)
{
    const auto until = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < until) {
        const int fd = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
        if (fd >= 0) {
            ::fcntl(fd, F_SETFL, 0);
            return fd;
        }
        if (errno != ENXIO) {
            break;
        }
        std::this_thread::sleep_for(5ms);
    }
    throw ConfigError(path + ": no image at the other end; does the emulator run there?");
}

} // namespace

EmulatedCore::EmulatedCore(const zh_pil_job &job, const params_t &params, const GainFile &gain,
                           zh_pil_result &result)
    : result_(result)
{
    if (job.words != nullptr) {
        words_.open(job.words, std::ios::binary);
    }
    const std::string folder = job.folder != nullptr ? job.folder : ".";
    to_image_ = open_for_writing(folder + "/" PIL_FIFO_TO_IMAGE);
    // Not blocking here: an emulator that dies between its two opens would leave us waiting.
    const std::string from = folder + "/" PIL_FIFO_FROM_IMAGE;
    from_image_ = ::open(from.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (from_image_ < 0 || !there_is_something()) {
        ::close(to_image_);
        ::close(from_image_);
        throw ConfigError(from + ": the image says nothing; does the emulator still run?");
    }
    ::fcntl(from_image_, F_SETFL, 0);
    introduce(job, params, gain);
}

EmulatedCore::~EmulatedCore()
{
    ::close(to_image_);
    ::close(from_image_);
}

void EmulatedCore::introduce(const zh_pil_job &job, const params_t &params, const GainFile &gain)
{
    pil_hello_t hello{};
    // An image without a fieldbus lacks its parameters, the last of the list.
    constexpr std::size_t without_fieldbus = offsetof(params_t, fieldbus_commands);
    if (!read(&hello, sizeof hello) || hello.magic != PIL_MAGIC ||
        (hello.params_bytes != sizeof(params_t) && hello.params_bytes != without_fieldbus) ||
        hello.signals != PIL_SIGNALS) {
        throw ConfigError("image: is of other sources than the SIL library; build both anew");
    }
    if (params.observer_gain_enable != 0 && hello.table_crc32c != gain.table().crc32c) {
        throw ConfigError("image: carries another gain table than the run's, " + gain.motor +
                          "; build it with that motor's configuration");
    }
    result_.clock_Hz = hello.clock_Hz;
    pil_start_t start{};
    start.use_params = job.own_params != 0 ? 0 : 1;
    bus_ = job.bus != 0;
    injecting_ = job.inject != PIL_INJECT_NONE;
    start.inject = job.inject;
    start.inject_at = job.inject_at;
    start.inject_address = job.inject_address;
    start.params = params;
    std::uint32_t refused = 0;
    static_assert(offsetof(pil_start_t, params) + sizeof(params_t) == sizeof start);
    if (!write(&start, offsetof(pil_start_t, params) + hello.params_bytes) ||
        !read(&refused, sizeof refused)) {
        throw ConfigError("image: left before its first control period");
    }
    if (refused != 0) {
        throw ConfigError("image: refuses parameters that the SIL firmware took");
    }
}

bool EmulatedCore::there_is_something() const
{
    pollfd waiting{from_image_, POLLIN, 0};
    return ::poll(&waiting, 1, patience_ms) == 1;
}

bool EmulatedCore::read(void *data, std::size_t n)
{
    auto *at = static_cast<char *>(data);
    while (n > 0) {
        const ssize_t got = ::read(from_image_, at, n);
        if (got <= 0) {
            return false;
        }
        at += got;
        n -= static_cast<std::size_t>(got);
    }
    return true;
}

bool EmulatedCore::write(const void *data, std::size_t n)
{
    return ::write(to_image_, data, n) == static_cast<ssize_t>(n);
}

void EmulatedCore::ask(hal_sample_t &sample, unit_command_t &command)
{
    sample.late_periods = late_periods_;
    const pil_in_t in{command.command, command.omega_m_ref_rad_s, command.torque_ref_Nm,
                      command.count, sample};
    (void)write(&in, sizeof in); // a broken pipe shows when the answer is read
    heard_ = bus_ && hear();
    if (heard_) {
        command = {out_.command, out_.omega_m_ref_rad_s, out_.torque_ref_Nm, out_.command_count};
    }
}

// The image's answer into out_; false, and how the run ends, when there is none.
bool EmulatedCore::hear()
{
    if (!there_is_something()) {
        result_.end = ZH_PIL_SILENT;
        return false;
    }
    if (!read(&out_, sizeof out_)) {
        result_.end = ZH_PIL_LEFT;
        return false;
    }
    return true;
}

void EmulatedCore::name_difference(const std::uint32_t *host, const std::uint32_t *image)
{
    for (std::size_t k = 0; k < PIL_SIGNALS; ++k) {
        const std::uint32_t differing = host[k] ^ image[k];
        if (differing != 0 && result_.differing_bits == 0) {
            (void)std::snprintf(result_.difference, sizeof result_.difference,
                                "period %llu: %s: image %08x, SIL %08x",
                                static_cast<unsigned long long>(result_.periods), signal_names[k],
                                image[k], host[k]);
        }
        result_.differing_bits += static_cast<std::uint32_t>(std::popcount(differing));
    }
}

bool EmulatedCore::answer(const unit_t &unit, hal_output_t &output)
{
    if (!heard_ && (bus_ || !hear())) {
        return false;
    }
    const pil_out_t &out = out_;
    late_periods_ = static_cast<std::uint16_t>(out.late_periods);
    words_.write(reinterpret_cast<const char *>(out.signal), sizeof out.signal);
    std::uint32_t host[PIL_SIGNALS];
    gather(&unit, &output, host);
    output = {std::bit_cast<float>(out.signal[PIL_SIGNAL_duty_u]),
              std::bit_cast<float>(out.signal[PIL_SIGNAL_duty_v]),
              std::bit_cast<float>(out.signal[PIL_SIGNAL_duty_w]),
              out.signal[PIL_SIGNAL_gates_on] != 0, out.signal[PIL_SIGNAL_brake_on] != 0};
    result_.gates_on = out.signal[PIL_SIGNAL_gates_on];
    result_.faults = out.signal[PIL_SIGNAL_faults];
    result_.warned |= result_.faults;
    result_.worst_latency_ticks = std::max(result_.worst_latency_ticks, out.latency_ticks);
    periods_.push_back({out.begin_ticks, out.end_ticks, out.signal[PIL_SIGNAL_state],
                        out.signal[slot_signal], out.signal[PIL_SIGNAL_faults]});
    if (std::memcmp(host, out.signal, sizeof host) != 0) {
        name_difference(host, out.signal);
        result_.end = ZH_PIL_DIFFERS;
        if (!injecting_) {
            return false;
        }
    }
    ++result_.periods;
    return true;
}

void EmulatedCore::finish()
{
    const pil_in_t stop{PIL_STOP, 0.0F, 0.0F, 0, {}};
    pil_end_t end{};
    if (!write(&stop, sizeof stop) || !read(&end, sizeof end) || end.magic != PIL_MAGIC) {
        result_.end = ZH_PIL_LEFT;
        return;
    }
    result_.stack_bytes = end.stack_bytes;
    result_.stack_used_bytes = end.stack_used_bytes;
    result_.late_periods = end.late_periods;
    result_.background_calls = end.background_calls;
}

std::vector<zh_pil_period> EmulatedCore::take_periods()
{
    return std::move(periods_);
}

} // namespace zh
