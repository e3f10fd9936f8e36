/* The host link of the emulated board: first the content of a file of the host, then UART 0. */
#ifndef HOST_LINK_H
#define HOST_LINK_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int32_t file;      /* negative: none, or read to its end */
    uint8_t heard[64]; /* of the file */
    uint32_t heard_n;
    uint32_t heard_at;
} host_link_t;

/* Operations of hal_devices_t; context: host_link_t. */
bool host_link_read(void *context, uint8_t *byte);
uint32_t host_link_write(void *context, const uint8_t *data, uint32_t n);

#endif
