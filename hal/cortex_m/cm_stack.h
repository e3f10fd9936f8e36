/* Stack watermark: painted at start, read at any time. */
#ifndef CM_STACK_H
#define CM_STACK_H

#include <stdint.h>

/* Paints everything below the caller's frame. */
void cm_stack_paint(void);

/* Largest number of bytes used since then. */
uint32_t cm_stack_used(void);

uint32_t cm_stack_size(void);

#endif
