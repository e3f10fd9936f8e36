#include "stm32_services.h"

#include "stm32_rng.h"
#include "stm32_timebase.h"
#include "stm32_usart.h"
#include "stm32_watchdog.h"

void stm32_services_received(const stm32_services_t *services)
{
    uint8_t byte;
    if (stm32_usart_receive(services->usart, &byte)) {
        stm32_inbox_put(services->inbox, byte);
    }
}

bool stm32_services_link_read(void *context, uint8_t *byte)
{
    return stm32_inbox_take(((const stm32_services_t *)context)->inbox, byte);
}

uint32_t stm32_services_link_write(void *context, const uint8_t *data, uint32_t n)
{
    const stm32_services_t *const services = (const stm32_services_t *)context;
    return ((n > 0u) && stm32_usart_put(services->usart, data[0])) ? 1u : 0u;
}

void stm32_services_watchdog(void *context)
{
    stm32_watchdog_serve(((const stm32_services_t *)context)->iwdg);
}

uint32_t stm32_services_clock_us(void *context)
{
    return stm32_timebase_us(((const stm32_services_t *)context)->timebase);
}

bool stm32_services_entropy(void *context, uint64_t *bits)
{
    return stm32_rng_draw(((const stm32_services_t *)context)->rng, bits);
}

void stm32_services_drain(const stm32_services_t *services)
{
    for (uint32_t n = 0u; (n < STM32_USART_POLLS) && !stm32_usart_sent(services->usart); n++) {
    }
}
