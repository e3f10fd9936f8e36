/* The way into the boot loader, for an image that stands above one. */
#ifndef STM32_LOADER_H
#define STM32_LOADER_H

/* Operation of hal_devices_t: the answer leaves, then the part resets. Context: stm32_services_t.
 */
void stm32_loader_call(void *context);

#endif
