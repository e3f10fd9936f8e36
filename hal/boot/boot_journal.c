#include "boot_journal.h"

static bool blank_at(const boot_journal_t *j, uint32_t offset)
{
    uint32_t words[2];
    return boot_read(j->flash, j->area, offset, words);
}

/* Of a record; 0: blank or not whole. */
static uint32_t number_at(const boot_journal_t *j, uint32_t offset)
{
    uint32_t words[2];
    (void)boot_read(j->flash, j->area, offset, words);
    return (words[0] == ~words[1]) ? words[0] : 0u;
}

uint32_t boot_journal_read(const boot_journal_t *j)
{
    uint32_t highest = 0u;
    for (uint32_t at = j->from; at < j->end; at += BOOT_UNIT_BYTES) {
        const uint32_t number = number_at(j, at);
        highest = (number > highest) ? number : highest;
    }
    return highest;
}

/* Behind the last unit that is not blank. */
static uint32_t first_free(const boot_journal_t *j)
{
    uint32_t at = j->end;
    while ((at > j->from) && blank_at(j, at - BOOT_UNIT_BYTES)) {
        at -= BOOT_UNIT_BYTES;
    }
    return at;
}

static bool proven(const boot_journal_t *j, uint32_t number)
{
    uint32_t before = 0u;
    for (uint32_t at = j->from; at + BOOT_UNIT_BYTES < j->end; at += BOOT_UNIT_BYTES) {
        const uint32_t now = number_at(j, at);
        if ((now >= number) && (now == before) && !blank_at(j, at + BOOT_UNIT_BYTES)) {
            return true;
        }
        before = now;
    }
    return false;
}

/* A unit that fails is left behind, and the three begin anew. */
static bool append(const boot_journal_t *j, uint32_t number)
{
    const uint32_t record[2] = {number, ~number};
    uint32_t written = 0u;
    for (uint32_t at = first_free(j); at < j->end; at += BOOT_UNIT_BYTES) {
        written = boot_write(j->flash, j->area, at, record) ? (written + 1u) : 0u;
        if (written == BOOT_JOURNAL_RECORDS) {
            return true;
        }
    }
    return false;
}

bool boot_journal_raise(const boot_journal_t *j, uint32_t number)
{
    return proven(j, number) || append(j, number);
}

bool boot_journal_room(const boot_journal_t *j)
{
    return first_free(j) + BOOT_JOURNAL_RECORDS * BOOT_UNIT_BYTES <= j->end;
}
