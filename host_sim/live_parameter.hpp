// One parameter of a drive that runs.
#ifndef ZH_LIVE_PARAMETER_HPP
#define ZH_LIVE_PARAMETER_HPP

#include <string>

#include "firmware.hpp"

namespace zh {

// In force from the next period on, or a status of sil.h and its text. `caller` begins the text.
int set_live(Firmware &firmware, const char *name, float value, const std::string &caller);

} // namespace zh

#endif
