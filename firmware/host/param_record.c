#include "param_record.h"

#include "crc32c.h"

uint32_t param_record_next(param_record_reader_t *r)
{
    const uint32_t word =
        r->flash->read(r->flash->context, r->slot, PARAM_RECORD_WORD_BYTES * r->at);
    r->crc = crc32c_update(r->crc, &word, sizeof word);
    r->at++;
    return word;
}

uint32_t param_record_body_words(uint32_t entries)
{
    return PARAM_RECORD_HEADER_WORDS + PARAM_RECORD_ENTRY_WORDS * entries;
}

bool param_record_fits(const hal_flash_t *flash, uint32_t entries)
{
    if (entries > PARAM_RECORD_ENTRIES_MAX) {
        return false;
    }
    const uint32_t words = param_record_body_words(entries) + PARAM_RECORD_TRAILER_WORDS +
                           2u * PARAM_STORE_PAIRS * flash->unit_words;
    return PARAM_RECORD_WORD_BYTES * words <= flash->slot_bytes;
}

uint32_t param_record_key(const char *name)
{
    uint32_t crc = 0u;
    for (const char *at = name; *at != '\0'; at++) {
        crc = crc32c_update(crc, at, 1u);
    }
    return crc;
}

uint32_t param_record_mark_offset(const hal_flash_t *flash, const param_store_record_t *record,
                                  uint32_t mark)
{
    return PARAM_RECORD_WORD_BYTES *
           (param_record_body_words(record->entries) + PARAM_RECORD_TRAILER_WORDS +
            (2u * record->pair + mark) * flash->unit_words);
}

uint32_t param_record_mark_word(uint32_t k)
{
    return (k == 0u) ? PARAM_RECORD_MARK : ~PARAM_RECORD_MARK;
}

param_record_mark_t param_record_mark(const hal_flash_t *flash, const param_store_record_t *record,
                                      uint32_t mark)
{
    const uint32_t offset = param_record_mark_offset(flash, record, mark);
    bool good = true;
    bool blank = true;
    for (uint32_t k = 0u; k < flash->unit_words; k++) {
        const uint32_t word =
            flash->read(flash->context, record->slot, offset + PARAM_RECORD_WORD_BYTES * k);
        good = good && (word == param_record_mark_word(k));
        blank = blank && (word == flash->erased_word);
    }
    if (good) {
        return PARAM_RECORD_MARK_GOOD;
    }
    return blank ? PARAM_RECORD_MARK_BLANK : PARAM_RECORD_MARK_DAMAGED;
}

bool param_record_find_marks(const hal_flash_t *flash, param_store_record_t *record)
{
    bool committed = false;
    uint32_t unused = 0u;
    record->settled = false;
    for (uint32_t pair = 0u; pair < PARAM_STORE_PAIRS; pair++) {
        record->pair = pair;
        const param_record_mark_t first = param_record_mark(flash, record, 0u);
        const param_record_mark_t second = param_record_mark(flash, record, 1u);
        if (first == PARAM_RECORD_MARK_GOOD) {
            committed = true;
            if (second != PARAM_RECORD_MARK_BLANK) {
                record->settled = true;
            }
        }
        if ((first != PARAM_RECORD_MARK_BLANK) || (second != PARAM_RECORD_MARK_BLANK)) {
            unused = pair + 1u;
        }
    }
    record->pair = unused;
    return committed;
}
