#include "cm_stack.h"

#define PAINT 0xA5A5A5A5u

extern uint32_t cm_stack_bottom[];
extern uint32_t cm_stack_top[];

void cm_stack_paint(void)
{
    uint32_t *sp;
    __asm volatile("mov %0, sp" : "=r"(sp));
    /* volatile: as a call of memset it would paint over memset's own frame. */
    for (volatile uint32_t *word = cm_stack_bottom; word < sp; word++) {
        *word = PAINT;
    }
}

uint32_t cm_stack_used(void)
{
    const uint32_t *word = cm_stack_bottom;
    while ((word < cm_stack_top) && (*word == PAINT)) {
        word++;
    }
    return (uint32_t)((const char *)cm_stack_top - (const char *)word);
}

uint32_t cm_stack_size(void)
{
    return (uint32_t)((const char *)cm_stack_top - (const char *)cm_stack_bottom);
}
