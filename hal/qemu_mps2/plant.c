#include "plant.h"

#include "cm_config.h"
#include "cm_image.h"
#include "mps2_registers.h"
#include "semihosting.h"
#include "unit_signal.h"

bool plant_connect(plant_t *plant, pil_start_t *asked)
{
    plant->from = semihosting_open(PIL_FIFO_TO_IMAGE, SEMIHOSTING_READ);
    plant->to = semihosting_open(PIL_FIFO_FROM_IMAGE, SEMIHOSTING_WRITE);
    const pil_hello_t hello = {.magic = PIL_MAGIC,
                               .params_bytes = sizeof(params_t),
                               .signals = PIL_SIGNALS,
                               .table_crc32c = cm_config.table->crc32c,
                               .image_crc32c = cm_image_crc32c(),
                               .clock_Hz = MPS2_CLOCK_HZ};
    return (plant->from >= 0) && (plant->to >= 0) &&
           semihosting_write(plant->to, &hello, sizeof hello) &&
           semihosting_read(plant->from, asked, sizeof *asked);
}

bool plant_ready(const plant_t *plant, bool refused)
{
    const uint32_t word = refused ? 1u : 0u;
    return semihosting_write(plant->to, &word, sizeof word);
}

bool plant_ask(const plant_t *plant, pil_in_t *in)
{
    return semihosting_read(plant->from, in, sizeof *in);
}

/* Not by number: that took the background two thirds of its time. */
static void gather(const unit_t *a, const hal_output_t *o, uint32_t *signal)
{
#define SIGNAL_F(name, path, text)  signal[PIL_SIGNAL_##name] = float_bits(a->path);
#define SIGNAL_U(name, path, text)  signal[PIL_SIGNAL_##name] = a->path;
#define SIGNAL_OF(name, path, text) signal[PIL_SIGNAL_##name] = float_bits(o->path);
#define SIGNAL_OU(name, path, text) signal[PIL_SIGNAL_##name] = o->path ? 1u : 0u;
#define SIGNAL_X(name, value, text) signal[PIL_SIGNAL_##name] = (value);
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
}

bool plant_answer(const plant_t *plant, const unit_t *u, const hal_output_t *o, pil_out_t *out)
{
    const unit_command_t command = u->mailbox.slot[u->mailbox.published & 1u];
    out->command = command.command;
    out->omega_m_ref_rad_s = command.omega_m_ref_rad_s;
    out->torque_ref_Nm = command.torque_ref_Nm;
    out->command_count = u->mailbox.alive;
    gather(u, o, out->signal);
    return semihosting_write(plant->to, out, sizeof *out);
}

bool plant_leave(const plant_t *plant, const pil_end_t *end)
{
    return semihosting_write(plant->to, end, sizeof *end);
}
