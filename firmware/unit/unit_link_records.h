/* Requests of the host link on records: trace, last fault, identified motor. */
#ifndef UNIT_LINK_RECORDS_H
#define UNIT_LINK_RECORDS_H

#include "unit.h"

unit_link_status_t unit_link_trace_setup(unit_t *unit, command_reader_t *body, command_writer_t *w);

/* Starts a flight, or stops it; rows of one from the number asked for, those before are freed. */
unit_link_status_t unit_link_flight_arm(unit_t *unit, command_reader_t *body);
unit_link_status_t unit_link_flight_read(unit_t *unit, command_reader_t *body, command_writer_t *w);

/* Answers requests of the recorders; NO_SUCH_OP for every other request. */
unit_link_status_t unit_link_records(const unit_t *unit, uint8_t op, command_reader_t *body,
                                     command_writer_t *w);

#endif
