/* The parser alone, for many inputs: any bytes, and the same bytes as the body of a frame.
 *
 * Claims: what the parser calls a frame lies inside its buffer and, written again, is read as the
 * same; a body written is read back whole; behind noise and a zero a good frame is always met.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "command.h"
#include "fuzz_link.h"

static void claim(bool holds, const char *what)
{
    if (!holds) {
        (void)fprintf(stderr, "does not hold: %s\n", what);
        abort();
    }
}

static bool last_frame(command_parser_t *parser, const uint8_t *byte, size_t n,
                       command_frame_t *frame)
{
    bool good = false;
    for (size_t k = 0u; k < n; k++) {
        good = command_byte(parser, byte[k], frame);
        if (good) {
            claim((frame->body >= parser->byte) &&
                      (&frame->body[frame->body_bytes] <= &parser->byte[COMMAND_FRAME_MAX]),
                  "a body lies in the parser");
        }
    }
    return good;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    command_parser_t parser = {0};
    command_frame_t frame;
    (void)last_frame(&parser, data, n, &frame);

    command_writer_t w;
    command_begin(&w, (uint8_t)n, 0x55u);
    const uint32_t body = (n < COMMAND_BODY_MAX) ? (uint32_t)n : COMMAND_BODY_MAX;
    for (uint32_t k = 0u; k < body; k++) {
        command_put_u8(&w, data[k]);
    }
    command_end(&w);
    claim(w.length <= COMMAND_WIRE_MAX, "a frame fits its buffer");
    claim(last_frame(&parser, w.byte, w.length, &frame), "a good frame is met behind any noise");
    claim((frame.sequence == (uint8_t)n) && (frame.op == 0x55u) && (frame.body_bytes == body) &&
              ((body == 0u) || (memcmp(frame.body, data, body) == 0)),
          "a frame is read as it was written");
    return 0;
}
