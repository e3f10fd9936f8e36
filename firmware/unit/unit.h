/* One drive as an object: all its state, its control period and its background step.
 *
 * The same sources for every port. Everything that can change a duty or the gates runs inside
 * unit_control_period. The background stores, communicates and tests, and hands over by mailbox.
 */
#ifndef UNIT_H
#define UNIT_H

#include <stdbool.h>
#include <stdint.h>

#include "unit_link.h"
#include "unit_store.h"
#include "auto_restart.h"
#include "commissioning.h"
#include "drive.h"
#include "sequence.h"
#include "fault_record.h"
#include "flight.h"
#include "gain_table.h"
#include "hal_devices.h"
#include "hal_drive_io.h"
#include "params.h"
#include "params_check.h"
#include "trace.h"

/* Command to the drive; posted by the background, read once per period. */
typedef struct {
    uint32_t command; /* SEQUENCE_CMD_* */
    float omega_m_ref_rad_s;
    float torque_ref_Nm; /* with SEQUENCE_CMD_TORQUE_MODE */
    uint32_t count;      /* any change shows that the commander is alive */
} unit_command_t;

/* Double buffer: the background fills the slot that is not published, then flips the index. All of
 * it volatile, so that no compiler publishes a slot before it is filled. */
typedef struct {
    volatile unit_command_t slot[2];
    volatile uint32_t faults;    /* faults found by the background */
    volatile uint32_t alive;     /* count of the last command posted */
    volatile uint32_t published; /* counts the posts; its last bit is the slot to read */
} unit_mailbox_t;

/* All configurations made of the parameters. */
typedef struct {
    drive_config_t drive;
    sequence_config_t state;
    uint32_t command_timeout_periods; /* 0: not watched */
    bool one_way;
    float direction;        /* of the references allowed, then */
    float speed_max_rad_s;  /* of any reference, electrical */
    float stop_speed_rad_s; /* electrical */
    commissioning_config_t commissioning;
    auto_restart_config_t restart;
} unit_config_t;

/* Memory for recording, from the port; no start-up code may clear `fault`. */
typedef struct {
    uint32_t *trace_word;
    uint32_t trace_words;  /* 0: no trace */
    fault_memory_t *fault; /* NULL: no record */
    uint32_t *flight_word;
    uint32_t flight_words; /* 0: no flight recorder */
} unit_memory_t;

typedef struct {
    /* What a period needs lies together, at the front and not behind a pointer: loads and stores of
     * floats reach 1 KiB, and either would cost the control law 80 instructions. Behind the other,
     * `last` would be out of reach; of the state only what the modes beside vector control keep is.
     */
    drive_out_t last; /* of the last period, for telemetry and trace */
    drive_state_t drive;
    sequence_state_t machine;
    commissioning_out_t commissioned; /* what it said last; zero: not begun */
    auto_restart_state_t restart;
    drive_in_t asked;           /* of the law, by command, mode and aim */
    uint32_t decided;           /* unit_decisions when they changed last */
    unit_command_t command;     /* as it came last */
    uint32_t taken;             /* mailbox.published then */
    uint32_t command_faults;    /* a number of it is none */
    uint32_t command_count;     /* of the command that was last seen alive */
    uint32_t silent_periods;    /* since it changed, with the gates on */
    bool configured;            /* false: some parameter, motor datum or the table was refused */
    bool late;                  /* late_periods had changed in the last period */
    uint16_t late_periods;      /* the port's count then */
    uint32_t in_force;          /* index of the configuration in force */
    volatile bool change_ready; /* the other one is whole: the next period takes it */
    volatile uint32_t period_count; /* the background watches it change */
    unit_mailbox_t mailbox;

    unit_config_t config[2]; /* one in force; the other is the background's until change_ready */
    hal_output_t output;     /* of the last period, when it is recorded */
    fault_recorder_t fault_recorder;
    trace_t trace;
    flight_t flight;
    commissioning_state_t commissioning;

    /* The background's. */
    const gain_table_t *table;
    const params_t *image; /* parameters where nothing was saved; NULL: a port without a store */
    params_conflict_t refused; /* why the set that was given last was refused, if it was */
    params_t params;           /* source of the newest configuration */
    uint32_t crc_entry;        /* next table entry of the running check */
    uint32_t crc;
    uint32_t config_crc[2];  /* of each configuration, once it was built */
    uint32_t config_at;      /* next byte of the running check of the one in force */
    uint32_t config_sum;     /* of the bytes before */
    uint32_t config_checked; /* index of the one that is looked at */
    uint32_t served_count;   /* period_count at the last watchdog service */
    unit_link_t link;
    unit_store_t store;
} unit_t;

