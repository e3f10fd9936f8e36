/* Limits of the torque current from dc link, thermal models and pull-out. */
#ifndef TORQUE_LIMITS_H
#define TORQUE_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#include "fault.h"
#include "link_limit.h"
#include "overload.h"
#include "speed_control.h"

typedef struct {
    link_limit_params_t link;
    overload_params_t overload;
    float i_q_max_A;
} torque_limits_params_t;

typedef struct {
    link_limit_config_t link;
    overload_config_t overload;
    float i_q_max_A;
} torque_limits_config_t;

typedef struct {
    link_limit_state_t link;
    overload_state_t overload;
} torque_limits_state_t;

/* False if one of the parts refuses. schedule_s: time between two steps of the overload. */
CHECKED bool torque_limits_init(torque_limits_config_t *cfg, const torque_limits_params_t *params,
                                float schedule_s);

static inline bool torque_limits_active(const torque_limits_state_t *st)
{
    return st->link.limiting || st->overload.derating;
}

/* The warnings FAULT_REGENERATION (running) and FAULT_DERATED while a limit acts. */
COLD uint32_t torque_limits_acting(const torque_limits_state_t *st, bool running);

static inline uint32_t torque_limits_warnings(const torque_limits_state_t *st, bool running)
{
    return torque_limits_active(st) ? torque_limits_acting(st, running) : 0u;
}

/* i_d_A has priority; pull_out_A: reduction of the largest torque current by pull-out. */
COLD torque_window_t torque_limits_window(const torque_limits_config_t *cfg,
                                          const torque_limits_state_t *st, float omega_e_rad_s,
                                          float i_d_A, float pull_out_A);

#endif
