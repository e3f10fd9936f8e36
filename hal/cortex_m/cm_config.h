/* Start values of the application: parameters and gain table in flash, from a configuration, a
 * board and a motor (tools/generate_params.py).
 */
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
