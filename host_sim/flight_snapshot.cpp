#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "c_boundary.hpp"
#include "firmware_sources.h"
#include "flight_replay.hpp"

namespace {

using zh::fail;

struct Head {
    std::uint32_t magic;
    std::uint32_t bytes;
    std::uint32_t firmware; // its sources
    std::uint32_t layout;   // what a compiler made of them
    std::uint32_t table;
    std::uint32_t body; // CRC-32C of what follows
};

struct Snapshot {
    Head head;
    zh_flight::State state;
};
static_assert(std::is_trivially_destructible_v<Snapshot>);

// Byte for byte: checksums are of the padding as well, and a mailbox cannot be assigned.
void copy(void *to, const void *from, std::size_t bytes)
{
    std::memcpy(to, from, bytes);
}

constexpr std::uint32_t magic = 0x3146485AU; // "ZHF1"
constexpr std::size_t body_at = sizeof(Head);

std::uint32_t folded(const void *bytes, std::size_t count)
{
    return crc32c_update(0, static_cast<const std::uint8_t *>(bytes),
                         static_cast<std::uint32_t>(count));
}

std::uint32_t layout_of_today()
{
    const std::uint32_t sizes[] = {sizeof(unit_t), sizeof(drive_state_t), sizeof(unit_config_t),
                                   sizeof(void *), UNIT_SIGNALS};
    return folded(sizes, sizeof sizes);
}

std::uint32_t table_of(const zh_flight &flight)
{
    return flight.gain != nullptr ? flight.gain->table().crc32c : 0;
}

std::uint32_t body_of(const Snapshot &snapshot)
{
    return folded(reinterpret_cast<const std::byte *>(&snapshot) + body_at,
                  sizeof snapshot - body_at);
}

// Why this snapshot is not to be restored into this replay; empty: it is.
const char *objection(const Snapshot &snapshot, const zh_flight &flight)
{
    const Head &head = snapshot.head;
    if (head.magic != magic || head.bytes != sizeof snapshot) {
        return "is no state of a flight of this library";
    }
    if (head.firmware != ZH_FIRMWARE_SOURCES || head.layout != layout_of_today()) {
        return "is the state of another firmware than the one here";
    }
    if (head.body != body_of(snapshot)) {
        return "is damaged";
    }
    if (head.table != table_of(flight)) {
        return "is the state of a drive with another gain table";
    }
    return "";
}

} // namespace

void zh_flight::save(State &to) const
{
    copy(&to.unit, &unit, sizeof unit);
    std::memset(static_cast<void *>(&to.unit.config), 0, sizeof to.unit.config);
    to.unit.table = nullptr;
    to.output = output;
    to.samples = samples;
    to.changes = changes;
    to.digest = digest;
    to.late_periods = late_periods;
}

void zh_flight::load(const State &from)
{
    const auto made = std::make_unique<unit_t>();
    copy(made.get(), &unit, sizeof unit);
    copy(&unit, &from.unit, sizeof unit);
    const std::uint32_t at = unit.in_force & 1U;
    for (std::uint32_t k = 0; k < 2; ++k) {
        copy(&unit.config[at ^ k], &made->config[made->in_force ^ k], sizeof unit.config[k]);
        unit.config_crc[at ^ k] = made->config_crc[made->in_force ^ k];
    }
    unit.table = made->table;
    unit.params = made->params;
    output = from.output;
    samples = from.samples;
    changes = from.changes;
    digest = from.digest;
    late_periods = from.late_periods;
    started = true;
}

size_t zh_flight_snapshot_bytes(void)
{
    return sizeof(Snapshot);
}

int zh_flight_snapshot(const zh_flight *handle, void *buffer, size_t bytes)
{
    if (handle == nullptr || buffer == nullptr || bytes < sizeof(Snapshot)) {
        return fail(ZH_BAD_ARGUMENT, "zh_flight_snapshot: handle or buffer: is NULL, or bytes: "
                                     "fewer than zh_flight_snapshot_bytes()");
    }
    if (handle->unit.change_ready || !handle->started) {
        return fail(ZH_NOT_NOW, "zh_flight_snapshot: a period is due first");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        const auto snapshot = std::make_unique<Snapshot>();
        handle->save(snapshot->state);
        snapshot->head = {magic,
                          sizeof(Snapshot),
                          ZH_FIRMWARE_SOURCES,
                          layout_of_today(),
                          table_of(*handle),
                          body_of(*snapshot)};
        copy(buffer, snapshot.get(), sizeof(Snapshot));
        return int{ZH_OK};
    });
}

int zh_flight_restore(zh_flight *handle, const void *buffer, size_t bytes)
{
    if (handle == nullptr || buffer == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_flight_restore: handle or buffer: is NULL");
    }
    if (bytes != sizeof(Snapshot) || handle->started) {
        return fail(ZH_REFUSED, "zh_flight_restore: buffer: is not a state of this library's "
                                "size, or handle: has run rows");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        const auto snapshot = std::make_unique<Snapshot>();
        copy(snapshot.get(), buffer, sizeof(Snapshot));
        if (const std::string_view wrong = objection(*snapshot, *handle); !wrong.empty()) {
            return fail(ZH_REFUSED, "zh_flight_restore: buffer: " + std::string(wrong));
        }
        handle->load(snapshot->state);
        return int{ZH_OK};
    });
}
