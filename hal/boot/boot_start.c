#include "boot_start.h"

boot_journal_t boot_counter(const boot_config_t *cfg)
{
    return (boot_journal_t){cfg->flash, BOOT_COUNTER, 0u, cfg->flash->counter_bytes};
}

bool boot_slot_good(const boot_config_t *cfg, boot_area_t slot, boot_header_t *header)
{
    const boot_journal_t counter = boot_counter(cfg);
    boot_header_read(cfg->flash, slot, header);
    return boot_image_marked(cfg->flash, slot) &&
           (boot_header_check(cfg, header, boot_journal_read(&counter)) == BOOT_GOOD) &&
           boot_image_intact(cfg->flash, slot, header);
}

static bool copy(const boot_flash_t *flash, const boot_header_t *header)
{
    if (!flash->erase(flash->context, BOOT_RUN)) {
        return false;
    }
    const uint32_t end = BOOT_IMAGE_AT + header->word[BOOT_AT_BYTES];
    for (uint32_t at = BOOT_IMAGE_AT; at < end; at += BOOT_UNIT_BYTES) {
        uint32_t words[2];
        (void)boot_read(flash, BOOT_STAGE, at, words);
        if (!boot_write(flash, BOOT_RUN, at, words)) {
            return false;
        }
    }
    return boot_image_complete(flash, BOOT_RUN, header);
}

/* To verify a slot takes a second: only for one that says it is newer. */
static bool update_found(const boot_config_t *cfg, bool running, const boot_header_t *run,
                         boot_header_t *next)
{
    const uint32_t above = running ? run->word[BOOT_AT_VERSION] : 0u;
    boot_header_read(cfg->flash, BOOT_STAGE, next);
    return (next->word[BOOT_AT_VERSION] > above) && boot_slot_good(cfg, BOOT_STAGE, next) &&
           (next->word[BOOT_AT_VERSION] > above);
}

/* Nothing of the running slot is lost before what replaces it is whole for good. */
static bool take_update(const boot_config_t *cfg, bool running, boot_header_t *run)
{
    boot_header_t next = {{0u}};
    if (!update_found(cfg, running, run, &next) || !boot_image_settle(cfg->flash, BOOT_STAGE)) {
        return running;
    }
    return copy(cfg->flash, &next) && boot_slot_good(cfg, BOOT_RUN, run);
}

bool boot_start(const boot_config_t *cfg)
{
    boot_header_t run;
    bool running = boot_slot_good(cfg, BOOT_RUN, &run);
    if (cfg->flash->staged) {
        running = take_update(cfg, running, &run);
    }
    const boot_journal_t counter = boot_counter(cfg);
    return running && boot_image_settle(cfg->flash, BOOT_RUN) &&
           boot_journal_raise(&counter, run.word[BOOT_AT_VERSION]);
}
