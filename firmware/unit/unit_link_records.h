/* Requests of the host link on what was recorded: trace, last fault, the motor that was found. */
#ifndef UNIT_LINK_RECORDS_H
#define UNIT_LINK_RECORDS_H

#include "unit.h"

unit_link_status_t unit_link_trace_setup(unit_t *unit, command_reader_t *body, command_writer_t *w);
unit_link_status_t unit_link_trace_status(const unit_t *unit, command_writer_t *w);
unit_link_status_t unit_link_trace_read(const unit_t *unit, command_reader_t *body,
                                        command_writer_t *w);

unit_link_status_t unit_link_commissioning(const unit_t *unit, command_writer_t *w);

unit_link_status_t unit_link_fault_log(const unit_t *unit, command_writer_t *w);
unit_link_status_t unit_link_fault_record(const unit_t *unit, command_writer_t *w);
unit_link_status_t unit_link_fault_read(const unit_t *unit, command_reader_t *body,
                                        command_writer_t *w);

#endif
