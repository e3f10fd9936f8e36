/* Does a set of parameters survive the power going at any moment?
 *
 *   powercut single|double|triple|saves COUNT UNIT_WORDS SEED
 *
 * A run: a set is stored (or none yet), a newer one is being saved, the power goes; boot; the next
 * save, the power goes; ... At every boot the set found has to be one that was stored or being
 * stored since the last completed save, and the very same once the store has proven it; nothing
 * else, never nothing. After the last cut three boots must find one such set, and a save must work.
 *
 * COUNT 0: every operation and every way of tearing; else so many random ones. One JSON line on
 * stdout; exit code 1 when a run failed.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "crc32c.h"
#include "param_store.h"
#include "sim_flash.h"

#define CUTS_MAX   3u
#define STEPS_MAX  10000u
#define LAST_BOOTS 3u

typedef struct {
    uint32_t at;
    torn_t torn;
} cut_t;

typedef struct {
    sim_flash_t sim;
    param_store_config_t cfg;
    param_store_t store;
    uint32_t confirmed; /* number of the set that certainly is there; 0: none yet */
    uint32_t attempted; /* the newest that was begun */
    const char *wrong;  /* what, once something is */
} bench_t;

#define SETS 8u /* more than one run needs; they repeat */

/* Set n differs from set n-1 in every parameter, within its range; set 0: the defaults. */
static params_t make_set(uint32_t n)
{
    params_t set;
    params_default(&set);
    for (size_t k = 0u; (n > 0u) && (k < params_count()); k++) {
        const param_info_t *info = params_info(k);
        const float share = (float)(n % (SETS + 1u)) / (float)SETS;
        float value = info->minimum + share * (info->maximum - info->minimum);
        if (info->type != PARAM_FLOAT) {
            const uint32_t span = (uint32_t)(info->maximum - info->minimum) + 1u;
            value = info->minimum + (float)((n + k) % span);
        }
        if (params_set(&set, k, value) != PARAMS_OK) {
            abort();
        }
    }
    return set;
}

static params_t sets[SETS + 1u];

static const params_t *set_of(uint32_t n)
{
    return &sets[(n == 0u) ? 0u : (1u + (n - 1u) % SETS)];
}

static bool same_set(const params_t *a, uint32_t n)
{
    return memcmp(a, set_of(n), sizeof *a) == 0;
}

static void demand(bench_t *b, bool holds, const char *what)
{
    if (!holds && (b->wrong == NULL)) {
        b->wrong = what;
    }
}

/* Which set is found; demands that it is one of those it may be. */
static void boot(bench_t *b, lean_t lean)
{
    sim_flash_boot(&b->sim, lean);
    params_t set = *set_of(0u);
    param_store_report_t report;
    const param_store_found_t found = param_store_load(&b->cfg, &b->store, &set, &report);
    if (found != PARAM_STORE_LOADED) {
        demand(b, (found == PARAM_STORE_EMPTY) && (b->confirmed == 0u), "a set is lost");
        demand(b, same_set(&set, 0u), "an empty store changed the defaults");
        return;
    }
    demand(b, (report.missing | report.unknown | report.refused) == 0u, "an entry is lost");
    demand(b, report.taken == params_count(), "an entry is lost");
    for (uint32_t n = (b->confirmed > 0u) ? b->confirmed : 1u; n <= b->attempted; n++) {
        if (same_set(&set, n)) {
            /* Proven: no later boot may fall behind it. */
            b->confirmed = b->store.used.settled ? n : b->confirmed;
            return;
        }
    }
    demand(b, false, "neither the old nor the new set");
}

/* Saves the next set; true when it came to its end before the power went. */
static bool save(bench_t *b)
{
    b->attempted++;
    demand(b, param_store_save(&b->cfg, &b->store, set_of(b->attempted)), "a save was not taken");
    bool busy = true;
    for (uint32_t k = 0u; busy && !b->sim.dead && (k < STEPS_MAX); k++) {
        busy = param_store_step(&b->cfg, &b->store, true);
    }
    demand(b, b->sim.dead || !busy, "a save does not end");
    /* The cut may have been within the last mark: committed, as the boot will see. */
    if (busy || b->store.failed || b->sim.dead) {
        return false;
    }
    b->confirmed = b->attempted;
    return true;
}

static void bench_init(bench_t *b, uint32_t unit_words, uint64_t seed, uint32_t sets_before)
{
    memset(b, 0, sizeof *b);
    sim_flash_init(&b->sim, unit_words, seed);
    b->cfg = (param_store_config_t){.flash = &b->sim.flash, .table = {1u, 2u}};
    boot(b, LEAN_OLD);
    for (uint32_t k = 0u; k < sets_before; k++) {
        demand(b, save(b), "a save without a cut failed");
    }
}

/* Operations of one save behind a fresh boot; with the marks that a boot may have to add. */
static uint32_t operations_of_a_save(uint32_t unit_words)
{
    bench_t b;
    bench_init(&b, unit_words, 1u, 2u);
    boot(&b, LEAN_OLD);
    (void)save(&b);
    return b.sim.operations + 2u;
}

/* Judges one sequence of cuts from a store with so many sets before. */
static const char *run(const cut_t *cut, uint32_t cuts, uint32_t unit_words, uint64_t seed,
                       uint32_t sets_before)
{
    static bench_t b;
    bench_init(&b, unit_words, seed, sets_before);
    for (uint32_t k = 0u; k < cuts; k++) {
        sim_flash_arm(&b.sim, cut[k].at, cut[k].torn);
        (void)save(&b);
        boot(&b, (lean_t)(sim_flash_random(&b.sim) % LEANS));
    }
    for (uint32_t k = 0u; k < LAST_BOOTS; k++) {
        boot(&b, (lean_t)k);
    }
    demand(&b, save(&b), "a save behind the cuts failed");
    boot(&b, LEAN_OLD);
    demand(&b, b.confirmed == b.attempted, "the last save is not found");
    demand(&b, b.sim.misuses == 0u, "the flash was misused");
    return b.wrong;
}

