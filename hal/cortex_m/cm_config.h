/* What a port starts the application with: parameters and gain table in flash, generated from a
 * configuration and a board (tools/zh params). */
#ifndef CM_CONFIG_H
#define CM_CONFIG_H

#include "gain_table.h"
#include "params.h"

typedef struct {
    params_t params;
    const gain_table_t *table;
} cm_config_t;

extern const cm_config_t cm_config;

#endif
