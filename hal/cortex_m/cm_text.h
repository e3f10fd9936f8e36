/* Text without a C library: each appends at `to` and returns the new end, not terminated. */
#ifndef CM_TEXT_H
#define CM_TEXT_H

#include <stdint.h>

char *cm_text(char *to, const char *text);

/* Eight digits. */
char *cm_text_hex(char *to, uint32_t value);

#endif