typedef struct {
    uint64_t runs;
    uint64_t failed;
} tally_t;

static void judge(tally_t *tally, const cut_t *cut, uint32_t cuts, uint32_t unit_words,
                  uint64_t seed)
{
    /* From nothing, from the first set alone, and from two: either slot is the target. */
    const uint32_t before = (uint32_t)(seed % 4u);
    const char *wrong = run(cut, cuts, unit_words, seed, before);
    tally->runs++;
    if (wrong != NULL) {
        tally->failed++;
        fprintf(stderr, "%s: seed %" PRIu64 ", %" PRIu32 " sets before, cuts", wrong, seed, before);
        for (uint32_t k = 0u; k < cuts; k++) {
            fprintf(stderr, " %" PRIu32 "/%d", cut[k].at, (int)cut[k].torn);
        }
        fprintf(stderr, "\n");
    }
}

static tally_t every_cut(uint32_t cuts, uint32_t unit_words, uint64_t seed)
{
    tally_t tally = {0};
    const uint64_t choices = (uint64_t)operations_of_a_save(unit_words) * TORN_MODES;
    const uint64_t total = (cuts == 1u) ? choices : choices * choices;
    for (uint64_t k = 0u; k < total; k++) {
        const uint64_t first = k % choices;
        const uint64_t second = k / choices;
        const cut_t cut[] = {{(uint32_t)(first / TORN_MODES), (torn_t)(first % TORN_MODES)},
                             {(uint32_t)(second / TORN_MODES), (torn_t)(second % TORN_MODES)}};
        if (cuts == 1u) {
            /* Each from nothing, one, two and three sets before. */
            for (uint64_t before = 0u; before < 4u; before++) {
                judge(&tally, cut, cuts, unit_words, 4u * (seed + k) + before);
            }
        } else {
            judge(&tally, cut, cuts, unit_words, seed + k + k / choices);
        }
    }
    return tally;
}

static tally_t random_cuts(uint32_t cuts, uint32_t count, uint32_t unit_words, uint64_t seed)
{
    tally_t tally = {0};
    const uint32_t operations = operations_of_a_save(unit_words);
    sim_flash_t dice = {.random = seed};
    for (uint32_t n = 0u; n < count; n++) {
        cut_t cut[CUTS_MAX];
        for (uint32_t k = 0u; k < cuts; k++) {
            /* Half of them where it is hardest: erasing, the trailer, the marks. */
            const uint32_t dice_at = sim_flash_random(&dice);
            const uint32_t hard = dice_at % 12u;
            const uint32_t at = (hard < 4u) ? hard : (operations - 1u - (hard - 4u));
            cut[k].at = ((dice_at >> 16) % 2u != 0u) ? at : (sim_flash_random(&dice) % operations);
            cut[k].torn = (torn_t)(sim_flash_random(&dice) % TORN_MODES);
        }
        judge(&tally, cut, cuts, unit_words, seed + n);
    }
    return tally;
}

/* One drive's life: every save read back by a boot, the slots worn alike. */
static tally_t many_saves(uint32_t count, uint32_t unit_words, uint64_t seed)
{
    static bench_t b;
    bench_init(&b, unit_words, seed, 0u);
    tally_t tally = {0};
    for (uint32_t k = 0u; k < count; k++) {
        demand(&b, save(&b), "a save failed");
        boot(&b, (lean_t)(k % LEANS));
        demand(&b, b.confirmed == b.attempted, "a save is not found");
        demand(&b, (b.sim.erased[0] - b.sim.erased[1]) <= 1u, "one slot wears more");
        tally.runs++;
        tally.failed += (b.wrong != NULL) ? 1u : 0u;
    }
    demand(&b, b.sim.misuses == 0u, "the flash was misused");
    if (b.wrong != NULL) {
        tally.failed += (tally.failed == 0u) ? 1u : 0u;
        fprintf(stderr, "%s\n", b.wrong);
    }
    return tally;
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        fprintf(stderr, "usage: powercut single|double|triple|saves COUNT UNIT_WORDS SEED\n");
        return 2;
    }
    if (crc32c("123456789", 9u) != 0xE3069283u) {
        abort(); /* crc32c_fast.c is not the firmware's */
    }
    for (uint32_t n = 0u; n <= SETS; n++) {
        sets[n] = make_set(n);
    }
    const char *what = argv[1];
    const uint32_t count = (uint32_t)strtoul(argv[2], NULL, 10);
    const uint32_t unit = (uint32_t)strtoul(argv[3], NULL, 10);
    const uint64_t seed = strtoull(argv[4], NULL, 10);
    const uint32_t cuts = (strcmp(what, "single") == 0)   ? 1u
                          : (strcmp(what, "double") == 0) ? 2u
                                                          : 3u;
    const bool all = (count == 0u) && (cuts < 3u);
    const tally_t tally = (strcmp(what, "saves") == 0) ? many_saves(count, unit, seed)
                          : all                        ? every_cut(cuts, unit, seed)
                                                       : random_cuts(cuts, count, unit, seed);
    printf("{\"what\": \"%s\", \"unit_bytes\": %" PRIu32 ", \"operations\": %" PRIu32
           ", \"runs\": %" PRIu64 ", \"failed\": %" PRIu64 "}\n",
           what, 4u * unit, operations_of_a_save(unit), tally.runs, tally.failed);
    return ((tally.failed == 0u) && (tally.runs > 0u)) ? 0 : 1;
}
