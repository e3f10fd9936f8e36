#include "semihosting.h"

/* Operation numbers of the ARM semihosting specification. */
#define SYS_OPEN          0x01u
#define SYS_WRITE0        0x04u
#define SYS_WRITE         0x05u
#define SYS_READ          0x06u
#define SYS_EXIT_EXTENDED 0x20u
#define APPLICATION_EXIT  0x20026u

static uint32_t call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm("r0") = operation;
    register const void *r1 __asm("r1") = argument;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

int32_t semihosting_open(const char *path, uint32_t mode)
{
    uint32_t length = 0u;
    while (path[length] != '\0') {
        length++;
    }
    const uint32_t block[3] = {(uint32_t)(uintptr_t)path, mode, length};
    return (int32_t)call(SYS_OPEN, block);
}

/* Both answer how many bytes are still to do; a FIFO may hand over a part. */
static bool transfer(uint32_t operation, int32_t handle, uint32_t at, uint32_t n)
{
    while (n > 0u) {
        const uint32_t block[3] = {(uint32_t)handle, at, n};
        const uint32_t left = call(operation, block);
        if (left >= n) {
            return false;
        }
        at += n - left;
        n = left;
    }
    return true;
}

bool semihosting_read(int32_t handle, void *data, uint32_t n)
{
    return transfer(SYS_READ, handle, (uint32_t)(uintptr_t)data, n);
}

uint32_t semihosting_read_some(int32_t handle, void *data, uint32_t n)
{
    const uint32_t block[3] = {(uint32_t)handle, (uint32_t)(uintptr_t)data, n};
    const uint32_t left = call(SYS_READ, block);
    return (left <= n) ? (n - left) : 0u;
}

bool semihosting_write(int32_t handle, const void *data, uint32_t n)
{
    return transfer(SYS_WRITE, handle, (uint32_t)(uintptr_t)data, n);
}

void semihosting_print(const char *text)
{
    (void)call(SYS_WRITE0, text);
}

void semihosting_exit(uint32_t code)
{
    const uint32_t block[2] = {APPLICATION_EXIT, code};
    (void)call(SYS_EXIT_EXTENDED, block);
    while (true) {
    }
}
