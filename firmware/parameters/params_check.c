#include "params_check.h"

#include <math.h>

/* How a limit follows from the parameters. */
typedef enum {
    LIMIT_NUMBER,     /* factor */
    LIMIT_SCALED,     /* factor times second */
    LIMIT_PER_PERIOD, /* factor over the period */
    LIMIT_RATE,       /* factor times second over the period */
    LIMIT_LEAKAGE,    /* sqrt(Ls Lr): beyond, no leakage is left */
    LIMIT_TRANSIENT,  /* 1 over a11, the decay of the stator current: Euler's limit */
    LIMIT_STANDING    /* factor times 1/Tr */
} limit_t;

/* Indices: all members of params_t are 32 bits wide, in the order of the list. */
typedef struct {
    uint8_t first;
    uint8_t second;
    uint8_t relation; /* params_relation_t */
    uint8_t limit;    /* limit_t */
    float factor;
    uint8_t when;  /* the rule holds when this parameter ... */
    uint8_t least; /* ... is positive, or with a choice at least that */
} rule_t;

_Static_assert(sizeof(params_t) <= 255u * sizeof(uint32_t), "an index is a byte");

#define INDEX(name) ((uint8_t)(offsetof(params_t, name) / sizeof(uint32_t)))

#define ALWAYS                 INDEX(period_s), 0u
#define IF_SET(name)           INDEX(name), 0u
#define IF_CHOICE(name, least) INDEX(name), least
#define RULE(first, relation, limit, factor, second, when)                                         \
    {                                                                                              \
        INDEX(first), INDEX(second), PARAMS_##relation, LIMIT_##limit, factor, when                \
    }

static const rule_t rules[] = {
    RULE(M_H, BELOW, LEAKAGE, 1.0f, Ls_H, ALWAYS),
    RULE(period_s, BELOW, TRANSIENT, 1.0f, Ls_H, ALWAYS),
    RULE(min_pulse_s, BELOW, SCALED, 0.5f, period_s, ALWAYS),
    RULE(dead_time_s, BELOW, SCALED, 1.0f, period_s, ALWAYS),
    RULE(eps1_off_Hz, AT_LEAST, SCALED, 1.0f, eps1_on_Hz, ALWAYS),
    RULE(current_bandwidth_rad_s, BELOW, PER_PERIOD, 1.0f, period_s, ALWAYS),
    RULE(i_d_A, AT_MOST, SCALED, 1.0f, i_d_max_A, ALWAYS),
    RULE(overload_motor_A, AT_MOST, SCALED, 1.0f, i_max_A, ALWAYS),
    RULE(overload_inverter_A, AT_MOST, SCALED, 1.0f, i_max_A, ALWAYS),
    /* The acceleration is counted in steps of jerk times period. */
    RULE(speed_jerk_rad_s3, AT_MOST, RATE, 1.0f, speed_slew_rad_s2, ALWAYS),
    RULE(speed_jerk_rad_s3, AT_MOST, RATE, 1.0f, ramp_down_rad_s2, ALWAYS),
    RULE(economy_flux_min, AT_LEAST, NUMBER, 0.1f, economy_flux_min, IF_SET(economy_flux_min)),
    /* A level lasts 100 periods to 1e6. */
    RULE(rs_level_s, AT_LEAST, SCALED, 100.0f, period_s, ALWAYS),
    RULE(rs_level_s, AT_MOST, SCALED, 1e6f, period_s, ALWAYS),
    /* I-f is there where something asks for it. */
    RULE(i_f_A, ABOVE, NUMBER, 0.0f, lost_action, IF_CHOICE(lost_action, 2u)),
    RULE(i_f_A, ABOVE, NUMBER, 0.0f, control_mode, IF_CHOICE(control_mode, 2u)),
    /* Flying start: the shaft may turn faster than what counts as standing, and by less than half a
     * turn in the eight periods from block to block. */
    RULE(omega_max_rad_s, ABOVE, STANDING, 3.0f, Rr_ohm, IF_SET(flying_start)),
    RULE(omega_max_rad_s, BELOW, PER_PERIOD, NUM_PI / 8.0f, period_s, IF_SET(flying_start)),
    RULE(u_dc_min_V, BELOW, SCALED, 1.0f, u_dc_max_V, ALWAYS),
    RULE(regen_start_V, BELOW, SCALED, 1.0f, u_dc_max_V, ALWAYS),
    RULE(chopper_on_V, AT_MOST, SCALED, 1.0f, u_dc_max_V, ALWAYS),
    /* The trip would come first; and the supply counts as back at 1.1 times the level held. */
    RULE(mains_lost_V, ABOVE, SCALED, 1.0f, u_dc_min_V, IF_SET(mains_lost_V)),
    RULE(mains_lost_V, BELOW, SCALED, 0.79f, u_dc_max_V, IF_SET(mains_lost_V)),
    /* Counted in slow periods, a million of them. */
    RULE(stall_s, BELOW, SCALED, 1.599e7f, period_s, ALWAYS),
    /* Tones of commissioning: twice the slip, 8 periods per turn, ten turns in a million. */
    RULE(com_slip_Hz, AT_MOST, PER_PERIOD, 1.0f / 16.0f, period_s, ALWAYS),
    RULE(com_slip_Hz, AT_LEAST, PER_PERIOD, 5e-6f, period_s, ALWAYS),
};

static float limit_of(const params_t *p, const rule_t *rule)
{
    const float second = params_get(p, rule->second);
    switch ((limit_t)rule->limit) {
    case LIMIT_SCALED:
        return rule->factor * second;
    case LIMIT_PER_PERIOD:
        return rule->factor / p->period_s;
    case LIMIT_RATE:
        return rule->factor * second / p->period_s;
    case LIMIT_LEAKAGE:
        return sqrtf(p->Ls_H * p->Lr_H);
    case LIMIT_TRANSIENT: {
        /* a11 = (Rs + (M/Lr)^2 Rr)/(sigma Ls) */
        const float kr = p->M_H / p->Lr_H;
        return (p->Ls_H - kr * p->M_H) / (p->Rs_ohm + kr * kr * p->Rr_ohm);
    }
    case LIMIT_STANDING:
        return rule->factor * p->Rr_ohm / p->Lr_H;
    case LIMIT_NUMBER:
    default:
        return rule->factor;
    }
}

static bool kept(float value, params_relation_t relation, float limit)
{
    switch (relation) {
    case PARAMS_AT_MOST:
        return value <= limit;
    case PARAMS_BELOW:
        return value < limit;
    case PARAMS_AT_LEAST:
        return value >= limit;
    case PARAMS_ABOVE:
        return value > limit;
    case PARAMS_FIXED:
    default:
        return false;
    }
}

bool params_check(const params_t *params, params_conflict_t *conflict)
{
    for (size_t k = 0u; k < sizeof rules / sizeof rules[0]; k++) {
        const rule_t *rule = &rules[k];
        const float when = params_get(params, rule->when);
        const float limit = limit_of(params, rule);
        const params_relation_t relation = (params_relation_t)rule->relation;
        if ((when > 0.0f) && (when >= (float)rule->least) &&
            !kept(params_get(params, rule->first), relation, limit)) {
            *conflict = (params_conflict_t){rule->first, rule->second, relation, limit};
            return false;
        }
    }
    *conflict = (params_conflict_t){params_count(), params_count(), PARAMS_FIXED, 0.0f};
    return true;
}
