/* Between background and control period, which interrupts it: what is written before this call is
 * in memory before what is written after it. One core: no instruction, only the compiler is held.
 */
#ifndef HANDOVER_H
#define HANDOVER_H

#include <stdatomic.h>

static inline void handover(void)
{
    atomic_signal_fence(memory_order_seq_cst);
}

#endif
