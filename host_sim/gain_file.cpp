#include "gain_file.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <utility>

#include <nlohmann/json.hpp>

#include "toml_reader.hpp"

namespace zh {
namespace {

using Json = nlohmann::json;

constexpr int schema = 2;
constexpr double largest_float = std::numeric_limits<float>::max();
constexpr float step_rad_s_of_grid = static_cast<float>(2.0 * 2.0 * std::numbers::pi / 60.0);
constexpr const char *redesign = "; write the file anew with tools/zh design";

static_assert(sizeof(observer_gain_t) == 4 * sizeof(std::uint32_t));

[[noreturn]] void reject(const std::string &path, const std::string &problem)
{
    throw ConfigError(path + ": " + problem + redesign);
}

// A value of the wanted type under the key, or the complaint that names it.
template <typename T> T take(const std::string &path, const Json &object, const char *key)
{
    const auto at = object.is_object() ? object.find(key) : object.end();
    if (!object.is_object() || at == object.end()) {
        reject(path, std::string(key) + ": missing");
    }
    try {
        return at->get<T>();
    } catch (const Json::exception &) {
        reject(path, std::string(key) + ": has the wrong type (" + at->type_name() + ")");
    }
}

std::uint32_t word(const std::string &path, const char *key, const std::string &hex)
{
    std::uint32_t value = 0;
    const char *end = hex.data() + hex.size();
    const auto parsed = std::from_chars(hex.data(), end, value, 16);
    if (hex.size() != 8 || parsed.ec != std::errc{} || parsed.ptr != end) {
        reject(path, std::string(key) + ": \"" + hex + "\" is not a word of eight hex digits");
    }
    return value;
}

Circuit take_circuit(const std::string &path, const Json &root)
{
    const Json inputs = take<Json>(path, root, "inputs");
    const Json circuit = take<Json>(path, inputs, "circuit");
    return {take<double>(path, circuit, "Rs_ohm"), take<double>(path, circuit, "Rr_ohm"),
            take<double>(path, circuit, "Ls_H"), take<double>(path, circuit, "Lr_H"),
            take<double>(path, circuit, "M_H")};
}

double take_period(const std::string &path, const Json &root)
{
    const Json design = take<Json>(path, take<Json>(path, root, "inputs"), "design");
    return take<double>(path, design, "period_s");
}

// Decimals of nine digits: the float they stand for comes back exactly.
std::array<float, 4> four_floats(const std::string &path, std::size_t k, const Json &entry)
{
    const auto fail = [&] {
        reject(path, "entries[" + std::to_string(k) + "].L: is not four float32 numbers");
    };
    const auto at = entry.is_object() ? entry.find("L") : entry.end();
    if (!entry.is_object() || at == entry.end() || !at->is_array() || at->size() != 4) {
        fail();
    }
    std::array<float, 4> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
        const Json &number = (*at)[i];
        if (!number.is_number() || std::abs(number.get<double>()) > largest_float) {
            fail();
        }
        values[i] = static_cast<float>(number.get<double>());
    }
    return values;
}

std::vector<observer_gain_t> take_entries(const std::string &path, const Json &root)
{
    const auto rows = root.find("entries");
    if (rows == root.end() || !rows->is_array()) {
        reject(path, "entries: is missing or no list");
    }
    if (rows->empty() || rows->size() > GAIN_TABLE_MAX_ENTRIES) {
        reject(path, "entries: " + std::to_string(rows->size()) + " is outside 1 .. " +
                         std::to_string(GAIN_TABLE_MAX_ENTRIES));
    }
    std::vector<observer_gain_t> entries(rows->size());
    for (std::size_t k = 0; k < entries.size(); ++k) {
        const auto [l1_re, l1_im, l2_re, l2_im] = four_floats(path, k, (*rows)[k]);
        entries[k] = {l1_re, l1_im, l2_re, l2_im};
    }
    return entries;
}

float take_step(const std::string &path, const Json &root)
{
    const auto step_rad_s = take<double>(path, root, "step_rad_s");
    if (!(step_rad_s > 0.0 && step_rad_s <= 100.0)) {
        reject(path, "step_rad_s: is outside 0 .. 100");
    }
    return static_cast<float>(step_rad_s);
}

std::shared_ptr<const GainFile> read(const std::string &path)
{
    std::ifstream stream(path, std::ios::binary);
    if (!stream) {
        throw ConfigError(path + ": cannot be read; give the folder of a motor whose table was "
                                 "designed (tools/zh design)");
    }
    const Json root = Json::parse(stream, nullptr, false);
    if (root.is_discarded()) {
        reject(path, "is not valid JSON");
    }
    if (take<std::int64_t>(path, root, "schema") != schema) {
        reject(path, "schema: is not " + std::to_string(schema));
    }
    auto gain = std::make_shared<const GainFile>(take<std::string>(path, root, "motor"),
                                                 take_circuit(path, root), take_period(path, root),
                                                 take_entries(path, root), take_step(path, root));
    const std::uint32_t stored = word(path, "crc32c", take<std::string>(path, root, "crc32c"));
    if (gain->table().crc32c != stored) {
        reject(path, "crc32c: does not match the entries, the file was changed or damaged");
    }
    if (!gain_table_valid(&gain->table())) {
        reject(path, "entries: L at standstill is not real");
    }
    return gain;
}

// What the file looked like when it was read.
struct Stamp {
    std::filesystem::file_time_type written;
    std::uintmax_t size = 0;

