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
 * their end. 2: the observer alone became sil_estimator.h. 3: speed_unknown. 4: commissioning,
 * telemetry from `confidence` on, signals, reset, snapshots, many periods per call. 5: terminals.
 */
#define ZH_SIL_VERSION 5u

#define ZH_SIL_RUN         (1u << 0) /* level: run; after a fault it must drop and rise again */
#define ZH_SIL_FAULT_RESET (1u << 1) /* rising edge */
#define ZH_SIL_TORQUE_OFF  (1u << 2) /* level: gates off, overrides run */
#define ZH_SIL_COMMISSION  (1u << 3) /* level: identify the motor's circuit at standstill */

/* Bits of reasons: why the drive doubts the angle of its flux. */
#define ZH_REASON_UNSURE (1u << 0) /* the bound of the flux error is beyond 25 degrees */
#define ZH_REASON_RESIDUAL                                                                         \
    (1u << 1)                     /* two flux estimates differ more than uncertainty explains      \
                                   */
#define ZH_REASON_FLUX  (1u << 2) /* more flux than any current here makes */
#define ZH_REASON_LOST  (1u << 3) /* far beyond, or one of the others for too long */
#define ZH_REASON_STILL (1u << 4) /* a field at standstill under torque */

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

/* commissioning: of the last one; the result by zh_sil_commissioned */
enum {
    ZH_COMMISSIONING_NONE = 0, /* not begun, or ended by another command */
    ZH_COMMISSIONING_BUSY = 1,
    ZH_COMMISSIONING_DONE = 2,
    ZH_COMMISSIONING_REFUSED = 3
};

