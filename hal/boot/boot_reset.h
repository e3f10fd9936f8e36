/* The way out of the loader. */
#ifndef BOOT_RESET_H
#define BOOT_RESET_H

#include <stdint.h>

/* Starts the program whose vector table lies at this address. */
_Noreturn void boot_leave(uint32_t address);

#endif
