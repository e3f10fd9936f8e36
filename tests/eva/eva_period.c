/* The whole control period of a drive with the default parameters and no gain table, started by
 * unit_init, period after period, with any words and any command. No stage of `zh test`: it is not
 * proven (firmware/guard/README.md). `tools/zh python -m zerohertz.testing.eva eva_period`.
 */
#include "any.h"
#include "unit.h"

void eva_main(void);

static unit_t unit;

static hal_sample_t any_sample(void)
{
    hal_sample_t sample = {.i_u_counts = (uint16_t)any_word(), .i_v_counts = (uint16_t)any_word()};
    sample.i_w_counts = (uint16_t)any_word();
    sample.u_uv_counts = (uint16_t)any_word();
    sample.u_vw_counts = (uint16_t)any_word();
    sample.u_dc_counts = (uint16_t)any_word();
    sample.late_periods = (uint16_t)any_word();
    sample.inputs = any_word();
    return sample;
}

void eva_main(void)
{
    static params_t params;
    params_default(&params);
    params.observer_gain_enable = 0u;
    if (!unit_init(&unit, &params, (const gain_table_t *)0)) {
        return;
    }
    while (any_bool()) {
        unit_command_t command = {.command = any_word(), .count = any_word()};
        command.omega_m_ref_rad_s = any_float();
        command.torque_ref_Nm = any_float();
        unit_post_command(&unit, &command);
        const hal_sample_t sample = any_sample();
        hal_output_t output;
        unit_control_period(&unit, &sample, &output);
    }
}
