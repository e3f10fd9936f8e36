#include "fmu_instance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    LONGEST_OVERRIDE = 96
};
/* A communication point is a sum of steps: this share of a period is rounding. */
static const double rounding = 1e-6;

static _Thread_local char last_error[256];

const char *fmu_error(void)
{
    return last_error;
}

fmu_status_t fmu_refuse(const char *text)
{
    (void)snprintf(last_error, sizeof last_error, "%s", text);
    return FMU_ERROR;
}

static void close_parts(fmu_t *fmu)
{
    zh_sil_close(fmu->drive);
    zh_plant_close(fmu->plant);
    fmu->drive = NULL;
    fmu->plant = NULL;
}

/* Lines for zh_sil_open: those of the folder, then what was given. To be freed. */
static char *overrides_of(const fmu_t *fmu)
{
    const size_t size =
        strlen(fmu->settings.overrides) + 2 + (size_t)fmu->parameters * (size_t)LONGEST_OVERRIDE;
    char *text = malloc(size);
    if (text != NULL) {
        int at = snprintf(text, size, "%s\n", fmu->settings.overrides);
        for (uint32_t k = 0; k < fmu->parameters; ++k) {
            if (!isnan(fmu->given[k])) {
                at += snprintf(text + at, size - (size_t)at, "%s=%.9g\n", zh_sil_name(k),
                               fmu->given[k]);
            }
        }
    }
    return text;
}

static bool open_plant(fmu_t *fmu)
{
    char rig[FMU_PATH_MAX];
    char board[FMU_PATH_MAX];
    fmu_settings_path(&fmu->settings, "rig.toml", rig);
    fmu_settings_path(&fmu->settings, "board.toml", board);
    fmu->plant = zh_plant_open(rig, board, NULL, NULL, fmu->settings.seed);
    return fmu->plant != NULL && zh_plant_look(fmu->plant, &fmu->values.truth) == ZH_OK;
}

bool fmu_open_parts(fmu_t *fmu)
{
    close_parts(fmu);
    char motor[FMU_PATH_MAX];
    char board[FMU_PATH_MAX];
    fmu_settings_path(&fmu->settings, "motor", motor);
    fmu_settings_path(&fmu->settings, "board.toml", board);
    char *overrides = overrides_of(fmu);
    float period_s = 0.0F;
    fmu->drive = overrides != NULL ? zh_sil_open(motor, board, overrides) : NULL;
    free(overrides);
    const bool opened = fmu->drive != NULL &&
                        zh_sil_get(fmu->drive, "period_s", &period_s) == ZH_OK &&
                        (!fmu->settings.plant || open_plant(fmu));
    /* The float nearest to 200 us is not 200 us: the communication points are multiples of that. */
    fmu->period_s = round((double)period_s * 1e9) * 1e-9;
    if (!opened) {
        (void)fmu_refuse(zh_sil_error());
        close_parts(fmu);
    }
    return opened;
}

/* All values as at the start. */
static void clear_values(fmu_t *fmu)
{
    memset(&fmu->values, 0, sizeof fmu->values);
    zh_sil_out *out = &fmu->values.out;
    out->struct_size = sizeof *out;
    out->duty_u = out->duty_v = out->duty_w = 0.5F;
    fmu->values.truth.struct_size = sizeof fmu->values.truth;
    for (uint32_t k = 0; k < fmu->parameters; ++k) {
        fmu->given[k] = (double)NAN;
    }
}

fmu_t *fmu_open(const char *resources)
{
    fmu_t *fmu = calloc(1, sizeof *fmu);
    if (fmu == NULL || !fmu_settings_read(&fmu->settings, resources)) {
        (void)fmu_refuse("the folder of resources cannot be read; unpack the FMU again");
        free(fmu);
        return NULL;
    }
    fmu->parameters = zh_sil_name_count();
    fmu->given = calloc(fmu->parameters, sizeof *fmu->given);
    if (fmu->given != NULL) {
        clear_values(fmu);
    }
    if (fmu->given == NULL || !fmu_open_parts(fmu)) {
        fmu_close(fmu);
        return NULL;
    }
    return fmu;
}

void fmu_close(fmu_t *fmu)
{
    if (fmu != NULL) {
        close_parts(fmu);
        fmu_settings_free(&fmu->settings);
        free(fmu->given);
        free(fmu);
    }
}

