#include "fieldbus_params.h"

#include "unit_link_params.h"

#include <stddef.h>

#define MEMBER_BYTES sizeof(uint32_t)
#define SET_BYTES    6u /* of the link's request: index u16, value f32 */

/* Their offsets: all members of params_t have 32 bits. */
static const uint16_t writable[] = {
#define FIELDBUS_WRITABLE(name) offsetof(params_t, name),
#include "fieldbus_writable.def"
};

size_t fieldbus_param_at(uint32_t group, uint32_t k)
{
    uint32_t before = 0u;
    for (size_t i = 0u; i < params_count(); i++) {
        if (params_info(i)->group == group) {
            if (before == k) {
                return i;
            }
            before++;
        }
    }
    return params_count();
}

bool fieldbus_param_writable(size_t index)
{
    for (size_t k = 0u; k < sizeof writable / sizeof writable[0]; k++) {
        if (writable[k] == MEMBER_BYTES * index) {
            return true;
        }
    }
    return false;
}

static bool is_float(size_t index)
{
    return params_info(index)->type == (uint32_t)PARAM_FLOAT;
}

uint32_t fieldbus_param_bits(const unit_t *unit, size_t index)
{
    const float value = params_get(&unit->params, index);
    return is_float(index) ? float_bits(value) : (uint32_t)value;
}

unit_link_status_t fieldbus_param_set(unit_t *unit, size_t index, uint32_t bits)
{
    if (!fieldbus_param_writable(index)) {
        return UNIT_LINK_PROTECTED;
    }
    if (fieldbus_allowed(unit) != FIELDBUS_OK) {
        return UNIT_LINK_NOT_NOW;
    }
    const uint32_t value = is_float(index) ? bits : float_bits((float)bits);
    const uint8_t request[SET_BYTES] = {
        (uint8_t)(index & 0xFFu),          (uint8_t)(index >> 8u),
        (uint8_t)(value & 0xFFu),          (uint8_t)((value >> 8u) & 0xFFu),
        (uint8_t)((value >> 16u) & 0xFFu), (uint8_t)(value >> 24u)};
    command_reader_t body = {.at = request, .left = SET_BYTES};
    return unit_link_set(unit, &body);
}
