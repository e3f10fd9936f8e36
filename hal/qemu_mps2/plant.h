/* The plant behind two FIFOs (pil_protocol.h): this board has it in place of converters. */
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

/* Sends the identity of this image and receives the request. False: no plant. */
bool plant_connect(plant_t *plant, pil_start_t *asked);

/* Reports whether the drive accepted its parameters. False: the plant is gone; the same for the
 * other functions. */
bool plant_ready(const plant_t *plant, bool refused);

/* The next sample and command. */
bool plant_ask(const plant_t *plant, pil_in_t *in);

/* Sends every signal of the period, with the ticks already in `out`. */
bool plant_answer(const plant_t *plant, const unit_t *u, const hal_output_t *o, pil_out_t *out);

bool plant_leave(const plant_t *plant, const pil_end_t *end);

#endif
