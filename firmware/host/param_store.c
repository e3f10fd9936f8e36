#include "param_store.h"

#include "crc32c.h"

#define MAGIC         0x5A485053u /* "ZHPS" */
#define FORMAT        1u
#define MARK          0x4B52414Du
#define HEADER_WORDS  8u
#define TRAILER_WORDS 2u
#define ENTRY_WORDS   2u
#define ENTRIES_MAX   1024u
#define WORD_BYTES    4u
#define UNIT_WORDS    2u  /* at most */
#define VERIFY_WORDS  16u /* per slice */

/* Words of the header. */
#define AT_MAGIC    0u
#define AT_FORMAT   1u
#define AT_SEQUENCE 2u
#define AT_MOTOR_ID 3u
#define AT_TABLE    4u
#define AT_ENTRIES  5u

typedef enum {
    MARK_BLANK,
    MARK_GOOD,
    MARK_DAMAGED
} mark_t;

typedef struct {
    const hal_flash_t *flash;
    uint32_t slot;
    uint32_t at;
    uint32_t crc; /* of all words so far */
} reader_t;

static uint32_t next_word(reader_t *r)
{
    const uint32_t word = r->flash->read(r->flash->context, r->slot, WORD_BYTES * r->at);
    r->crc = crc32c_update(r->crc, &word, sizeof word);
    r->at++;
    return word;
}

static uint32_t body_words(uint32_t entries)
{
    return HEADER_WORDS + ENTRY_WORDS * entries;
}

static bool fits(const hal_flash_t *flash, uint32_t entries)
{
    if (entries > ENTRIES_MAX) {
        return false;
    }
    const uint32_t words =
        body_words(entries) + TRAILER_WORDS + 2u * PARAM_STORE_PAIRS * flash->unit_words;
    return WORD_BYTES * words <= flash->slot_bytes;
}

/* The identity of a parameter. */
static uint32_t key_of(const char *name)
{
    uint32_t crc = 0u;
    for (const char *at = name; *at != '\0'; at++) {
        crc = crc32c_update(crc, at, 1u);
    }
    return crc;
}

/* Index of the parameter with this key; `guess` is looked at first: a record of today's list is in
 * its order. params_count(): none. */
static size_t find_key(const param_store_config_t *cfg, uint32_t key, size_t guess, bool *renamed)
{
    *renamed = false;
    const size_t count = params_count();
    for (size_t k = 0u; k < count; k++) {
        const size_t index = (guess + k) % count;
        if (key_of(params_info(index)->name) == key) {
            return index;
        }
    }
    for (uint32_t k = 0u; k < cfg->rename_count; k++) {
        if (key_of(cfg->rename[k].before) == key) {
            *renamed = true;
            return params_find(cfg->rename[k].now);
        }
    }
    return count;
}

static param_store_entry_t next_entry(const param_store_config_t *cfg, reader_t *r, size_t guess)
{
    param_store_entry_t entry = {.key = next_word(r), .fate = PARAM_STORE_TAKEN};
    entry.value = float_of_bits(next_word(r));
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
    reader_t r = {.flash = cfg->flash, .slot = st->used.slot, .at = body_words(n)};
    *entry = next_entry(cfg, &r, n);
    return true;
}

