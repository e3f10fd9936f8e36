/* Vector table of the loader, and the way from reset to main and on to the application. */
#include <stdint.h>

#include "boot_port.h"
#include "boot_reset.h"
#include "cm_registers.h"

extern uint32_t boot_stack_top[];
extern const uint32_t boot_data_load[];
extern uint32_t boot_data_start[];
extern uint32_t boot_data_end[];
extern uint32_t boot_bss_start[];
extern uint32_t boot_bss_end[];

void boot_reset(void);
_Noreturn void boot_enter(void);
_Noreturn void boot_stop(void);
void boot_nmi(void);
int main(void);

typedef void (*boot_vector_t)(void);

__attribute__((section(".vectors"), used)) static const boot_vector_t vectors[16] = {
    (boot_vector_t)(uintptr_t)boot_stack_top,
    boot_reset,
    boot_nmi,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
    boot_stop,
};

/* The FPU first: the compiler may save its registers on entry of whatever follows. */
__attribute__((naked)) void boot_reset(void)
{
    __asm volatile("cpsid i\n\t"
                   "movw r0, #0xED88\n\t" /* CPACR */
                   "movt r0, #0xE000\n\t"
                   "ldr r1, [r0]\n\t"
                   "orr r1, r1, #0x00F00000\n\t"
                   "str r1, [r0]\n\t"
                   "dsb\n\t"
                   "isb\n\t"
                   "b boot_enter\n\t");
}

__attribute__((used, noinline)) void boot_enter(void)
{
    boot_port_gates_off();
    CM_VTOR = (uint32_t)(uintptr_t)vectors;
    const uint32_t *from = boot_data_load;
    for (uint32_t *to = boot_data_start; to < boot_data_end; to++) {
        *to = *from;
        from++;
    }
    for (uint32_t *to = boot_bss_start; to < boot_bss_end; to++) {
        *to = 0u;
    }
    (void)main();
    boot_stop();
}

/* Dark until the next reset. */
void boot_stop(void)
{
    while (true) {
        boot_port_gates_off();
    }
}

void boot_nmi(void)
{
    if (!boot_port_forgive()) {
        boot_stop();
    }
}

void boot_leave(uint32_t address)
{
    const uint32_t *const application = (const uint32_t *)(uintptr_t)address;
    CM_VTOR = address;
    cm_barrier();
    __asm volatile("msr msp, %0\n\tbx %1" : : "r"(application[0]), "r"(application[1]));
    __builtin_unreachable();
}
