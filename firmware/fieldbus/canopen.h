/* CANopen slave of one drive, CiA 301 with the profile CiA 402: NMT, heartbeat as producer and
 * consumer, SDO, two PDOs in each direction, EMCY, SYNC.
 *
 * Heartbeats of the consumer's node, and received PDOs, renew the command that stands. When neither
 * comes for fieldbus_timeout_s, or the heartbeat is lost, the run command ends.
 */
#ifndef CANOPEN_H
#define CANOPEN_H

#include "canopen_od.h"
#include "canopen_sdo.h"
#include "hal_can.h"

#define CANOPEN_PDOS 2u

typedef enum {
    CANOPEN_BOOT_UP = 0,
    CANOPEN_STOPPED = 4,
    CANOPEN_OPERATIONAL = 5,
    CANOPEN_PRE_OPERATIONAL = 127
} canopen_nmt_t;

/* A zeroed state is valid: it boots. */
typedef struct {
    canopen_nmt_t nmt;
    uint32_t node;
    canopen_od_t od;
    canopen_sdo_t sdo;
    uint32_t beat_us;  /* time of our last heartbeat */
    uint32_t heard_us; /* of the consumer's last one */
    bool hears;        /* that one is watched */
    bool lost;         /* and missing */
    uint32_t sent_us[CANOPEN_PDOS];
    uint32_t syncs[CANOPEN_PDOS]; /* since the last transmission */
    uint32_t told;                /* faults of the last EMCY */
    bool told_lost;
} canopen_t;

/* One slice of the background: at most one frame received. */
void canopen_background(canopen_t *co, const canopen_drive_t *drive, const hal_can_t *can);

#endif