fmu_status_t fmu_reset(fmu_t *fmu)
{
    clear_values(fmu);
    return fmu_open_parts(fmu) ? FMU_OK : FMU_ERROR;
}

fmu_status_t fmu_start(fmu_t *fmu)
{
    if (!fmu_open_parts(fmu)) {
        return FMU_ERROR;
    }
    fmu->values.started = true;
    return FMU_OK;
}

void fmu_set_start_time(fmu_t *fmu, double start_s)
{
    fmu->values.start_s = start_s;
}

double fmu_time_s(const fmu_t *fmu)
{
    return fmu->values.start_s + (double)fmu->values.periods * fmu->period_s;
}

static uint16_t word(double value)
{
    return (uint16_t)lrint(fmin(fmax(value, 0.0), 65535.0));
}

/* As the board's converter: zero in the middle, clipped at both ends. */
static uint16_t word_of(const fmu_settings_t *s, double value, double full_scale)
{
    const double middle = ldexp(1.0, s->adc_bits - 1);
    return word(fmin(round(middle + middle * value / full_scale), 2.0 * middle - 1.0));
}

static uint16_t link_word(const fmu_settings_t *s, double u_dc_V)
{
    const double words = ldexp(1.0, s->adc_bits);
    return word(fmin(round(words * u_dc_V / s->dc_link_full_scale_V), words - 1.0));
}

static uint32_t bit(double flag, uint32_t mask)
{
    return flag > 0.0 ? mask : 0U;
}

static zh_sil_in input_of(const fmu_t *fmu)
{
    const fmu_inputs_t *in = &fmu->values.in;
    const fmu_settings_t *s = &fmu->settings;
    const bool words = in->adc_words > 0.0;
    const double I_A = s->current_full_scale_A;
    const double U_V = s->line_voltage_full_scale_V;
    return (zh_sil_in){
        .struct_size = sizeof(zh_sil_in),
        .i_u = words ? word(in->i_u) : word_of(s, in->i_u_A, I_A),
        .i_v = words ? word(in->i_v) : word_of(s, in->i_v_A, I_A),
        .i_w = words ? word(in->i_w) : word_of(s, in->i_w_A, I_A),
        .u_uv = words ? word(in->u_uv) : word_of(s, in->u_uv_V, U_V),
        .u_vw = words ? word(in->u_vw) : word_of(s, in->u_vw_V, U_V),
        .u_dc = words ? word(in->u_dc) : link_word(s, in->u_dc_V),
        .speed_ref_rpm = (float)in->speed_ref_rpm,
        .torque_ref_Nm = (float)in->torque_ref_Nm,
        .mode = in->torque_mode > 0.0 ? ZH_SIL_TORQUE : ZH_SIL_SPEED,
        .command = bit(in->run, ZH_SIL_RUN) | bit(in->fault_reset, ZH_SIL_FAULT_RESET) |
                   bit(in->torque_off, ZH_SIL_TORQUE_OFF) | bit(in->commission, ZH_SIL_COMMISSION)};
}

static int plant_period(fmu_t *fmu, const zh_sil_in *in)
{
    fmu_values_t *v = &fmu->values;
    int status = ZH_OK;
    if (fabs(v->in.load_torque_Nm - v->load_Nm) > 0.0) {
        status = zh_plant_set(fmu->plant, "load_torque_Nm", v->in.load_torque_Nm);
        v->load_Nm = v->in.load_torque_Nm;
    }
    if (status == ZH_OK) {
        status = zh_plant_run(fmu->plant, fmu->drive, in, &v->out, NULL, 1, NULL);
    }
    const int looked = zh_plant_look(fmu->plant, &v->truth);
    return status != ZH_OK ? status : looked;
}

fmu_status_t fmu_step(fmu_t *fmu, double until_s)
{
    if (!fmu->values.started || fmu->drive == NULL) {
        return fmu_refuse("a step before the end of the initialization");
    }
    fmu_status_t status = FMU_OK;
    const zh_sil_in in = input_of(fmu);
    while (fmu_time_s(fmu) < until_s - rounding * fmu->period_s) {
        const int done = fmu->plant != NULL ? plant_period(fmu, &in)
                                            : zh_sil_step(fmu->drive, &in, &fmu->values.out);
        ++fmu->values.periods;
        if (done != ZH_OK) {
            (void)fmu_refuse(zh_sil_error());
            status = FMU_WARNING;
        }
    }
    return status;
}
