/* The background's side of the host link, and what each request does: firmware/host/README.md.
 */
#ifndef UNIT_LINK_REQUESTS_H
#define UNIT_LINK_REQUESTS_H

#include "unit.h"

/* Reads the body, writes the answer's body behind its status; anything but OK: nothing was changed,
 * and what was written is to be dropped. */
unit_link_status_t unit_link_request(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                                     command_reader_t *body);

/* Slice of the background: some bytes, one answer at most. */
void unit_link_background(unit_t *unit, const hal_devices_t *devices);

#endif