/* confidence */
enum {
    ZH_CONFIDENCE_CLOSED = 0,   /* oriented, as far as anyone can know */
    ZH_CONFIDENCE_DEGRADED = 1, /* may be lost, or could be lost without a sign */
    ZH_CONFIDENCE_LOST = 2      /* lost: I-f operation is requested */
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
    uint32_t command;    /* ZH_SIL_RUN and the other bits */
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
    uint32_t speed_unknown; /* 1: nothing shows the speed: a mode imposes the frequency, or the
                             * estimate is in doubt beside a field that stands under torque */
    uint32_t confidence;    /* ZH_CONFIDENCE_* */
    uint32_t reasons;       /* ZH_REASON_* */
    uint32_t commissioning; /* ZH_COMMISSIONING_* */
    float speed_bound_rpm;  /* bound of the speed error, as far as known */
    float speed_ref_rpm;    /* after the slew limit */
    float i_d_ref_A;
    float lambda_ref_Wb;
    float Rs_hat_ohm;  /* in use: parameter, measurement at the start, tracking */
    float leg_loss_pu; /* voltage lost in a leg over the dc link, as identified; 0: it was not */
    float u_s_alpha_V; /* what the estimator was given: voltage ... */
    float u_s_beta_V;
    float i_s_alpha_A; /* ... and current, stationary frame */
    float i_s_beta_A;
    float u_dc_V;
    uint32_t brake_on; /* brake resistor, 0 or 1 */
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

#define ZH_COMMISSIONING_LEVELS 8u

/* Result of commissioning (firmware/law/mode/commissioning.h); vectors power invariant. */
typedef struct {
    uint32_t done;
    uint32_t refusal; /* commissioning_refusal_t */
    float Rs_ohm;
    float lost_V;
    float sigma_Ls_H;
    float Rr_gamma_ohm; /* (M/Lr)^2 Rr */
    float M_gamma_H;    /* M^2/Lr for small changes about bias_A */
    float bias_A;
    float level_A[ZH_COMMISSIONING_LEVELS];
    float flux_Wb[ZH_COMMISSIONING_LEVELS];
    float error_V[ZH_COMMISSIONING_LEVELS];
} zh_commissioning;

typedef struct {
    uint32_t struct_size; /* sizeof(zh_sil_signal_info), set by the caller */
    uint32_t whole;       /* 1: whole numbers only */
    const char *name;
    const char *unit; /* empty: a bare number */
    const char *text;
} zh_sil_signal_info;

/* Terminals (firmware/terminals). Inputs: a contact that is closed. */
#define ZH_TERMINAL_START          (1u << 0)
#define ZH_TERMINAL_STOP           (1u << 1) /* open stops */
#define ZH_TERMINAL_REVERSE        (1u << 2)
#define ZH_TERMINAL_RESET          (1u << 3)
#define ZH_TERMINAL_BRAKE_RELEASED (1u << 4)
#define ZH_TERMINAL_CONTACTOR_ON   (1u << 5)
#define ZH_TERMINAL_CHOPPER_LEADS  (1u << 6)
/* Outputs. */
#define ZH_TERMINAL_READY         (1u << 16)
#define ZH_TERMINAL_NO_FAULT      (1u << 17)
#define ZH_TERMINAL_BRAKE_RELEASE (1u << 18)
#define ZH_TERMINAL_CONTACTOR     (1u << 19)
#define ZH_TERMINAL_CHOPPER       (1u << 20)

typedef struct {
    uint32_t struct_size; /* sizeof(zh_sil_terminal_in), set by the caller */
    uint32_t inputs;      /* ZH_TERMINAL_START and the others */
    double analog_V;      /* the one that analog_reference names is read */
    double analog_A;
    double sink_ohm; /* resistance of a sensor; infinity: its wire is open */
    double motor_ohm;
    uint32_t unreadable; /* 1: the board's inputs do not answer */
} zh_sil_terminal_in;

typedef struct {
    uint32_t struct_size; /* sizeof(zh_sil_terminal_out), set by the caller */
    uint32_t outputs;     /* ZH_TERMINAL_READY and the others: 1 is energised */
    uint32_t faults;      /* latched, firmware/terminals/terminal_faults.def */
    uint32_t brake;       /* 0 closed, 1 proving, 2 releasing, 3 released, 4 closing */
    uint32_t precharge;   /* 0 waiting, 1 charging, 2 closing, 3 closed, 4 failed */
    float reference_pu;   /* of the analogue reference, filtered */
    float sink_degC;      /* NaN: never measured */
    float motor_degC;
    float current_pu;  /* limit of the torque current in force, over its parameter */
    float Rs_pu;       /* Rs in force at the start, over its parameter */
    float resistor_pu; /* heat of the brake resistor, over its rating */
} zh_sil_terminal_out;

/* Signals that zh_sil_run notes after every period. */
typedef struct {
    uint32_t struct_size;  /* sizeof(zh_sil_record), set by the caller */
    uint32_t count;        /* of the signals */
    const uint32_t *index; /* of each */
    double *value;         /* row by row: count values per period */
} zh_sil_record;

ZH_API uint32_t zh_sil_version(void);

/* motor_dir holds motor.toml (machine data) and l_gain.json (the gain table, read word for word).
 * board_toml gives ADC, full scales and period. overrides: NULL or lines "name=value" with the
 * names below; '#' starts a comment. NULL when refused: see zh_sil_error(). */
ZH_API zh_sil *zh_sil_open(const char *motor_dir, const char *board_toml, const char *overrides);

/* One control period, and the background function every thousandth call. On any error *out (if it
 * can be written) has the gates off and duties of one half. A speed_ref_rpm that is not finite
 * trips the firmware; an unknown mode is a torque-off for this period. */
ZH_API int zh_sil_step(zh_sil *handle, const zh_sil_in *in, zh_sil_out *out);

/* What the last zh_sil_step gave; before the first, gates off. */
ZH_API int zh_sil_look(const zh_sil *handle, zh_sil_out *out);

/* One period of each of `count` drives, or `count` periods of one; the result is that of single
 * steps. Elements lie struct_size of the first apart, and all have the same. Every element is
 * stepped; the status is that of the first one refused. record: NULL, or what to note. */
ZH_API int zh_sil_step_many(zh_sil *const *handles, const zh_sil_in *in, zh_sil_out *out,
                            uint32_t count);
ZH_API int zh_sil_run(zh_sil *handle, const zh_sil_in *in, zh_sil_out *out, uint32_t count,
                      const zh_sil_record *record);

/* Gives the drive a board with every terminal. parameters: lines "name=value" of
 * firmware/terminals/terminal_params.def; all is off by default. From then on the command of a step
 * is that of a host, and the terminals make of it what the drive gets. Only with the gates off. A
 * drive with terminals has no snapshots; zh_sil_reset takes them away. */
ZH_API int zh_sil_terminals_fit(zh_sil *handle, const char *parameters);

/* What is wired to them, from the next step on; before that every contact is open. */
ZH_API int zh_sil_terminals_set(zh_sil *handle, const zh_sil_terminal_in *in);
ZH_API int zh_sil_terminals_look(const zh_sil *handle, zh_sil_terminal_out *out);

/* Of the last commissioning; zero until found. */
ZH_API int zh_sil_commissioned(const zh_sil *handle, zh_commissioning *result);

/* As after zh_sil_open, parameters too. */
ZH_API int zh_sil_reset(zh_sil *handle);

/* The whole state of a drive, parameters too, in memory of the caller: a drive that it is restored
 * into continues bit for bit. It has to be opened with the same motor, board and overrides, by the
 * same library, in this process or another; the rest is refused (ZH_REFUSED), and nothing changes.
 */
ZH_API size_t zh_sil_snapshot_bytes(void);
ZH_API int zh_sil_snapshot(const zh_sil *handle, void *buffer, size_t bytes);
ZH_API int zh_sil_restore(zh_sil *handle, const void *buffer, size_t bytes);

/* The traced signals (firmware/unit/signal_list.def), in order. zh_sil_signal_find gives the count
 * for a name that does not exist. value: as of the last period, `count` of them. */
ZH_API uint32_t zh_sil_signal_count(void);
ZH_API uint32_t zh_sil_signal_find(const char *name);
ZH_API int zh_sil_signal_describe(uint32_t index, zh_sil_signal_info *info);
ZH_API int zh_sil_signals(const zh_sil *handle, const uint32_t *index, uint32_t count,
                          double *value);

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
