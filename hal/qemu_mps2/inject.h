/* Defects on demand: how the image ends under each is a test (tests/pil). Only this port has them.
 */
#ifndef INJECT_H
#define INJECT_H

#include <stdint.h>

#include "unit.h"
#include "pil_protocol.h"

/* A no-operation that takes the place of an instruction, or what it has taken the place of. */
typedef struct {
    uint32_t address;
    uint32_t halfwords; /* 0: nothing to do */
    uint16_t code[2];
} inject_patch_t;

/* Inside the control interrupt, at the period asked for, before its work; most defects do not
 * return. An instruction that is to be skipped is in *patch then. */
void inject(const pil_start_t *asked, unit_t *unit, inject_patch_t *patch);

/* Behind the work of the period: everything is as it was. */
void inject_take_out(inject_patch_t *patch);

/* At the end of the control interrupt that began at `entry` (MPS2_TIMER1), `age` periods after the
 * one asked for: it is made to last a period, or three. */
void inject_delay(uint32_t what, uint32_t age, uint32_t entry, uint32_t period_ticks);

/* In the background, `age` periods after the one asked for (before it `age` has wrapped). It stays
 * there when what is asked for is refused. */
void inject_background(uint32_t what, uint32_t age, unit_t *unit);

#endif
