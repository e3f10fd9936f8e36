/* Requests of the host link on the running drive: command, status, signals. */
#ifndef UNIT_LINK_DRIVE_H
#define UNIT_LINK_DRIVE_H

#include "unit.h"

unit_link_status_t unit_link_drive_command(unit_t *unit, command_reader_t *body);
unit_link_status_t unit_link_status(const unit_t *unit, command_writer_t *w);

unit_link_status_t unit_link_signal_info(command_reader_t *body, command_writer_t *w);
unit_link_status_t unit_link_sample(const unit_t *unit, command_reader_t *body,
                                    command_writer_t *w);

#endif
