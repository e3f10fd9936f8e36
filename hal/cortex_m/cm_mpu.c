#include "cm_mpu.h"

#include "cm_registers.h"

/* Addresses and log2 of sizes, as symbols of the linker script. */
extern const char cm_flash_start[];
extern const char cm_flash_log2[];
extern const char cm_ram_start[];
extern const char cm_ram_log2[];
extern const char cm_data1_start[];
extern const char cm_data1_log2[];
extern const char cm_data2_start[];
extern const char cm_data2_log2[];
extern const char cm_guard_start[];
extern const char cm_guard_log2[];
#ifdef CM_FAST_CODE /* the port has a fast.ld */
extern const char cm_code_start[];
extern const char cm_code_log2[];
extern const char cm_code_gaps[];
#endif

#define NULL_PAGE_LOG2  8u /* only the vectors lie there, and the core reads them past the MPU */
#define PERIPHERAL_BASE 0x40000000u
#define PERIPHERAL_LOG2 29u

static uint32_t value_of(const char *symbol)
{
    return (uint32_t)(uintptr_t)symbol;
}

/* Where regions overlap the one with the higher number decides. */
static void region(uint32_t number, uint32_t base, uint32_t log2, uint32_t attributes)
{
    CM_MPU_RBAR = base | CM_MPU_RBAR_VALID | number;
    CM_MPU_RASR = attributes | ((log2 - 1u) << 1) | CM_MPU_RASR_ENABLE;
}

/* Off when there is none: a program before this one may have left it on. */
static void optional(uint32_t number, uint32_t base, uint32_t log2, uint32_t attributes)
{
    if (log2 != 0u) {
        region(number, base, log2, attributes);
    } else {
        CM_MPU_RBAR = CM_MPU_RBAR_VALID | number;
        CM_MPU_RASR = 0u;
    }
}

void cm_mpu_enable(void)
{
    const uint32_t data = CM_MPU_RASR_FULL | CM_MPU_RASR_XN | CM_MPU_RASR_MEMORY;
    const uint32_t nothing = CM_MPU_RASR_NO_ACCESS | CM_MPU_RASR_XN;
    CM_MPU_CTRL = 0u;
    region(0u, value_of(cm_flash_start), value_of(cm_flash_log2),
           CM_MPU_RASR_READ | CM_MPU_RASR_MEMORY);
    region(1u, value_of(cm_ram_start), value_of(cm_ram_log2), data);
    optional(2u, value_of(cm_data1_start), value_of(cm_data1_log2), data);
    optional(4u, value_of(cm_data2_start), value_of(cm_data2_log2), data);
#ifdef CM_FAST_CODE
    region(5u, value_of(cm_code_start), value_of(cm_code_log2),
           CM_MPU_RASR_READ | CM_MPU_RASR_MEMORY | (value_of(cm_code_gaps) << CM_MPU_RASR_SRD_Pos));
#else
    optional(5u, 0u, 0u, 0u);
#endif
    region(3u, PERIPHERAL_BASE, PERIPHERAL_LOG2,
           CM_MPU_RASR_FULL | CM_MPU_RASR_XN | CM_MPU_RASR_DEVICE);
    region(6u, 0u, NULL_PAGE_LOG2, nothing);
    region(7u, value_of(cm_guard_start), value_of(cm_guard_log2), nothing);
    CM_MPU_CTRL = CM_MPU_CTRL_ENABLE;
    cm_barrier();
}

int cm_mpu_is_stack_guard(uint32_t address)
{
    const uint32_t guard = value_of(cm_guard_start);
    return (address >= guard) && (address < guard + (1u << value_of(cm_guard_log2)));
}
