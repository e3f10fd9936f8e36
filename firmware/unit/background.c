#include "unit.h"

#include <stddef.h>

#include "table_crc.h"
#include "unit_link_requests.h"
#include "unit_record.h"
#include "unit_store_background.h"

/* Table entries per background slice: a full check of 1801 entries takes 76 slices, and a
 * slice beside the control period no more than two or three periods of the slowest core here. */
#define UNIT_CRC_ENTRIES_PER_SLICE 24u

/* Bytes of the configuration per slice: whole within 50 ms where the background has its turn every
 * 2 ms. */
#define UNIT_CONFIG_BYTES_PER_SLICE 96u

bool unit_at_rest(const unit_t *unit)
{
    const uint32_t command = unit->mailbox.slot[unit->mailbox.published & 1u].command;
    const uint32_t harmless = SEQUENCE_CMD_FAULT_RESET | SEQUENCE_CMD_TORQUE_OFF;
    return (unit->asked.mode == DRIVE_OFF) && ((command & ~harmless) == 0u);
}

void unit_post_command(unit_t *unit, const unit_command_t *command)
{
    const volatile unit_command_t *now = &unit->mailbox.slot[unit->mailbox.published & 1u];
    unit->mailbox.alive = command->count;
    if ((command->command == now->command) &&
        (float_bits(command->omega_m_ref_rad_s) == float_bits(now->omega_m_ref_rad_s)) &&
        (float_bits(command->torque_ref_Nm) == float_bits(now->torque_ref_Nm))) {
        return; /* nothing new: the period need not look */
    }
    const uint32_t next = unit->mailbox.published + 1u;
    unit->mailbox.slot[next & 1u] = *command;
    unit->mailbox.published = next;
}

/* Running check of the table: flash can lose a bit after the check at start. */
static void check_table_slice(unit_t *unit)
{
    if (estimator_table(&unit_config(unit)->drive.estimator) == NULL) {
        return;
    }
    const gain_table_t *table = unit->table;
    uint32_t end = unit->crc_entry + UNIT_CRC_ENTRIES_PER_SLICE;
    if (end > table->entry_count) {
        end = table->entry_count;
    }
    unit->crc = table_crc(table, unit->crc, unit->crc_entry, end);
    unit->crc_entry = end;
    if (unit->crc_entry >= table->entry_count) {
        if (unit->crc != table->crc32c) {
            unit->mailbox.faults |= FAULT_TABLE_CRC;
        }
        unit->crc_entry = 0u;
        unit->crc = 0u;
    }
}

/* Running check of the configuration in force: RAM can lose a bit, a trip limit among them. */
static void check_config_slice(unit_t *unit)
{
    const uint32_t index = unit->in_force;
    const uint32_t bytes = (uint32_t)sizeof unit->config[index];
    if (index != unit->config_checked) {
        unit->config_checked = index;
        unit->config_at = 0u;
    }
    const uint32_t left = bytes - unit->config_at;
    const uint32_t n = (left < UNIT_CONFIG_BYTES_PER_SLICE) ? left : UNIT_CONFIG_BYTES_PER_SLICE;
    const uint8_t *config = (const uint8_t *)&unit->config[index];
    const uint32_t before = (unit->config_at == 0u) ? 0u : unit->config_sum;
    unit->config_sum = crc32c_update(before, &config[unit->config_at], n);
    unit->config_at += n;
    if (unit->config_at >= bytes) {
        if (unit->config_sum != unit->config_crc[index]) {
            unit->mailbox.faults |= FAULT_CONFIG;
        }
        unit->config_at = 0u;
    }
}

COLD void unit_background(unit_t *unit, const hal_devices_t *devices)
{
    if (unit->configured) {
        check_table_slice(unit);
        check_config_slice(unit);
    }
    unit_record_background(unit);
    if (devices != NULL) {
        unit_link_background(unit, devices);
        unit_store_background(unit, devices);
    }
    /* The watchdog is fed only while the control period lives. */
    const uint32_t count = unit->period_count;
    if ((devices != NULL) && (devices->watchdog_serve != NULL) && (count != unit->served_count)) {
        unit->served_count = count;
        devices->watchdog_serve(devices->context);
    }
}
