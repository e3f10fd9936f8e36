/* Does the boot loader stand the power going, or the flash failing, at any moment of an update?
 *
 *   bootcut single|double|triple|frames COUNT staged|lone UNIT_WORDS SEED
 *
 * A run: version 1 is installed, an update is sent and started, and at some flash operation the
 * power goes or the operation fails; boot; the next update, and so on. At every boot what is
 * started has to be an image that was signed, whole, not older than any that ran before; the
 * counter never stands below what ran; a forged and an older image are refused. With two slots
 * something always starts after a power cut; with one, the loader may wait for a repeat. After the
 * last cut an update must succeed.
 *
 * `frames`: requests in any order and of any content, signed ones among them, while the flash fails
 * again and again. Besides the above, nothing may be erased but for a signed newer header, and the
 * running slot of two never by a request.
 *
 * COUNT random runs; 0 with `single`: every operation and every way of tearing. One JSON line on
 * stdout; exit code 1 when a run failed.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "boot_rig.h"

#define CUTS_MAX   3u
#define LAST_BOOTS 3u
#define WAYS       (TORN_MODES * LEANS * 2u * 2u) /* torn, lean, power or failure, repeat or not */

typedef struct {
    uint32_t at;
    uint32_t way;
} cut_t;

typedef struct {
    boot_rig_t rig;
    uint32_t sent;    /* the newest version that was begun */
    uint32_t started; /* the newest version that ran */
    const char *wrong;
} bench_t;

static void demand(bench_t *b, bool holds, const char *what)
{
    if (!holds && (b->wrong == NULL)) {
        b->wrong = what;
    }
}

/* The loader has started what is in the running slot. */
static void judge_start(bench_t *b)
{
    for (uint32_t version = b->started; version <= b->sent; version++) {
        const rig_image_t image = rig_image(&b->rig, version);
        if (rig_runs(&b->rig, &image)) {
            b->started = version;
            demand(b, rig_counter(&b->rig) >= version, "started without the counter");
            return;
        }
    }
    demand(b, false, "an unverified or older image was started");
}

static bool boot(bench_t *b)
{
    const bool running = rig_boot(&b->rig);
    if (b->rig.sim.dead) {
        return false; /* nobody is left to start anything */
    }
    if (running) {
        judge_start(b);
    }
    demand(b, rig_counter(&b->rig) >= b->started, "the counter went back");
    return running;
}

/* As the next reset finds it. */
static bool power_up(bench_t *b, lean_t lean)
{
    b->rig.fails = false;
    sim_flash_boot(&b->rig.sim, lean);
    return boot(b);
}

static void send(bench_t *b, uint32_t version)
{
    const rig_image_t image = rig_image(&b->rig, version);
    b->sent = (version > b->sent) ? version : b->sent;
    (void)rig_send(&b->rig, &image);
    (void)boot(b);
}

/* What must never get in, whatever state the loader is in. */
static void attack(bench_t *b)
{
    rig_image_t forged = rig_image(&b->rig, b->sent + 1u);
    forged.header.word[BOOT_AT_VERSION]++;
    demand(b, rig_send(&b->rig, &forged) == BOOT_BAD_SIGNATURE, "a forged image was taken");
    if (b->started > 1u) {
        const rig_image_t old = rig_image(&b->rig, b->started - 1u);
        demand(b, rig_send(&b->rig, &old) == BOOT_OLDER, "an older image was taken");
    }
}

static void bench_init(bench_t *b, bool staged, uint32_t unit_words, uint64_t seed)
{
    memset(b, 0, sizeof *b);
    rig_init(&b->rig, staged, unit_words, seed);
    demand(b, !boot(b), "blank flash was started");
    send(b, 1u);
    demand(b, b->started == 1u, "the first image does not start");
}

/* Flash operations from a reset through an update to its start. */
static uint32_t operations(bool staged, uint32_t unit_words)
{
    static bench_t b;
    bench_init(&b, staged, unit_words, 1u);
    sim_flash_arm(&b.rig.sim, SIM_FLASH_NEVER, TORN_NOTHING);
    send(&b, 2u);
    return b.rig.sim.operations;
}

