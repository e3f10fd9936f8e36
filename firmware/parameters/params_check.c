#include "params_check.h"

#include <math.h>

/* Beyond the range of any parameter. */
#define PARAMS_NO_LIMIT 1e30f

/* How a limit follows from the parameters. */
typedef enum {
    LIMIT_NUMBER,     /* factor */
    LIMIT_SCALED,     /* factor times second */
    LIMIT_PER_PERIOD, /* factor over the period */
    LIMIT_RATE,       /* factor times second over the period */
    LIMIT_LEAKAGE,    /* sqrt(Ls Lr): beyond, no leakage is left */
    LIMIT_TRANSIENT,  /* 1 over a11, the decay of the stator current: Euler's limit */
    LIMIT_STANDING,   /* factor times 1/Tr */
    LIMIT_INVERSE,    /* factor over second */
    LIMIT_FLUX,       /* factor times M times second, a magnetising current */
    LIMIT_RESISTIVE,  /* factor times Rs times second, a current */
    LIMIT_EMF         /* factor times second over nominal flux; none with field weakening */
} limit_t;

/* Indices: all members of params_t are 32 bits wide, in the order of the list. Packed into 8 bytes:
 * there are half a hundred. */
typedef struct {
    uint32_t first : 7;
    uint32_t second : 7;
    uint32_t when : 7;     /* the rule holds when this parameter ... */
    uint32_t least : 3;    /* ... is positive, or with a choice at least that */
    uint32_t relation : 3; /* params_relation_t */
    uint32_t limit : 4;    /* limit_t */
    float factor;
} rule_t;

_Static_assert(sizeof(params_t) <= 128u * sizeof(uint32_t), "an index has 7 bits");

#define INDEX(name) (offsetof(params_t, name) / sizeof(uint32_t))

static const rule_t rules[] = {
#define PARAM_RULE(first, relation, limit, factor, second, when, least)                            \
    {INDEX(first), INDEX(second), INDEX(when), least, PARAMS_##relation, LIMIT_##limit, factor},
#include "param_rules.def"
};

/* 1/a11 = sigma Ls/(Rs + (M/Lr)^2 Rr) */
static float transient_s(const params_t *p)
{
    const float kr = p->M_H / p->Lr_H;
    return (p->Ls_H - kr * p->M_H) / (p->Rs_ohm + kr * kr * p->Rr_ohm);
}

static float limit_of(const params_t *p, const rule_t *rule)
{
    const float second = params_get(p, rule->second);
    const float scaled = rule->factor * second;
    const float emf = (p->weaken_share > 0.0f) ? PARAMS_NO_LIMIT : (scaled / (p->M_H * p->i_d_A));
    const float limits[(uint32_t)LIMIT_EMF + 1u] = {
        [LIMIT_NUMBER] = rule->factor,
        [LIMIT_SCALED] = scaled,
        [LIMIT_PER_PERIOD] = rule->factor / p->period_s,
        [LIMIT_RATE] = scaled / p->period_s,
        [LIMIT_LEAKAGE] = sqrtf(p->Ls_H * p->Lr_H),
        [LIMIT_TRANSIENT] = transient_s(p),
        [LIMIT_STANDING] = rule->factor * p->Rr_ohm / p->Lr_H,
        [LIMIT_INVERSE] = rule->factor / second,
        [LIMIT_FLUX] = rule->factor * p->M_H * second,
        [LIMIT_RESISTIVE] = rule->factor * p->Rs_ohm * second,
        [LIMIT_EMF] = emf};
    const limit_t limit = (limit_t)rule->limit;
    return limits[limit];
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
    case PARAMS_FIXED: /* of no rule */
    default:
        return value > limit;
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
