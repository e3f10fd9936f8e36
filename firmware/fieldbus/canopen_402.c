#include "canopen_402.h"

#include "fieldbus_actual.h"

#include <stddef.h>

#define STATUS_VOLTAGE   (1u << 4)
#define STATUS_WARNING   (1u << 7)
#define STATUS_REMOTE    (1u << 9)
#define PER_MILLE        1000.0f
#define ERROR_GENERIC    0x01u
#define ERROR_CODE_OTHER 0x1000u

/* Of the rated flux and the most torque current: full scale of the torque objects. */
static float rated_torque_Nm(const unit_t *unit)
{
    const params_t *p = &unit->params;
    return p->pole_pairs * (p->M_H / p->Lr_H) * (p->M_H * p->i_d_A) * p->i_q_max_A;
}

static float target_torque_Nm(const canopen_od_t *od, const unit_t *unit)
{
    const int16_t target = (int16_t)od->word[CANOPEN_AT_0x6071_0];
    return (float)target / PER_MILLE * rated_torque_Nm(unit);
}

static float target_rpm(const canopen_od_t *od)
{
    const uint32_t control = od->machine.control;
    const bool follows =
        ((control & CIA402_RAMP) == CIA402_RAMP) && ((control & CIA402_HALT) == 0u);
    return follows ? (float)(int16_t)od->word[CANOPEN_AT_0x6042_0] : 0.0f;
}

static bool torque_mode(const canopen_od_t *od)
{
    return od->word[CANOPEN_AT_0x6060_0] == CANOPEN_TORQUE;
}

static fieldbus_demand_t demand_of(const canopen_od_t *od, const unit_t *unit)
{
    const bool halt = (od->machine.control & CIA402_HALT) != 0u;
    fieldbus_demand_t demand = {0};
    demand.omega_m_ref_rad_s = fieldbus_rad_s_from_rpm(target_rpm(od));
    demand.torque_ref_Nm = halt ? 0.0f : target_torque_Nm(od, unit);
    if (od->machine.id == CIA402_OPERATION_ENABLED) {
        demand.command |= SEQUENCE_CMD_RUN;
    }
    if (torque_mode(od)) {
        demand.command |= SEQUENCE_CMD_TORQUE_MODE;
    }
    if ((od->machine.control & CIA402_ENABLE_VOLTAGE) == 0u) {
        demand.command |= SEQUENCE_CMD_TORQUE_OFF;
    }
    return demand;
}

uint32_t canopen_402_apply(canopen_od_t *od, const canopen_drive_t *drive, const canopen_od_t *next,
                           bool controlled)
{
    canopen_od_t tried = *next;
    bool reset = false;
    const uint32_t mode = tried.word[CANOPEN_AT_0x6060_0];
    if ((mode != CANOPEN_VELOCITY) && (mode != CANOPEN_TORQUE)) {
        return CANOPEN_OUT_OF_RANGE;
    }
    if (controlled) {
        reset = cia402_control(&tried.machine, tried.word[CANOPEN_AT_0x6040_0]);
    }
    fieldbus_demand_t demand = demand_of(&tried, drive->unit);
    demand.command |= reset ? SEQUENCE_CMD_FAULT_RESET : 0u;
    const fieldbus_status_t status = fieldbus_ask(drive->fb, drive->unit, &demand);
    if (status == FIELDBUS_OUT_OF_RANGE) {
        return CANOPEN_OUT_OF_RANGE;
    }
    if (status != FIELDBUS_OK) {
        return CANOPEN_NOT_NOW;
    }
    *od = tried;
    return CANOPEN_DONE;
}

void canopen_od_follow(canopen_od_t *od, const canopen_drive_t *drive)
{
    const sequence_state_t *machine = &drive->unit->machine;
    const bool gates_on = drive->unit->asked.mode != DRIVE_OFF;
    const cia402_drive_t does = {.ready = (machine->id != SEQUENCE_BOOT) &&
                                          (machine->id != SEQUENCE_SELF_TEST),
                                 .gates_on = gates_on,
                                 .reacting = gates_on && (fault_stopping(machine->faults) != 0u),
                                 .fault = machine->id == SEQUENCE_FAULT,
                                 .runs = (drive->fb->demand.command & SEQUENCE_CMD_RUN) != 0u};
    const bool ran = od->machine.id == CIA402_OPERATION_ENABLED;
    cia402_follow(&od->machine, &does);
    /* A run command of the other bus is none of ours. */
    if (ran && does.runs && (od->machine.id != CIA402_OPERATION_ENABLED)) {
        canopen_od_renew(od, drive); /* with run low */
    }
}

