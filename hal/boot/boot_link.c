#include "boot_link.h"

void boot_link_reset(boot_link_t *link, bool running, uint32_t window_ms)
{
    *link = (boot_link_t){.running = running, .left_ms = window_ms};
}

bool boot_link_listens(const boot_link_t *link)
{
    return !link->done && (!link->running || (link->left_ms > 0u));
}

void boot_link_tick(boot_link_t *link)
{
    if (link->left_ms > 0u) {
        link->left_ms--;
    }
}

static boot_area_t target(const boot_config_t *cfg)
{
    return cfg->flash->staged ? BOOT_STAGE : BOOT_RUN;
}

static boot_status_t do_ask(const boot_config_t *cfg, boot_link_t *link)
{
    boot_header_t run = {{0u}};
    if (link->running) {
        boot_header_read(cfg->flash, BOOT_RUN, &run);
    }
    const boot_journal_t counter = boot_counter(cfg);
    command_writer_t *const w = &link->answer;
    command_put_u16(w, (uint16_t)BOOT_LINK_PROTOCOL);
    command_put_u32(w, run.word[BOOT_AT_VERSION]);
    command_put_u32(w, boot_journal_read(&counter));
    command_put_u32(w, cfg->flash->slot_bytes - BOOT_IMAGE_AT);
    for (uint32_t k = 0u; k < BOOT_BOARD_WORDS; k++) {
        command_put_u32(w, cfg->board[k]);
    }
    return BOOT_GOOD;
}

/* Erases only for a header that is signed, of this board, and newer than what runs; without
 * anything to run, the counter's own version may be sent again. */
static boot_status_t do_begin(const boot_config_t *cfg, boot_link_t *link, command_reader_t *body)
{
    for (uint32_t k = 0u; k < BOOT_HEADER_WORDS; k++) {
        link->header.word[k] = command_take_u32(body);
    }
    link->open = false;
    const boot_journal_t counter = boot_counter(cfg);
    const uint32_t least = boot_journal_read(&counter) + (link->running ? 1u : 0u);
    const boot_status_t status = boot_header_check(cfg, &link->header, least);
    if (status != BOOT_GOOD) {
        return status;
    }
    if (!boot_journal_room(&counter)) {
        return BOOT_COUNTER_FULL;
    }
    if (!cfg->flash->staged) {
        link->running = false;
    }
    if (!cfg->flash->erase(cfg->flash->context, target(cfg))) {
        return BOOT_FLASH_FAILS;
    }
    link->open = true;
    link->next = 0u;
    return BOOT_GOOD;
}

static boot_status_t do_data(const boot_config_t *cfg, boot_link_t *link, command_reader_t *body)
{
    const uint32_t offset = command_take_u32(body);
    if (!link->open || (offset != link->next)) {
        return BOOT_OUT_OF_ORDER;
    }
    if ((body->left % BOOT_UNIT_BYTES != 0u) ||
        (body->left > link->header.word[BOOT_AT_BYTES] - offset)) {
        return BOOT_NOT_COMPLETE;
    }
    while (body->left > 0u) {
        const uint32_t low = command_take_u32(body);
        const uint32_t words[2] = {low, command_take_u32(body)};
        if (!boot_write(cfg->flash, target(cfg), BOOT_IMAGE_AT + link->next, words)) {
            link->open = false;
            return BOOT_FLASH_FAILS;
        }
        link->next += BOOT_UNIT_BYTES;
    }
    command_put_u32(&link->answer, link->next);
    return BOOT_GOOD;
}

static boot_status_t do_commit(const boot_config_t *cfg, boot_link_t *link)
{
    if (!link->open) {
        return BOOT_OUT_OF_ORDER;
    }
    link->open = false;
    if ((link->next != link->header.word[BOOT_AT_BYTES]) ||
        !boot_image_intact(cfg->flash, target(cfg), &link->header)) {
        return BOOT_NOT_COMPLETE;
    }
    if (!boot_image_complete(cfg->flash, target(cfg), &link->header)) {
        return BOOT_FLASH_FAILS;
    }
    link->done = true;
    return BOOT_GOOD;
}

/* Checked before anything is done: a request of another length is of another protocol. */
static bool length_good(uint8_t op, uint32_t n)
{
    switch (op) {
    case BOOT_LINK_BEGIN:
        return n == BOOT_HEADER_BYTES;
    case BOOT_LINK_DATA:
        return (n > 4u) && (n <= 4u + BOOT_LINK_DATA_MAX);
    default:
        return n == 0u;
    }
}

static boot_status_t request(const boot_config_t *cfg, boot_link_t *link,
                             const command_frame_t *frame)
{
    command_reader_t body = {.at = frame->body, .left = frame->body_bytes};
    if (!length_good(frame->op, body.left)) {
        return BOOT_UNKNOWN;
    }
    switch (frame->op) {
    case BOOT_LINK_ASK:
        return do_ask(cfg, link);
    case BOOT_LINK_BEGIN:
        return do_begin(cfg, link, &body);
    case BOOT_LINK_DATA:
        return do_data(cfg, link, &body);
    case BOOT_LINK_COMMIT:
        return do_commit(cfg, link);
    default:
        return BOOT_UNKNOWN;
    }
}

bool boot_link_byte(const boot_config_t *cfg, boot_link_t *link, uint8_t byte)
{
    command_frame_t frame;
    if (!command_byte(&link->parser, byte, &frame)) {
        return false;
    }
    link->left_ms = BOOT_LINK_PATIENCE_MS;
    if (link->answered && (frame.sequence == link->last_sequence) &&
        (frame.crc32c == link->last_crc32c)) {
        return true; /* the answer was lost on its way: once more, but nothing is done twice */
    }
    const uint8_t op = (uint8_t)(frame.op | BOOT_LINK_ANSWER);
    command_begin(&link->answer, frame.sequence, op);
    command_put_u8(&link->answer, (uint8_t)BOOT_GOOD);
    const boot_status_t status = request(cfg, link, &frame);
    if (status != BOOT_GOOD) {
        command_begin(&link->answer, frame.sequence, op);
        command_put_u8(&link->answer, (uint8_t)status);
    }
    command_end(&link->answer);
    link->answered = true;
    link->last_sequence = frame.sequence;
    link->last_crc32c = frame.crc32c;
    return true;
}
