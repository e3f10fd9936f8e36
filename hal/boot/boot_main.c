/* The boot loader: proves what is in flash, listens for a moment, starts it. Gates stay off.
 *
 * With nothing to start it listens for ever. Otherwise for a moment after a reset and after each
 * request, longer when the application called it, so that nobody keeps a drive from starting by
 * falling silent.
 */
#include "boot_call.h"
#include "boot_key.h"
#include "boot_link.h"
#include "boot_port.h"
#include "boot_reset.h"
#include "cm_registers.h"

extern uint32_t boot_mark[BOOT_CALL_WORDS];

static boot_link_t link;

static const uint8_t key[BOOT_KEY_BYTES] = BOOT_PUBLIC_KEY;
static const boot_config_t config = {&boot_port_flash, key, BOOT_BOARD};

static void send(const uint8_t *bytes, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        while (!boot_port_put(bytes[k])) {
        }
    }
}

static void say(const char *text)
{
    for (; *text != '\0'; text++) {
        send((const uint8_t *)text, 1u);
    }
}

static void start_clock(void)
{
    CM_SYST_RVR = boot_port_ms_clocks() - 1u;
    CM_SYST_CVR = 0u;
    CM_SYST_CSR = CM_SYST_CSR_CORE | CM_SYST_CSR_ENABLE;
}

static void listen(void)
{
    while (boot_link_listens(&link)) {
        uint8_t byte;
        if (boot_port_receive(&byte) && boot_link_byte(&config, &link, byte)) {
            send(link.answer.byte, link.answer.length);
        }
        if ((CM_SYST_CSR & CM_SYST_CSR_PASSED) != 0u) {
            boot_link_tick(&link);
        }
    }
}

int main(void)
{
    boot_port_start();
    start_clock();
    uint32_t window_ms = boot_called(boot_mark) ? BOOT_LINK_CALLED_MS : BOOT_LINK_WINDOW_MS;
    do {
        boot_link_reset(&link, boot_start(&config), window_ms);
        window_ms = BOOT_LINK_WINDOW_MS;
        say(link.running ? "ZeroHertz loader\r\n" : "ZeroHertz loader: waits for an update\r\n");
        listen();
    } while (link.done);
    CM_SYST_CSR = 0u;
    boot_port_stop();
    boot_leave(boot_port_run_address() + BOOT_IMAGE_AT);
}
