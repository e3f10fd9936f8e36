#include "cm_loader.h"

#include <stdbool.h>
#include <stdint.h>

#include "boot_call.h"
#include "cm_port.h"
#include "cm_registers.h"

extern const char cm_guard_start[]; /* lowest in RAM */

void cm_loader_call(void *context)
{
    (void)context;
    cm_irq_off();
    port_gates_off();
    CM_MPU_CTRL = 0u; /* the guard is nobody's to write */
    cm_barrier();
    boot_call((volatile uint32_t *)(uintptr_t)cm_guard_start);
    cm_barrier();
    CM_AIRCR = CM_AIRCR_RESET;
    cm_barrier();
    while (true) {
        port_gates_off();
    }
}
