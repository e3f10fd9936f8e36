/* Defects on demand: how the image ends under each is a test (tests/pil). Only this port has them.
 */
#ifndef INJECT_H
#define INJECT_H

#include <stdint.h>

#include "unit.h"
#include "pil_protocol.h"

/* Code that takes the place of other code. */
typedef struct {
    uint32_t address;
    uint32_t halfwords; /* 0: nothing to do */
    uint16_t code[2];
} inject_patch_t;

/* A no-operation as long as the instruction at that address; an if-then block counts it as it
 * counts that instruction. Nothing unless a skip is asked for. */
inject_patch_t inject_skip(uint32_t what, uint32_t address);

/* Puts it in; called again, takes it out. */
void inject_exchange(inject_patch_t *patch);

/* Inside the control interrupt, at the period asked for; most do not return. */
void inject(uint32_t what, unit_t *unit);

/* At the end of the control interrupt that began at `entry` (MPS2_TIMER1), `age` periods after the
 * one asked for: it is made to last a period, or three. */
void inject_delay(uint32_t what, uint32_t age, uint32_t entry, uint32_t period_ticks);

/* In the background, `age` periods after the one asked for (before it `age` has wrapped). It stays
 * there when what is asked for is refused. */
void inject_background(uint32_t what, uint32_t age, unit_t *unit);

#endif
