/* What an FMU is made of: the folder `resources`, read as text. */
#ifndef FMU_SETTINGS_H
#define FMU_SETTINGS_H

#include <stdbool.h>

#define FMU_PATH_MAX 1024

typedef struct {
    char folder[FMU_PATH_MAX - 32];
    char *overrides; /* name=value lines; freed by fmu_settings_free */
    bool plant;
    unsigned long seed;
    int adc_bits;
    double current_full_scale_A;
    double line_voltage_full_scale_V;
    double dc_link_full_scale_V;
} fmu_settings_t;

/* false: a file is missing or lacks a name. */
bool fmu_settings_read(fmu_settings_t *settings, const char *folder);
void fmu_settings_free(fmu_settings_t *settings);

/* The path of a file of the folder. */
void fmu_settings_path(const fmu_settings_t *settings, const char *file, char path[FMU_PATH_MAX]);

#endif
