#include "stm32_inbox.h"

void stm32_inbox_put(stm32_inbox_t *inbox, uint8_t byte)
{
    if (inbox->in - inbox->out < STM32_INBOX_BYTES) {
        inbox->byte[inbox->in % STM32_INBOX_BYTES] = byte;
        inbox->in++;
    }
}

bool stm32_inbox_take(stm32_inbox_t *inbox, uint8_t *byte)
{
    if (inbox->in == inbox->out) {
        return false;
    }
    *byte = inbox->byte[inbox->out % STM32_INBOX_BYTES];
    inbox->out++;
    return true;
}
