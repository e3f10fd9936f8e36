#include "stm32_usart.h"

#include "num.h"

#define OVERSAMPLING 16u /* fewer clocks to a bit cannot be sampled */
#define BRR_MAX      0xFFFFu
#define LINE_ERRORS  (USART_ISR_PE | USART_ISR_FE | USART_ISR_NF)
#define CLEAR_ERRORS (USART_ICR_PECF | USART_ICR_FECF | USART_ICR_NCF | USART_ICR_ORECF)

COLD bool stm32_usart_start(stm32_usart_t *usart, uint32_t bus_Hz, uint32_t baud)
{
    const uint32_t clocks = (baud == 0u) ? 0u : ((bus_Hz + baud / 2u) / baud);
    if ((clocks < OVERSAMPLING) || (clocks > BRR_MAX)) {
        return false;
    }
    usart->CR1 &= ~USART_CR1_UE; /* the rate can be written only while it is off */
    usart->BRR = clocks;
    usart->CR1 |= USART_CR1_UE | USART_CR1_TE | USART_CR1_RE;
    return true;
}

COLD void stm32_usart_even(stm32_usart_t *usart)
{
    /* The parity is a ninth bit. It can be switched only while the port is off. */
    usart->CR1 = 0u;
    usart->CR1 = USART_CR1_M0 | USART_CR1_PCE;
}

bool stm32_usart_put(stm32_usart_t *usart, uint8_t byte)
{
    if ((usart->ISR & USART_ISR_TXE) == 0u) {
        return false;
    }
    usart->TDR = byte;
    return true;
}

bool stm32_usart_sent(const stm32_usart_t *usart)
{
    return (usart->ISR & USART_ISR_TC) != 0u;
}

void stm32_usart_wish(stm32_usart_t *usart, stm32_usart_wish_t wish)
{
    const uint32_t others = usart->CR1 & ~(USART_CR1_TXEIE | USART_CR1_TCIE);
    const uint32_t bit = (wish == STM32_USART_ROOM) ? USART_CR1_TXEIE : USART_CR1_TCIE;
    usart->CR1 = (wish == STM32_USART_QUIET) ? others : (others | bit);
}

COLD static bool send_byte(stm32_usart_t *usart, char byte)
{
    for (uint32_t n = 0u; n < STM32_USART_POLLS; n++) {
        if (stm32_usart_put(usart, (uint8_t)byte)) {
            return true;
        }
    }
    return false;
}

COLD void stm32_usart_interrupt(stm32_usart_t *usart)
{
    usart->CR1 |= USART_CR1_RXNEIE;
}

COLD bool stm32_usart_send(stm32_usart_t *usart, const char *text)
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
    const uint32_t status = usart->ISR;
    if ((status & (LINE_ERRORS | USART_ISR_ORE)) != 0u) {
        usart->ICR = CLEAR_ERRORS;
    }
    if ((status & USART_ISR_RXNE) == 0u) {
        return false;
    }
    const uint32_t data = usart->RDR; /* clears the request */
    /* The byte in front of an overrun is good; one with a line error is not. */
    if ((status & LINE_ERRORS) != 0u) {
        return false;
    }
    *byte = (uint8_t)(data & 0xFFu);
    return true;
}