static void take_entries(const param_store_config_t *cfg, params_t *set, reader_t *r,
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

static uint32_t mark_offset(const hal_flash_t *flash, const param_store_record_t *record,
                            uint32_t mark)
{
    return WORD_BYTES * (body_words(record->entries) + TRAILER_WORDS +
                         (2u * record->pair + mark) * flash->unit_words);
}

static uint32_t mark_word(uint32_t k)
{
    return (k == 0u) ? MARK : ~MARK;
}

static mark_t read_mark(const hal_flash_t *flash, const param_store_record_t *record, uint32_t mark)
{
    const uint32_t offset = mark_offset(flash, record, mark);
    bool good = true;
    bool blank = true;
    for (uint32_t k = 0u; k < flash->unit_words; k++) {
        const uint32_t word = flash->read(flash->context, record->slot, offset + WORD_BYTES * k);
        good = good && (word == mark_word(k));
        blank = blank && (word == flash->erased_word);
    }
    if (good) {
        return MARK_GOOD;
    }
    return blank ? MARK_BLANK : MARK_DAMAGED;
}

/* Whether the record was committed; also finds out about its proof and the pairs left. */
static bool read_marks(const hal_flash_t *flash, param_store_record_t *record)
{
    bool committed = false;
    uint32_t unused = 0u;
    record->settled = false;
    for (uint32_t pair = 0u; pair < PARAM_STORE_PAIRS; pair++) {
        record->pair = pair;
        const mark_t first = read_mark(flash, record, 0u);
        const mark_t second = read_mark(flash, record, 1u);
        if (first == MARK_GOOD) {
            committed = true;
            if (second != MARK_BLANK) {
                record->settled = true;
            }
        }
        if ((first != MARK_BLANK) || (second != MARK_BLANK)) {
            unused = pair + 1u;
        }
    }
    record->pair = unused;
    return committed;
}

/* The values taken are the very ones that the CRC was made of: each word is read once. */
static bool decode(const param_store_config_t *cfg, param_store_t *st, uint32_t slot,
                   param_store_report_t *report)
{
    reader_t r = {.flash = cfg->flash, .slot = slot};
    uint32_t header[HEADER_WORDS];
    for (uint32_t k = 0u; k < HEADER_WORDS; k++) {
        header[k] = next_word(&r);
    }
    if ((header[AT_MAGIC] != MAGIC) || (header[AT_FORMAT] != FORMAT) ||
        !fits(cfg->flash, header[AT_ENTRIES])) {
        return false;
    }
    *report = (param_store_report_t){.made_for = {header[AT_MOTOR_ID], header[AT_TABLE]}};
    take_entries(cfg, &st->set, &r, header[AT_ENTRIES], report);
    const uint32_t crc = r.crc;
    const uint32_t stored = next_word(&r);
    const uint32_t complement = next_word(&r);
    if ((stored != crc) || (complement != ~crc)) {
        return false;
    }
    st->used = (param_store_record_t){
        .slot = slot, .sequence = header[AT_SEQUENCE], .entries = header[AT_ENTRIES]};
    return read_marks(cfg->flash, &st->used);
}

static uint32_t header_word(const hal_flash_t *flash, uint32_t slot, uint32_t at)
{
    return flash->read(flash->context, slot, WORD_BYTES * at);
}

/* The first save goes to slot 0 and ends with its marks: a record there whose marks prove it, or
 * anything in slot 1, and something was saved once. A torn first save shows neither. */
static bool never_saved(const hal_flash_t *flash)
{
    for (uint32_t k = 0u; k < HEADER_WORDS; k++) {
        if (header_word(flash, 1u, k) != flash->erased_word) {
            return false;
        }
    }
    param_store_record_t record = {.entries = header_word(flash, 0u, AT_ENTRIES)};
    if ((header_word(flash, 0u, AT_MAGIC) != MAGIC) || !fits(flash, record.entries)) {
        return true;
    }
    (void)read_marks(flash, &record);
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
    const uint32_t ahead =
        header_word(flash, 1u, AT_SEQUENCE) - header_word(flash, 0u, AT_SEQUENCE);
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

bool param_store_save(const param_store_config_t *cfg, param_store_t *st, const params_t *params)
{
    if ((cfg->flash == NULL) || st->wanted || !fits(cfg->flash, (uint32_t)params_count())) {
        return false;
    }
    st->set = *params;
    st->wanted = true;
    st->failed = false;
    return true;
}

static uint32_t record_word(const param_store_config_t *cfg, const param_store_t *st, uint32_t at)
{
    const uint32_t header[HEADER_WORDS] = {
        [AT_MAGIC] = MAGIC,
        [AT_FORMAT] = FORMAT,
        [AT_SEQUENCE] = st->next.sequence,
        [AT_MOTOR_ID] = cfg->table.motor_id,
        [AT_TABLE] = cfg->table.crc32c,
        [AT_ENTRIES] = st->next.entries,
    };
    if (at < HEADER_WORDS) {
        return header[at];
    }
    const uint32_t index = (at - HEADER_WORDS) / ENTRY_WORDS;
    if (index >= st->next.entries) {
        return (at == body_words(st->next.entries)) ? st->crc : ~st->crc;
    }
    return ((at % ENTRY_WORDS) == 0u) ? key_of(params_info(index)->name)
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
    const uint32_t body = body_words(st->next.entries);
    uint32_t words[UNIT_WORDS];
    uint32_t crc = st->crc;
    for (uint32_t k = 0u; k < unit; k++) {
        words[k] = record_word(cfg, st, st->at + k);
        /* Body and trailer are whole units each. */
        if (st->at < body) {
            crc = crc32c_update(crc, &words[k], sizeof words[k]);
        }
    }
    const hal_flash_status_t status =
        cfg->flash->program(cfg->flash->context, st->next.slot, WORD_BYTES * st->at, words);
    if (status == HAL_FLASH_DONE) {
        st->crc = crc;
        st->at += unit;
        if (st->at >= (body + TRAILER_WORDS)) {
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
    const uint32_t body = body_words(st->next.entries);
    reader_t r = {.flash = cfg->flash, .slot = st->next.slot, .at = st->at, .crc = st->read_back};
    for (uint32_t k = 0u; (k < VERIFY_WORDS) && (r.at < body); k++) {
        (void)next_word(&r);
    }
    st->at = r.at;
    st->read_back = r.crc;
    if (r.at < body) {
        return;
    }
    const uint32_t stored = next_word(&r);
    const uint32_t complement = next_word(&r);
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
    const uint32_t words[UNIT_WORDS] = {mark_word(0u), mark_word(1u)};
    const hal_flash_status_t status =
        flash->program(flash->context, st->next.slot, mark_offset(flash, &st->next, mark), words);
    if (status == HAL_FLASH_BUSY) {
        return;
    }
    const bool good =
        (status == HAL_FLASH_DONE) && (read_mark(flash, &st->next, mark) == MARK_GOOD);
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
