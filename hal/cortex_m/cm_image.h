/* Identity of the flash image, and the check that it is still as linked.
 *
 * The CRC-32C over everything before it is the image's last word, written after linking
 * (tools/stamp_image.py).
 */
#ifndef CM_IMAGE_H
#define CM_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

#define CM_IMAGE_MAGIC 0x5A48494Du /* "ZHIM" */

/* At a fixed address, after the vectors, for tools that read a .bin. */
typedef struct {
    uint32_t magic;
    uint32_t bytes; /* of the image, its CRC included */
    char version[12];
    char git[44];  /* git describe of the source, "-dirty" when it had changes */
    char port[16]; /* folder in hal/ */
    char config[16];
    char motor[32];
    uint32_t table_crc32c;
    uint32_t params_crc32c;
} cm_image_info_t;

extern const cm_image_info_t cm_image_info;

uint32_t cm_image_crc32c(void);

/* The whole image at once. */
bool cm_image_intact(void);

/* The running check: one slice per call; false once a complete round has found a changed image. */
typedef struct {
    uint32_t offset;
    uint32_t crc;
} cm_image_check_t;

bool cm_image_check_slice(cm_image_check_t *check);

/* One line for the banner and the host link, without terminator; returns its length. */
#define CM_IMAGE_BANNER_BYTES 224u
uint32_t cm_image_banner(char *text);

#endif