/* From one power-up to the cut: within what the loader finds to do first, or the update behind it.
 */
static void one_cut(bench_t *b, const cut_t *cut)
{
    const bool failed = b->rig.fails;
    const bool repeat = cut->way / (TORN_MODES * LEANS * 2u) != 0u;
    b->rig.fails = (cut->way / (TORN_MODES * LEANS)) % 2u != 0u;
    sim_flash_boot(&b->rig.sim, (lean_t)((cut->way / TORN_MODES) % LEANS));
    sim_flash_arm(&b->rig.sim, cut->at, (torn_t)(cut->way % TORN_MODES));
    const bool running = boot(b);
    if (!b->rig.sim.dead) {
        demand(b, running || failed || b->rig.fails || !b->rig.flash.staged, "nothing starts");
        attack(b);
        send(b, (repeat && (b->sent > b->started)) ? b->sent : (b->sent + 1u));
    }
}

static const char *run(const cut_t *cut, uint32_t cuts, bool staged, uint32_t unit_words,
                       uint64_t seed)
{
    static bench_t b;
    bench_init(&b, staged, unit_words, seed);
    for (uint32_t k = 0u; k < cuts; k++) {
        one_cut(&b, &cut[k]);
    }
    const bool failed = b.rig.fails;
    for (uint32_t k = 0u; k < LAST_BOOTS; k++) {
        const bool running = power_up(&b, (lean_t)((seed + k) % LEANS));
        demand(&b, running || !staged || (failed && (k == 0u)), "nothing starts in the end");
        attack(&b);
    }
    send(&b, b.sent + 1u);
    demand(&b, b.started == b.sent, "an update behind the cuts failed");
    demand(&b, power_up(&b, LEAN_RANDOM), "the last update does not start again");
    demand(&b, b.started == b.sent, "the last update is lost");
    demand(&b, b.rig.sim.misuses == 0u, "the flash was misused");
    return b.wrong;
}

/* A header that may have been signed: for the next version, one that ran, another board, of no
 * size, or changed behind the signature. */
static rig_image_t any_image(bench_t *b, sim_flash_t *dice)
{
    const uint32_t kind = sim_flash_random(dice) % 8u;
    rig_image_t image = rig_image(&b->rig, (kind == 1u) ? b->started : (b->sent + 1u));
    if (kind == 2u) {
        image.header.word[sim_flash_random(dice) % BOOT_HEADER_WORDS] ^=
            1u << sim_flash_random(dice) % 32u;
    } else if ((kind == 3u) || (kind == 4u)) {
        image.header.word[(kind == 3u) ? BOOT_AT_BOARD : BOOT_AT_BYTES] ^= 0xFFFFFFF0u;
        rig_sign(&b->rig, &image);
    }
    return image;
}

static void say_begin(bench_t *b, sim_flash_t *dice, rig_image_t *open)
{
    const rig_image_t image = any_image(b, dice);
    /* What ran may be sent again once nothing runs any more. */
    const uint32_t version = image.header.word[BOOT_AT_VERSION];
    const bool new = version == b->sent + 1u;
    const bool again = !b->rig.link.running && (version == b->started);
    const rig_image_t honest = rig_image(&b->rig, version);
    const bool good =
        (new || again) && (memcmp(&image.header, &honest.header, sizeof image.header) == 0);
    uint32_t before = 0u, after = 0u;
    for (uint32_t k = 0u; k < SIM_FLASH_SLOTS; k++) {
        before += b->rig.sim.erased[k];
    }
    const boot_status_t status = rig_begin(&b->rig, &image);
    for (uint32_t k = 0u; k < SIM_FLASH_SLOTS; k++) {
        after += b->rig.sim.erased[k];
    }
    demand(b, good || ((status != BOOT_GOOD) && (after == before)), "erased for a wrong header");
    if (status == BOOT_GOOD) {
        *open = image;
        b->sent += new ? 1u : 0u;
    }
}

