/* A parameter record of commit 54f5414 in a drive of today: what is still known is in force, and
 * every other name can be told. */
#include <string.h>

#include "crc32c.h"
#include "hasegawa2005_recommended/l_gain.h"
#include "host_port.h"
#include "ram_flash.h"
#include "record_54f5414.h"
#include "unit_store_background.h"

#include "unity.h"

typedef struct {
    const char *before;
    const char *now; /* NULL: dropped */
} former_t;

static const former_t former[] = {
#define PARAM_RENAMED(before, now)    {#before, #now},
#define PARAM_CONSTANT(before, value) {#before, NULL},
#define PARAM_DROPPED(before, text)   {#before, NULL},
#include "param_former.def"
};
#define FORMER  (sizeof former / sizeof former[0])
#define RENAMED 3u
#define NEW     16u /* since then */

static ram_flash_t memory;
static const hal_flash_t flash = RAM_FLASH(&memory);
static const host_port_store_t store = {.flash = &flash};
static host_port_t port;
static params_t image;

void setUp(void)
{
    memset(&memory, 0, sizeof memory);
    ram_flash_start(&memory);
    memcpy(memory.cell[0], record_54f5414, sizeof record_54f5414);
    params_default(&image);
    TEST_ASSERT_TRUE(host_port_init(&port, &image, &l_gain_hasegawa2005_recommended));
    /* It holds a pair that made a trip toothless, and says so. */
    TEST_ASSERT_FALSE(host_port_start(&port, &image, &l_gain_hasegawa2005_recommended, &store));
    TEST_ASSERT_EQUAL_size_t(params_find("over_speed_rad_s"), port.unit.refused.first);
    TEST_ASSERT_EQUAL_size_t(params_find("omega_max_rad_s"), port.unit.refused.second);
}
void tearDown(void)
{
}

static uint32_t key_of(const char *name)
{
    return crc32c(name, strlen(name));
}

/* The entry saved under this name; fails without one. */
static param_store_entry_t entry_of(const char *name)
{
    param_store_entry_t entry;
    for (uint32_t n = 0u; unit_store_entry(&port.unit, &port.devices, n, &entry); n++) {
        if (entry.key == key_of(name)) {
            return entry;
        }
    }
    TEST_FAIL_MESSAGE(name);
    return entry;
}

static void test_every_entry_is_in_force_or_counted(void)
{
    const param_store_report_t *report = &port.unit.store.report;
    TEST_ASSERT_EQUAL(PARAM_STORE_LOADED, port.unit.store.found);
    TEST_ASSERT_EQUAL_UINT32(params_count() - NEW, report->taken);
    TEST_ASSERT_EQUAL_UINT32(RENAMED, report->renamed);
    TEST_ASSERT_EQUAL_UINT32(FORMER - RENAMED, report->unknown);
    TEST_ASSERT_EQUAL_UINT32(RECORD_54F5414_ENTRIES, report->taken + report->unknown);
    TEST_ASSERT_EQUAL_UINT32(NEW, report->missing);
    TEST_ASSERT_EQUAL_UINT32(0u, report->refused);
    TEST_ASSERT_FALSE(port.unit.configured);
    const params_t *p = &port.unit.params;
    TEST_ASSERT_EQUAL_FLOAT(5.0f, p->i_d_A);
    TEST_ASSERT_EQUAL_FLOAT(14.0f, p->i_f_A);
    TEST_ASSERT_EQUAL_FLOAT(55.0f, p->open_loop_slew_rad_s2);
    TEST_ASSERT_EQUAL_FLOAT(300.0f, p->torque_speed_max_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(4.0f, p->adapt_kp);
    TEST_ASSERT_EQUAL_UINT32(2u, p->lost_action);
}

static void test_every_former_name_is_told_with_its_value(void)
{
    for (size_t k = 0u; k < FORMER; k++) {
        const param_store_entry_t entry = entry_of(former[k].before);
        if (former[k].now == NULL) {
            TEST_ASSERT_EQUAL_MESSAGE(PARAM_STORE_UNKNOWN, entry.fate, former[k].before);
            TEST_ASSERT_EQUAL_size_t(params_count(), entry.index);
        } else {
            TEST_ASSERT_EQUAL_MESSAGE(PARAM_STORE_RENAMED, entry.fate, former[k].before);
            TEST_ASSERT_EQUAL_size_t(params_find(former[k].now), entry.index);
        }
    }
    TEST_ASSERT_EQUAL_FLOAT(0.95f, entry_of("rs_track_low").value);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, entry_of("eps1_prior").value);
    TEST_ASSERT_EQUAL_FLOAT(14.0f, entry_of("impressed_A").value);
    TEST_ASSERT_EQUAL(PARAM_STORE_TAKEN, entry_of("i_d_A").fate);
    param_store_entry_t none;
    TEST_ASSERT_FALSE(unit_store_entry(&port.unit, &port.devices, RECORD_54F5414_ENTRIES, &none));
}

static void test_saved_anew_it_has_todays_names_alone(void)
{
    params_t corrected = port.unit.params;
    corrected.over_speed_rad_s = image.over_speed_rad_s;
    TEST_ASSERT_TRUE(unit_reconfigure(&port.unit, &corrected));
    TEST_ASSERT_TRUE(unit_store_save(&port.unit, &port.devices));
    for (uint32_t k = 0u; (k < 10000u) && port.unit.store.store.wanted; k++) {
        unit_background(&port.unit, &port.devices);
    }
    const params_t saved = port.unit.params;
    TEST_ASSERT_TRUE(host_port_start(&port, &image, &l_gain_hasegawa2005_recommended, &store));
    TEST_ASSERT_EQUAL_MEMORY(&saved, &port.unit.params, sizeof saved);
    TEST_ASSERT_EQUAL_UINT32(params_count(), port.unit.store.report.taken);
    TEST_ASSERT_EQUAL_UINT32(0u, port.unit.store.report.unknown + port.unit.store.report.renamed);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_entry_is_in_force_or_counted);
    RUN_TEST(test_every_former_name_is_told_with_its_value);
    RUN_TEST(test_saved_anew_it_has_todays_names_alone);
    return UNITY_END();
}
