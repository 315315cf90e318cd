/* SPDX-License-Identifier: MIT
 * What the machine is like: caches, cores, NUMA nodes and memory. Looks, and binds nothing. hwloc is seen only here. */
#include "base/context.h"
#include "base/os.h"
#include "loxo_config.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef LOXO_WITH_HWLOC
#include <hwloc.h>
#endif

/* ---- from the system's files ---------------------------------------------------------------------------------- */

/* The text of a small file of /sys; false when there is none. */
static bool read_text(const char *path, char *text, size_t n)
{
    loxo_os_file file;
    size_t got = 0;
    if (loxo_os_open(NULL, path, &file) < 0) return false;
    const bool is_read = loxo_os_read(NULL, &file, text, n - 1, &got) >= 0 && got > 0;
    loxo_os_close(&file);
    text[got] = '\0';
    return is_read;
}

static void caches_from_files(loxo_machine *machine)
{
    char path[128], text[64];
    for (int index = 0; index < 16; ++index) {
        snprintf(path, sizeof path, "/sys/devices/system/cpu/cpu0/cache/index%d/type", index);
        if (!read_text(path, text, sizeof text)) return;
        if (strncmp(text, "Instruction", 11) == 0) continue;
        snprintf(path, sizeof path, "/sys/devices/system/cpu/cpu0/cache/index%d/size", index);
        if (!read_text(path, text, sizeof text)) continue;
        char *unit = NULL;
        size_t bytes = (size_t)strtoull(text, &unit, 10);
        bytes *= *unit == 'K' ? 1024 : *unit == 'M' ? 1048576 : 1;
        snprintf(path, sizeof path, "/sys/devices/system/cpu/cpu0/cache/index%d/level", index);
        if (!read_text(path, text, sizeof text)) continue;
        switch (text[0]) {
        case '1': machine->l1_bytes = bytes; break;
        case '2': machine->l2_bytes = bytes; break;
        case '3': machine->l3_bytes = bytes; break;
        default: break;
        }
    }
}

/* Cores: the processors that come first among their siblings. Those that are off have no such file. */
static int cores_from_files(void)
{
    char path[128], text[64];
    int n_cores = 0;
    for (int cpu = 0, n_missing = 0; n_missing < 64; ++cpu) {
        snprintf(path, sizeof path, "/sys/devices/system/cpu/cpu%d/topology/thread_siblings_list", cpu);
        if (!read_text(path, text, sizeof text)) {
            ++n_missing;
            continue;
        }
        n_missing = 0;
        n_cores += strtol(text, NULL, 10) == cpu;
    }
    return n_cores;
}

/* Numbers in a list like "0-3,8". */
static int nodes_from_files(void)
{
    char text[256];
    int n = 0;
    if (!read_text("/sys/devices/system/node/online", text, sizeof text)) return 0;
    for (char *p = text; *p >= '0' && *p <= '9';) {
        const long first = strtol(p, &p, 10), last = *p == '-' ? strtol(p + 1, &p, 10) : first;
        n += last >= first ? (int)(last - first) + 1 : 0;
        if (*p == ',') ++p;
    }
    return n;
}

/* ---- from hwloc ----------------------------------------------------------------------------------------------- */

#if defined(LOXO_WITH_HWLOC) && HWLOC_API_VERSION >= 0x00020500
static void look_with_hwloc(hwloc_topology_t topology, loxo_machine *machine)
{
    const int n_cores = hwloc_get_nbobjs_by_type(topology, HWLOC_OBJ_CORE);
    const int n_nodes = hwloc_get_nbobjs_by_type(topology, HWLOC_OBJ_NUMANODE);
    if (n_cores > 0) machine->n_cores = n_cores;
    if (n_nodes > 0) machine->n_numa_nodes = n_nodes;
    for (hwloc_obj_t o = hwloc_get_obj_by_type(topology, HWLOC_OBJ_PU, 0); o != NULL; o = o->parent) {
        if (o->type == HWLOC_OBJ_L1CACHE) machine->l1_bytes = (size_t)o->attr->cache.size;
        if (o->type == HWLOC_OBJ_L2CACHE) machine->l2_bytes = (size_t)o->attr->cache.size;
        if (o->type == HWLOC_OBJ_L3CACHE) machine->l3_bytes = (size_t)o->attr->cache.size;
    }
    machine->from_hwloc = true;
}

/* The part of the machine that this process may use. DONT_CHANGE_BINDING leaves out the discovery that binds the calling
 * thread to each processor in turn, which is also most of the 15 ms of a plain load (2 ms so, measured). */
static void machine_from_hwloc(loxo_machine *machine)
{
    const unsigned long flags = HWLOC_TOPOLOGY_FLAG_IS_THISSYSTEM | HWLOC_TOPOLOGY_FLAG_DONT_CHANGE_BINDING |
                                HWLOC_TOPOLOGY_FLAG_RESTRICT_TO_CPUBINDING | HWLOC_TOPOLOGY_FLAG_RESTRICT_TO_MEMBINDING;
    hwloc_topology_t topology;
#ifdef __linux__
    char text[64]; /* hwloc says on standard error that it finds no /sys, as in a bare chroot */
    if (!read_text("/sys/devices/system/cpu/cpu0/topology/thread_siblings_list", text, sizeof text)) return;
#endif
    if (hwloc_topology_init(&topology) != 0) return;
    if (hwloc_topology_set_flags(topology, flags) == 0 &&
        hwloc_topology_set_all_types_filter(topology, HWLOC_TYPE_FILTER_KEEP_NONE) == 0 &&
        hwloc_topology_set_cache_types_filter(topology, HWLOC_TYPE_FILTER_KEEP_ALL) == 0 &&
        hwloc_topology_set_type_filter(topology, HWLOC_OBJ_CORE, HWLOC_TYPE_FILTER_KEEP_ALL) == 0 &&
        hwloc_topology_load(topology) == 0)
        look_with_hwloc(topology, machine);
    hwloc_topology_destroy(topology);
}
#else
static void machine_from_hwloc(loxo_machine *machine) { (void)machine; }
#endif

loxo_status loxo_machine_get(loxo_context *ctx, loxo_machine *machine)
{
    if (ctx == NULL || machine == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "machine: NULL argument");
    if (!ctx->machine_is_known) {
        loxo_machine m = {
            .n_processors = loxo_os_n_processors(),
            .memory_bytes = loxo_os_memory(),
            .memory_limit_bytes = loxo_os_memory_limit(),
        };
        machine_from_hwloc(&m);
        if (!m.from_hwloc) {
            caches_from_files(&m);
            m.n_cores = cores_from_files();
            m.n_numa_nodes = nodes_from_files();
        }
        if (m.n_cores < 1 || m.n_cores > m.n_processors) m.n_cores = m.n_processors;
        if (m.n_numa_nodes < 1) m.n_numa_nodes = 1;
        ctx->machine = m;
        ctx->machine_is_known = true;
    }
    *machine = ctx->machine;
    return LOXO_OK;
}
