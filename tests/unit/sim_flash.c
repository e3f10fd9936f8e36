#include "sim_flash.h"

#include <string.h>

#define ERASED 0xFFFFFFFFu

/* Steele's SplitMix64: any seed will do. */
uint32_t sim_flash_random(sim_flash_t *sim)
{
    uint64_t z = (sim->random += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return (uint32_t)((z ^ (z >> 31)) >> 32);
}

/* One word on its way from what it is to `wanted`, left where the power went. */
static void tear(sim_flash_t *sim, uint32_t slot, uint32_t at, uint32_t wanted, uint32_t share)
{
    uint32_t *cell = &sim->cell[slot][at];
    const uint32_t change = *cell ^ wanted;
    const uint32_t random = sim_flash_random(sim);
    switch (sim->torn) {
    case TORN_PARTIAL:
        /* Words of an erasure go in whole, too: some, none and all have to occur. */
        *cell ^= change & ((share == 0u) ? random : ((share == 1u) ? ERASED : 0u));
        break;
    case TORN_GARBAGE:
        *cell = (*cell & ~change) | (random & change);
        break;
    case TORN_UNSTABLE:
        sim->marginal[slot][at] |= change & ((share == 0u) ? random : ERASED);
        sim->wanted[slot][at] = wanted;
        *cell ^= change & ~sim->marginal[slot][at];
        sim->dirty[slot] = true;
        break;
    case TORN_NOTHING:
    case TORN_MODES:
    default:
        break;
    }
}

/* True when the operation is to be carried out; false when the power is gone, or goes now. */
static bool powered(sim_flash_t *sim, bool *now)
{
    *now = false;
    if (sim->dead) {
        return false;
    }
    *now = sim->operations == sim->cut_at;
    sim->operations++;
    sim->dead = *now;
    return !*now;
}

static hal_flash_status_t erase(void *context, uint32_t slot)
{
    sim_flash_t *sim = (sim_flash_t *)context;
    bool now;
    if (powered(sim, &now)) {
        memset(sim->cell[slot], 0xFF, sizeof sim->cell[slot]);
        memset(sim->marginal[slot], 0, sizeof sim->marginal[slot]);
        sim->dirty[slot] = false;
        sim->erased[slot]++;
        return HAL_FLASH_DONE;
    }
    if (now) {
        for (uint32_t k = 0u; k < SIM_FLASH_WORDS; k++) {
            tear(sim, slot, k, ERASED, sim_flash_random(sim) % 3u);
        }
    }
    return HAL_FLASH_FAILED;
}

static hal_flash_status_t program(void *context, uint32_t slot, uint32_t offset,
                                  const uint32_t *words)
{
    sim_flash_t *sim = (sim_flash_t *)context;
    const uint32_t unit = sim->flash.unit_words;
    const uint32_t at = offset / 4u;
    bool now;
    const bool on = powered(sim, &now);
    if ((slot >= SIM_FLASH_SLOTS) || (offset % (4u * unit) != 0u) ||
        (at + unit > SIM_FLASH_WORDS)) {
        sim->misuses++;
        return HAL_FLASH_FAILED;
    }
    const uint32_t share = sim_flash_random(sim) % 2u;
    for (uint32_t k = 0u; (on || now) && (k < unit); k++) {
        /* A cell once 0 stays 0; one that is only marginally so does not count as written. */
        sim->misuses +=
            ((sim->cell[slot][at + k] | sim->marginal[slot][at + k]) != ERASED) ? 1u : 0u;
        const uint32_t wanted = sim->cell[slot][at + k] & words[k];
        if (on) {
            sim->cell[slot][at + k] = wanted;
            sim->marginal[slot][at + k] &= words[k]; /* a full pulse ends in a firm 0 */
        } else {
            tear(sim, slot, at + k, wanted, share);
        }
    }
    return on ? HAL_FLASH_DONE : HAL_FLASH_FAILED;
}

static uint32_t read_word(void *context, uint32_t slot, uint32_t offset)
{
    sim_flash_t *sim = (sim_flash_t *)context;
    const uint32_t at = offset / 4u;
    if (at >= SIM_FLASH_WORDS) {
        sim->misuses++;
        return 0u;
    }
    const uint32_t cell = sim->cell[slot][at];
    if (!sim->dirty[slot] || (sim->lean == LEAN_OLD)) {
        return cell;
    }
    const uint32_t other = (sim->lean == LEAN_NEW) ? sim->wanted[slot][at] : sim_flash_random(sim);
    return (cell & ~sim->marginal[slot][at]) | (other & sim->marginal[slot][at]);
}

void sim_flash_init(sim_flash_t *sim, uint32_t unit_words, uint64_t seed)
{
    memset(sim, 0, sizeof *sim);
    memset(sim->cell, 0xFF, sizeof sim->cell);
    sim->cut_at = SIM_FLASH_NEVER;
    sim->random = seed;
    sim->flash = (hal_flash_t){.context = sim,
                               .slot_bytes = 4u * SIM_FLASH_WORDS,
                               .unit_words = unit_words,
                               .erased_word = ERASED,
                               .erase = erase,
                               .program = program,
                               .read = read_word};
}

void sim_flash_boot(sim_flash_t *sim, lean_t lean)
{
    sim->dead = false;
    sim->lean = lean;
    sim_flash_arm(sim, SIM_FLASH_NEVER, TORN_NOTHING);
}

void sim_flash_arm(sim_flash_t *sim, uint32_t cut_at, torn_t torn)
{
    sim->operations = 0u;
    sim->cut_at = cut_at;
    sim->torn = torn;
}
