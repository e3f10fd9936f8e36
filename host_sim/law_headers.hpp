// The firmware's C headers below any estimator, as C++ sees them: motor, table, parameters.
#ifndef ZH_LAW_HEADERS_HPP
#define ZH_LAW_HEADERS_HPP

// Compound literals in the inline functions are C, and an extension here.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wold-style-cast"
extern "C" {
#include "crc32c.h"
#include "gain_table.h"
#include "motor.h"
#include "params.h"
#include "params_check.h"
}
#pragma GCC diagnostic pop

#endif
