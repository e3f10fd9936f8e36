/* CiA 402 on this drive: what its objects mean. */
#ifndef CANOPEN_402_H
#define CANOPEN_402_H

#include "canopen_od.h"

typedef enum {
    CANOPEN_LIVE_ERROR_REGISTER,
    CANOPEN_LIVE_ERROR_CODE,
    CANOPEN_LIVE_STATUSWORD,
    CANOPEN_LIVE_VELOCITY_DEMAND,
    CANOPEN_LIVE_VELOCITY,
    CANOPEN_LIVE_MODE,
    CANOPEN_LIVE_RATED_TORQUE, /* mNm: 1000 per mille of the torque objects */
    CANOPEN_LIVE_TORQUE,
    CANOPEN_LIVES
} canopen_live_t;

uint32_t canopen_402_live(const canopen_od_t *od, const canopen_drive_t *drive,
                          canopen_live_t which);

/* Control word, target or mode as they would be in *next; all or nothing. */
CHECKED uint32_t canopen_402_apply(canopen_od_t *od, const canopen_drive_t *drive,
                                   const canopen_od_t *next, bool controlled);

#endif
