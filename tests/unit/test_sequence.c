/* Who may open the gates: every state with every event, and the path from start to RUN. */
#include "sequence.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "fault_reaction.h"
#include "unity.h"

#define RUN   SEQUENCE_CMD_RUN
#define RESET SEQUENCE_CMD_FAULT_RESET
#define OFF   SEQUENCE_CMD_TORQUE_OFF
#define FIND  SEQUENCE_CMD_COMMISSION
#define NM    SEQUENCE_CMD_TORQUE_MODE
#define RAMPS FAULT_COMMAND_TIMEOUT /* of those that allow a ramp */

static sequence_config_t cfg;
static sequence_state_t st;

static sequence_out_t step(uint32_t command, uint32_t faults)
{
    const sequence_in_t in = {.command = command, .faults = faults, .i_raw_A = {0.1f, -0.2f, 0.3f}};
    return sequence_step(&cfg, &st, &in);
}

void setUp(void)
{
    st = (sequence_state_t){0};
    cfg =
        (sequence_config_t){.offset_periods = 3u, .premagnetise_periods = 2u, .offset_max_A = 0.5f};
}

void tearDown(void)
{
}

static void go_ready(void)
{
    for (int k = 0; k < 10; k++) {
        (void)step(0u, 0u);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
}

static void go_run(void)
{
    go_ready();
    for (int k = 0; k < 10; k++) {
        (void)step(RUN, 0u);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, st.id);
}

static void test_start_averages_offsets_and_waits_for_the_run_command(void)
{
    (void)step(0u, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_FALSE(step(0u, 0u).offsets_ready);
        TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
    }
    const sequence_out_t out = step(0u, 0u);
    TEST_ASSERT_TRUE(out.offsets_ready);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.1f, st.offset_A.u);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, -0.2f, st.offset_A.v);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.3f, st.offset_A.w);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_FALSE(step(0u, 0u).offsets_ready); /* once */
}

static void test_one_period_is_an_average_too(void)
{
    cfg.offset_periods = 1u;
    st = (sequence_state_t){.id = SEQUENCE_SELF_TEST};
    const sequence_in_t in = {.i_raw_A = {0.25f, 0.0f, -0.25f}};
    (void)sequence_step(&cfg, &st, &in);
    TEST_ASSERT_TRUE(sequence_step(&cfg, &st, &in).offsets_ready);
    TEST_ASSERT_EQUAL_FLOAT(0.25f, st.offset_A.u);
    TEST_ASSERT_EQUAL_FLOAT(-0.25f, st.offset_A.w);
}

static void test_no_averaging_leaves_the_offsets_alone(void)
{
    cfg.offset_periods = 0u;
    (void)step(0u, 0u);
    const sequence_out_t out = step(0u, 0u);
    TEST_ASSERT_FALSE(out.offsets_ready);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
}

static void test_an_impossible_offset_is_a_fault(void)
{
    const uvw_t bad[4] = {
        {0.6f, 0.0f, 0.0f}, {0.0f, -0.6f, 0.0f}, {0.0f, 0.0f, 0.6f}, {NAN, 0.0f, 0.0f}};
    for (int n = 0; n < 4; n++) {
        setUp();
        for (int k = 0; k < 6; k++) {
            const sequence_in_t in = {.i_raw_A = bad[n]};
            TEST_ASSERT_FALSE(sequence_step(&cfg, &st, &in).offsets_ready);
        }
        TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
        TEST_ASSERT_EQUAL_UINT32(FAULT_CURRENT_OFFSET, st.faults);
    }
}

static void test_run_builds_flux_first(void)
{
    go_ready();
    sequence_out_t out = step(RUN, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, st.id);
    TEST_ASSERT_EQUAL(DRIVE_PREMAGNETISE, out.mode);
    TEST_ASSERT_TRUE(out.gates_on);
    (void)step(RUN, 0u);
    (void)step(RUN, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, st.id);
    out = step(RUN, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, st.id);
    TEST_ASSERT_EQUAL(DRIVE_RUN, out.mode);
    TEST_ASSERT_TRUE(out.gates_on);
}

