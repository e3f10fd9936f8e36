#include "param_store.h"

#include "param_record.h"

/* Index of the parameter with this key; `guess` is looked at first: a record of today's list is in
 * its order. params_count(): none. */
static size_t find_key(const param_store_config_t *cfg, uint32_t key, size_t guess, bool *renamed)
{
    *renamed = false;
    const size_t count = params_count();
    for (size_t k = 0u; k < count; k++) {
        const size_t index = (guess + k) % count;
        if (param_record_key(params_name(index)) == key) {
            return index;
        }
    }
    for (uint32_t k = 0u; k < cfg->rename_count; k++) {
        if (param_record_key(cfg->rename[k].before) == key) {
            *renamed = true;
            return params_find(cfg->rename[k].now);
        }
    }
    return count;
}

static param_store_entry_t next_entry(const param_store_config_t *cfg, param_record_reader_t *r,
                                      size_t guess)
{
    param_store_entry_t entry = {.key = param_record_next(r), .fate = PARAM_STORE_TAKEN};
    entry.value = float_of_bits(param_record_next(r));
    bool renamed;
    entry.index = find_key(cfg, entry.key, guess, &renamed);
    if (entry.index == params_count()) {
        entry.fate = PARAM_STORE_UNKNOWN;
    } else if (params_allows(entry.index, entry.value) != PARAMS_OK) {
        entry.fate = PARAM_STORE_REFUSED;
    } else if (renamed) {
        entry.fate = PARAM_STORE_RENAMED;
    } else {
        /* as it was saved */
    }
    return entry;
}

bool param_store_entry(const param_store_config_t *cfg, const param_store_t *st, uint32_t n,
                       param_store_entry_t *entry)
{
    if ((cfg->flash == NULL) || !st->present || (n >= st->used.entries)) {
        return false;
    }
    param_record_reader_t r = {
        .flash = cfg->flash, .slot = st->used.slot, .at = param_record_body_words(n)};
    *entry = next_entry(cfg, &r, n);
    return true;
}

static void take_entries(const param_store_config_t *cfg, params_t *set, param_record_reader_t *r,
                         uint32_t entries, param_store_report_t *report)
{
    const size_t count = params_count();
    size_t guess = 0u;
    for (uint32_t n = 0u; n < entries; n++) {
        const param_store_entry_t entry = next_entry(cfg, r, guess);
        guess = entry.index + 1u;
        if (entry.fate == PARAM_STORE_UNKNOWN) {
            report->unknown++;
        } else if (params_set(set, entry.index, entry.value) == PARAMS_OK) {
            report->taken++;
            report->renamed += (entry.fate == PARAM_STORE_RENAMED) ? 1u : 0u;
        } else {
            report->refused++;
            report->last_refused = (uint32_t)entry.index;
        }
    }
    const uint32_t known = report->taken + report->refused;
    report->missing = (known < count) ? ((uint32_t)count - known) : 0u;
}

/* The values taken are the very ones that the CRC was made of: each word is read once. */
static bool decode(const param_store_config_t *cfg, param_store_t *st, uint32_t slot,
                   param_store_report_t *report)
{
    param_record_reader_t r = {.flash = cfg->flash, .slot = slot};
    uint32_t header[PARAM_RECORD_HEADER_WORDS];
    for (uint32_t k = 0u; k < PARAM_RECORD_HEADER_WORDS; k++) {
        header[k] = param_record_next(&r);
    }
    if ((header[PARAM_RECORD_AT_MAGIC] != PARAM_RECORD_MAGIC) ||
        (header[PARAM_RECORD_AT_FORMAT] != PARAM_RECORD_FORMAT) ||
        !param_record_fits(cfg->flash, header[PARAM_RECORD_AT_ENTRIES])) {
        return false;
    }
    *report = (param_store_report_t){
        .made_for = {header[PARAM_RECORD_AT_MOTOR_ID], header[PARAM_RECORD_AT_TABLE]}};
    take_entries(cfg, &st->set, &r, header[PARAM_RECORD_AT_ENTRIES], report);
    const uint32_t crc = r.crc;
    const uint32_t stored = param_record_next(&r);
    const uint32_t complement = param_record_next(&r);
    if ((stored != crc) || (complement != ~crc)) {
        return false;
    }
    st->used = (param_store_record_t){.slot = slot,
                                      .sequence = header[PARAM_RECORD_AT_SEQUENCE],
                                      .entries = header[PARAM_RECORD_AT_ENTRIES]};
    return param_record_find_marks(cfg->flash, &st->used);
}

static uint32_t header_word(const hal_flash_t *flash, uint32_t slot, uint32_t at)
{
    return flash->read(flash->context, slot, PARAM_RECORD_WORD_BYTES * at);
}

/* The first save goes to slot 0 and ends with its marks: a record there whose marks prove it, or
 * anything in slot 1, and something was saved once. A torn first save shows neither. */
static bool never_saved(const hal_flash_t *flash)
{
    for (uint32_t k = 0u; k < PARAM_RECORD_HEADER_WORDS; k++) {
        if (header_word(flash, 1u, k) != flash->erased_word) {
            return false;
        }
    }
    param_store_record_t record = {.entries = header_word(flash, 0u, PARAM_RECORD_AT_ENTRIES)};
    if ((header_word(flash, 0u, PARAM_RECORD_AT_MAGIC) != PARAM_RECORD_MAGIC) ||
        !param_record_fits(flash, record.entries)) {
        return true;
    }
    (void)param_record_find_marks(flash, &record);
    return !record.settled;
}

param_store_found_t param_store_load(const param_store_config_t *cfg, param_store_t *st,
                                     params_t *params, param_store_report_t *report)
{
    const hal_flash_t *flash = cfg->flash;
    *st = (param_store_t){0};
    *report = (param_store_report_t){.missing = (uint32_t)params_count(), .made_for = cfg->table};
    if (flash == NULL) {
        return PARAM_STORE_EMPTY;
    }
    /* Newer first; the difference survives the counter's wrap. */
    const uint32_t ahead = header_word(flash, 1u, PARAM_RECORD_AT_SEQUENCE) -
                           header_word(flash, 0u, PARAM_RECORD_AT_SEQUENCE);
    uint32_t newer = 0u;
    if ((ahead - 1u) < 0x7FFFFFFFu) {
        newer = 1u;
    }
    for (uint32_t k = 0u; k < 2u; k++) {
        st->set = *params;
        if (decode(cfg, st, newer ^ k, report)) {
            st->present = true;
            *params = st->set;
            return PARAM_STORE_LOADED;
        }
    }
    /* Of a record that was complete but never committed nothing may stay, its sequence above all.
     */
    *st = (param_store_t){0};
    *report = (param_store_report_t){.missing = (uint32_t)params_count(), .made_for = cfg->table};
    return never_saved(flash) ? PARAM_STORE_EMPTY : PARAM_STORE_LOST;
}
