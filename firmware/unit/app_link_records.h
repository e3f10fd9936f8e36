/* Requests of the host link on what was recorded: trace, last fault, the motor that was found. */
#ifndef APP_LINK_RECORDS_H
#define APP_LINK_RECORDS_H

#include "app.h"

app_link_status_t app_link_trace_setup(app_t *app, command_reader_t *body, command_writer_t *w);
app_link_status_t app_link_trace_status(const app_t *app, command_writer_t *w);
app_link_status_t app_link_trace_read(const app_t *app, command_reader_t *body,
                                      command_writer_t *w);

app_link_status_t app_link_commissioning(const app_t *app, command_writer_t *w);

app_link_status_t app_link_fault_log(const app_t *app, command_writer_t *w);
app_link_status_t app_link_fault_record(const app_t *app, command_writer_t *w);
app_link_status_t app_link_fault_read(const app_t *app, command_reader_t *body,
                                      command_writer_t *w);

#endif
