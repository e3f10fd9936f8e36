#include "fault_reaction.h"

#include "monitor.h"

/* A bit moved in one of the two places would change the meaning of every log. */
#define FAULT(name, bit, reaction, text, cause, remedy)                                            \
    _Static_assert(FAULT_##name == (1u << (bit)), #name);
#include "fault_list.def"
#undef FAULT

static const fault_info_t fault_table[] = {
#define FAULT(name, bit, reaction, text, cause, remedy)                                            \
    {#name, (bit), FAULT_##reaction, text, cause, remedy},
#include "fault_list.def"
#undef FAULT
};

uint32_t fault_count(void)
{
    return (uint32_t)(sizeof fault_table / sizeof fault_table[0]);
}

const fault_info_t *fault_info(uint32_t index)
{
    return &fault_table[(index < fault_count()) ? index : 0u];
}
