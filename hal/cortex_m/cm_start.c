/* Vector table of the core and the way from reset to main. */
#include <stddef.h>
#include <stdint.h>

#include "cm_fault.h"
#include "cm_image.h"
#include "cm_mpu.h"
#include "cm_port.h"
#include "cm_registers.h"
#include "cm_stack.h"

extern uint32_t cm_stack_top[];
extern const uint32_t cm_data_load[];
extern uint32_t cm_data_start[];
extern uint32_t cm_data_end[];
extern uint32_t cm_bss_start[];
extern uint32_t cm_bss_end[];
#ifdef CM_FAST_CODE /* the port has a fast.ld */
extern const uint32_t cm_fast_load[];
extern uint32_t cm_fast_start[];
extern uint32_t cm_fast_end[];
#endif

void cm_reset(void);
_Noreturn void cm_start(void);
void cm_fault_handler(void);
void cm_unexpected(void);

__attribute__((section(".vectors.core"), used)) static const cm_vector_t vectors[16] = {
    (cm_vector_t)(uintptr_t)cm_stack_top,
    cm_reset,
    port_nmi,
    cm_fault_handler, /* hard */
    cm_fault_handler, /* memory management */
    cm_fault_handler, /* bus */
    cm_fault_handler, /* usage */
    cm_unexpected,
    cm_unexpected,
    cm_unexpected,
    cm_unexpected,
    cm_unexpected, /* SVCall */
    cm_unexpected,
    cm_unexpected,
    cm_unexpected, /* PendSV */
    cm_unexpected, /* SysTick */
};

void cm_unexpected(void)
{
    cm_stop(CM_END_UNEXPECTED_INTERRUPT);
}

/* The FPU first: the compiler may save its registers on entry of whatever follows. */
__attribute__((naked)) void cm_reset(void)
{
    __asm volatile("cpsid i\n\t"
                   "movw r0, #0xED88\n\t" /* CPACR */
                   "movt r0, #0xE000\n\t"
                   "ldr r1, [r0]\n\t"
                   "orr r1, r1, #0x00F00000\n\t"
                   "str r1, [r0]\n\t"
                   "dsb\n\t"
                   "isb\n\t"
                   "b cm_start\n\t");
}

static void copy(const uint32_t *from, uint32_t *to, const uint32_t *end)
{
    while (to < end) {
        *to = *from;
        to++;
        from++;
    }
}

__attribute__((used, noinline)) void cm_start(void)
{
    port_gates_off();
    port_early();
    CM_VTOR = (uint32_t)(uintptr_t)vectors;
    CM_CCR |= CM_CCR_DIV_0_TRP;
    CM_SHCSR |= CM_SHCSR_FAULTS;

    copy(cm_data_load, cm_data_start, cm_data_end);
#ifdef CM_FAST_CODE
    copy(cm_fast_load, cm_fast_start, cm_fast_end);
#endif
    for (uint32_t *to = cm_bss_start; to < cm_bss_end; to++) {
        *to = 0u;
    }
    cm_stack_paint();
    cm_mpu_enable();
    if (!cm_image_intact()) {
        cm_stop(CM_END_IMAGE_CHANGED);
    }
    (void)main();
    cm_stop(CM_END_HARD_FAULT);
}