/* The next bytes mostly; else others, others' places, or a length that does not fit. */
static void say_data(bench_t *b, sim_flash_t *dice, const rig_image_t *open)
{
    uint8_t bytes[BOOT_LINK_DATA_MAX + BOOT_UNIT_BYTES];
    const uint32_t kind = sim_flash_random(dice) % 16u;
    const uint32_t next = b->rig.link.next % RIG_IMAGE_BYTES;
    for (uint32_t k = 0u; k < sizeof bytes; k++) {
        bytes[k] = open->application[(next + k) % RIG_IMAGE_BYTES];
    }
    const uint32_t left = RIG_IMAGE_BYTES - next;
    uint32_t n = (left < 16u) ? left : 16u;
    uint32_t at = b->rig.link.next;
    if (kind == 0u) {
        bytes[sim_flash_random(dice) % n] ^= (uint8_t)(1u << sim_flash_random(dice) % 8u);
    } else if (kind == 1u) {
        at = sim_flash_random(dice) % (2u * RIG_IMAGE_BYTES);
    } else if (kind == 2u) {
        n = sim_flash_random(dice) % sizeof bytes;
    } else if (kind == 3u) {
        at ^= 0x80000000u;
    }
    (void)rig_data(&b->rig, at, bytes, n);
}

static void say_noise(bench_t *b, sim_flash_t *dice)
{
    for (uint32_t n = sim_flash_random(dice) % 64u; n > 0u; n--) {
        (void)boot_link_byte(&b->rig.cfg, &b->rig.link, (uint8_t)sim_flash_random(dice));
    }
    (void)boot_link_byte(&b->rig.cfg, &b->rig.link, 0u);
}

static void say_anything(bench_t *b, sim_flash_t *dice, rig_image_t *open)
{
    const uint32_t what = sim_flash_random(dice) % 16u;
    const uint32_t ran = b->rig.sim.erased[BOOT_RUN];
    if (what < 3u) {
        say_begin(b, dice, open);
    } else if (what < 12u) {
        say_data(b, dice, open);
    } else if (what < 14u) {
        (void)rig_request(&b->rig, BOOT_LINK_COMMIT, NULL, 0u);
    } else if (what == 14u) {
        say_noise(b, dice);
    } else {
        const uint8_t op = (uint8_t)sim_flash_random(dice);
        (void)rig_request(&b->rig, op, open, sim_flash_random(dice) % 240u % sizeof *open);
    }
    demand(b, !b->rig.flash.staged || (b->rig.sim.erased[BOOT_RUN] == ran), "running slot erased");
}

#define REQUESTS 200u

/* A third of the runs on a flash that never fails: they have to get somewhere. */
static const char *babble(bool staged, uint32_t unit, uint64_t seed)
{
    static bench_t b;
    sim_flash_t dice = {.random = ~seed};
    bench_init(&b, staged, unit, seed);
    rig_image_t open = rig_image(&b.rig, 1u);
    const bool fails = seed % 3u != 0u;
    for (uint32_t k = 0u; k < REQUESTS; k++) {
        if (fails && (sim_flash_random(&dice) % 8u == 0u)) {
            b.rig.fails = true;
            sim_flash_arm(&b.rig.sim, sim_flash_random(&dice) % 8u,
                          (torn_t)(sim_flash_random(&dice) % TORN_MODES));
        }
        say_anything(&b, &dice, &open);
        if (b.rig.link.done || (sim_flash_random(&dice) % 64u == 0u)) {
            (void)boot(&b);
        }
    }
    demand(&b, power_up(&b, LEAN_RANDOM) || !staged || fails, "nothing starts behind it");
    demand(&b, power_up(&b, LEAN_RANDOM) || !staged, "nothing starts in the end");
    attack(&b);
    send(&b, b.sent + 1u);
    demand(&b, b.started == b.sent, "an update behind the frames failed");
    demand(&b, b.rig.sim.misuses == 0u, "the flash was misused");
    return b.wrong;
}

