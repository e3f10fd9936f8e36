/* The background's side of the host link, and the effect of each request: firmware/host/README.md.
 */
#ifndef UNIT_LINK_REQUESTS_H
#define UNIT_LINK_REQUESTS_H

#include "unit.h"

/* Reads the body, writes the answer's body after its status. For any status but OK nothing was
 * changed, and the written body must be dropped. */
unit_link_status_t unit_link_request(unit_t *unit, const hal_devices_t *devices, uint8_t op,
                                     command_reader_t *body);

/* Slice of the background: some bytes, at most one answer. */
void unit_link_background(unit_t *unit, const hal_devices_t *devices);

#endif
