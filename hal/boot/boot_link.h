/* Updates over the serial line: frames of the host link (firmware/host/command.h), requests of the
 * loader's own.
 *
 * There is no session and no key: whoever holds the signing key may update, over whatever line.
 * BEGIN carries the signed header; unless that is good for this board and newer than the counter,
 * nothing is erased. With two slots, the running one is out of reach from here.
 *
 *   ASK     -                     status, protocol u16, version running u32 (0: none), counter u32,
 *                                 bytes of a slot's application u32, board 16
 *   BEGIN   header                status
 *   DATA    offset u32, bytes     status, next offset u32
 *   COMMIT  -                     status; then the loader begins anew, as after a reset
 */
#ifndef BOOT_LINK_H
#define BOOT_LINK_H

#include "boot_start.h"
#include "command.h"

#define BOOT_LINK_PROTOCOL 1u
#define BOOT_LINK_ANSWER   0x80u
#define BOOT_LINK_DATA_MAX 224u /* a multiple of BOOT_UNIT_BYTES */

#define BOOT_LINK_WINDOW_MS   500u   /* after a reset */
#define BOOT_LINK_CALLED_MS   30000u /* after a reset for an update */
#define BOOT_LINK_PATIENCE_MS 3000u  /* after each request */

enum {
    BOOT_LINK_ASK = 0x70,
    BOOT_LINK_BEGIN = 0x71,
    BOOT_LINK_DATA = 0x72,
    BOOT_LINK_COMMIT = 0x73
};

typedef struct {
    command_parser_t parser;
    command_writer_t answer; /* byte[0..length-1] go to the line when boot_link_byte says so */
    boot_header_t header;    /* of the update under way */
    uint32_t next;           /* offset in its application */
    bool open;               /* an update has begun */
    bool running;            /* what boot_start found */
    bool done;               /* an update is complete: begin anew */
    uint32_t left_ms;        /* of the time to listen while there is something to start */
    bool answered;
    uint8_t last_sequence;
    uint32_t last_crc32c;
} boot_link_t;

void boot_link_reset(boot_link_t *link, bool running, uint32_t window_ms);

/* Until an update is complete, or nobody asks any more; with nothing to start for ever. */
bool boot_link_listens(const boot_link_t *link);

/* Once per millisecond. */
void boot_link_tick(boot_link_t *link);

/* One byte from the line; true when there is an answer. Takes seconds when it erases. */
bool boot_link_byte(const boot_config_t *cfg, boot_link_t *link, uint8_t byte);

#endif
