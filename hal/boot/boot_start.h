/* What a reset does, before anybody is heard: bring a complete update into the running slot, prove
 * the application there, raise the counter to its version. Begun anew at every reset; nothing has
 * to be remembered.
 *
 * Two slots: an update is received in one and copied to the other, where it runs. It stays, so that
 * a copy that was cut short begins again, and a running slot that decays is written anew. One slot:
 * an update overwrites the application, and after a cut the loader waits for a repeat.
 */
#ifndef BOOT_START_H
#define BOOT_START_H

#include "boot_image.h"
#include "boot_journal.h"

/* True: the application in BOOT_RUN is signed, for this board, not older than the counter, and the
 * counter stands at its version for good. Only then may it be started. */
bool boot_start(const boot_config_t *cfg);

/* Signed, complete, of this board, at least of the counter's version, every byte as signed. */
bool boot_slot_good(const boot_config_t *cfg, boot_area_t slot, boot_header_t *header);

boot_journal_t boot_counter(const boot_config_t *cfg);

#endif
