#include "host_link.h"

#include "mps2_registers.h"
#include "semihosting.h"

bool host_link_read(void *context, uint8_t *byte)
{
    host_link_t *const link = (host_link_t *)context;
    if ((link->heard_at == link->heard_n) && (link->file >= 0)) {
        link->heard_at = 0u;
        link->heard_n = semihosting_read_some(link->file, link->heard, sizeof link->heard);
        link->file = (link->heard_n > 0u) ? link->file : -1;
    }
    if (link->heard_at < link->heard_n) {
        *byte = link->heard[link->heard_at];
        link->heard_at++;
        return true;
    }
    if ((MPS2_UART_STATE & MPS2_UART_RXFULL) == 0u) {
        return false;
    }
    *byte = (uint8_t)MPS2_UART_DATA;
    return true;
}

uint32_t host_link_write(void *context, const uint8_t *data, uint32_t n)
{
    (void)context;
    uint32_t k = 0u;
    while ((k < n) && ((MPS2_UART_STATE & MPS2_UART_TXFULL) == 0u)) {
        MPS2_UART_DATA = data[k];
        k++;
    }
    return k;
}
