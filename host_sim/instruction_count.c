/* Emulator plugin: how often each instruction ran inside the counted part of the control interrupt
 * (tools/zerohertz/image/histogram.py).
 *
 * A window opens with the instruction at `begin` and closes with the one at `end`; window k is
 * control period k. Of the windows first..last it counts, per address and k modulo 16, executions
 * and those that did not go on to the next instruction. Debian's emulator comes without the plugin
 * header, so the part of its interface used here is declared below (version 1,
 * docs/devel/tcg-plugins.rst).
 */
#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORTED   __attribute__((visibility("default")))
#define SLOTS      16u
#define CODE_BYTES (256u * 1024u) /* from `base` on */

typedef uint64_t qemu_plugin_id_t;
typedef struct qemu_info_t qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
typedef void (*translated_t)(qemu_plugin_id_t id, struct qemu_plugin_tb *tb);
typedef void (*executed_t)(unsigned vcpu, void *data);
typedef void (*ended_t)(qemu_plugin_id_t id, void *data);

void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id, translated_t callback);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *insn, executed_t callback,
                                            int flags, void *data);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t id, ended_t callback, void *data);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *tb, size_t index);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *insn);
size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *insn);

EXPORTED extern int qemu_plugin_version;
EXPORTED int qemu_plugin_version = 1;
EXPORTED int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc,
                                 char **argv);

typedef struct {
    uint32_t executed;
    uint32_t left; /* of them not to the next instruction */
} count_t;

typedef struct {
    uint32_t address;
    uint32_t bytes;
} insn_t;

static uint32_t base, begin, end, first, last; /* arguments */
static char out_path[512];
static count_t count[SLOTS][CODE_BYTES / 2u];
static insn_t insns[CODE_BYTES / 2u];
static uint32_t window; /* the open one, or the next */
static bool open;
static count_t *previous; /* of the open window, when it is counted */
static uint32_t expected; /* the address behind it */

/* `data`: its insn_t. */
static void executed(unsigned vcpu, void *data)
{
    (void)vcpu;
    const insn_t *insn = (const insn_t *)data;
    const uint32_t address = insn->address;
    if (address == begin) {
        open = true;
    }
    if (!open) {
        return;
    }
    if ((previous != NULL) && (address != expected)) {
        previous->left++;
    }
    previous = NULL;
    if (address == end) {
        open = false;
        window++;
    } else if ((window >= first) && (window <= last)) {
        previous = &count[window % SLOTS][(address - base) / 2u];
        previous->executed++;
        expected = address + insn->bytes;
    }
}

static void translated(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    (void)id;
    for (size_t k = 0; k < qemu_plugin_tb_n_insns(tb); k++) {
        struct qemu_plugin_insn *insn = qemu_plugin_tb_get_insn(tb, k);
        const uint32_t address = (uint32_t)qemu_plugin_insn_vaddr(insn);
        if (address - base < CODE_BYTES) {
            insn_t *known = &insns[(address - base) / 2u];
            *known = (insn_t){address, (uint32_t)qemu_plugin_insn_size(insn)};
            qemu_plugin_register_vcpu_insn_exec_cb(insn, executed, 0, known);
        }
    }
}

/* One line per slot and address: `slot address executed left`. */
static void ended(qemu_plugin_id_t id, void *data)
{
    (void)id;
    (void)data;
    FILE *out = fopen(out_path, "w");
    if (out == NULL) {
        return;
    }
    for (uint32_t slot = 0; slot < SLOTS; slot++) {
        for (uint32_t k = 0; k < CODE_BYTES / 2u; k++) {
            const count_t *c = &count[slot][k];
            if (c->executed > 0u) {
                (void)fprintf(out, "%" PRIu32 " %" PRIx32 " %" PRIu32 " %" PRIu32 "\n", slot,
                              base + 2u * k, c->executed, c->left);
            }
        }
    }
    (void)fclose(out);
}

int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv)
{
    (void)info;
    const struct {
        const char *name;
        uint32_t *value;
    } numbers[] = {
        {"base=", &base}, {"begin=", &begin}, {"end=", &end}, {"first=", &first}, {"last=", &last}};
    for (int k = 0; k < argc; k++) {
        if (strncmp(argv[k], "out=", 4) == 0) {
            for (size_t n = 0; n + 1 < sizeof out_path && argv[k][n + 4] != '\0'; n++) {
                out_path[n] = argv[k][n + 4]; /* zeroed before: ends with a zero */
            }
        }
        for (size_t n = 0; n < sizeof numbers / sizeof numbers[0]; n++) {
            const size_t length = strlen(numbers[n].name);
            if (strncmp(argv[k], numbers[n].name, length) == 0) {
                *numbers[n].value = (uint32_t)strtoul(argv[k] + length, NULL, 0);
            }
        }
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    qemu_plugin_register_atexit_cb(id, ended, NULL);
    return 0;
}
