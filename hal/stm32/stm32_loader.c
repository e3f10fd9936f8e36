#include "stm32_loader.h"

#include "cm_loader.h"
#include "stm32_services.h"

void stm32_loader_call(void *context)
{
    stm32_services_drain((const stm32_services_t *)context);
    cm_loader_call(context);
}
