/* Memory protection: code and constants are read-only, RAM and devices do not execute, and neither
 * address 0 nor the word below the stack can be touched.
 *
 * Regions from the linker script (sections.ld); everything outside them faults.
 */
#ifndef CM_MPU_H
#define CM_MPU_H

#include <stdint.h>

void cm_mpu_enable(void);

/* The address lies in the guard below the stack. */
int cm_mpu_is_stack_guard(uint32_t address);

#endif
