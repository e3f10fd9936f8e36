/* The background's side of the host link, and what each request does: firmware/host/README.md.
 */
#ifndef APP_LINK_REQUESTS_H
#define APP_LINK_REQUESTS_H

#include "app.h"

/* Reads the body, writes the answer's body behind its status; anything but OK: nothing was changed,
 * and what was written is to be dropped. */
app_link_status_t app_link_request(app_t *app, const hal_devices_t *devices, uint8_t op,
                                   command_reader_t *body);

/* Slice of the background: some bytes, one answer at most. */
void app_link_background(app_t *app, const hal_devices_t *devices);

#endif
