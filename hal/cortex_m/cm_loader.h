/* The way from an application into the boot loader below it (hal/boot). */
#ifndef CM_LOADER_H
#define CM_LOADER_H

#include <stddef.h>

/* Operation of hal_devices_t; NULL in an image that stands above no loader. */
#ifdef ZH_ABOVE
#define CM_LOADER(call) (call)
#else
#define CM_LOADER(call) NULL
#endif

/* Opens the gates, leaves word for the loader to wait for an update, and resets the part; does not
 * return. */
void cm_loader_call(void *context);

#endif
