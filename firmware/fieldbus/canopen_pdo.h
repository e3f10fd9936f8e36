/* PDOs by their mapping in the dictionary. */
#ifndef CANOPEN_PDO_H
#define CANOPEN_PDO_H

#include "canopen.h"

/* A frame of an RPDO's identifier, written to its objects; false: it is none of ours, or short. */
CHECKED bool canopen_pdo_received(canopen_t *co, const canopen_drive_t *drive,
                                  const hal_can_frame_t *frame);

/* TPDOs that are due: by event timer, or at a SYNC. */
void canopen_pdo_send(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can,
                      uint32_t now_us, bool sync);

#endif
