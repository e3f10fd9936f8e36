#include "cm_text.h"

char *cm_text(char *to, const char *text)
{
    while (*text != '\0') {
        *to = *text;
        to++;
        text++;
    }
    return to;
}

char *cm_text_hex(char *to, uint32_t value)
{
    for (uint32_t shift = 32u; shift > 0u; shift -= 4u) {
        *to = "0123456789abcdef"[(value >> (shift - 4u)) & 15u];
        to++;
    }
    return to;
}
