/* In place of hal/cortex_m's, for drivers that hold interrupts back: a test sees when. */
#ifndef CM_REGISTERS_H
#define CM_REGISTERS_H

#include <stdint.h>

void cm_irq_off(void);
void cm_irq_on(void);
void cm_nvic_forget(uint32_t irq);

#endif