typedef struct {
    uint32_t state; /* sequence_id_t */
    uint32_t faults;
    float omega_m_hat_rad_s; /* NaN when unknown */
    float lambda_hat_Wb;
    float lambda_angle_rad; /* stationary frame */
    float i_d_A;
    float i_q_A;
    float i_q_ref_A;
    float e1_alpha_A;
    float e1_beta_A;
    float stator_frequency_Hz;
    float Rs_hat_ohm;
    uint32_t confidence;         /* supervisor: 0 closed loop, 1 degraded, 2 I-f operation */
    uint32_t supervisor_reasons; /* SUPERVISOR_* */
    float omega_m_bound_rad_s;   /* bound of the speed error, as far as known */
    uint32_t speed_unknown;      /* 1: nothing shows the speed, imposed or estimated */
} unit_telemetry_t;

/* What decides about gates and law, in one word: a bit that flips in any of them shows. */
static inline uint32_t unit_decisions(const unit_t *unit)
{
    return (uint32_t)unit->asked.mode ^ (uint32_t)unit->asked.aim ^ (uint32_t)unit->drive.mode ^
           (uint32_t)unit->configured ^ (uint32_t)unit->machine.run_blocked ^
           unit->command.command ^ float_bits(unit->asked.omega_e_ref_rad_s);
}

/* The configuration in force. */
static inline const unit_config_t *unit_config(const unit_t *unit)
{
    return &unit->config[unit->in_force];
}

/* table may be NULL when observer_gain_enable is 0. False: refused; the unit can still be stepped,
 * stands in FAULT with FAULT_CONFIG and keeps the gates off. */
CHECKED bool unit_init(unit_t *unit, const params_t *params, const gain_table_t *table);

/* The same from a board: what its store holds is in force, the image's only where nothing was ever
 * saved. Refused with FAULT_STORE: a record that cannot be read, of another gain table (another
 * motor, another design) or of another control period. Who has looked at both saves anew. *image
 * stays the caller's. */
CHECKED bool unit_start(unit_t *unit, const params_t *image, const gain_table_t *table,
                        const hal_devices_t *devices);

/* Before the first period: unit->params become the configuration in force. made_for: the table they
 * were saved with, NULL for those of the image. False: refused, as unit_init and unit_start do. */
CHECKED bool unit_adopt(unit_t *unit, const gain_table_id_t *made_for);

/* Live change of parameters from the background, whole from the next period on; false, and nothing
 * changed, when refused. Whether a parameter may change now is the caller's to know. */
CHECKED bool unit_reconfigure(unit_t *unit, const params_t *params);

/* The gates are off and no command that stands can open them before the background's next word. */
bool unit_at_rest(const unit_t *unit);

/* Called by the background or, in SIL, before the period. */
void unit_post_command(unit_t *unit, const unit_command_t *command);

/* One control period: sample in, duties and gates out. A duty outside 0..1 never leaves. */
void unit_control_period(unit_t *unit, const hal_sample_t *sample, hal_output_t *output);

/* One slice of background work: gain-table CRC, link, fault record, watchdog. devices may be NULL.
 */
void unit_background(unit_t *unit, const hal_devices_t *devices);

void unit_telemetry(const unit_t *unit, unit_telemetry_t *telemetry);

/* The present command of the host link. The owner of the background fetches it in every round and
 * posts it, with the board's own inputs (a safety input) added. An expired command has no RUN any
 * more; a reset is a pulse that ends once the control period saw it. */
unit_command_t unit_link_command(unit_t *unit);

#endif
