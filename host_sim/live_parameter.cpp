#include "live_parameter.hpp"

#include "c_boundary.hpp"
#include "firmware_setup.hpp"
#include "sil.h"

namespace zh {
namespace {

int access_status(const Firmware &firmware, const char *name, const param_info_t &info,
                  const std::string &caller)
{
    const std::string named = caller + ": " + std::string(name) + ": ";
    if (info.access == PARAM_ACCESS_PROTECTED) {
        return fail(ZH_PROTECTED, named + "is protected; give it in the overrides of zh_sil_open");
    }
    if (info.access == PARAM_ACCESS_READY && firmware.gates_on()) {
        return fail(ZH_NOT_NOW, named + "can only change with the gates off; take the run command "
                                        "away first");
    }
    return ZH_OK;
}

} // namespace

int set_live(Firmware &firmware, const char *name, float value, const std::string &caller)
{
    return guarded<int>(ZH_OUT_OF_RANGE, [&] {
        const param_info_t *info = params_info(params_find(name));
        if (info == nullptr) {
            return fail(ZH_NO_SUCH_NAME, caller + ": " + std::string(name) +
                                             ": no such parameter; zh_sil_name lists them");
        }
        params_t changed = firmware.params();
        set_param(changed, name, value, caller);
        if (const int status = access_status(firmware, name, *info, caller); status != ZH_OK) {
            return status;
        }
        if (!firmware.reconfigure(changed)) {
            return fail(ZH_REFUSED, caller + ": " + refusal_reason(changed));
        }
        return int{ZH_OK};
    });
}

} // namespace zh
