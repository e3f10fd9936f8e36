/* Software in the loop: the firmware as a shared library, for any plant in any language.
 *
 * One handle is one drive. Handles share nothing: many may run at once, each used by one thread at
 * a time. Timing: step k takes the samples of carrier crest t_k; its duties act on [t_(k+1),
 * t_(k+2)) (timer preload). The caller has to keep that delay. gates_on = 0 acts at once. Vectors
 * are power invariant; speeds are mechanical, angles and frequencies electrical.
 */
#ifndef ZH_SIL_H
#define ZH_SIL_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define ZH_API __attribute__((visibility("default")))
#else
#define ZH_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Raised when a struct grows, a meaning changes or a function is removed; structs only grow at
 * their end. 2: the observer alone became sil_estimator.h. 3: speed_unknown. */
#define ZH_SIL_VERSION 3u

#define ZH_SIL_RUN         (1u << 0) /* level: run; after a fault it must drop and rise again */
#define ZH_SIL_FAULT_RESET (1u << 1) /* rising edge */
#define ZH_SIL_TORQUE_OFF  (1u << 2) /* level: gates off, overrides run */
#define ZH_SIL_COMMISSION  (1u << 3) /* level: identify the motor's circuit at standstill */

/* mode */
enum {
    ZH_SIL_SPEED = 0,
    ZH_SIL_TORQUE = 1 /* within -torque_speed_max_rad_s .. +torque_speed_max_rad_s */
};

/* state of the drive; numbers are append-only */
enum {
    ZH_STATE_BOOT = 0,
    ZH_STATE_SELF_TEST = 1, /* averages the current offsets */
    ZH_STATE_READY = 2,
    ZH_STATE_PREMAGNETISE = 3,
    ZH_STATE_RUN = 4,
    ZH_STATE_RAMP_DOWN = 5,
    ZH_STATE_COAST = 6,
    ZH_STATE_COMMISSIONING = 7,
    ZH_STATE_FAULT = 8,
    ZH_STATE_TORQUE_OFF = 9
};

/* faults: bits, latched until a fault reset */
enum {
    ZH_FAULT_OVER_CURRENT = 1 << 0,
    ZH_FAULT_DC_OVER_VOLTAGE = 1 << 1,
    ZH_FAULT_DC_UNDER_VOLTAGE = 1 << 2,
    ZH_FAULT_NON_FINITE = 1 << 3,
    ZH_FAULT_ADC_RANGE = 1 << 4,
    ZH_FAULT_CURRENT_SUM = 1 << 5,
    ZH_FAULT_OVER_SPEED = 1 << 6,
    ZH_FAULT_CONFIG = 1 << 7,
    ZH_FAULT_CURRENT_OFFSET = 1 << 8,
    ZH_FAULT_TABLE_CRC = 1 << 9,
    ZH_FAULT_PERIOD_LATE = 1 << 10, /* a warning; only a port can raise this and the next */
    ZH_FAULT_PERIOD_OVERRUN = 1 << 11,
    ZH_FAULT_STORE = 1 << 26 /* only with a parameter store */
};

/* Returned by every function with a status; 0 is success, text in zh_sil_error(). */
enum {
    ZH_OK = 0,
    ZH_BAD_ARGUMENT = 1, /* NULL pointer, or struct_size below version 1's */
    ZH_BAD_INPUT = 2,    /* value not finite, unknown mode, bad file */
    ZH_NO_SUCH_NAME = 3,
    ZH_OUT_OF_RANGE = 4, /* not finite, outside the limits, a fraction for a whole number */
    ZH_NOT_NOW = 5,      /* the parameter can only be changed with the gates off */
    ZH_PROTECTED = 6,    /* the parameter can only be given at open */
    ZH_REFUSED = 7       /* in range, but excluded by other parameters */
};

typedef struct zh_sil zh_sil;

