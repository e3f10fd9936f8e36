/* Requests of the host link on parameters and their record: firmware/host/README.md. */
#ifndef UNIT_LINK_PARAMS_H
#define UNIT_LINK_PARAMS_H

#include "unit.h"

unit_link_status_t unit_link_param_info(const unit_t *unit, command_reader_t *body,
                                        command_writer_t *w);

unit_link_status_t unit_link_get(const unit_t *unit, command_reader_t *body, command_writer_t *w);

unit_link_status_t unit_link_set(unit_t *unit, command_reader_t *body);

/* After status REFUSED of a set: the two parameters that exclude each other, and the limit. */
void unit_link_put_refused(const unit_t *unit, command_writer_t *w);

/* What the store found at start, and what it does now. */
unit_link_status_t unit_link_store(const unit_t *unit, command_writer_t *w);

/* An entry of the record in the flash: its saved name, and the result of loading it. */
unit_link_status_t unit_link_store_entry(const unit_t *unit, const hal_devices_t *devices,
                                         command_reader_t *body, command_writer_t *w);

#endif
