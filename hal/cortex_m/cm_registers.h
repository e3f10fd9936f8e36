/* Registers of the Cortex-M4 core that the ports use.
 *
 * Addresses and bits: ARMv7-M Architecture Reference Manual, chapters B3 (system control, NVIC,
 * MPU).
 */
#ifndef CM_REGISTERS_H
#define CM_REGISTERS_H

#include <stdint.h>

#define CM_REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))

#define CM_ICSR  CM_REGISTER(0xE000ED04u)
#define CM_VTOR  CM_REGISTER(0xE000ED08u)
#define CM_AIRCR CM_REGISTER(0xE000ED0Cu)
#define CM_CCR   CM_REGISTER(0xE000ED14u)
#define CM_SHPR2 CM_REGISTER(0xE000ED1Cu)
#define CM_SHPR3 CM_REGISTER(0xE000ED20u)
#define CM_SHCSR CM_REGISTER(0xE000ED24u)
#define CM_CFSR  CM_REGISTER(0xE000ED28u)
#define CM_HFSR  CM_REGISTER(0xE000ED2Cu)
#define CM_MMFAR CM_REGISTER(0xE000ED34u)
#define CM_BFAR  CM_REGISTER(0xE000ED38u)

#define CM_AIRCR_RESET   0x05FA0004u /* key and SYSRESETREQ */
#define CM_CCR_DIV_0_TRP (1u << 4)
#define CM_SHCSR_FAULTS  (7u << 16) /* usage, bus and memory-management faults of their own */

#define CM_CFSR_IACCVIOL   (1u << 0)
#define CM_CFSR_DACCVIOL   (1u << 1)
#define CM_CFSR_MSTKERR    (1u << 4)
#define CM_CFSR_MLSPERR    (1u << 5)
#define CM_CFSR_MMARVALID  (1u << 7)
#define CM_CFSR_BFARVALID  (1u << 15)
#define CM_CFSR_MEMORY     0x000000FFu
#define CM_CFSR_BUS        0x0000FF00u
#define CM_CFSR_UNDEFINSTR (1u << 16)
#define CM_CFSR_DIVBYZERO  (1u << 25)
#define CM_CFSR_USAGE      0xFFFF0000u

/* SysTick, polled: PASSED since it was last read. */
#define CM_SYST_CSR        CM_REGISTER(0xE000E010u)
#define CM_SYST_RVR        CM_REGISTER(0xE000E014u)
#define CM_SYST_CVR        CM_REGISTER(0xE000E018u)
#define CM_SYST_CSR_ENABLE (1u << 0)
#define CM_SYST_CSR_CORE   (1u << 2)
#define CM_SYST_CSR_PASSED (1u << 16)

#define CM_NVIC_ISER(n) CM_REGISTER(0xE000E100u + 4u * (n))
#define CM_NVIC_ISPR(n) CM_REGISTER(0xE000E200u + 4u * (n))
#define CM_NVIC_ICPR(n) CM_REGISTER(0xE000E280u + 4u * (n))
#define CM_NVIC_IPR(n)  (*(volatile uint8_t *)(uintptr_t)(0xE000E400u + (n)))

/* Interrupt priorities, 0 highest; parts have 4 priority bits or more. Only the timer that opens
 * the gates when the control interrupt hangs has priority 0. That is the reset value of all
 * interrupts, so a port changes all others. */
#define CM_LEVEL_HANG    0u
#define CM_LEVEL_CONTROL 1u

#define CM_MPU_CTRL CM_REGISTER(0xE000ED94u)
#define CM_MPU_RBAR CM_REGISTER(0xE000ED9Cu)
#define CM_MPU_RASR CM_REGISTER(0xE000EDA0u)

#define CM_MPU_CTRL_ENABLE    (1u << 0)
#define CM_MPU_RBAR_VALID     (1u << 4)
#define CM_MPU_RASR_ENABLE    (1u << 0)
#define CM_MPU_RASR_XN        (1u << 28)
#define CM_MPU_RASR_NO_ACCESS (0u << 24)
#define CM_MPU_RASR_FULL      (1u << 24) /* privileged only */
#define CM_MPU_RASR_READ      (5u << 24) /* privileged only */
#define CM_MPU_RASR_MEMORY    (1u << 17) /* normal, write-through: flash and RAM */
#define CM_MPU_RASR_DEVICE    (1u << 16)
#define CM_MPU_RASR_SRD_Pos   8u /* a bit for each eighth of the region: not of it */

static inline void cm_barrier(void)
{
    __asm volatile("dsb\n\tisb" ::: "memory");
}

/* Between two rounds of the background: what an interrupt changed meanwhile is read again. */
static inline void cm_background_sync(void)
{
    __asm volatile("" ::: "memory");
}

static inline void cm_irq_off(void)
{
    __asm volatile("cpsid i" ::: "memory");
}

static inline void cm_irq_on(void)
{
    __asm volatile("cpsie i" ::: "memory");
}

static inline uint32_t cm_ipsr(void)
{
    uint32_t ipsr;
    __asm volatile("mrs %0, ipsr" : "=r"(ipsr));
    return ipsr;
}

static inline void cm_nvic_enable(uint32_t irq, uint32_t level)
{
    CM_NVIC_IPR(irq) = (uint8_t)(level << 4);
    CM_NVIC_ISER(irq / 32u) = 1u << (irq % 32u);
}

/* Clears a pending interrupt. */
static inline void cm_nvic_forget(uint32_t irq)
{
    CM_NVIC_ICPR(irq / 32u) = 1u << (irq % 32u);
}

#endif
