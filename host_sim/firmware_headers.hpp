// The firmware's C headers as C++ sees them.
#ifndef ZH_FIRMWARE_HEADERS_HPP
#define ZH_FIRMWARE_HEADERS_HPP

// Compound literals in the inline functions are C, and an extension here; the C library of a C++
// compilation brings a finitef of its own.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#define finitef zh_finitef
extern "C" {
#include "app_config.h"
#include "crc32c.h"
#include "gain_table.h"
#include "host_port.h"
#include "params.h"
}
#undef finitef
#pragma GCC diagnostic pop

#endif
