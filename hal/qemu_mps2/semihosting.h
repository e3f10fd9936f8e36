/* Calls to the host through the emulator (ARM semihosting): files, text, the end of the run. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdbool.h>
#include <stdint.h>

#define SEMIHOSTING_READ  1u /* fopen's "rb" and "wb" */
#define SEMIHOSTING_WRITE 5u

/* Handle, or -1. */
int32_t semihosting_open(const char *path, uint32_t mode);

/* All n bytes; false when the other end is gone. */
bool semihosting_read(int32_t handle, void *data, uint32_t n);
bool semihosting_write(int32_t handle, const void *data, uint32_t n);

/* Of a file: up to n bytes, how many; 0 at its end. */
uint32_t semihosting_read_some(int32_t handle, void *data, uint32_t n);

/* To the emulator's standard error. */
void semihosting_print(const char *text);

_Noreturn void semihosting_exit(uint32_t code);

#endif
