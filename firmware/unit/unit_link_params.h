/* What the host link asks about parameters and their record: firmware/host/README.md. */
#ifndef UNIT_LINK_PARAMS_H
#define UNIT_LINK_PARAMS_H

#include "unit.h"

unit_link_status_t unit_link_param_info(const unit_t *unit, command_reader_t *body,
                                        command_writer_t *w);

unit_link_status_t unit_link_get(const unit_t *unit, command_reader_t *body, command_writer_t *w);

unit_link_status_t unit_link_set(unit_t *unit, command_reader_t *body);

/* Behind status REFUSED of a set: which two parameters exclude each other, and the limit. */
void unit_link_put_refused(const unit_t *unit, command_writer_t *w);

/* What the store found at start and does now. */
unit_link_status_t unit_link_store(const unit_t *unit, command_writer_t *w);

/* An entry of the record in the flash: what it was saved under, and what became of it. */
unit_link_status_t unit_link_store_entry(const unit_t *unit, const hal_devices_t *devices,
                                         command_reader_t *body, command_writer_t *w);

#endif