    bool operator==(const Stamp &) const = default;
};

struct Cached {
    Stamp stamp;
    std::shared_ptr<const GainFile> gain;
};

struct Cache {
    std::mutex mutex;
    std::map<std::string, Cached> files;
};

Cache &cache()
{
    static Cache instance;
    return instance;
}

// A search may go through thousands of folders; the drives hold what they use themselves.
constexpr std::size_t cache_max_files = 64;

// A file younger than the file system's clock can tell apart may change under the same stamp.
constexpr auto racy = std::chrono::milliseconds(50);

} // namespace

GainFile::GainFile(std::string motor_name, const Circuit &designed_for, double designed_period_s,
                   std::vector<observer_gain_t> entries, float step_rad_s)
    : motor(std::move(motor_name)), circuit(designed_for), period_s(designed_period_s),
      entries_(std::move(entries)), table_{
                                        .magic = GAIN_TABLE_MAGIC,
                                        .version = GAIN_TABLE_VERSION,
                                        .motor_id = 0U,
                                        .entry_count = static_cast<std::uint32_t>(entries_.size()),
                                        .crc32c = crc32c(entries_.data(),
                                                         entries_.size() * sizeof(observer_gain_t)),
                                        .step_rad_s = step_rad_s,
                                        .entry = entries_.data()}
{
}

std::shared_ptr<const GainFile> load_gain_file(const std::string &path)
{
    std::error_code no_file;
    const Stamp stamp{std::filesystem::last_write_time(path, no_file),
                      no_file ? 0 : std::filesystem::file_size(path, no_file)};
    Cache &shared = cache();
    const std::scoped_lock lock(shared.mutex);
    const auto at = shared.files.find(path);
    if (!no_file && at != shared.files.end() && at->second.stamp == stamp) {
        return at->second.gain;
    }
    auto gain = read(path);
    if (std::filesystem::file_time_type::clock::now() - stamp.written > racy) {
        if (shared.files.size() >= cache_max_files) {
            shared.files.clear();
        }
        shared.files.insert_or_assign(path, Cached{stamp, gain});
    }
    return gain;
}

std::shared_ptr<const GainFile> gain_from_floats(std::span<const float> words)
{
    if (words.empty() || words.size() % 4 != 0 || words.size() / 4 > GAIN_TABLE_MAX_ENTRIES) {
        throw ConfigError("gain: " + std::to_string(words.size()) +
                          " floats are no table; give four per entry, at most " +
                          std::to_string(GAIN_TABLE_MAX_ENTRIES) + " entries");
    }
    std::vector<observer_gain_t> entries(words.size() / 4);
    for (std::size_t k = 0; k < entries.size(); ++k) {
        entries[k] = {words[4 * k], words[4 * k + 1], words[4 * k + 2], words[4 * k + 3]};
    }
    // Whoever gives a table by hand answers for its period.
    auto gain = std::make_shared<const GainFile>(
        "", Circuit{}, std::numeric_limits<double>::infinity(), entries, step_rad_s_of_grid);
    if (!gain_table_valid(&gain->table())) {
        throw ConfigError("gain: a gain is not finite, or L at standstill is not real; give "
                          "finite numbers with l1_im = l2_im = 0 in the first entry");
    }
    return gain;
}

} // namespace zh