typedef struct {
    uint64_t runs;
    uint64_t failed;
} tally_t;

static void judge(tally_t *tally, const cut_t *cut, uint32_t cuts, bool staged, uint32_t unit,
                  uint64_t seed)
{
    const char *wrong = run(cut, cuts, staged, unit, seed);
    tally->runs++;
    if (wrong != NULL) {
        tally->failed++;
        fprintf(stderr, "%s: seed %" PRIu64 ", cuts", wrong, seed);
        for (uint32_t k = 0u; k < cuts; k++) {
            fprintf(stderr, " %" PRIu32 "/%" PRIu32, cut[k].at, cut[k].way);
        }
        fprintf(stderr, "\n");
    }
}

static tally_t every_cut(bool staged, uint32_t unit, uint64_t seed)
{
    tally_t tally = {0};
    const uint32_t total = operations(staged, unit) * WAYS;
    for (uint32_t k = 0u; k < total; k++) {
        const cut_t cut = {k / WAYS, k % WAYS};
        judge(&tally, &cut, 1u, staged, unit, seed + k);
    }
    return tally;
}

static tally_t random_cuts(uint32_t cuts, uint32_t count, bool staged, uint32_t unit, uint64_t seed)
{
    tally_t tally = {0};
    const uint32_t all = operations(staged, unit);
    sim_flash_t dice = {.random = seed};
    for (uint32_t n = 0u; n < count; n++) {
        cut_t cut[CUTS_MAX];
        for (uint32_t k = 0u; k < cuts; k++) {
            /* A third of them at the first operations of a boot, a third at its last. */
            const uint32_t where = sim_flash_random(&dice);
            const uint32_t near = where % 16u;
            const uint32_t choice = (where >> 16) % 3u;
            cut[k].at = (choice == 0u) ? near : (choice == 1u) ? (all - 1u - near) : (where % all);
            cut[k].way = sim_flash_random(&dice) % WAYS;
        }
        judge(&tally, cut, cuts, staged, unit, seed + n);
    }
    return tally;
}

static tally_t random_frames(uint32_t count, bool staged, uint32_t unit, uint64_t seed)
{
    tally_t tally = {.runs = count};
    for (uint32_t n = 0u; n < count; n++) {
        const char *wrong = babble(staged, unit, seed + n);
        if (wrong != NULL) {
            tally.failed++;
            fprintf(stderr, "%s: seed %" PRIu64 "\n", wrong, seed + n);
        }
    }
    return tally;
}

int main(int argc, char **argv)
{
    if (argc != 6) {
        fprintf(stderr,
                "usage: bootcut single|double|triple|frames COUNT staged|lone UNIT_WORDS SEED\n");
        return 2;
    }
    const char *what = argv[1];
    const uint32_t cuts = (strcmp(what, "single") == 0)   ? 1u
                          : (strcmp(what, "double") == 0) ? 2u
                                                          : 3u;
    const uint32_t count = (uint32_t)strtoul(argv[2], NULL, 10);
    const bool staged = strcmp(argv[3], "staged") == 0;
    const uint32_t unit = (uint32_t)strtoul(argv[4], NULL, 10);
    const uint64_t seed = strtoull(argv[5], NULL, 10);
    const bool all = (count == 0u) && (cuts == 1u);
    const tally_t tally = (strcmp(what, "frames") == 0) ? random_frames(count, staged, unit, seed)
                          : all                         ? every_cut(staged, unit, seed)
                                : random_cuts(cuts, count, staged, unit, seed);
    printf("{\"what\": \"%s\", \"slots\": %d, \"unit_bytes\": %" PRIu32 ", \"operations\": %" PRIu32
           ", \"runs\": %" PRIu64 ", \"failed\": %" PRIu64 "}\n",
           what, staged ? 2 : 1, 4u * unit, operations(staged, unit), tally.runs, tally.failed);
    return ((tally.failed == 0u) && (tally.runs > 0u)) ? 0 : 1;
}
