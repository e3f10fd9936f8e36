/* A record in a flash slot, word by word; param_store.h describes its content. */
#ifndef PARAM_RECORD_H
#define PARAM_RECORD_H

#include "param_store.h"

#define PARAM_RECORD_MAGIC         0x5A485053u /* "ZHPS" */
#define PARAM_RECORD_FORMAT        1u
#define PARAM_RECORD_MARK          0x4B52414Du
#define PARAM_RECORD_HEADER_WORDS  8u
#define PARAM_RECORD_TRAILER_WORDS 2u
#define PARAM_RECORD_ENTRY_WORDS   2u
#define PARAM_RECORD_ENTRIES_MAX   1024u
#define PARAM_RECORD_WORD_BYTES    4u
#define PARAM_RECORD_UNIT_WORDS    2u /* at most */

/* Words of the header. */
#define PARAM_RECORD_AT_MAGIC    0u
#define PARAM_RECORD_AT_FORMAT   1u
#define PARAM_RECORD_AT_SEQUENCE 2u
#define PARAM_RECORD_AT_MOTOR_ID 3u
#define PARAM_RECORD_AT_TABLE    4u
#define PARAM_RECORD_AT_ENTRIES  5u

typedef enum {
    PARAM_RECORD_MARK_BLANK,
    PARAM_RECORD_MARK_GOOD,
    PARAM_RECORD_MARK_DAMAGED
} param_record_mark_t;

typedef struct {
    const hal_flash_t *flash;
    uint32_t slot;
    uint32_t at;
    uint32_t crc; /* of all words so far */
} param_record_reader_t;

/* Returns the next word and adds it to the CRC. */
uint32_t param_record_next(param_record_reader_t *r);

/* Words that the CRC covers. */
uint32_t param_record_body_words(uint32_t entries);

bool param_record_fits(const hal_flash_t *flash, uint32_t entries);

/* The identity of a parameter: the CRC-32C of its name. */
uint32_t param_record_key(const char *name);

/* Position of mark 0 or 1 of the record's current pair, in bytes, and its content. */
uint32_t param_record_mark_offset(const hal_flash_t *flash, const param_store_record_t *record,
                                  uint32_t mark);
uint32_t param_record_mark_word(uint32_t k);

param_record_mark_t param_record_mark(const hal_flash_t *flash, const param_store_record_t *record,
                                      uint32_t mark);

/* True when the record was committed; also finds its proof and the next unused pair. */
bool param_record_find_marks(const hal_flash_t *flash, param_store_record_t *record);

#endif
