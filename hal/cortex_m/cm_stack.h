/* How much of the stack was ever used: painted at start, read at leisure. */
#ifndef CM_STACK_H
#define CM_STACK_H

#include <stdint.h>

/* Everything below the caller's frame. */
void cm_stack_paint(void);

/* Bytes used at most since then. */
uint32_t cm_stack_used(void);

uint32_t cm_stack_size(void);

#endif
