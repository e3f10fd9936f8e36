#include "stm32_usart.h"

#define OVERSAMPLING 16u /* fewer clocks to a bit cannot be sampled */
#define BRR_MAX      0xFFFFu

bool stm32_usart_start(stm32_usart_t *usart, uint32_t bus_Hz, uint32_t baud)
{
    /* Mantissa and fraction together are the bus clocks of one bit. */
    const uint32_t clocks = (baud == 0u) ? 0u : ((bus_Hz + baud / 2u) / baud);
    if ((clocks < OVERSAMPLING) || (clocks > BRR_MAX)) {
        return false;
    }
    usart->BRR = clocks;
    usart->CR1 |= USART_CR1_UE | USART_CR1_TE | USART_CR1_RE;
    return true;
}

void stm32_usart_even(stm32_usart_t *usart)
{
    /* The parity is a ninth bit. */
    usart->CR1 = USART_CR1_M | USART_CR1_PCE;
}

bool stm32_usart_put(stm32_usart_t *usart, uint8_t byte)
{
    if ((usart->SR & USART_SR_TXE) == 0u) {
        return false;
    }
    usart->DR = byte;
    return true;
}

bool stm32_usart_sent(const stm32_usart_t *usart)
{
    return (usart->SR & USART_SR_TC) != 0u;
}

void stm32_usart_wish(stm32_usart_t *usart, stm32_usart_wish_t wish)
{
    const uint32_t others = usart->CR1 & ~(USART_CR1_TXEIE | USART_CR1_TCIE);
    const uint32_t bit = (wish == STM32_USART_ROOM) ? USART_CR1_TXEIE : USART_CR1_TCIE;
    usart->CR1 = (wish == STM32_USART_QUIET) ? others : (others | bit);
}

static bool send_byte(stm32_usart_t *usart, char byte)
{
    for (uint32_t n = 0u; n < STM32_USART_POLLS; n++) {
        if (stm32_usart_put(usart, (uint8_t)byte)) {
            return true;
        }
    }
    return false;
}

void stm32_usart_interrupt(stm32_usart_t *usart)
{
    usart->CR1 |= USART_CR1_RXNEIE;
}

bool stm32_usart_send(stm32_usart_t *usart, const char *text)
{
    for (; *text != '\0'; text++) {
        if (!send_byte(usart, *text)) {
            return false;
        }
    }
    return true;
}

bool stm32_usart_receive(stm32_usart_t *usart, uint8_t *byte)
{
    const uint32_t status = usart->SR;
    if ((status & (USART_SR_RXNE | USART_SR_ORE)) == 0u) {
        return false;
    }
    /* Status, then data: only that clears an overrun, which requests the interrupt by itself. */
    const uint32_t data = usart->DR;
    if ((status & USART_SR_RXNE) == 0u) {
        return false;
    }
    /* The byte in front of an overrun is good; one with a line error is not. */
    if ((status & (USART_SR_PE | USART_SR_FE | USART_SR_NF)) != 0u) {
        return false;
    }
    *byte = (uint8_t)(data & 0xFFu);
    return true;
}
