#include "link_drop.h"

#define LINK_DROP_PU 0.7f

bool link_drop_look(link_drop_state_t *st, float u_dc_V)
{
    const bool low = u_dc_V < LINK_DROP_PU * st->u_dc_V;
    const bool stays = low && st->low;
    if (!low) {
        st->u_dc_V = u_dc_V;
    }
    st->low = low;
    return stays;
}
