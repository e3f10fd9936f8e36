/* The plant behind two FIFOs (pil_protocol.h): what this board has in place of converters. */
#ifndef PLANT_H
#define PLANT_H

#include <stdbool.h>
#include <stdint.h>

#include "pil_protocol.h"
#include "unit.h"

typedef struct {
    int32_t from;
    int32_t to;
} plant_t;

/* Tells who this image is and hears what is asked of it. False: nobody there. */
bool plant_connect(plant_t *plant, pil_start_t *asked);

/* Whether the drive took its parameters. False: the plant is gone; so for the others. */
bool plant_ready(const plant_t *plant, bool refused);

/* The next sample and command. */
bool plant_ask(const plant_t *plant, pil_in_t *in);

/* Every signal of the period, with what `out` has of ticks already. */
bool plant_answer(const plant_t *plant, const unit_t *u, const hal_output_t *o, pil_out_t *out);

bool plant_leave(const plant_t *plant, const pil_end_t *end);

#endif
