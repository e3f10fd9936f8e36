/* The fieldbuses of the emulated board: what their masters say, and when, comes from files of the
 * host; what the drive says goes into others (pil_protocol.h). Without such files, and in an image
 * without ZH_FIELDBUS, the plant's side commands. */
#ifndef BUS_H
#define BUS_H

#include <stdbool.h>
#include <stdint.h>

#include "unit.h"

#ifdef ZH_FIELDBUS
#include "fieldbus_slave.h"
#include "pil_protocol.h"

typedef struct {
    int32_t heard; /* file; negative: none, or read to its end */
    int32_t said;
    pil_frame_t next;
    bool waits; /* the next frame's time has not come, or not all of it was taken */
    uint32_t taken;
    const unit_t *unit; /* its periods are the clock */
} bus_line_t;

typedef struct {
    bool on;
    fieldbus_slave_t slave;
    bus_line_t modbus;
    bus_line_t can;
} bus_t;

/* Before the first control period. */
void bus_connect(bus_t *bus, const unit_t *unit);

/* In each round of the background: a slice of each bus, and the command that follows. */
void bus_background(bus_t *bus, unit_t *unit);

#else

typedef struct {
    bool on;
} bus_t;

static inline void bus_connect(bus_t *bus, const unit_t *unit)
{
    (void)bus;
    (void)unit;
}

static inline void bus_background(bus_t *bus, unit_t *unit)
{
    (void)bus;
    (void)unit;
}

#endif
#endif
