/* A number in flash that only rises, whatever happens to the power: records are added and never
 * removed. The counter of versions is one; so is the mark that completes a slot.
 *
 * Records of one unit each: the number and its complement. A raise appends three equal ones, each
 * begun after the one before was read back. The number is the highest of all whole records.
 *
 * Why three: a unit that was being programmed when the power failed may read correctly today and
 * wrongly tomorrow, or read as blank and be used again. So the first of three may lie where an
 * earlier raise was torn, and the last may be torn itself. The second is neither: once a record
 * of the same number stands before it and the unit behind it is not blank, it is proven.
 */
#ifndef BOOT_JOURNAL_H
#define BOOT_JOURNAL_H

#include "boot_flash.h"

#define BOOT_JOURNAL_RECORDS 3u /* of a raise */

typedef struct {
    const boot_flash_t *flash;
    boot_area_t area;
    uint32_t from; /* offsets in the area */
    uint32_t end;
} boot_journal_t;

/* The highest number of a whole record; 0: none. */
uint32_t boot_journal_read(const boot_journal_t *journal);

/* True when this number, or a higher one, is proven; appends records until it is. False: the flash
 * fails, or there is no room. */
bool boot_journal_raise(const boot_journal_t *journal, uint32_t number);

/* Whether there is room for one more raise. */
bool boot_journal_room(const boot_journal_t *journal);

#endif
