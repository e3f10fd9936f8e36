#include "flight_replay.hpp"

#include <bit>
#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "c_boundary.hpp"
#include "firmware_setup.hpp"

namespace {

using zh::fail;

static_assert(ZH_FLIGHT_ROW_WORDS == FLIGHT_ROW_WORDS);

std::uint32_t low(std::uint32_t word)
{
    return word & 0xFFFFU;
}

std::uint16_t high(std::uint32_t word)
{
    return static_cast<std::uint16_t>(word >> 16U);
}

bool marked(std::uint32_t half_word)
{
    return (half_word & FLIGHT_MARK) != 0;
}

std::uint16_t adc_word(std::uint32_t half_word)
{
    return static_cast<std::uint16_t>(half_word & (FLIGHT_MARK - 1U));
}

} // namespace

zh_flight::zh_flight(const params_t &params, std::shared_ptr<const zh::GainFile> gain_file)
    : gain(std::move(gain_file))
{
    if (!unit_init(&unit, &params, gain != nullptr ? &gain->table() : nullptr)) {
        throw zh::ConfigError("parameters: " + zh::refusal_reason(params));
    }
}

bool zh_flight::take(const RowWords &row)
{
    if (state.ended != ZH_FLIGHT_GOES_ON) {
        return false;
    }
    if (!marked(row[0])) {
        return started ? period(row) : end(ZH_FLIGHT_NO_START);
    }
    switch (low(row[0])) {
    case FLIGHT_START:
        return start(row);
    case FLIGHT_COMMAND:
        return command(row);
    case FLIGHT_PARAMETER:
        return parameter(row);
    case FLIGHT_EVENT:
        late_periods = static_cast<std::uint16_t>(late_periods + high(row[0]));
        unit.mailbox.faults = row[1];
        return false;
    case FLIGHT_CHECK:
        return check(row);
    default:
        return end(ZH_FLIGHT_UNKNOWN);
    }
}

bool zh_flight::end(std::uint32_t why)
{
    state.ended = why;
    return false;
}

bool zh_flight::start(const RowWords &row)
{
    if (started) {
        return end(ZH_FLIGHT_SECOND);
    }
    started = true;
    changes = high(row[0]);
    float *heat_pu = unit.drive.limits.overload.heat_pu;
    heat_pu[OVERLOAD_MOTOR] = std::bit_cast<float>(row[1]);
    heat_pu[OVERLOAD_INVERTER] = std::bit_cast<float>(row[2]);
    return false;
}

// As unit_post_command, equal to the last one or not: the drive took it.
bool zh_flight::command(const RowWords &row)
{
    const std::uint32_t next = unit.mailbox.published + 1U;
    volatile unit_command_t &slot = unit.mailbox.slot[next & 1U];
    slot.command = high(row[0]);
    slot.omega_m_ref_rad_s = std::bit_cast<float>(row[1]);
    slot.torque_ref_Nm = std::bit_cast<float>(row[2]);
    unit.mailbox.published = next;
    return false;
}

// No parameter of this number: the drive took the same set again, or a replay keeps its own.
bool zh_flight::parameter(const RowWords &row)
{
    params_t params = unit.params;
    const auto index = static_cast<std::size_t>(high(row[0]));
    if (low(row[2] - changes) > 1U) {
        return end(ZH_FLIGHT_CHANGES);
    }
    changes = row[2];
    if (index < params_count() &&
        params_set(&params, index, std::bit_cast<float>(row[1])) != PARAMS_OK) {
        return end(ZH_FLIGHT_PARAMETER);
    }
    return unit_reconfigure(&unit, &params) ? false : end(ZH_FLIGHT_PARAMETER);
}

bool zh_flight::check(const RowWords &row)
{
    ++state.checks;
    const bool same = row[1] == digest && row[2] == samples;
    if (!same) {
        state.differs = 1;
    }
    if (state.differs == 0) {
        state.equal = state.periods;
    }
    return false;
}

bool zh_flight::period(const RowWords &row)
{
    unit.mailbox.alive = unit.mailbox.alive + (marked(high(row[0])) ? 1U : 0U);
    const hal_sample_t sample{adc_word(row[0]),
                              adc_word(high(row[0])),
                              adc_word(row[1]),
                              high(row[1]),
                              static_cast<std::uint16_t>(low(row[2])),
                              high(row[2]),
                              late_periods,
                              static_cast<std::uint16_t>(marked(row[1]) ? HAL_INPUT_BREAK : 0U)};
    unit_control_period(&unit, &sample, &output);
    unit.output = output; // as unit_record_period keeps it, for the signals
    digest = unit_flight_digest(&unit, &output, digest);
    if (state.first_fault == 0 && unit.machine.faults != 0) {
        state.first_fault = unit.machine.faults;
        state.fault_at = state.periods;
    }
    ++samples;
    ++state.periods;
    return true;
}

zh_flight *zh_flight_open(const char *params, const float *gain, std::uint32_t gain_entries)
{
    return zh::guarded<zh_flight *>(nullptr, [&]() -> zh_flight * {
        if (params == nullptr || (gain == nullptr) != (gain_entries == 0)) {
            fail(ZH_BAD_ARGUMENT, "zh_flight_open: params or gain: is NULL");
            return nullptr;
        }
        params_t set;
        params_default(&set);
        zh::apply_overrides(set, params, "flight");
        std::shared_ptr<const zh::GainFile> table;
        if (gain != nullptr) {
            table = zh::gain_from_floats({gain, std::size_t{4} * gain_entries});
        }
        return std::make_unique<zh_flight>(set, table).release();
    });
}

int zh_flight_run(zh_flight *handle, const std::uint32_t *rows, std::uint32_t count,
                  const std::uint32_t *number, std::uint32_t signals, std::uint32_t *words,
                  std::uint32_t *periods)
{
    if (handle == nullptr || rows == nullptr || periods == nullptr ||
        (signals > 0 && (number == nullptr || words == nullptr))) {
        return fail(ZH_BAD_ARGUMENT, "zh_flight_run: handle, rows, number, words or periods: is "
                                     "NULL");
    }
    const std::uint32_t room = *periods;
    *periods = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t *at = rows + std::size_t{FLIGHT_ROW_WORDS} * k;
        if (!handle->take({at[0], at[1], at[2]})) {
            continue;
        }
        if (*periods >= room) {
            return fail(ZH_OUT_OF_RANGE, "zh_flight_run: periods: more than there is room for");
        }
        for (std::uint32_t s = 0; s < signals; ++s) {
            *words = unit_signal(&handle->unit, number[s]);
            ++words;
        }
        ++*periods;
    }
    return ZH_OK;
}

int zh_flight_get_state(const zh_flight *handle, zh_flight_state *state)
{
    if (handle == nullptr || state == nullptr || state->struct_size < sizeof(zh_flight_state)) {
        return fail(ZH_BAD_ARGUMENT, "zh_flight_get_state: handle or state: is NULL or its "
                                     "struct_size too small; set it to sizeof(zh_flight_state)");
    }
    *state = handle->state;
    return ZH_OK;
}

std::uint32_t zh_flight_signal_is_float(std::uint32_t number)
{
    return unit_signal_is_float(number) ? 1U : 0U;
}

void zh_flight_close(zh_flight *handle)
{
    delete handle;
}
