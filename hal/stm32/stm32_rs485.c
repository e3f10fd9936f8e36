#include "stm32_rs485.h"

#define BYTE_BITS_US 10000000u /* start, eight and parity; of the stop bit half is enough */

static void begin_to_hear(stm32_rs485_t *line)
{
    line->hears_since_us = stm32_timebase_us(line->timebase);
    line->early = true;
    line->says = false;
}

bool stm32_rs485_start(stm32_rs485_t *line, uint32_t bus_Hz, uint32_t baud)
{
    stm32_gpio_write(line->port, line->pin, false);
    stm32_usart_even(line->usart);
    if (!stm32_usart_start(line->usart, bus_Hz, baud)) {
        return false;
    }
    line->character_us = BYTE_BITS_US / baud;
    begin_to_hear(line);
    stm32_usart_interrupt(line->usart);
    return true;
}

/* Whether a byte that ends now began before the line was switched. */
static bool early(stm32_rs485_t *line)
{
    const uint32_t heard_us = stm32_timebase_us(line->timebase) - line->hears_since_us;
    line->early = line->early && (heard_us < line->character_us);
    return line->early;
}

/* A full buffer drops the byte; the frame's CRC tells. */
static void keep(stm32_rs485_t *line, uint8_t byte)
{
    const uint32_t in = line->in;
    if (in - line->out < STM32_RS485_BYTES) {
        line->heard[in % STM32_RS485_BYTES] = byte;
        line->heard_at_us[in % STM32_RS485_BYTES] = stm32_timebase_us(line->timebase);
        line->in = in + 1u;
    }
}

static void say_on(stm32_rs485_t *line)
{
    const uint32_t at = line->said_at;
    if (at < line->said_n) {
        if (stm32_usart_put(line->usart, line->said[at])) {
            line->said_at = at + 1u;
            if (at + 1u == line->said_n) {
                stm32_usart_wish(line->usart, STM32_USART_DONE);
            }
        }
    } else if (stm32_usart_sent(line->usart)) {
        stm32_gpio_write(line->port, line->pin, false);
        stm32_usart_wish(line->usart, STM32_USART_QUIET);
        begin_to_hear(line);
    } else {
        /* The background may have asked for room behind the last byte: that request never ends. */
        stm32_usart_wish(line->usart, STM32_USART_DONE);
    }
}

void stm32_rs485_interrupt(stm32_rs485_t *line)
{
    uint8_t byte;
    const bool came = stm32_usart_receive(line->usart, &byte);
    if (line->says) {
        say_on(line);
    } else if (came && !early(line)) {
        keep(line, byte);
    } else {
        /* a damaged byte, or none of somebody else's */
    }
}

bool stm32_rs485_read(void *context, uint8_t *byte, uint32_t *at_us)
{
    stm32_rs485_t *const line = (stm32_rs485_t *)context;
    const uint32_t out = line->out;
    if (line->in == out) {
        return false;
    }
    *byte = line->heard[out % STM32_RS485_BYTES];
    *at_us = line->heard_at_us[out % STM32_RS485_BYTES];
    line->out = out + 1u;
    return true;
}

uint32_t stm32_rs485_write(void *context, const uint8_t *data, uint32_t n)
{
    stm32_rs485_t *const line = (stm32_rs485_t *)context;
    if (line->says || (n == 0u)) {
        return 0u;
    }
    const uint32_t taken = (n < STM32_RS485_BYTES) ? n : STM32_RS485_BYTES;
    for (uint32_t k = 0u; k < taken; k++) {
        line->said[k] = data[k];
    }
    line->said_n = taken;
    line->said_at = 0u;
    stm32_gpio_write(line->port, line->pin, true);
    line->says = true;
    stm32_usart_wish(line->usart, STM32_USART_ROOM); /* there is: the interrupt comes at once */
    return taken;
}

uint32_t stm32_rs485_clock_us(void *context)
{
    return stm32_timebase_us(((const stm32_rs485_t *)context)->timebase);
}
