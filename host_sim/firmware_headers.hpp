// The firmware's C headers as C++ sees them.
#ifndef ZH_FIRMWARE_HEADERS_HPP
#define ZH_FIRMWARE_HEADERS_HPP

#include "law_headers.hpp"

// Compound literals in the inline functions are C, and an extension here.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wold-style-cast"
extern "C" {
#include "canopen.h"
#include "crc32c.h"
#include "host_port.h"
#include "modbus.h"
#include "ram_flash.h"
#include "terminals.h"
#include "unit_config.h"
#include "unit_flight.h"
#include "unit_signal.h"
}
#pragma GCC diagnostic pop

#endif
