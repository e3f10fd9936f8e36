// Seen from outside the SIL library: where a process registers its functions.
#include "python_bridge.h"

extern "C" __attribute__((visibility("default"))) void
zh_python_bridge_register(const python_bridge_t *table)
{
    python_bridge_register(table);
}
