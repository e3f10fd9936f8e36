/* SDO server: expedited and segmented transfers of one client. */
#ifndef CANOPEN_SDO_H
#define CANOPEN_SDO_H

#include "canopen_od.h"
#include "hal_can.h"

#define CANOPEN_DEVICE_NAME 0x1008u

typedef enum {
    CANOPEN_SDO_IDLE = 0,
    CANOPEN_SDO_UPLOAD = 1,
    CANOPEN_SDO_DOWNLOAD = 2
} canopen_sdo_phase_t;

/* A zeroed state is valid. */
typedef struct {
    canopen_sdo_phase_t phase;
    canopen_key_t key;
    uint8_t toggle;  /* of the next segment: 0 or 0x10 */
    uint32_t at;     /* bytes of the transfer so far */
    uint8_t byte[4]; /* a download's */
} canopen_sdo_t;

/* The answer to a request into *answer (data; length 8); false: none is due. */
CHECKED bool canopen_sdo(canopen_sdo_t *sdo, canopen_od_t *od, const canopen_drive_t *drive,
                         const hal_can_frame_t *request, hal_can_frame_t *answer);

#endif
