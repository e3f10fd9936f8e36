#include "inject.h"

#include <stdbool.h>

#include "cm_mpu.h"
#include "mps2_registers.h"

#define FLOAT_MAX_BITS 0x7F7FFFFFu
#define THUMB_WIDE_MIN 0xE800u     /* from here on the first of two halfwords */
#define WILD_ADDRESS   0x30000000u /* no memory, no device */

static void write_word(uint32_t address, uint32_t value)
{
    CM_REGISTER(address) = value;
}

/* Far more levels than the stack holds; each needs the one below, so that it is no loop. */
__attribute__((noinline)) static uint32_t overflow(volatile uint32_t *above)
{
    volatile uint32_t here[16];
    here[0] = above[0] + 1u;
    return (here[0] > 100000u) ? 0u : (overflow(here) + here[0]);
}

static uint32_t divide(volatile uint32_t divisor)
{
    return 1000u / divisor;
}

/* Flash does that by itself; here it takes a moment without the MPU. */
static void flip_bit(uint32_t address)
{
    CM_MPU_CTRL = 0u;
    cm_barrier();
    CM_REGISTER(address) ^= 1u << 13;
    cm_mpu_enable();
}

static void execute_ram(void)
{
    static const uint16_t return_at_once = 0x4770u; /* bx lr */
    volatile uint16_t code = return_at_once;
    void (*const entry)(void) = (void (*)(void))((uintptr_t)&code | 1u);
    entry();
}

/* Writes where no program may. */
static void write_forbidden(uint32_t what)
{
    if (what == PIL_INJECT_WILD_WRITE) {
        write_word(WILD_ADDRESS, 1u);
    } else if (what == PIL_INJECT_NULL_WRITE) {
        write_word(0u, 1u);
    } else if (what == PIL_INJECT_CODE_WRITE) {
        write_word((uint32_t)(uintptr_t)&inject & ~3u, 0u);
    }
}

/* Changes what the running checks of the table and of the image read. */
static void corrupt_flash(uint32_t what, const unit_t *unit)
{
    if (what == PIL_INJECT_TABLE_BIT) {
        flip_bit((uint32_t)(uintptr_t)&unit->table->entry[6]);
    } else if (what == PIL_INJECT_IMAGE_BIT) {
        flip_bit((uint32_t)(uintptr_t)&inject & ~3u);
    }
}

/* The code there for the patch's; the same again undoes it. */
static void exchange(inject_patch_t *patch)
{
    volatile uint16_t *const at = (volatile uint16_t *)(uintptr_t)patch->address;
    CM_MPU_CTRL = 0u;
    cm_barrier();
    for (uint32_t k = 0u; k < patch->halfwords; k++) {
        const uint16_t was = at[k];
        at[k] = patch->code[k];
        patch->code[k] = was;
    }
    cm_mpu_enable();
}

/* A no-operation of the same length: an if-then block counts it as it counts the instruction. */
static void skip(uint32_t address, inject_patch_t *patch)
{
    const bool wide = *(const volatile uint16_t *)(uintptr_t)address >= THUMB_WIDE_MIN;
    *patch = (inject_patch_t){.address = address,
                              .halfwords = wide ? 2u : 1u,
                              .code = {wide ? 0xF3AFu : 0xBF00u, 0x8000u}};
    exchange(patch);
}

void inject_take_out(inject_patch_t *patch)
{
    if (patch->halfwords > 0u) {
        exchange(patch);
        patch->halfwords = 0u;
    }
}

void inject(const pil_start_t *asked, unit_t *unit, inject_patch_t *patch)
{
    const uint32_t what = asked->inject;
    volatile uint32_t seed = 0u;
    write_forbidden(what);
    corrupt_flash(what, unit);
    switch (what) {
    case PIL_INJECT_STACK_OVERFLOW:
        (void)overflow(&seed);
        break;
    case PIL_INJECT_DIVISION_BY_ZERO:
        seed = divide(0u);
        break;
    case PIL_INJECT_UNDEFINED_INSTRUCTION:
        __asm volatile("udf #0");
        break;
    case PIL_INJECT_STUCK_CONTROL:
        while (true) {
        }
    case PIL_INJECT_DEAD_CONTROL:
        MPS2_TIMER_CTRL(MPS2_TIMER0) = 0u;
        break;
    case PIL_INJECT_EXECUTE_RAM:
        execute_ram();
        break;
    case PIL_INJECT_SKIP:
        skip(asked->inject_address, patch);
        break;
    default:
        break;
    }
}

void inject_delay(uint32_t what, uint32_t age, uint32_t entry, uint32_t period_ticks)
{
    uint32_t ticks = period_ticks;
    uint32_t late = 0u; /* periods that take so long */
    if (what == PIL_INJECT_OVERRUN) {
        late = 1u;
    } else if (what == PIL_INJECT_OVERRUNS) {
        late = 2u;
    } else if (what == PIL_INJECT_HANG) {
        late = 1u;
        ticks = 3u * period_ticks;
    } else {
        return;
    }
    while ((age < late) && (entry - MPS2_TIMER_VALUE(MPS2_TIMER1) < ticks)) {
    }
}

/* Never triggered: a row in every period. */
static bool start_trace(trace_t *trace)
{
    const trace_setup_t setup = {.signal = {0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u},
                                 .signals = TRACE_SIGNALS_MAX,
                                 .decimation = 1u,
                                 .trigger_is_float = true,
                                 .edge = TRACE_RISING,
                                 .level = FLOAT_MAX_BITS};
    return trace_running(trace) || trace_arm(trace, &setup);
}

static bool act(uint32_t what, unit_t *unit)
{
    switch (what) {
    case PIL_INJECT_LIVE_CHANGE:
        return unit_reconfigure(unit, &unit->params);
    case PIL_INJECT_TRACE:
        return start_trace(&unit->trace);
    default:
        return what != PIL_INJECT_STUCK_BACKGROUND;
    }
}

void inject_background(uint32_t what, uint32_t age, unit_t *unit)
{
    const bool reached = age < UINT32_MAX / 2u;
    if (reached && !act(what, unit)) {
        while (true) {
        }
    }
}