static void test_releasing_run_closes_the_gates_in_both_states(void)
{
    go_ready();
    (void)step(RUN, 0u);
    TEST_ASSERT_FALSE(step(0u, 0u).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    setUp();
    go_run();
    TEST_ASSERT_FALSE(step(0u, 0u).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
}

/* run is a level: held from the first period on, the drive starts once its self-test is done. */
static void test_a_run_command_standing_at_start_runs_after_the_self_test(void)
{
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_TRUE(step(RUN, 0u).gates_on);
}

static void test_a_fault_closes_the_gates_in_the_same_period_and_latches(void)
{
    go_run();
    TEST_ASSERT_FALSE(step(RUN, FAULT_OVER_CURRENT).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
    (void)step(RUN, FAULT_DC_OVER_VOLTAGE);
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_CURRENT | FAULT_DC_OVER_VOLTAGE, st.faults);
    for (int k = 0; k < 20; k++) {
        TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
}

static void test_a_warning_is_latched_and_leaves_the_gates_on_until_it_is_reset(void)
{
    go_run();
    TEST_ASSERT_TRUE(step(RUN, FAULT_PERIOD_LATE).gates_on);
    TEST_ASSERT_TRUE(step(RUN, 0u).gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_PERIOD_LATE, st.faults);
    TEST_ASSERT_TRUE(step(RUN | RESET, 0u).gates_on);
    TEST_ASSERT_EQUAL_UINT32(0u, st.faults);
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, st.id);
}

static void test_a_warning_stands_beside_the_fault_that_follows(void)
{
    go_run();
    (void)step(RUN, FAULT_PERIOD_LATE);
    TEST_ASSERT_FALSE(step(RUN, FAULT_PERIOD_LATE | FAULT_PERIOD_OVERRUN).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
    TEST_ASSERT_EQUAL_UINT32(FAULT_PERIOD_LATE | FAULT_PERIOD_OVERRUN, st.faults);
}

static void test_reset_needs_an_edge_and_the_cause_gone(void)
{
    go_run();
    (void)step(RESET, FAULT_OVER_CURRENT); /* the edge comes with the fault still there */
    (void)step(RESET, 0u);                 /* level only */
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
    (void)step(0u, 0u);
    (void)step(RESET, FAULT_OVER_CURRENT);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
    (void)step(0u, 0u);
    (void)step(RESET, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
    TEST_ASSERT_EQUAL_UINT32(0u, st.faults);
    /* The offsets are averaged anew, not added to the old sum. */
    sequence_out_t out = {0};
    for (int k = 0; k < 4; k++) {
        out = step(0u, 0u);
    }
    TEST_ASSERT_TRUE(out.offsets_ready);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.1f, st.offset_A.u);
}

static void test_a_refused_configuration_cannot_be_reset(void)
{
    go_ready();
    (void)step(0u, FAULT_CONFIG);
    (void)step(RESET, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
}

static void test_torque_off_wins_over_run_and_needs_run_again(void)
{
    go_run();
    TEST_ASSERT_FALSE(step(RUN | OFF, 0u).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_TORQUE_OFF, st.id);
    (void)step(RUN, 0u);
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    (void)step(0u, 0u);
    TEST_ASSERT_TRUE(step(RUN, 0u).gates_on);
}

static void test_torque_off_does_not_skip_the_self_test(void)
{
    (void)step(OFF, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
    (void)step(OFF, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
    for (int k = 0; k < 6; k++) {
        (void)step(OFF, 0u);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_TORQUE_OFF, st.id);
}

static void test_a_steady_run_changes_nothing(void)
{
    go_run();
    const sequence_state_t before = st;
    TEST_ASSERT_TRUE(sequence_goes_on(&st, RUN, 0u));
    TEST_ASSERT_FALSE(sequence_goes_on(&st, RUN | NM, 0u));           /* the aim changes */
    TEST_ASSERT_FALSE(sequence_goes_on(&st, RUN, FAULT_PERIOD_LATE)); /* to be latched */
    const sequence_out_t out = step(RUN, 0u);
    TEST_ASSERT_EQUAL(DRIVE_RUN, out.mode);
    TEST_ASSERT_TRUE(out.gates_on);
    TEST_ASSERT_FALSE(out.offsets_ready);
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
}

/* A state no transition leads to: the short way through a steady run must not keep it alive. */
static void test_a_blocked_run_ends(void)
{
    go_run();
    st.run_blocked = true;
    TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
}

static bool powered(uint32_t id)
{
    return (id == SEQUENCE_PREMAGNETISE) || (id == SEQUENCE_RUN) || (id == SEQUENCE_RAMP_DOWN) ||
           (id == SEQUENCE_COMMISSIONING);
}

/* One of each reaction, none, and a bit that nobody knows. */
static const uint32_t fault_class[] = {0u,    FAULT_PERIOD_LATE,  FAULT_DERATED,
                                       RAMPS, FAULT_OVER_CURRENT, 1u << 31};

/* What has to hold after any step from any memory whatever, reachable or not. */
static void assert_step_is_safe(const sequence_state_t *before, const sequence_in_t *in)
{
    const bool goes_on = sequence_goes_on(before, in->command, in->faults);
    const sequence_out_t out = sequence_step(&cfg, &st, in);
    if (goes_on) { /* then the step need not be taken */
        TEST_ASSERT_EQUAL_MEMORY(before, &st, sizeof st);
        TEST_ASSERT_EQUAL(DRIVE_RUN, out.mode);
        TEST_ASSERT_EQUAL(((in->command & NM) != 0u) ? DRIVE_AIM_TORQUE : DRIVE_AIM_SPEED, out.aim);
    }
    const uint32_t faults = before->faults | in->faults;
    const bool was_on = powered((uint32_t)before->id) && (before->energised != 0u);
    TEST_ASSERT_EQUAL(out.gates_on, out.mode != DRIVE_OFF);
    TEST_ASSERT_EQUAL(out.gates_on, powered((uint32_t)st.id));
    TEST_ASSERT_EQUAL(out.gates_on, st.energised == SEQUENCE_ENERGISED);
    TEST_ASSERT_EQUAL(!out.gates_on, st.energised == 0u);
    TEST_ASSERT_EQUAL(st.id == SEQUENCE_RAMP_DOWN, out.aim == DRIVE_AIM_STOP);
    if (!out.gates_on) {
        return;
    }
    TEST_ASSERT_EQUAL_HEX32(0u, in->command & OFF);
    TEST_ASSERT_EQUAL_HEX32(0u, fault_opening(faults));
    if (was_on) {
        TEST_ASSERT_EQUAL_HEX32(SEQUENCE_ENERGISED, before->energised);
        TEST_ASSERT_TRUE((fault_stopping(faults) == 0u) || (st.id == SEQUENCE_RAMP_DOWN));
        return;
    }
    /* They went on in this step: out of READY, on a start command, with nothing in the way. */
    TEST_ASSERT_EQUAL(SEQUENCE_READY, before->id);
    TEST_ASSERT_EQUAL_HEX32(0u, before->energised);
    TEST_ASSERT_EQUAL_HEX32(0u, fault_stopping(faults));
    TEST_ASSERT_FALSE(before->run_blocked);
    TEST_ASSERT_TRUE((in->command & (RUN | FIND)) != 0u);
    TEST_ASSERT_EQUAL(((in->command & RUN) != 0u) ? SEQUENCE_PREMAGNETISE : SEQUENCE_COMMISSIONING,
                      st.id);
}

/* All flags, commands and faults against one memory. */
static uint32_t all_events(const sequence_state_t *before)
{
    uint32_t n = 0u;
    for (uint32_t event = 0u; event < 8u * 32u * 6u; event++) {
        const sequence_in_t in = {.premagnetising = (event & 1u) != 0u,
                                  .standing = (event & 2u) != 0u,
                                  .commissioned = (event & 4u) != 0u,
                                  .command = (event / 8u) % 32u,
                                  .faults = fault_class[event / 256u]};
        st = *before;
        assert_step_is_safe(before, &in);
        n++;
    }
    return n;
}

/* Every number a memory could hold, upset ones included: 0..15 and a wild state, the word whole,
 * absent, one bit off and all ones, each class of fault latched, each way to be configured. */
static void test_nothing_but_the_one_transition_turns_the_gates_on(void)
{
    static const uint32_t words[] = {0u, SEQUENCE_ENERGISED, SEQUENCE_ENERGISED ^ 0x100u,
                                     0xFFFFFFFFu};
    uint32_t n = 0u;
    for (uint32_t k = 0u; k < 17u * 4u * 6u * 2u * 2u * 2u * 4u; k++) {
        uint32_t left = k;
        const uint32_t id = left % 17u;
        left /= 17u;
        const uint32_t word = words[left % 4u];
        left /= 4u;
        const uint32_t latched = fault_class[left % 6u];
        left /= 6u;
        cfg.stop = ((left & 8u) != 0u) ? SEQUENCE_STOP_RAMP : SEQUENCE_STOP_COAST;
        cfg.coast_periods = ((left & 16u) != 0u) ? 2u : 0u;
        const sequence_state_t before = {.id = (sequence_id_t)((id < 16u) ? id : 0x1000003u),
                                         .energised = word,
                                         .faults = latched,
                                         .run_blocked = (left & 1u) != 0u,
                                         .periods = ((left & 2u) != 0u) ? 9u : 0u,
                                         .last_command = ((left & 4u) != 0u) ? RUN : 0u};
        n += all_events(&before);
    }
    printf("%u combinations of memory and event\n", (unsigned)n);
}

/* What the machine can really be in: closed under all events, from the zeroed memory on. Times are
 * 2 periods. Every state is met, and out of each the drive can be made ready again. */
#define MET_MAX (10u * 4u * 16u * 16u * 2u)
static sequence_state_t met[MET_MAX];
static uint32_t met_n;
static bool known[MET_MAX];

/* One number for each memory; a memory that has none is one nobody thought of. */
static uint32_t number_of(const sequence_state_t *m)
{
    uint32_t classes = 0u;
    uint32_t rest = m->faults;
    for (uint32_t k = 1u; k < 5u; k++) {
        classes |= ((rest & fault_class[k]) != 0u) ? (1u << (k - 1u)) : 0u;
        rest &= ~fault_class[k];
    }
    TEST_ASSERT_EQUAL_HEX32(0u, rest);
    TEST_ASSERT_TRUE(((uint32_t)m->id < 10u) && (m->periods < 4u) && (m->last_command < 16u));
    return ((((uint32_t)m->id * 4u + m->periods) * 16u + classes) * 16u + m->last_command) * 2u +
           (m->run_blocked ? 1u : 0u);
}

static void meet(const sequence_state_t *m)
{
    const uint32_t number = number_of(m);
    if (!known[number]) {
        known[number] = true;
        met[met_n] = *m;
        met_n++;
    }
}

static void assert_can_become_ready(const sequence_state_t *from)
{
    st = *from;
    const sequence_in_t quiet = {.standing = true};
    const sequence_in_t reset = {.standing = true, .command = RESET};
    for (int k = 0; (k < 40) && (st.id != SEQUENCE_READY); k++) {
        (void)sequence_step(&cfg, &st, (k == 10) ? &reset : &quiet);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_TRUE(step(0u, 0u).mode == DRIVE_OFF);
    TEST_ASSERT_TRUE(step(RUN, 0u).gates_on);
}

static bool leads[10][10]; /* from, to */

static uint32_t explore(void)
{
    uint32_t transitions = 0u;
    met_n = 0u;
    memset(known, 0, sizeof known);
    meet(&(sequence_state_t){0});
    for (uint32_t k = 0u; k < met_n; k++) {
        for (uint32_t event = 0u; event < 8u * 16u * 5u; event++) {
            const sequence_in_t in = {.premagnetising = (event & 1u) != 0u,
                                      .standing = (event & 2u) != 0u,
                                      .commissioned = (event & 4u) != 0u,
                                      .command = (event / 8u) % 16u,
                                      .faults = fault_class[event / 128u]};
            st = met[k];
            assert_step_is_safe(&met[k], &in);
            leads[met[k].id][st.id] = true;
            transitions++;
            meet(&st);
        }
        assert_can_become_ready(&met[k]);
    }
    return transitions;
}

static void explore_all(void)
{
    uint32_t memories = 0u;
    uint32_t transitions = 0u;
    memset(leads, 0, sizeof leads);
    for (uint32_t k = 0u; k < 4u; k++) {
        cfg.offset_periods = 1u;
        cfg.ramp_down_periods = 2u;
        cfg.stop = ((k & 1u) != 0u) ? SEQUENCE_STOP_RAMP : SEQUENCE_STOP_COAST;
        cfg.coast_periods = ((k & 2u) != 0u) ? 2u : 0u;
        transitions += explore();
        memories += met_n;
    }
    printf("%u memories, %u transitions\n", (unsigned)memories, (unsigned)transitions);
}

static void test_what_can_be_reached_is_closed_and_has_a_way_back(void)
{
    explore_all();
    for (int id = 0; id < 10; id++) {
        bool met_once = id == SEQUENCE_BOOT;
        for (int from = 0; from < 10; from++) {
            met_once = met_once || leads[from][id];
        }
        TEST_ASSERT_TRUE(met_once);
    }
}

static const char *const names[10] = {"BOOT",  "SELF_TEST", "READY", "PREMAGNETISE",
                                      "RUN",   "RAMP_DOWN", "COAST", "COMMISSIONING",
                                      "FAULT", "TORQUE_OFF"};

static int named(const char *name)
{
    for (int id = 0; id < 10; id++) {
        if (strcmp(names[id], name) == 0) {
            return id;
        }
    }
    return -1;
}

/* The ways into FAULT and TORQUE_OFF are a sentence beside the diagram, not forty arrows. */
static bool said_in_words(int from, int to)
{
    const bool early = (from == SEQUENCE_BOOT) || (from == SEQUENCE_SELF_TEST);
    return (to == SEQUENCE_FAULT) ||
           ((to == SEQUENCE_TORQUE_OFF) && !early && (from != SEQUENCE_FAULT));
}

static void test_the_diagram_has_every_transition_and_no_other(void)
{
    bool drawn[10][10] = {{false}};
    char line[256];
    FILE *readme = fopen(ZH_STATE_DIAGRAM, "r");
    TEST_ASSERT_NOT_NULL(readme);
    while (fgets(line, sizeof line, readme) != NULL) {
        char from[32];
        char to[32];
        if (sscanf(line, " %31[A-Z_] --> %31[A-Z_]", from, to) == 2) {
            TEST_ASSERT_TRUE_MESSAGE((named(from) >= 0) && (named(to) >= 0), line);
            drawn[named(from)][named(to)] = true;
        }
    }
    TEST_ASSERT_EQUAL_INT(0, fclose(readme));
    explore_all();
    for (int from = 0; from < 10; from++) {
        for (int to = 0; to < 10; to++) {
            char way[64];
            (void)snprintf(way, sizeof way, "%s --> %s", names[from], names[to]);
            const bool told = drawn[from][to] || said_in_words(from, to);
            if (from != to) {
                TEST_ASSERT_EQUAL_MESSAGE(leads[from][to], told, way);
            }
        }
    }
}

static void test_a_stop_by_ramp_waits_for_standstill_and_can_be_taken_back(void)
{
    cfg.stop = SEQUENCE_STOP_RAMP;
    cfg.ramp_down_periods = 100u;
    go_run();
    sequence_out_t out = step(0u, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_RAMP_DOWN, st.id);
    TEST_ASSERT_TRUE(out.gates_on);
    TEST_ASSERT_EQUAL(DRIVE_RUN, out.mode);
    TEST_ASSERT_EQUAL(DRIVE_AIM_STOP, out.aim);
    out = step(RUN, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, st.id);
    TEST_ASSERT_EQUAL(DRIVE_AIM_SPEED, out.aim);
    (void)step(0u, 0u);
    const sequence_in_t standing = {.standing = true};
    TEST_ASSERT_FALSE(sequence_step(&cfg, &st, &standing).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
}

static void test_a_stop_that_does_not_end_is_cut_off(void)
{
    cfg.stop = SEQUENCE_STOP_RAMP;
    cfg.ramp_down_periods = 5u;
    go_run();
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_TRUE(step(0u, 0u).gates_on);
    }
    TEST_ASSERT_FALSE(step(0u, 0u).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
}

static void test_a_ramp_fault_ends_in_fault_and_nobody_takes_it_back(void)
{
    cfg.ramp_down_periods = 5u;
    go_run();
    for (int k = 0; k < 6; k++) {
        const sequence_out_t out = step(RUN | ((k == 2) ? RESET : 0u), (k == 0) ? RAMPS : 0u);
        TEST_ASSERT_TRUE(out.gates_on);
        TEST_ASSERT_EQUAL(DRIVE_AIM_STOP, out.aim);
        TEST_ASSERT_EQUAL_HEX32(RAMPS, st.faults);
    }
    TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
    TEST_ASSERT_EQUAL_HEX32(RAMPS, st.faults);
}

static void test_a_hard_fault_cuts_a_ramp_short(void)
{
    cfg.ramp_down_periods = 50u;
    go_run();
    (void)step(RUN, RAMPS);
    TEST_ASSERT_FALSE(step(RUN, FAULT_OVER_CURRENT).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
}

/* Torque-off in the middle of it keeps the fault: it shows once torque may come back. */
static void test_torque_off_does_not_wipe_out_a_ramp_fault(void)
{
    cfg.ramp_down_periods = 50u;
    go_run();
    (void)step(RUN, RAMPS);
    TEST_ASSERT_FALSE(step(RUN | OFF, 0u).gates_on);
    (void)step(0u, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
    TEST_ASSERT_EQUAL_HEX32(RAMPS, st.faults);
}

static void test_a_ramp_fault_without_speed_opens_the_gates(void)
{
    cfg.ramp_down_periods = 50u;
    go_ready();
    (void)step(RUN, 0u);
    TEST_ASSERT_FALSE(step(RUN, RAMPS).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
}

static void test_warnings_do_not_keep_a_fault_from_being_reset(void)
{
    go_run();
    (void)step(RUN, FAULT_OVER_CURRENT);
    (void)step(0u, FAULT_REGENERATION);
    (void)step(RESET, FAULT_REGENERATION);
    TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
    TEST_ASSERT_EQUAL_HEX32(FAULT_REGENERATION, st.faults);
}

static void test_coast_waits_for_time_and_voltage(void)
{
    cfg.coast_periods = 3u;
    cfg.coast_max_V2 = 100.0f;
    st = (sequence_state_t){.id = SEQUENCE_RUN, .energised = SEQUENCE_ENERGISED};
    const sequence_in_t loud = {.command = 0u, .u_raw_V = {8.0f, 6.1f}};
    const sequence_in_t quiet = {.command = RUN, .u_raw_V = {8.0f, 6.0f}};
    TEST_ASSERT_FALSE(sequence_step(&cfg, &st, &loud).gates_on);
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL(SEQUENCE_COAST, st.id);
        (void)sequence_step(&cfg, &st, &quiet); /* the time */
    }
    const sequence_in_t restart = {.command = RUN, .u_raw_V = {8.0f, 6.1f}};
    for (int k = 0; k < 10; k++) {
        TEST_ASSERT_FALSE(sequence_step(&cfg, &st, &restart).gates_on); /* and the voltage */
        TEST_ASSERT_EQUAL(SEQUENCE_COAST, st.id);
    }
    (void)sequence_step(&cfg, &st, &quiet);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_TRUE(sequence_step(&cfg, &st, &quiet).gates_on);
}

/* Time and no voltage to wait for: the periods are those set, whatever the line says. */
static void test_coast_without_a_voltage_waits_for_the_time_alone(void)
{
    cfg.coast_periods = 3u;
    st = (sequence_state_t){.id = SEQUENCE_COAST};
    const sequence_in_t loud = {.u_raw_V = {300.0f, 0.0f}};
    for (int k = 0; k < 3; k++) {
        (void)sequence_step(&cfg, &st, &loud);
        TEST_ASSERT_EQUAL(SEQUENCE_COAST, st.id);
    }
    (void)sequence_step(&cfg, &st, &loud);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
}

static void test_a_state_that_does_not_exist_is_a_fault(void)
{
    st = (sequence_state_t){.id = (sequence_id_t)99};
    TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, st.faults);
}

static void test_commissioning_ends_when_done_or_when_the_command_drops(void)
{
    go_ready();
    sequence_out_t out = step(FIND, 0u);
    TEST_ASSERT_EQUAL(DRIVE_COMMISSION, out.mode);
    TEST_ASSERT_TRUE(out.gates_on);
    TEST_ASSERT_TRUE(step(FIND, 0u).gates_on);
    const sequence_in_t done = {.command = FIND, .commissioned = true};
    TEST_ASSERT_FALSE(sequence_step(&cfg, &st, &done).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_FALSE(step(FIND, 0u).gates_on); /* once per command */
    TEST_ASSERT_FALSE(step(FIND | RUN, 0u).gates_on);
    (void)step(0u, 0u);
    TEST_ASSERT_TRUE(step(FIND, 0u).gates_on);
    TEST_ASSERT_FALSE(step(0u, 0u).gates_on);
}

static void test_a_commissioning_that_fails_is_a_fault(void)
{
    go_ready();
    (void)step(FIND, 0u);
    TEST_ASSERT_FALSE(step(FIND, FAULT_COMMISSIONING).gates_on);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, st.id);
}

static void test_the_aim_of_run_is_a_matter_of_the_command(void)
{
    go_run();
    TEST_ASSERT_EQUAL(DRIVE_AIM_TORQUE, step(RUN | NM, 0u).aim);
    TEST_ASSERT_EQUAL(DRIVE_AIM_TORQUE, step(RUN | NM, 0u).aim);
    TEST_ASSERT_EQUAL(DRIVE_AIM_SPEED, step(RUN, 0u).aim);
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, st.id);
}

static const params_t good = {.offset_calibration_s = 0.1f,
                              .premagnetise_s = 1.0f,
                              .ramp_down_s = 2.0f,
                              .coast_s = 0.5f,
                              .coast_V = 10.0f,
                              .stop_mode = SEQUENCE_STOP_RAMP,
                              .current_full_scale_A = 25.0f,
                              .line_voltage_full_scale_V = 400.0f,
                              .period_s = 200e-6f};

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        params_t bad = good;                                                                       \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(sequence_init(&c, &bad), #field " " #value);                     \
    } while (0)

static void test_init_counts_periods_and_refuses_senseless_times(void)
{
    sequence_config_t c;
    TEST_ASSERT_TRUE(sequence_init(&c, &good));
    TEST_ASSERT_EQUAL_UINT32(500u, c.offset_periods);
    TEST_ASSERT_EQUAL_UINT32(5000u, c.premagnetise_periods);
    TEST_ASSERT_EQUAL_UINT32(10000u, c.ramp_down_periods);
    TEST_ASSERT_EQUAL_UINT32(2500u, c.coast_periods);
    TEST_ASSERT_EQUAL_FLOAT(100.0f, c.coast_max_V2);
    TEST_ASSERT_EQUAL(SEQUENCE_STOP_RAMP, c.stop);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, c.offset_max_A);
    TEST_ASSERT_EQUAL_FLOAT(8.0f, c.offset_max_V);
    params_t odd = good;
    odd.coast_s = 1.5f * good.period_s;
    TEST_ASSERT_TRUE(sequence_init(&c, &odd));
    TEST_ASSERT_EQUAL_UINT32(2u, c.coast_periods); /* to the nearest */
    odd.coast_s = 1.46f * good.period_s;
    TEST_ASSERT_TRUE(sequence_init(&c, &odd));
    TEST_ASSERT_EQUAL_UINT32(1u, c.coast_periods);
    odd.period_s = 1.0f;
    odd.coast_s = 1e9f;
    TEST_ASSERT_FALSE(sequence_init(&c, &odd)); /* as many are one too many */
    ASSERT_REFUSED(offset_calibration_s, -0.1f);
    ASSERT_REFUSED(premagnetise_s, NAN);
    ASSERT_REFUSED(premagnetise_s, 1e9f);
    ASSERT_REFUSED(ramp_down_s, -1.0f);
    ASSERT_REFUSED(coast_s, INFINITY);
    ASSERT_REFUSED(coast_V, -1.0f);
    ASSERT_REFUSED(coast_V, 1e30f); /* its square is none */
    ASSERT_REFUSED(stop_mode, 2u);
    ASSERT_REFUSED(current_full_scale_A, 0.0f);
    ASSERT_REFUSED(line_voltage_full_scale_V, NAN);
    ASSERT_REFUSED(period_s, 0.0f);
}

/* Residual flux: the mean is small, the voltage is not still. */
static void test_a_voltage_that_swings_is_no_offset(void)
{
    const float swing_V[] = {0.0f, 60.0f, -60.0f, 0.0f, 0.0f};
    cfg.offset_max_V = 4.0f;
    for (int k = 0; k < 5; k++) {
        const sequence_in_t in = {.u_raw_V = {0.5f + swing_V[k], 0.0f}};
        (void)sequence_step(&cfg, &st, &in);
    }
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.offset_V.alpha);
}

/* Through a self-test of three words on a line that swings by amplitude_V about mean_V. */
static void self_test_with(float mean_V, float amplitude_V)
{
    const float swing_pu[] = {1.0f, -1.0f, 0.0f};
    for (int k = 0; k < 4; k++) {
        const sequence_in_t in = {.u_raw_V = {mean_V + swing_pu[k % 3] * amplitude_V, 0.0f}};
        (void)sequence_step(&cfg, &st, &in);
    }
}

/* A quarter of offset_max_V, as the root of the mean square: here of .816 amplitudes. */
static void test_a_quarter_of_the_offset_allowed_is_still(void)
{
    const float amplitude_V[] = {1.2f, 1.25f};
    const float expected_V[] = {0.5f, 0.0f};
    for (int n = 0; n < 2; n++) {
        st = (sequence_state_t){.id = SEQUENCE_SELF_TEST};
        cfg.offset_max_V = 4.0f;
        self_test_with(0.5f, amplitude_V[n]);
        TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, expected_V[n], st.offset_V.alpha);
    }
}

/* What swung before the reset is forgotten. */
static void test_a_reset_measures_the_voltage_offset_anew(void)
{
    cfg.offset_max_V = 4.0f;
    st.id = SEQUENCE_SELF_TEST;
    self_test_with(0.5f, 60.0f);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.offset_V.alpha);
    (void)step(0u, FAULT_OVER_CURRENT);
    (void)step(RESET, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
    self_test_with(0.5f, 0.0f);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.5f, st.offset_V.alpha);
}

/* The largest offset itself is allowed, and the largest swing; a hair more is not. */
static void test_an_offset_at_its_limit_is_allowed(void)
{
    const float more[] = {1.0f, 1.0001f};
    cfg.offset_periods = 4u;
    for (int n = 0; n < 2; n++) {
        const float A = 0.5f * more[n];
        const uvw_t phase_A[] = {{A, 0.0f, 0.0f}, {0.0f, -A, 0.0f}, {0.0f, 0.0f, A}};
        for (int phase = 0; phase < 3; phase++) {
            st = (sequence_state_t){.id = SEQUENCE_SELF_TEST};
            for (int k = 0; k < 5; k++) {
                const sequence_in_t in = {.i_raw_A = phase_A[phase]};
                (void)sequence_step(&cfg, &st, &in);
            }
            TEST_ASSERT_EQUAL((n == 0) ? SEQUENCE_READY : SEQUENCE_FAULT, st.id);
        }
    }
}

static void test_a_voltage_offset_at_its_limit_is_allowed(void)
{
    cfg.offset_periods = 4u;
    cfg.offset_max_V = 8.0f;
    const ab_t offset_V[] = {{8.0f, 0.0f}, {0.0f, -8.0f}, {0.0f, 0.5f}};
    const float swing_V[] = {0.0f, 0.0f, 2.0f}; /* a quarter of 8 V */
    for (int n = 0; n < 3; n++) {
        st = (sequence_state_t){.id = SEQUENCE_SELF_TEST};
        for (int again = 0; again < 2; again++) { /* with the sums of before taken back */
            for (int k = 0; k < 5; k++) {
                const float u_V = ((k % 2) == 0) ? swing_V[n] : -swing_V[n];
                const sequence_in_t in = {.u_raw_V = {offset_V[n].alpha + u_V, offset_V[n].beta}};
                (void)sequence_step(&cfg, &st, &in);
            }
            TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
            TEST_ASSERT_EQUAL_FLOAT(offset_V[n].alpha, st.offset_V.alpha);
            TEST_ASSERT_EQUAL_FLOAT(offset_V[n].beta, st.offset_V.beta);
            (void)step(0u, FAULT_OVER_CURRENT);
            (void)step(RESET, 0u);
            TEST_ASSERT_EQUAL(SEQUENCE_SELF_TEST, st.id);
        }
    }
}

static void test_voltage_offsets_are_averaged_too(void)
{
    cfg.offset_max_V = 4.0f;
    for (int k = 0; k < 5; k++) {
        const sequence_in_t in = {.u_raw_V = {(float)k, -2.0f}};
        (void)sequence_step(&cfg, &st, &in);
    }
    /* Periods 1, 2, 3 are averaged; 0 leaves BOOT. */
    TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 2.0f, st.offset_V.alpha);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, -2.0f, st.offset_V.beta);
}

static void test_the_voltage_of_a_turning_motor_is_no_offset(void)
{
    const ab_t turning[3] = {{5.0f, 0.0f}, {0.0f, -5.0f}, {NAN, 0.0f}};
    cfg.offset_max_V = 4.0f;
    for (int n = 0; n < 3; n++) {
        st = (sequence_state_t){0};
        for (int k = 0; k < 5; k++) {
            const sequence_in_t in = {.u_raw_V = turning[n]};
            (void)sequence_step(&cfg, &st, &in);
        }
        TEST_ASSERT_EQUAL(SEQUENCE_READY, st.id);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, st.offset_V.alpha);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, st.offset_V.beta);
    }
}

