/* Slots of flash whose power can be cut within any operation, torn in four ways.
 *
 * A cell that was being changed when the power went may be unstable: until its slot is erased it
 * reads as it was, as it should have become, or differently each time, as the boot after that
 * decides.
 */
#ifndef SIM_FLASH_H
#define SIM_FLASH_H

#include <stdbool.h>
#include <stdint.h>

#include "hal_devices.h"

#define SIM_FLASH_WORDS 1024u /* per slot */
#define SIM_FLASH_SLOTS 3u    /* the parameter store has two, the boot loader three */
#define SIM_FLASH_NEVER UINT32_MAX

typedef enum {
    TORN_NOTHING = 0,  /* the operation did not begin */
    TORN_PARTIAL = 1,  /* some cells changed, for good */
    TORN_GARBAGE = 2,  /* cells that were to change hold anything */
    TORN_UNSTABLE = 3, /* all, half or none of the cells that were to change are marginal */
    TORN_MODES = 4
} torn_t;

typedef enum {
    LEAN_OLD = 0, /* a marginal cell reads as before the operation */
    LEAN_NEW = 1,
    LEAN_RANDOM = 2, /* anew at each read */
    LEANS = 3
} lean_t;

typedef struct {
    hal_flash_t flash; /* context points here */
    uint32_t cell[SIM_FLASH_SLOTS][SIM_FLASH_WORDS];
    uint32_t marginal[SIM_FLASH_SLOTS][SIM_FLASH_WORDS]; /* bits */
    uint32_t wanted[SIM_FLASH_SLOTS][SIM_FLASH_WORDS];   /* what they should have become */
    bool dirty[SIM_FLASH_SLOTS];                         /* the slot has marginal cells */
    uint32_t operations;                                 /* since the last sim_flash_arm */
    uint32_t cut_at;                                     /* operation during which the power goes */
    torn_t torn;
    lean_t lean;
    bool dead;        /* no power: nothing happens any more */
    uint32_t misuses; /* programmed twice, out of range: the store must not */
    uint32_t erased[SIM_FLASH_SLOTS];
    uint64_t random;
} sim_flash_t;

void sim_flash_init(sim_flash_t *sim, uint32_t unit_words, uint64_t seed);

/* Power on again; marginal cells lean so until the next time. */
void sim_flash_boot(sim_flash_t *sim, lean_t lean);

/* The power goes within the operation of this number, counted from now. */
void sim_flash_arm(sim_flash_t *sim, uint32_t cut_at, torn_t torn);

uint32_t sim_flash_random(sim_flash_t *sim);

#endif
