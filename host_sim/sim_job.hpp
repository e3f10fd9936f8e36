// A job of the C interface, its files read: what every kind of run starts from.
#ifndef ZH_SIM_JOB_HPP
#define ZH_SIM_JOB_HPP

#include "sim.h"
#include "simulate.hpp"

namespace zh {

// Throws ConfigError.
Run run_of(const zh_sim_job &job);

} // namespace zh

#endif
