#include "flight.h"

#include "handover.h"

/* The ring is written through the pointer that is kept; the checker does not see that.
 * NOLINTNEXTLINE(readability-non-const-parameter) */
void flight_init(flight_t *f, uint32_t *word, uint32_t words)
{
    *f = (flight_t){.word = word, .rows = FLIGHT_ROWS_MIN};
    if (words < FLIGHT_ROWS_MIN * FLIGHT_ROW_WORDS) {
        f->rows = 0u;
        return;
    }
    while (2u * f->rows <= words / FLIGHT_ROW_WORDS) {
        f->rows *= 2u;
    }
}

bool flight_arm(flight_t *f)
{
    flight_stop(f);
    handover();
    f->written = 0u;
    f->taken = 0u;
    f->lost = 0u;
    f->digest = 0u;
    f->samples = 0u;
    handover();
    f->state = (uint32_t)((f->rows > 0u) ? FLIGHT_ASKED : FLIGHT_OFF);
    return f->rows > 0u;
}

bool flight_take(flight_t *f, uint32_t row)
{
    if (row - f->taken > f->written - f->taken) {
        return false;
    }
    f->taken = row;
    return true;
}

bool flight_room(const flight_t *f)
{
    return f->rows - (f->written - f->taken) >= FLIGHT_PER_PERIOD;
}

void flight_put(flight_t *f, uint32_t first, uint32_t second, uint32_t third)
{
    const uint32_t at = f->written;
    uint32_t *row = &f->word[(size_t)FLIGHT_ROW_WORDS * (at & (f->rows - 1u))];
    row[0] = first;
    row[1] = second;
    row[2] = third;
    handover();
    f->written = at + 1u;
}
