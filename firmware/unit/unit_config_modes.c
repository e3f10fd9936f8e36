#include "unit_config.h"

/* Loss of the supply: held above mains_lost_V by this; braking power per volt of dip over i_max. */
#define CONFIG_MAINS_HOLD_PU 1.15f
#define CONFIG_MAINS_GAIN_PU 1.2658228f

/* Times and shares that nobody has to tune; a slip of three times 1/Tr is where the rotor follows
 * direct current. */
#define CONFIG_FLYING_SETTLE_S    0.02f
#define CONFIG_FLYING_WINDOW_S    0.15f
#define CONFIG_WEAKEN_RAD_S       20.0f
#define CONFIG_ECONOMY_FROM_RAD_S 31.4f
#define CONFIG_MAINS_BACK_PU      1.1f
#define CONFIG_STANDS_TAU         3.0f
#define CONFIG_PULL_OUT_SHARE     0.8f
#define CONFIG_WEAK_FLUX_MIN_PU   0.1f
#define CONFIG_ECONOMY_FILTER_S   0.5f
#define CONFIG_ECONOMY_RISE_PU    0.7f /* of the rate that i_d_max_A begins with */
#define CONFIG_MAINS_BACK_S       0.1f
#define CONFIG_BRAKE_RISE_S       0.1f

/* The flux reference: field weakening and economy. */
static void config_flux_reference(flux_reference_params_t *r, const params_t *p)
{
    const float lambda_Wb = p->M_H * p->i_d_A;
    *r = (flux_reference_params_t){.voltage_share = p->weaken_share,
                                   .bandwidth_rad_s = CONFIG_WEAKEN_RAD_S,
                                   .pull_out_share = CONFIG_PULL_OUT_SHARE,
                                   .economy_min_pu = p->economy_flux_min,
                                   .economy_from_rad_s = CONFIG_ECONOMY_FROM_RAD_S,
                                   .economy_filter_s = CONFIG_ECONOMY_FILTER_S,
                                   .economy_slew_Wb_per_s = CONFIG_ECONOMY_RISE_PU * p->M_H *
                                                            p->i_d_max_A * p->Rr_ohm / p->Lr_H,
                                   .lambda_nominal_Wb = lambda_Wb,
                                   .lambda_min_Wb = CONFIG_WEAK_FLUX_MIN_PU * lambda_Wb,
                                   .i_q_max_A = p->i_q_max_A};
}

void unit_config_modes(modes_params_t *m, const params_t *p)
{
    const float mains_hold_V = CONFIG_MAINS_HOLD_PU * p->mains_lost_V;
    const float stands_rad_s = CONFIG_STANDS_TAU * p->Rr_ohm / p->Lr_H;
    const float lambda_Wb = p->M_H * p->i_d_A;
    m->control = (modes_control_t)p->control_mode;
    config_flux_reference(&m->flux, p);
    m->flying = (flying_start_params_t){.enable = p->flying_start != 0u,
                                        .current_A = p->i_d_A,
                                        .settle_s = CONFIG_FLYING_SETTLE_S,
                                        .window_s = CONFIG_FLYING_WINDOW_S,
                                        .stand_rad_s = stands_rad_s,
                                        .omega_max_rad_s = p->omega_max_rad_s};
    m->volts = (volts_per_hertz_params_t){.psi_Wb = p->Ls_H * p->i_d_A,
                                          .boost_V = p->vf_boost_V,
                                          .slew_rad_s2 = p->open_loop_slew_rad_s2,
                                          .i_max_A = p->i_max_A};
    m->mains = (mains_loss_params_t){.u_lost_V = p->mains_lost_V,
                                     .u_hold_V = mains_hold_V,
                                     .u_back_V = CONFIG_MAINS_BACK_PU * mains_hold_V,
                                     .back_s = CONFIG_MAINS_BACK_S,
                                     .gain_W_per_V = CONFIG_MAINS_GAIN_PU * p->i_max_A,
                                     .stop_rad_s = stands_rad_s,
                                     .lambda_Wb = lambda_Wb,
                                     .i_q_max_A = p->i_q_max_A};
    m->brake.current_A = p->dc_brake_A;
    m->brake.from_rad_s = NUM_TWO_PI * p->dc_brake_from_Hz;
    m->brake.least_s = p->dc_brake_s;
    m->brake.slew_A_per_s = p->dc_brake_A / CONFIG_BRAKE_RISE_S;
    m->dc_bandwidth_rad_s = p->current_bandwidth_rad_s;
}