static void test_flux_is_built_after_the_measurement_only(void)
{
    go_ready();
    (void)step(RUN, 0u);
    for (int k = 0; k < 20; k++) {
        const sequence_in_t in = {.command = RUN, .premagnetising = true};
        (void)sequence_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, st.id);
    }
    (void)step(RUN, 0u);
    (void)step(RUN, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, st.id);
    /* Measured once more: the time begins again. */
    const sequence_in_t measured = {.command = RUN, .premagnetising = true};
    (void)sequence_step(&cfg, &st, &measured);
    (void)step(RUN, 0u);
    (void)step(RUN, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, st.id);
    (void)step(RUN, 0u);
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, st.id);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_start_averages_offsets_and_waits_for_the_run_command);
    RUN_TEST(test_one_period_is_an_average_too);
    RUN_TEST(test_no_averaging_leaves_the_offsets_alone);
    RUN_TEST(test_an_impossible_offset_is_a_fault);
    RUN_TEST(test_run_builds_flux_first);
    RUN_TEST(test_releasing_run_closes_the_gates_in_both_states);
    RUN_TEST(test_a_run_command_standing_at_start_runs_after_the_self_test);
    RUN_TEST(test_a_fault_closes_the_gates_in_the_same_period_and_latches);
    RUN_TEST(test_a_warning_is_latched_and_leaves_the_gates_on_until_it_is_reset);
    RUN_TEST(test_a_warning_stands_beside_the_fault_that_follows);
    RUN_TEST(test_reset_needs_an_edge_and_the_cause_gone);
    RUN_TEST(test_a_refused_configuration_cannot_be_reset);
    RUN_TEST(test_torque_off_wins_over_run_and_needs_run_again);
    RUN_TEST(test_torque_off_does_not_skip_the_self_test);
    RUN_TEST(test_a_steady_run_changes_nothing);
    RUN_TEST(test_a_blocked_run_ends);
    RUN_TEST(test_nothing_but_the_one_transition_turns_the_gates_on);
    RUN_TEST(test_what_can_be_reached_is_closed_and_has_a_way_back);
    RUN_TEST(test_the_diagram_has_every_transition_and_no_other);
    RUN_TEST(test_a_stop_by_ramp_waits_for_standstill_and_can_be_taken_back);
    RUN_TEST(test_a_stop_that_does_not_end_is_cut_off);
    RUN_TEST(test_a_ramp_fault_ends_in_fault_and_nobody_takes_it_back);
    RUN_TEST(test_a_hard_fault_cuts_a_ramp_short);
    RUN_TEST(test_torque_off_does_not_wipe_out_a_ramp_fault);
    RUN_TEST(test_a_ramp_fault_without_speed_opens_the_gates);
    RUN_TEST(test_warnings_do_not_keep_a_fault_from_being_reset);
    RUN_TEST(test_coast_waits_for_time_and_voltage);
    RUN_TEST(test_coast_without_a_voltage_waits_for_the_time_alone);
    RUN_TEST(test_a_state_that_does_not_exist_is_a_fault);
    RUN_TEST(test_commissioning_ends_when_done_or_when_the_command_drops);
    RUN_TEST(test_a_commissioning_that_fails_is_a_fault);
    RUN_TEST(test_the_aim_of_run_is_a_matter_of_the_command);
    RUN_TEST(test_init_counts_periods_and_refuses_senseless_times);
    RUN_TEST(test_a_voltage_that_swings_is_no_offset);
    RUN_TEST(test_a_quarter_of_the_offset_allowed_is_still);
    RUN_TEST(test_a_reset_measures_the_voltage_offset_anew);
    RUN_TEST(test_an_offset_at_its_limit_is_allowed);
    RUN_TEST(test_a_voltage_offset_at_its_limit_is_allowed);
    RUN_TEST(test_voltage_offsets_are_averaged_too);
    RUN_TEST(test_the_voltage_of_a_turning_motor_is_no_offset);
    RUN_TEST(test_flux_is_built_after_the_measurement_only);
    return UNITY_END();
}