void canopen_od_renew(const canopen_od_t *od, const canopen_drive_t *drive)
{
    const fieldbus_demand_t demand = demand_of(od, drive->unit);
    /* Refused, it is not renewed. */
    (void)!fieldbus_ask(drive->fb, drive->unit, &demand);
}

void canopen_od_stop(canopen_od_t *od, const canopen_drive_t *drive)
{
    if (od->machine.id == CIA402_OPERATION_ENABLED) {
        od->machine.id = CIA402_QUICK_STOP_ACTIVE;
        canopen_od_renew(od, drive);
    }
}

uint32_t canopen_od_error_code(uint32_t faults)
{
    static const struct {
        uint32_t faults;
        uint32_t code;
    } codes[] = {{FAULT_OVER_CURRENT, 0x2310u},    {FAULT_EARTH_FAULT, 0x2330u},
                 {FAULT_DC_OVER_VOLTAGE, 0x3210u}, {FAULT_DC_UNDER_VOLTAGE, 0x3220u},
                 {FAULT_OVERLOAD, 0x4310u},        {FAULT_COMMAND_TIMEOUT, 0x8100u},
                 {FAULT_OVER_SPEED, 0x8400u},      {FAULT_SPEED_DEVIATION, 0x8400u}};
    for (size_t k = 0u; k < sizeof codes / sizeof codes[0]; k++) {
        if ((faults & codes[k].faults) != 0u) {
            return codes[k].code;
        }
    }
    return (faults != 0u) ? ERROR_CODE_OTHER : 0u;
}

static uint32_t whole(float value)
{
    /* An unknown speed reads 0: bit 7 of the status word says that it is none. */
    return (uint32_t)(int32_t)(is_finite(value) ? clampf(value, -32767.0f, 32767.0f) : 0.0f);
}

static uint32_t status_word(const canopen_od_t *od, const canopen_drive_t *drive,
                            const fieldbus_actual_t *a)
{
    const bool warning = (a->status & (FIELDBUS_WARNING | FIELDBUS_UNKNOWN)) != 0u;
    uint32_t word = cia402_status(od->machine.id);
    word |= (a->u_dc_V > drive->unit->params.u_dc_min_V) ? STATUS_VOLTAGE : 0u;
    word |= warning ? STATUS_WARNING : 0u;
    word |= ((a->status & FIELDBUS_REMOTE) != 0u) ? STATUS_REMOTE : 0u;
    return word;
}

uint32_t canopen_402_live(const canopen_od_t *od, const canopen_drive_t *drive,
                          canopen_live_t which)
{
    fieldbus_actual_t a;
    fieldbus_actual(drive->fb, drive->unit, &a);
    const float rated_Nm = rated_torque_Nm(drive->unit);
    const uint32_t values[CANOPEN_LIVES] = {
        [CANOPEN_LIVE_ERROR_REGISTER] = (a.faults != 0u) ? ERROR_GENERIC : 0u,
        [CANOPEN_LIVE_ERROR_CODE] = canopen_od_error_code(a.faults),
        [CANOPEN_LIVE_STATUSWORD] = status_word(od, drive, &a),
        [CANOPEN_LIVE_VELOCITY_DEMAND] = whole(target_rpm(od)),
        [CANOPEN_LIVE_VELOCITY] = whole(a.speed_rpm),
        [CANOPEN_LIVE_MODE] = od->word[CANOPEN_AT_0x6060_0],
        [CANOPEN_LIVE_RATED_TORQUE] = (uint32_t)(PER_MILLE * rated_Nm),
        [CANOPEN_LIVE_TORQUE] = whole(PER_MILLE * a.torque_Nm / rated_Nm)};
    return values[which];
}