typedef struct {
    uint32_t struct_size; /* sizeof(zh_sil_in), set by the caller */
    /* ADC words, n bits: i = (code - 2^(n-1)) I_fs / 2^(n-1), positive into the motor; line
     * voltages u_uv = u_u - u_v and u_vw = u_v - u_w likewise, behind the board's filter;
     * u_dc = code U_fs / 2^n. */
    uint16_t i_u;
    uint16_t i_v;
    uint16_t i_w;
    uint16_t u_uv;
    uint16_t u_vw;
    uint16_t u_dc;
    float speed_ref_rpm; /* mechanical, min^-1 */
    float torque_ref_Nm; /* not read in speed mode */
    uint32_t mode;       /* ZH_SIL_SPEED or ZH_SIL_TORQUE; anything else is refused */
    uint32_t command;    /* ZH_SIL_RUN | ZH_SIL_FAULT_RESET | ZH_SIL_TORQUE_OFF */
} zh_sil_in;

typedef struct {
    uint32_t struct_size; /* sizeof(zh_sil_out), set by the caller */
    float duty_u;         /* 0..1 of the upper switch */
    float duty_v;
    float duty_w;
    uint32_t gates_on; /* 0 or 1 */
    uint32_t state;
    uint32_t faults;
    float speed_hat_rpm; /* telemetry from here on; all 0 while the gates are off. NaN: unknown */
    float lambda_Wb;     /* rotor flux estimate */
    float lambda_angle_rad; /* stationary frame */
    float i_d_A;
    float i_q_A;
    float i_q_ref_A;
    float e1_alpha_A; /* estimated minus measured stator current */
    float e1_beta_A;
    float stator_frequency_Hz;
    float l1_re; /* observer gain L in use; l1 in 1/s; 0, like x_rad_s, if the estimator has none */
    float l1_im;
    float l2_re; /* l2 in ohm */
    float l2_im;
    float x_rad_s; /* state of the speed adaptation's integrator, electrical */
    /* Filled in where struct_size leaves room. */
    uint32_t speed_unknown; /* 1: a mode imposes the frequency and nothing shows that the rotor
                             * follows */
} zh_sil_out;

typedef struct {
    uint32_t struct_size; /* sizeof(zh_sil_name_info), set by the caller */
    uint32_t access;      /* 0 any time, 1 with the gates off, 2 at open only */
    uint32_t whole;       /* 1: whole numbers only */
    float minimum;
    float maximum;
    float initial; /* default of the firmware, before motor, board and overrides */
    const char *unit;
    const char *text;
    /* Filled in where struct_size leaves room. */
    const char *group;
    const char *const *choice; /* names of the values 0 .. maximum; NULL: a number */
} zh_sil_name_info;

ZH_API uint32_t zh_sil_version(void);

/* motor_dir holds motor.toml (machine data) and l_gain.json (the gain table, read word for word).
 * board_toml gives ADC, full scales and period. overrides: NULL or lines "name=value" with the
 * names below; '#' starts a comment. NULL when refused: see zh_sil_error(). */
ZH_API zh_sil *zh_sil_open(const char *motor_dir, const char *board_toml, const char *overrides);

/* One control period, and the background function every thousandth call. On any error *out (if it
 * can be written) has the gates off and duties of one half. A speed_ref_rpm that is not finite
 * trips the firmware; an unknown mode is a torque-off for this period. */
ZH_API int zh_sil_step(zh_sil *handle, const zh_sil_in *in, zh_sil_out *out);

ZH_API int zh_sil_get(const zh_sil *handle, const char *name, float *value);

/* Takes effect with the next step. */
ZH_API int zh_sil_set(zh_sil *handle, const char *name, float value);

/* Names of all parameters; NULL beyond the last. */
ZH_API uint32_t zh_sil_name_count(void);
ZH_API const char *zh_sil_name(uint32_t index);
ZH_API int zh_sil_describe(uint32_t index, zh_sil_name_info *info);

/* NULL is allowed. */
ZH_API void zh_sil_close(zh_sil *handle);

/* Error text of the last call that failed on this thread; never NULL. */
ZH_API const char *zh_sil_error(void);

#ifdef __cplusplus
}
#endif

#endif
