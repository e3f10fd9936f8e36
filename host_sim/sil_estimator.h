/* An estimator of the firmware alone, through its contract (firmware/law/estimator/estimator.h): no
 * sensor, no control, no modulator. For recorded signals (`zh replay`), and to compare estimators.
 *
 * zerohertz_sil exports these functions for the estimator of its drive. zh_estimator_<name> is one
 * estimator with the same functions; several can be loaded into one process (dlopen with
 * RTLD_LOCAL). Vectors power invariant, stationary frame; speeds electrical.
 */
#ifndef ZH_SIL_ESTIMATOR_H
#define ZH_SIL_ESTIMATOR_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define ZH_ESTIMATOR_API __attribute__((visibility("default")))
#else
#define ZH_ESTIMATOR_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Function of the contract to call. */
enum {
    ZH_ESTIMATOR_STEP = 0,  /* estimate */
    ZH_ESTIMATOR_HOLD = 1,  /* imposed speed, estimated flux */
    ZH_ESTIMATOR_OFF = 2,   /* no estimation */
    ZH_ESTIMATOR_SEED = 3,  /* start from a known current, flux and speed */
    ZH_ESTIMATOR_RESET = 4, /* gates off: a motor at rest without flux */
    ZH_ESTIMATOR_VERBS = 5
};

/* A verb ignores the members that it does not need, but they have to be finite. */
typedef struct {
    uint32_t verb;
    uint32_t frame_imposed; /* STEP: 1 when the stator frequency is known */
    float u_alpha_V;        /* STEP, HOLD: mean over the interval that just ended */
    float u_beta_V;
    float i_alpha_A; /* sampled now */
    float i_beta_A;
    float expected_step_rad_s; /* STEP: expected change of speed since the last */
    float omega_frame_rad_s;   /* STEP with frame_imposed */
    float omega_e_rad_s;       /* HOLD, OFF, SEED */
    float lambda_alpha_Wb;     /* SEED */
    float lambda_beta_Wb;
    float dwell; /* STEP: 0 to 1, how far the drive dwells at zero stator frequency (dwell.h) */
    float slip_extra_rad_s; /* STEP, HOLD: of a rotor warmer than the parameter's Rr */
    float tau_extra_per_s;  /* STEP, HOLD: of another M than the parameter's */
} zh_estimator_event;

typedef struct {
    float omega_e_rad_s; /* of the rotor */
    float omega_s_rad_s; /* of the rotor flux */
    float lambda_alpha_Wb;
    float lambda_beta_Wb;
    float residual_alpha_A; /* estimated minus measured current; 0 where there is none */
    float residual_beta_A;
    float correction_alpha_V; /* what the correction adds to the flux row */
    float correction_beta_V;
} zh_estimate;

typedef struct zh_estimator zh_estimator;

/* Motor data and table from motor_dir, no board. overrides: NULL or lines "name=value" of the
 * firmware's parameters. NULL when refused: see zh_estimator_error(). */
ZH_ESTIMATOR_API zh_estimator *zh_estimator_open(const char *motor_dir, const char *overrides,
                                                 float period_s);

/* `count` events in a row, and the estimate after each. 0: done. Otherwise it stopped at the first
 * row that is not finite or has an unknown verb, or at once at a NULL pointer; text in
 * zh_estimator_error(). */
ZH_ESTIMATOR_API int zh_estimator_run(zh_estimator *handle, size_t count,
                                      const zh_estimator_event *event, zh_estimate *estimate);

/* Signals of this estimator beside the estimate; NULL beyond the last, and 0. */
ZH_ESTIMATOR_API const char *zh_estimator_signal_name(uint32_t index);
ZH_ESTIMATOR_API float zh_estimator_signal(const zh_estimator *handle, uint32_t index);

/* NULL is allowed. */
ZH_ESTIMATOR_API void zh_estimator_close(zh_estimator *handle);

/* Error text of the last call that failed on this thread; never NULL. */
ZH_ESTIMATOR_API const char *zh_estimator_error(void);

#ifdef __cplusplus
}
#endif

#endif
