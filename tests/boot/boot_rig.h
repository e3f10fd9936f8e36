/* A boot loader with its flash in memory, and a host that sends it updates. */
#ifndef BOOT_RIG_H
#define BOOT_RIG_H

#include "boot_link.h"
#include "sim_flash.h"

#define RIG_IMAGE_BYTES   64u
#define RIG_COUNTER_BYTES 2048u

typedef struct {
    boot_header_t header;
    uint8_t application[RIG_IMAGE_BYTES];
} rig_image_t;

typedef struct {
    sim_flash_t sim; /* slots numbered as boot_area_t */
    boot_flash_t flash;
    boot_config_t cfg;
    boot_link_t link;
    uint32_t sequence;
    bool fails; /* the operation at which the power would go fails instead; the power stays */
} boot_rig_t;

/* Blank flash; program operations of so many words: 1 as the F405's, 2 as the G431's. */
void rig_init(boot_rig_t *rig, bool staged, uint32_t unit_words, uint64_t seed);

/* Signed, for the rig's board; the content follows from the version. */
rig_image_t rig_image(const boot_rig_t *rig, uint32_t version);
/* The hash of an application of any length, into the header. */
void rig_hash(boot_header_t *header, const void *application, uint32_t bytes);
void rig_sign(const boot_rig_t *rig, rig_image_t *image);

/* The loader as after a reset; what boot_start said. */
bool rig_boot(boot_rig_t *rig);

/* One request and its status; the answer's body in rig->link.answer. */
boot_status_t rig_request(boot_rig_t *rig, uint8_t op, const void *body, uint32_t n);

boot_status_t rig_begin(boot_rig_t *rig, const rig_image_t *image);
boot_status_t rig_data(boot_rig_t *rig, uint32_t offset, const void *bytes, uint32_t n);

/* All of an update, up to the first refusal. */
boot_status_t rig_send(boot_rig_t *rig, const rig_image_t *image);

/* Whether the running slot holds this application, byte for byte. */
bool rig_runs(boot_rig_t *rig, const rig_image_t *image);

uint32_t rig_counter(const boot_rig_t *rig);

#endif
