/* One pin of a port: what it is, and its level. RM0090, chapter on GPIO. */
#ifndef STM32_GPIO_H
#define STM32_GPIO_H

#include <stdbool.h>

#include "stm32_registers.h"

typedef enum {
    STM32_GPIO_INPUT = 0,
    STM32_GPIO_OUTPUT = 1,
    STM32_GPIO_ALTERNATE = 2,
    STM32_GPIO_ANALOG = 3
} stm32_gpio_mode_t;

typedef enum {
    STM32_GPIO_FLOATING = 0,
    STM32_GPIO_PULL_UP = 1,
    STM32_GPIO_PULL_DOWN = 2
} stm32_gpio_pull_t;

/* Pin 0..15; function 0..15 counts for ALTERNATE only. Other pins stay as they are. */
void stm32_gpio_configure(stm32_gpio_t *port, uint32_t pin, stm32_gpio_mode_t mode,
                          stm32_gpio_pull_t pull, uint32_t function);

/* One store: nothing another context writes at that moment is lost. */
void stm32_gpio_write(stm32_gpio_t *port, uint32_t pin, bool high);

bool stm32_gpio_read(const stm32_gpio_t *port, uint32_t pin);

#endif
