#include "cm_image.h"

#include "cm_config.h"
#include "cm_text.h"
#include "cm_version.h"
#include "crc32c.h"
#include "image_params.h"

/* Enough slices for a whole round in some seconds of background calls. */
#define SLICE_BYTES 256u

/* A text that fills its field would run into the next. */
#define FITS(text, field) (sizeof(text) <= sizeof(((cm_image_info_t *)0)->field))
_Static_assert(FITS(ZH_VERSION, version) && FITS(ZH_GIT, git) && FITS(ZH_PORT, port) &&
                   FITS(PARAMS_CONFIG, config) && FITS(PARAMS_MOTOR, motor),
               "a name is too long for the image's header");

extern const uint8_t cm_image_start[];
extern const uint32_t cm_image_crc[]; /* the last word */
extern const char cm_image_bytes[];   /* size, as the value of a symbol */

__attribute__((section(".image_info"), used)) const cm_image_info_t cm_image_info = {
    .magic = CM_IMAGE_MAGIC,
    .bytes = (uint32_t)(uintptr_t)cm_image_bytes,
    .version = ZH_VERSION,
    .git = ZH_GIT,
    .port = ZH_PORT,
    .config = PARAMS_CONFIG,
    .motor = PARAMS_MOTOR,
    .table_crc32c = PARAMS_TABLE_CRC32C,
    .params_crc32c = PARAMS_CRC32C,
};

const cm_config_t cm_config = {.params = PARAMS_VALUES, .table = &PARAMS_TABLE};

static uint32_t checked_bytes(void)
{
    return (uint32_t)((const uint8_t *)cm_image_crc - cm_image_start);
}

uint32_t cm_image_crc32c(void)
{
    return cm_image_crc[0];
}

bool cm_image_intact(void)
{
    return crc32c(cm_image_start, checked_bytes()) == cm_image_crc[0];
}

bool cm_image_check_slice(cm_image_check_t *check)
{
    uint32_t n = checked_bytes() - check->offset;
    if (n > SLICE_BYTES) {
        n = SLICE_BYTES;
    }
    check->crc = crc32c_update(check->crc, &cm_image_start[check->offset], n);
    check->offset += n;
    if (check->offset < checked_bytes()) {
        return true;
    }
    const bool same = check->crc == cm_image_crc[0];
    *check = (cm_image_check_t){0};
    return same;
}

uint32_t cm_image_banner(char *text)
{
    static const char *const named[] = {
        "ZeroHertz ", cm_image_info.version, " ",        cm_image_info.git,
        " port=",     cm_image_info.port,    " config=", cm_image_info.config,
        " motor=",    cm_image_info.motor};
    char *end = text;
    for (size_t k = 0u; k < sizeof named / sizeof named[0]; k++) {
        end = cm_text(end, named[k]);
    }
    end = cm_text_hex(cm_text(end, " table="), cm_image_info.table_crc32c);
    end = cm_text_hex(cm_text(end, " params="), cm_image_info.params_crc32c);
    end = cm_text_hex(cm_text(end, " image="), cm_image_crc32c());
    *end = '\0';
    return (uint32_t)(end - text);
}
