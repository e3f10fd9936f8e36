/* What a Cortex-M port supplies to the start-up and the fault handlers. */
#ifndef CM_PORT_H
#define CM_PORT_H

#include "cm_fault.h"

typedef void (*cm_vector_t)(void);

/* Opens the gates at once, from any context, also before main: the first action of every fault
 * handler. */
void port_gates_off(void);

/* Directly after reset, before the image is checked and with nothing in RAM: sets the gate pins
 * inactive, as far as the part can before its clocks are set up. */
void port_early(void);

/* Reports why the drive stopped, then stays there, or resets, with the gates off. */
_Noreturn void port_halt(const cm_fault_t *fault);

/* Called with .data and .bss ready, FPU and MPU on, interrupts masked. Must not return. */
int main(void);

/* NMI: the watchdog's, where it has one. */
void port_nmi(void);

/* The port's interrupts follow the core's 16 vectors: section ".vectors.irq". */

#endif
