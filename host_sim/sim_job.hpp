// A job of the C interface, its files read: what every kind of run starts from.
#ifndef ZH_SIM_JOB_HPP
#define ZH_SIM_JOB_HPP

#include "sim.h"
#include "simulate.hpp"

namespace zh {

// All throw ConfigError. A file by path, or its text; overrides: NULL or lines.
Run run_of(const zh_sim_job &job);
Scenario scenario_of(const char *source, const char *overrides);
Rig rig_of(const char *source, const char *overrides);
Board board_of(const char *source, const char *overrides);

// Large enough, both of them, for what this library reads and writes.
bool sized(const zh_sim_job *job, const zh_sim_result *result);

zh_sim_result empty_result();

// The result points into the outcome. flags: of the job.
void show(const Outcome &outcome, std::uint32_t flags, zh_sim_result &result);

// The result owns the outcome from here on.
void hand_over(Outcome &&outcome, std::uint32_t flags, zh_sim_result &result);

} // namespace zh

#endif
