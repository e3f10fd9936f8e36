#include "boot_rig.h"

#include <string.h>

#include "monocypher.h"

#define CHUNK_BYTES 24u /* several to an image */

static const uint8_t public_key[BOOT_KEY_BYTES] = {1u, 2u, 3u};

/* A failing operation leaves what a power cut would, but the power stays. */
static bool told(boot_rig_t *rig, bool was_dead, hal_flash_status_t status)
{
    if (rig->fails && !was_dead && rig->sim.dead) {
        rig->sim.dead = false;
    }
    return status == HAL_FLASH_DONE;
}

static bool erase(void *context, boot_area_t slot)
{
    boot_rig_t *rig = (boot_rig_t *)context;
    const hal_flash_t *flash = &rig->sim.flash;
    const bool was_dead = rig->sim.dead;
    rig->sim.misuses += (slot == BOOT_COUNTER) ? 1u : 0u;
    return told(rig, was_dead, flash->erase(flash->context, (uint32_t)slot));
}

static bool program(void *context, boot_area_t area, uint32_t offset, const uint32_t *words)
{
    boot_rig_t *rig = (boot_rig_t *)context;
    const hal_flash_t *flash = &rig->sim.flash;
    bool done = true;
    for (uint32_t k = 0u; done && (k < 2u); k += flash->unit_words) {
        const bool was_dead = rig->sim.dead;
        const uint32_t at = offset + 4u * k;
        done = told(rig, was_dead, flash->program(flash->context, (uint32_t)area, at, &words[k]));
    }
    return done;
}

static uint32_t read_word(void *context, boot_area_t area, uint32_t offset)
{
    boot_rig_t *rig = (boot_rig_t *)context;
    rig->sim.misuses += ((offset % 4u) != 0u) ? 1u : 0u;
    return rig->sim.flash.read(rig->sim.flash.context, (uint32_t)area, offset);
}

void rig_init(boot_rig_t *rig, bool staged, uint32_t unit_words, uint64_t seed)
{
    memset(rig, 0, sizeof *rig);
    sim_flash_init(&rig->sim, unit_words, seed);
    rig->flash = (boot_flash_t){.context = rig,
                                .counter_bytes = RIG_COUNTER_BYTES,
                                .slot_bytes = 4u * SIM_FLASH_WORDS,
                                .staged = staged,
                                .erase = erase,
                                .program = program,
                                .read = read_word};
    rig->cfg = (boot_config_t){&rig->flash, public_key, {0x6769725Fu, 0u, 0u, 0u}};
}

void rig_hash(boot_header_t *header, const void *application, uint32_t bytes)
{
    crypto_blake2b_ctx hash;
    crypto_blake2b_init(&hash, BOOT_HASH_BYTES);
    crypto_blake2b_update(&hash, (const uint8_t *)application, bytes);
    crypto_blake2b_final(&hash, (uint8_t *)&header->word[BOOT_AT_HASH]);
}

void rig_sign(const boot_rig_t *rig, rig_image_t *image)
{
    rig_hash(&image->header, image->application, RIG_IMAGE_BYTES);
    toy_sign((uint8_t *)&image->header.word[BOOT_AT_SIGNATURE], rig->cfg.key,
             (const uint8_t *)image->header.word, BOOT_SIGNED_BYTES);
}

rig_image_t rig_image(const boot_rig_t *rig, uint32_t version)
{
    rig_image_t image = {{{BOOT_MAGIC, BOOT_FORMAT, version, RIG_IMAGE_BYTES}}, {0u}};
    memcpy(&image.header.word[BOOT_AT_BOARD], rig->cfg.board, sizeof rig->cfg.board);
    for (uint32_t k = 0u; k < RIG_IMAGE_BYTES; k++) {
        image.application[k] = (uint8_t)(version * 31u + k * 7u);
    }
    rig_sign(rig, &image);
    return image;
}

bool rig_boot(boot_rig_t *rig)
{
    const bool running = boot_start(&rig->cfg);
    boot_link_reset(&rig->link, running, BOOT_LINK_WINDOW_MS);
    return running;
}

boot_status_t rig_request(boot_rig_t *rig, uint8_t op, const void *body, uint32_t n)
{
    command_writer_t w;
    rig->sequence++;
    command_begin(&w, (uint8_t)rig->sequence, op);
    for (uint32_t k = 0u; k < n; k++) {
        command_put_u8(&w, ((const uint8_t *)body)[k]);
    }
    command_end(&w);
    bool answered = false;
    for (uint32_t k = 0u; k < w.length; k++) {
        answered = boot_link_byte(&rig->cfg, &rig->link, w.byte[k]) || answered;
    }
    command_parser_t parser = {.length = 0u};
    command_frame_t frame;
    for (uint32_t k = 0u; answered && (k < rig->link.answer.length); k++) {
        if (command_byte(&parser, rig->link.answer.byte[k], &frame) &&
            (frame.sequence == (uint8_t)rig->sequence) &&
            (frame.op == (uint8_t)(op | BOOT_LINK_ANSWER))) {
            return (boot_status_t)frame.body[0];
        }
    }
    return BOOT_UNKNOWN;
}

boot_status_t rig_begin(boot_rig_t *rig, const rig_image_t *image)
{
    return rig_request(rig, BOOT_LINK_BEGIN, image->header.word, BOOT_HEADER_BYTES);
}

boot_status_t rig_data(boot_rig_t *rig, uint32_t offset, const void *bytes, uint32_t n)
{
    uint8_t body[4u + BOOT_LINK_DATA_MAX + BOOT_UNIT_BYTES];
    memcpy(body, &offset, sizeof offset);
    memcpy(&body[4], bytes, n);
    return rig_request(rig, BOOT_LINK_DATA, body, 4u + n);
}

boot_status_t rig_send(boot_rig_t *rig, const rig_image_t *image)
{
    boot_status_t status = rig_begin(rig, image);
    for (uint32_t at = 0u; (status == BOOT_GOOD) && (at < RIG_IMAGE_BYTES); at += CHUNK_BYTES) {
        const uint32_t left = RIG_IMAGE_BYTES - at;
        const uint32_t n = (left < CHUNK_BYTES) ? left : CHUNK_BYTES;
        status = rig_data(rig, at, &image->application[at], n);
    }
    return (status == BOOT_GOOD) ? rig_request(rig, BOOT_LINK_COMMIT, NULL, 0u) : status;
}

bool rig_runs(boot_rig_t *rig, const rig_image_t *image)
{
    uint8_t found[RIG_IMAGE_BYTES];
    for (uint32_t k = 0u; k < RIG_IMAGE_BYTES; k += 4u) {
        const uint32_t word = read_word(rig, BOOT_RUN, BOOT_IMAGE_AT + k);
        memcpy(&found[k], &word, sizeof word);
    }
    return memcmp(found, image->application, sizeof found) == 0;
}

uint32_t rig_counter(const boot_rig_t *rig)
{
    const boot_journal_t counter = boot_counter(&rig->cfg);
    return boot_journal_read(&counter);
}
