/* Barrier between the background and the control period that interrupts it: writes before this call
 * are in memory before writes after it. On one core only the compiler has to be held back, without
 * an instruction.
 */
#ifndef HANDOVER_H
#define HANDOVER_H

#include <stdatomic.h>

static inline void handover(void)
{
    atomic_signal_fence(memory_order_seq_cst);
}

#endif
