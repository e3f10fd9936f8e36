#include "premagnetise.h"

#include "fault.h"

/* Of the parameter: what is found outside is none. */
#define PREMAGNETISE_RR_LOW  0.5f
#define PREMAGNETISE_RR_HIGH 1.8f

/* A parameter stands unless the start finds something further away: a start itself is off by 11 %
 * with 10-bit words (the smallest motor), by 13 % with a steep saturation (45 kW). */
#define PREMAGNETISE_RR_PU 0.15f

/* Rr_pu: of the parameter. */
static void take_rotor(premagnetise_state_t *st, float Rr_pu, float warm_pu)
{
    if ((Rr_pu > PREMAGNETISE_RR_LOW) && (Rr_pu < PREMAGNETISE_RR_HIGH)) {
        const float extra_pu = Rr_pu - warm_pu;
        st->Rr_extra_pu = (absf(extra_pu) > PREMAGNETISE_RR_PU) ? extra_pu : 0.0f;
    }
}

bool premagnetise_measure(const premagnetise_config_t *cfg, premagnetise_state_t *st,
                          const mode_in_t *in, float *i_ref_A, uint32_t *faults)
{
    const rs_measurement_in_t measured = {.i_A = in->meas->i_s_A.alpha,
                                          .u_V = in->u_s_V.alpha,
                                          .u_duty_V = in->acting->ended_V.alpha,
                                          .slot = in->slot};
    const rs_measurement_out_t rs =
        rs_measurement_step(&cfg->measurement, &st->measurement, &measured);
    if (rs.status == RS_MEASUREMENT_DONE) {
        st->Rs_delta_ohm = rs.Rs_ohm - cfg->Rs_ohm;
        take_rotor(st, rs.Rr_ohm / cfg->Rr_ohm, in->Rr_pu - st->Rr_extra_pu);
        if (cfg->identify_leg_loss) {
            st->leg_loss_found = true;
            st->leg_loss_pu = rs.lost_V / in->meas->u_dc_V;
            st->leg_threshold_A = rs.threshold_A;
            st->leg_tail_A = rs.tail_A;
        }
    } else if (rs.status == RS_MEASUREMENT_REFUSED) {
        *faults |= FAULT_STATOR_RESISTANCE;
    } else {
        /* busy, or nothing to do */
    }
    *i_ref_A = rs.i_ref_A;
    return rs.status == RS_MEASUREMENT_BUSY;
}
