/* Defects on demand, for tests of how the image ends under each (tests/pil). Only this port has
 * them.
 */
#ifndef INJECT_H
#define INJECT_H

#include <stdint.h>

#include "unit.h"
#include "pil_protocol.h"

/* A no-operation that replaces an instruction, or the instruction it replaced. */
typedef struct {
    uint32_t address;
    uint32_t halfwords; /* 0: nothing to do */
    uint16_t code[2];
} inject_patch_t;

/* Inside the control interrupt, at the requested period, before its work; most defects do not
 * return. For an instruction to skip, *patch then holds it. */
void inject(const pil_start_t *asked, unit_t *unit, inject_patch_t *patch);

/* After the work of the period: restores everything. */
void inject_take_out(inject_patch_t *patch);

/* At the end of the control interrupt that began at `entry` (MPS2_TIMER1), `age` periods after the
 * one asked for: it is made to last a period, or three. */
void inject_delay(uint32_t what, uint32_t age, uint32_t entry, uint32_t period_ticks);

/* In the background, `age` periods after the requested one (before it, `age` has wrapped). Stays
 * there when the request is refused. */
void inject_background(uint32_t what, uint32_t age, unit_t *unit);

#endif
