/* Hasegawa's estimator: full-order observer with gain table, and eps1-modified speed adaptation. */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "estimate.h"
#include "gain_table.h"
#include "observer.h"
#include "speed_adaptation.h"

typedef struct {
    observer_config_t observer;
    speed_adaptation_config_t adaptation;
    const gain_table_t *table; /* NULL: L = 0 */
    float lambda_min_Wb;       /* flux below which its frequency is not measured by itself */
    float table_end_rad_s;     /* from here on L grows with the speed; FLT_MAX: it holds */
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    observer_state_t observer;
    speed_adaptation_state_t adaptation;
    observer_gain_t gain; /* of the last step */
} estimator_state_t;

typedef struct {
    float period_s;
    float i_max_A;
    float lambda_min_Wb;
    float lambda_max_Wb;
    observer_method_t method;
    speed_adaptation_params_t adaptation;
    bool gain_enable;       /* false: L = 0, and table may be NULL */
    bool gain_beyond_table; /* L grows with the speed beyond the table's end (field weakening) */
} estimator_params_t;

/* False: some number, the motor or the table is refused; then *cfg must not be used. */
CHECKED bool estimator_init(estimator_config_t *cfg, const estimator_params_t *params,
                            const motor_model_t *motor, const gain_table_t *table);

#endif
