/* What a board supplies to the boot loader, in its folder boot/. Interrupts stay masked: everything
 * is polled. */
#ifndef BOOT_PORT_H
#define BOOT_PORT_H

#include "boot_flash.h"

/* Gate pins driven to their inactive level; first after reset, and of every fault. */
void boot_port_gates_off(void);

/* Serial port, 115200 baud. */
void boot_port_start(void);

/* Serial port off. Clocks and pins stay as the loader left them; the application sets its own. */
void boot_port_stop(void);

/* A received byte, if any. */
bool boot_port_receive(uint8_t *byte);

/* False when the transmitter has no room now. */
bool boot_port_put(uint8_t byte);

/* A non-maskable interrupt; false: nothing that can be lived with. */
bool boot_port_forgive(void);

/* Clocks of the core in a millisecond. */
uint32_t boot_port_ms_clocks(void);

/* Address of the slot BOOT_RUN. */
uint32_t boot_port_run_address(void);

extern const boot_flash_t boot_port_flash;

#endif
