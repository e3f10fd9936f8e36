#include "stm32_gpio.h"

static void field(stm32_reg_t *reg, uint32_t index, uint32_t width, uint32_t value)
{
    const uint32_t mask = ((1u << width) - 1u) << (index * width);
    *reg = (*reg & ~mask) | (value << (index * width));
}

void stm32_gpio_configure(stm32_gpio_t *port, uint32_t pin, stm32_gpio_mode_t mode,
                          stm32_gpio_pull_t pull, uint32_t function)
{
    field(&port->PUPDR, pin, 2u, (uint32_t)pull);
    field((pin < 8u) ? &port->AFRL : &port->AFRH, pin % 8u, 4u, function);
    field(&port->MODER, pin, 2u, (uint32_t)mode);
}

void stm32_gpio_write(stm32_gpio_t *port, uint32_t pin, bool high)
{
    port->BSRR = high ? (1u << pin) : (1u << (pin + 16u));
}

bool stm32_gpio_read(const stm32_gpio_t *port, uint32_t pin)
{
    return (port->IDR & (1u << pin)) != 0u;
}
