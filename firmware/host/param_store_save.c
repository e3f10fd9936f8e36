#include "param_store.h"

#include "crc32c.h"
#include "param_record.h"

#define VERIFY_WORDS 16u /* per slice */

bool param_store_save(const param_store_config_t *cfg, param_store_t *st, const params_t *params)
{
    if ((cfg->flash == NULL) || st->wanted ||
        !param_record_fits(cfg->flash, (uint32_t)params_count())) {
        return false;
    }
    st->set = *params;
    st->wanted = true;
    st->failed = false;
    return true;
}

static uint32_t record_word(const param_store_config_t *cfg, const param_store_t *st, uint32_t at)
{
    const uint32_t header[PARAM_RECORD_HEADER_WORDS] = {
        [PARAM_RECORD_AT_MAGIC] = PARAM_RECORD_MAGIC,
        [PARAM_RECORD_AT_FORMAT] = PARAM_RECORD_FORMAT,
        [PARAM_RECORD_AT_SEQUENCE] = st->next.sequence,
        [PARAM_RECORD_AT_MOTOR_ID] = cfg->table.motor_id,
        [PARAM_RECORD_AT_TABLE] = cfg->table.crc32c,
        [PARAM_RECORD_AT_ENTRIES] = st->next.entries,
    };
    if (at < PARAM_RECORD_HEADER_WORDS) {
        return header[at];
    }
    const uint32_t index = (at - PARAM_RECORD_HEADER_WORDS) / PARAM_RECORD_ENTRY_WORDS;
    if (index >= st->next.entries) {
        return (at == param_record_body_words(st->next.entries)) ? st->crc : ~st->crc;
    }
    return ((at % PARAM_RECORD_ENTRY_WORDS) == 0u) ? param_record_key(params_name(index))
                                                   : float_bits(params_get(&st->set, index));
}

/* The set before stays in use. */
static void fail(param_store_t *st)
{
    st->phase = PARAM_STORE_IDLE;
    st->wanted = false;
    st->failed = true;
}

static void begin(param_store_t *st)
{
    st->saving = !(st->present && !st->used.settled && (st->used.pair < PARAM_STORE_PAIRS));
    if (!st->saving) {
        st->next = st->used;
        st->phase = PARAM_STORE_MARK_FIRST;
    } else if (st->wanted) {
        st->next = (param_store_record_t){.slot = st->present ? (1u - st->used.slot) : 0u,
                                          .sequence = st->used.sequence + 1u,
                                          .entries = (uint32_t)params_count()};
        st->phase = PARAM_STORE_ERASE;
    } else {
        /* Nothing to do. */
    }
}

static void erase(const param_store_config_t *cfg, param_store_t *st)
{
    const hal_flash_status_t status = cfg->flash->erase(cfg->flash->context, st->next.slot);
    if (status == HAL_FLASH_DONE) {
        st->at = 0u;
        st->crc = 0u;
        st->phase = PARAM_STORE_PROGRAM;
    } else if (status == HAL_FLASH_FAILED) {
        fail(st);
    } else {
        /* Busy: the same again. */
    }
}

static void program(const param_store_config_t *cfg, param_store_t *st)
{
    const uint32_t unit = cfg->flash->unit_words;
    const uint32_t body = param_record_body_words(st->next.entries);
    uint32_t words[PARAM_RECORD_UNIT_WORDS];
    uint32_t crc = st->crc;
    for (uint32_t k = 0u; k < unit; k++) {
        words[k] = record_word(cfg, st, st->at + k);
        /* Body and trailer are whole units each. */
        if (st->at < body) {
            crc = crc32c_update(crc, &words[k], sizeof words[k]);
        }
    }
    const hal_flash_status_t status = cfg->flash->program(cfg->flash->context, st->next.slot,
                                                          PARAM_RECORD_WORD_BYTES * st->at, words);
    if (status == HAL_FLASH_DONE) {
        st->crc = crc;
        st->at += unit;
        if (st->at >= (body + PARAM_RECORD_TRAILER_WORDS)) {
            st->at = 0u;
            st->read_back = 0u;
            st->phase = PARAM_STORE_VERIFY;
        }
    } else if (status == HAL_FLASH_FAILED) {
        fail(st);
    } else {
        /* Busy: the same again. */
    }
}

static void verify(const param_store_config_t *cfg, param_store_t *st)
{
    const uint32_t body = param_record_body_words(st->next.entries);
    param_record_reader_t r = {
        .flash = cfg->flash, .slot = st->next.slot, .at = st->at, .crc = st->read_back};
    for (uint32_t k = 0u; (k < VERIFY_WORDS) && (r.at < body); k++) {
        (void)param_record_next(&r);
    }
    st->at = r.at;
    st->read_back = r.crc;
    if (r.at < body) {
        return;
    }
    const uint32_t stored = param_record_next(&r);
    const uint32_t complement = param_record_next(&r);
    if ((st->read_back == st->crc) && (stored == st->crc) && (complement == ~st->crc)) {
        st->phase = PARAM_STORE_MARK_FIRST;
    } else {
        fail(st);
    }
}

/* Both marks are there, or the second failed: the record is valid then, and to be proven anew. */
static void marks_end(param_store_t *st, bool settled)
{
    st->next.settled = settled;
    st->next.pair++;
    st->used = st->next;
    st->present = true;
    st->phase = PARAM_STORE_IDLE;
    if (st->saving) {
        st->wanted = false;
    }
}

static void write_mark(const param_store_config_t *cfg, param_store_t *st)
{
    const hal_flash_t *flash = cfg->flash;
    uint32_t mark = 0u;
    if (st->phase == PARAM_STORE_MARK_SECOND) {
        mark = 1u;
    }
    const uint32_t words[PARAM_RECORD_UNIT_WORDS] = {param_record_mark_word(0u),
                                                     param_record_mark_word(1u)};
    const hal_flash_status_t status = flash->program(
        flash->context, st->next.slot, param_record_mark_offset(flash, &st->next, mark), words);
    if (status == HAL_FLASH_BUSY) {
        return;
    }
    const bool good = (status == HAL_FLASH_DONE) &&
                      (param_record_mark(flash, &st->next, mark) == PARAM_RECORD_MARK_GOOD);
    if (good && (mark == 0u)) {
        st->phase = PARAM_STORE_MARK_SECOND;
    } else if (!good && (mark == 0u) && st->saving) {
        fail(st);
    } else {
        marks_end(st, good);
    }
}

bool param_store_step(const param_store_config_t *cfg, param_store_t *st, bool allowed)
{
    if (!allowed || (cfg->flash == NULL)) {
        return st->wanted;
    }
    switch (st->phase) {
    case PARAM_STORE_ERASE:
        erase(cfg, st);
        break;
    case PARAM_STORE_PROGRAM:
        program(cfg, st);
        break;
    case PARAM_STORE_VERIFY:
        verify(cfg, st);
        break;
    case PARAM_STORE_MARK_FIRST:
    case PARAM_STORE_MARK_SECOND:
        write_mark(cfg, st);
        break;
    case PARAM_STORE_IDLE:
    default:
        begin(st);
        break;
    }
    return st->wanted;
}
