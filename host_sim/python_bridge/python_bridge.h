/* The functions that the bridge calls, one table for the process. */
#ifndef PYTHON_BRIDGE_H
#define PYTHON_BRIDGE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    PYTHON_BRIDGE_IN = 11,  /* u, i (alpha, beta each), expected step, frame imposed and its speed,
                               dwell, slip extra, tau extra, imposed rotor speed */
    PYTHON_BRIDGE_SEED = 5, /* i, flux, speed */
    PYTHON_BRIDGE_OUT = 8   /* flux, residual, correction (alpha, beta each), speed, stator speed */
};

typedef struct {
    uint32_t (*init)(const float *values, uint32_t count); /* every parameter; 0: refused */
    uint32_t (*begin)(uint32_t numbers);                   /* a new object at rest */
    void (*seed)(uint32_t object, const float *in, float *out);
    void (*step)(uint32_t object, uint32_t numbers, const float *in, float *out);
    void (*hold)(uint32_t object, uint32_t numbers, const float *in, float *out);
} python_bridge_t;

/* Before the first drive; NULL: none any more. The table has to stay. */
void python_bridge_register(const python_bridge_t *table);

#ifdef __cplusplus
}
#endif

#endif
