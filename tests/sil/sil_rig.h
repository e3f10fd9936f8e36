/* What the SIL tests share: a drive on the paper's board, words, one step. */
#ifndef SIL_RIG_H
#define SIL_RIG_H

#include "sil.h"
#include "unity.h"

#define MOTOR_DIR ZH_ROOT "/gain_tables/hasegawa2005"
#define BOARD     ZH_ROOT "/host_sim/boards/paper.toml"

#define MID  8192u  /* 14 bit */
#define U_DC 11592u /* 283 V of 400 V */

static inline zh_sil *open_drive(const char *overrides)
{
    zh_sil *drive = zh_sil_open(MOTOR_DIR, BOARD, overrides);
    TEST_ASSERT_NOT_NULL_MESSAGE(drive, zh_sil_error());
    return drive;
}

/* Standing still, dc link up, speed 0, nothing asked. */
static inline zh_sil_in quiet_input(void)
{
    return (zh_sil_in){.struct_size = sizeof(zh_sil_in),
                       .i_u = MID,
                       .i_v = MID,
                       .i_w = MID,
                       .u_uv = MID,
                       .u_vw = MID,
                       .u_dc = U_DC};
}

static inline zh_sil_out fresh_output(void)
{
    return (zh_sil_out){.struct_size = sizeof(zh_sil_out)};
}

/* n steps with the same input; the last output. */
static inline zh_sil_out step_n(zh_sil *drive, const zh_sil_in *in, unsigned n)
{
    zh_sil_out out = fresh_output();
    for (unsigned k = 0u; k < n; k++) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(ZH_OK, zh_sil_step(drive, in, &out), zh_sil_error());
    }
    return out;
}

/* To the state with the gates on: offsets first, then the run command. */
static inline zh_sil_out to_premagnetise(zh_sil *drive)
{
    zh_sil_in in = quiet_input();
    const zh_sil_out ready = step_n(drive, &in, 600u);
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_READY, ready.state);
    in.command = ZH_SIL_RUN;
    const zh_sil_out out = step_n(drive, &in, 2u);
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_PREMAGNETISE, out.state);
    TEST_ASSERT_EQUAL_UINT32(1u, out.gates_on);
    return out;
}

#endif
