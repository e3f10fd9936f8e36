#include <bit>
#include <cstring>
#include <memory>
#include <type_traits>

#include "c_boundary.hpp"
#include "commissioning_of.hpp"
#include "sil.h"
#include "sil_handle.hpp"

namespace {

using zh::fail;

struct Head {
    std::uint32_t magic;
    std::uint32_t bytes;
    std::uint32_t library; // layout of the state
    std::uint32_t opened;  // motor, board, overrides
    std::uint32_t body;    // CRC-32C of what follows
};

struct Snapshot {
    Head head;
    std::uint32_t steps;
    hal_output_t output;
    zh::Firmware::State state;
};
static_assert(std::is_trivially_destructible_v<Snapshot>);

constexpr std::uint32_t magic = 0x3153485AU; // "ZHS1"
constexpr const char *terminals_fitted =
    "zh_sil_snapshot, zh_sil_restore: a drive with terminals has no snapshots; zh_sil_reset takes "
    "them away";
constexpr std::size_t body_at = sizeof(Head);

std::uint32_t folded(std::uint32_t crc, const void *bytes, std::size_t count)
{
    return crc32c_update(crc, static_cast<const std::uint8_t *>(bytes),
                         static_cast<std::uint32_t>(count));
}

// By the names of all signals: they cover every state of the law. Libraries that differ elsewhere
// differ in size.
std::uint32_t library_of_today()
{
    static const std::uint32_t crc = [] {
        const std::uint32_t sizes[] = {sizeof(unit_t), sizeof(drive_state_t), sizeof(params_t),
                                       sizeof(Snapshot), ZH_SIL_VERSION};
        std::uint32_t sum = folded(0, sizes, sizeof sizes);
        for (std::uint32_t k = 0; k < UNIT_SIGNALS; ++k) {
            const char *name = unit_signal_name(k);
            sum = folded(sum, name, std::strlen(name) + 1);
        }
        return sum;
    }();
    return crc;
}

std::uint32_t opened_with(const zh_sil &drive)
{
    const gain_table_t &table = drive.firmware.gain().table();
    const std::uint32_t id[] = {table.motor_id, table.crc32c,
                                std::bit_cast<std::uint32_t>(table.step_rad_s)};
    return folded(folded(0, &drive.opened, sizeof drive.opened), id, sizeof id);
}

std::uint32_t body_of(const Snapshot &snapshot)
{
    return folded(0, reinterpret_cast<const std::byte *>(&snapshot) + body_at,
                  sizeof snapshot - body_at);
}

// Why this snapshot is not to be restored into this drive; empty: it is.
const char *objection(const Snapshot &snapshot, const zh_sil &drive)
{
    const Head &head = snapshot.head;
    if (head.magic != magic || head.bytes != sizeof snapshot ||
        head.library != library_of_today()) {
        return "is not a snapshot of this library";
    }
    if (head.body != body_of(snapshot)) {
        return "is damaged";
    }
    if (head.opened != opened_with(drive)) {
        return "is of a drive with another motor, board or overrides; open this one alike";
    }
    return "";
}

} // namespace

size_t zh_sil_snapshot_bytes(void)
{
    return sizeof(Snapshot);
}

int zh_sil_snapshot(const zh_sil *handle, void *buffer, size_t bytes)
{
    if (handle == nullptr || buffer == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_snapshot: handle or buffer: is NULL");
    }
    if (bytes < sizeof(Snapshot)) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_snapshot: bytes: fewer than zh_sil_snapshot_bytes()");
    }
    if (handle->firmware.terminals().fitted()) {
        return fail(ZH_REFUSED, terminals_fitted);
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        const auto snapshot = std::make_unique<Snapshot>();
        snapshot->steps = handle->steps;
        snapshot->output = handle->output;
        handle->firmware.save(snapshot->state);
        snapshot->head = {magic, sizeof(Snapshot), library_of_today(), opened_with(*handle),
                          body_of(*snapshot)};
        std::memcpy(buffer, static_cast<const void *>(snapshot.get()), sizeof(Snapshot));
        return int{ZH_OK};
    });
}

int zh_sil_restore(zh_sil *handle, const void *buffer, size_t bytes)
{
    if (handle == nullptr || buffer == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_restore: handle or buffer: is NULL");
    }
    if (bytes != sizeof(Snapshot)) {
        return fail(ZH_REFUSED, "zh_sil_restore: bytes: not those of a snapshot of this library");
    }
    if (handle->firmware.terminals().fitted()) {
        return fail(ZH_REFUSED, terminals_fitted);
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        const auto snapshot = std::make_unique<Snapshot>();
        std::memcpy(static_cast<void *>(snapshot.get()), buffer, sizeof(Snapshot));
        const std::string_view wrong = objection(*snapshot, *handle);
        if (!wrong.empty() || !handle->firmware.load(snapshot->state)) {
            return fail(ZH_REFUSED, "zh_sil_restore: buffer: " +
                                        std::string(wrong.empty() ? "is damaged" : wrong));
        }
        handle->steps = snapshot->steps;
        handle->output = snapshot->output;
        return int{ZH_OK};
    });
}

int zh_sil_reset(zh_sil *handle)
{
    if (handle == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_reset: handle: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        handle->firmware.restart(handle->opened);
        handle->steps = 0;
        handle->output = zh::no_output;
        return int{ZH_OK};
    });
}

int zh_sil_commissioned(const zh_sil *handle, zh_commissioning *result)
{
    if (handle == nullptr || result == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_commissioned: handle or result: is NULL");
    }
    const unit_t &unit = handle->firmware.unit();
    *result = zh::commissioning_of(unit.commissioned.status == COMMISSIONING_DONE,
                                   unit.commissioning.refusal, unit.commissioning.result);
    return ZH_OK;
}
