/* MPS2 board: CMSDK timers and watchdog, FPGA I/O block.
 *
 * Addresses and bits: Arm application note AN386; Cortex-M System Design Kit reference, chapters
 * on the APB timer, UART and watchdog. All of them count at 25 MHz.
 */
#ifndef MPS2_REGISTERS_H
#define MPS2_REGISTERS_H

#include <stdint.h>

#include "cm_registers.h"

#define MPS2_CLOCK_HZ 25000000u

#define MPS2_TIMER0     0x40000000u /* control period */
#define MPS2_TIMER1     0x40001000u /* free-running: what instructions are counted with */
#define MPS2_TIMER0_IRQ 8u

#define MPS2_TIMER_CTRL(base)   CM_REGISTER((base) + 0x0u)
#define MPS2_TIMER_VALUE(base)  CM_REGISTER((base) + 0x4u)
#define MPS2_TIMER_RELOAD(base) CM_REGISTER((base) + 0x8u)
#define MPS2_TIMER_INTCLR(base) CM_REGISTER((base) + 0xCu)
#define MPS2_TIMER_ENABLE       (1u << 0)
#define MPS2_TIMER_INTERRUPT    (1u << 3)

/* One half of the dual timer: opens the gates when the control interrupt hangs. A write to LOAD
 * begins anew. */
#define MPS2_HANG_LOAD   CM_REGISTER(0x40002000u)
#define MPS2_HANG_CTRL   CM_REGISTER(0x40002008u)
#define MPS2_HANG_INTCLR CM_REGISTER(0x4000200Cu)
#define MPS2_HANG_RUN    ((7u << 5) | (1u << 1)) /* on, periodic, interrupts; 32 bits */
#define MPS2_HANG_IRQ    10u

/* UART 0: the host link. One byte each way; full until it is read or gone. */
#define MPS2_UART_DATA    CM_REGISTER(0x40004000u)
#define MPS2_UART_STATE   CM_REGISTER(0x40004004u)
#define MPS2_UART_CTRL    CM_REGISTER(0x40004008u)
#define MPS2_UART_BAUDDIV CM_REGISTER(0x40004010u)
#define MPS2_UART_TXFULL  (1u << 0)
#define MPS2_UART_RXFULL  (1u << 1)
#define MPS2_UART_TXEN    (1u << 0)
#define MPS2_UART_RXEN    (1u << 1)

#define MPS2_WATCHDOG_LOAD   CM_REGISTER(0x40008000u)
#define MPS2_WATCHDOG_CTRL   CM_REGISTER(0x40008008u)
#define MPS2_WATCHDOG_INTCLR CM_REGISTER(0x4000800Cu)
#define MPS2_WATCHDOG_LOCK   CM_REGISTER(0x40008C00u)
#define MPS2_WATCHDOG_UNLOCK 0x1ACCE551u
#define MPS2_WATCHDOG_INTEN  (1u << 0) /* the NMI */
#define MPS2_WATCHDOG_RESEN  (1u << 1)

/* The board's two LEDs stand for lines: bit 0 gates enabled, bit 1 fault. */
#define MPS2_LEDS       CM_REGISTER(0x40028000u)
#define MPS2_LEDS_GATES (1u << 0)
#define MPS2_LEDS_FAULT (1u << 1)

#endif
