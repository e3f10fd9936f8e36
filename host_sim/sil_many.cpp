#include <cstddef>
#include <string>

#include "c_boundary.hpp"
#include "sil.h"
#include "sil_array.hpp"
#include "sil_handle.hpp"

namespace {

using zh::element;
using zh::fail;

// Nothing is stepped if not: who mistakes the size of one element has all others at wrong places.
int sizes_status(const char *caller, const zh_sil_in *in, const zh_sil_out *out,
                 std::uint32_t count)
{
    if (in == nullptr || out == nullptr) {
        return fail(ZH_BAD_ARGUMENT, std::string(caller) + ": in or out: is NULL");
    }
    if (in->struct_size % alignof(zh_sil_in) != 0 || out->struct_size % alignof(zh_sil_out) != 0) {
        return fail(ZH_BAD_ARGUMENT, std::string(caller) + ": in or out: struct_size of the first "
                                                           "element: is no size of a struct");
    }
    for (std::uint32_t k = 1; k < count; ++k) {
        if (element(in, k)->struct_size != in->struct_size ||
            element(out, k)->struct_size != out->struct_size) {
            return fail(ZH_BAD_ARGUMENT, std::string(caller) + ": in or out: element " +
                                             std::to_string(k) +
                                             ": struct_size is not that of the first");
        }
    }
    return ZH_OK;
}

// Of the first element refused, which the text then names.
class FirstRefusal {
public:
    void follow(int status, std::uint32_t k)
    {
        if (status != ZH_OK && status_ == ZH_OK) {
            status_ = status;
            text_ = "element " + std::to_string(k) + ": " + zh::last_error();
        }
    }
    int status() const
    {
        return status_ == ZH_OK ? int{ZH_OK} : fail(status_, text_);
    }

private:
    int status_ = ZH_OK;
    std::string text_;
};

} // namespace

int zh::record_status(const char *caller, const zh_sil_record *record)
{
    if (record == nullptr || record->count == 0) {
        return ZH_OK;
    }
    if (record->struct_size < sizeof(zh_sil_record) || record->index == nullptr ||
        record->value == nullptr) {
        return fail(ZH_BAD_ARGUMENT, std::string(caller) +
                                         ": record: struct_size too small, or index or value is "
                                         "NULL; set it to sizeof(zh_sil_record)");
    }
    for (std::uint32_t k = 0; k < record->count; ++k) {
        if (record->index[k] >= zh_sil_signal_count()) {
            return fail(ZH_NO_SUCH_NAME, std::string(caller) + ": record: index " +
                                             std::to_string(record->index[k]) +
                                             ": is not below zh_sil_signal_count()");
        }
    }
    return ZH_OK;
}

void zh::note(const zh_sil &drive, const zh_sil_record *record, std::uint32_t period)
{
    if (record == nullptr) {
        return;
    }
    double *row = record->value + std::size_t{period} * record->count;
    for (std::uint32_t k = 0; k < record->count; ++k) {
        row[k] = signal_value(drive, record->index[k]);
    }
}

int zh_sil_step_many(zh_sil *const *handles, const zh_sil_in *in, zh_sil_out *out,
                     std::uint32_t count)
{
    if (count == 0) {
        return ZH_OK;
    }
    if (handles == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_step_many: handles: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        if (const int status = sizes_status("zh_sil_step_many", in, out, count); status != ZH_OK) {
            return status;
        }
        FirstRefusal refusal;
        for (std::uint32_t k = 0; k < count; ++k) {
            refusal.follow(zh_sil_step(handles[k], element(in, k), element(out, k)), k);
        }
        return refusal.status();
    });
}

int zh_sil_run(zh_sil *handle, const zh_sil_in *in, zh_sil_out *out, std::uint32_t count,
               const zh_sil_record *record)
{
    if (count == 0) {
        return ZH_OK;
    }
    if (handle == nullptr) {
        return fail(ZH_BAD_ARGUMENT, "zh_sil_run: handle: is NULL");
    }
    return zh::guarded<int>(ZH_BAD_INPUT, [&] {
        int status = sizes_status("zh_sil_run", in, out, count);
        status = status == ZH_OK ? zh::record_status("zh_sil_run", record) : status;
        if (status != ZH_OK) {
            return status;
        }
        FirstRefusal refusal;
        for (std::uint32_t k = 0; k < count; ++k) {
            refusal.follow(zh_sil_step(handle, element(in, k), element(out, k)), k);
            zh::note(*handle, record, k);
        }
        return refusal.status();
    });
}
