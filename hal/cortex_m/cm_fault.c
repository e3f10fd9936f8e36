#include "cm_fault.h"

#include <stddef.h>

#include "cm_mpu.h"
#include "cm_port.h"
#include "cm_registers.h"
#include "cm_text.h"

#define FAULT_STACK_BYTES 512

/* What the core pushes on entry, without the floating-point part. */
typedef struct {
    uint32_t r[4];
    uint32_t r12;
    uint32_t lr;
    uint32_t pc;
    uint32_t psr;
} cm_frame_t;

extern uint32_t cm_stack_bottom[];
extern uint32_t cm_stack_top[];

void cm_fault_handler(void);
__attribute__((used)) _Noreturn void cm_fault_c(const cm_frame_t *frame);

/* The stack may be what failed, so the handlers have one of their own. */
__attribute__((used)) static uint64_t fault_stack[FAULT_STACK_BYTES / sizeof(uint64_t)];

/* r0: where the core pushed its frame, if it could. */
__attribute__((naked)) void cm_fault_handler(void)
{
    __asm volatile("mrs r0, msp\n\t"
                   "movw r1, #:lower16:(fault_stack + %c[bytes])\n\t"
                   "movt r1, #:upper16:(fault_stack + %c[bytes])\n\t"
                   "msr msp, r1\n\t"
                   "b cm_fault_c\n\t"
                   :
                   : [bytes] "i"(FAULT_STACK_BYTES));
}

static cm_end_t classify(uint32_t cfsr, const cm_fault_t *fault)
{
    const uint32_t stacking = CM_CFSR_MSTKERR | CM_CFSR_MLSPERR;
    if (((cfsr & stacking) != 0u) || cm_mpu_is_stack_guard(fault->address)) {
        return CM_END_STACK_OVERFLOW;
    }
    if ((cfsr & CM_CFSR_MEMORY) != 0u) {
        return CM_END_WILD_ACCESS;
    }
    if ((cfsr & CM_CFSR_BUS) != 0u) {
        return CM_END_BUS_FAULT;
    }
    if ((cfsr & CM_CFSR_DIVBYZERO) != 0u) {
        return CM_END_DIVISION_BY_ZERO;
    }
    if ((cfsr & CM_CFSR_UNDEFINSTR) != 0u) {
        return CM_END_UNDEFINED_INSTRUCTION;
    }
    return ((cfsr & CM_CFSR_USAGE) != 0u) ? CM_END_USAGE_FAULT : CM_END_HARD_FAULT;
}

/* Only a frame that lies in the stack can be read. */
static const cm_frame_t *readable(const cm_frame_t *frame)
{
    const uintptr_t at = (uintptr_t)frame;
    const uintptr_t last = (uintptr_t)cm_stack_top - sizeof(cm_frame_t);
    return ((at >= (uintptr_t)cm_stack_bottom) && (at <= last)) ? frame : NULL;
}

void cm_fault_c(const cm_frame_t *frame)
{
    port_gates_off();
    const uint32_t cfsr = CM_CFSR;
    const cm_frame_t *pushed = readable(frame);
    cm_fault_t fault = {.cfsr = cfsr};
    if (pushed != NULL) {
        fault.pc = pushed->pc;
        fault.lr = pushed->lr;
    }
    if ((cfsr & CM_CFSR_MMARVALID) != 0u) {
        fault.address = CM_MMFAR;
    } else if ((cfsr & CM_CFSR_BFARVALID) != 0u) {
        fault.address = CM_BFAR;
    }
    fault.code = classify(cfsr, &fault);
    port_halt(&fault);
}

void cm_stop(cm_end_t code)
{
    cm_irq_off();
    port_gates_off();
    const cm_fault_t fault = {.code = code, .pc = (uint32_t)(uintptr_t)__builtin_return_address(0)};
    port_halt(&fault);
}

void cm_watchdog_expired(int progressed)
{
    cm_stop(progressed ? CM_END_BACKGROUND_STUCK : CM_END_CONTROL_STUCK);
}

char *cm_fault_text(char *to, const cm_fault_t *fault, bool gates_on)
{
    char *at = cm_text_hex(cm_text(to, "end "), (uint32_t)fault->code);
    at = cm_text_hex(cm_text(at, gates_on ? " gates on pc " : " gates off pc "), fault->pc);
    return cm_text_hex(cm_text(at, " address "), fault->address);
}
