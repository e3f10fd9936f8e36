#include "fmu_settings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    LONGEST_NAME = 64
};

/* The whole file, to be freed; NULL: it cannot be read. */
static char *text_of(const char *path)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    if (file != NULL && fseek(file, 0, SEEK_END) == 0) {
        const long size = ftell(file);
        text = size >= 0 ? calloc((size_t)size + 1, 1) : NULL;
        rewind(file);
        if (text != NULL && fread(text, 1, (size_t)size, file) != (size_t)size) {
            free(text);
            text = NULL;
        }
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    return text;
}

/* The number behind `name=` at the start of a line. */
static bool number_of(const char *text, const char *name, double *value)
{
    char key[LONGEST_NAME];
    (void)snprintf(key, sizeof key, "%s=", name);
    const size_t length = strlen(key);
    for (const char *line = text; line != NULL && *line != '\0';) {
        if (strncmp(line, key, length) == 0) {
            char *end = NULL;
            *value = strtod(line + length, &end);
            return end != line + length;
        }
        line = strchr(line, '\n');
        line = line != NULL ? line + 1 : NULL;
    }
    return false;
}

void fmu_settings_path(const fmu_settings_t *settings, const char *file, char path[FMU_PATH_MAX])
{
    (void)snprintf(path, FMU_PATH_MAX, "%s/%s", settings->folder, file);
}

bool fmu_settings_read(fmu_settings_t *settings, const char *folder)
{
    *settings = (fmu_settings_t){0};
    if (strlen(folder) >= sizeof settings->folder) {
        return false;
    }
    (void)snprintf(settings->folder, sizeof settings->folder, "%s", folder);
    char path[FMU_PATH_MAX];
    fmu_settings_path(settings, "overrides.txt", path);
    settings->overrides = text_of(path);
    fmu_settings_path(settings, "settings.txt", path);
    char *text = text_of(path);
    double plant = 0.0;
    double seed = 0.0;
    double bits = 0.0;
    const bool read =
        text != NULL && settings->overrides != NULL && number_of(text, "plant", &plant) &&
        number_of(text, "seed", &seed) && number_of(text, "adc_bits", &bits) &&
        number_of(text, "current_full_scale_A", &settings->current_full_scale_A) &&
        number_of(text, "line_voltage_full_scale_V", &settings->line_voltage_full_scale_V) &&
        number_of(text, "dc_link_full_scale_V", &settings->dc_link_full_scale_V);
    settings->plant = plant > 0.0;
    settings->seed = (unsigned long)seed;
    settings->adc_bits = (int)bits;
    free(text);
    if (!read) {
        fmu_settings_free(settings);
    }
    return read;
}

void fmu_settings_free(fmu_settings_t *settings)
{
    free(settings->overrides);
    settings->overrides = NULL;
}
