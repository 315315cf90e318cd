/* SPDX-License-Identifier: MIT
 * What the machine is said to be like, and that asking changes nothing. */
#define _GNU_SOURCE /* sched_getaffinity */
#include "../test.h"

#include <loxo/context.h>

#include <sched.h>

TEST(the_machine_makes_sense)
{
    loxo_machine m, again;
    CHECK_OK(loxo_machine_get(test_context, &m));
    CHECK(m.n_processors >= 1);
    CHECK(m.n_cores >= 1 && m.n_cores <= m.n_processors);
    CHECK(m.n_numa_nodes >= 1);
    CHECK(m.l1_bytes == 0 || (m.l1_bytes >= 1024 && m.l1_bytes < (size_t)1 << 30));
    CHECK(m.l2_bytes == 0 || m.l2_bytes >= m.l1_bytes);
    CHECK(m.memory_bytes > 0 && m.memory_limit_bytes > 0 && m.memory_limit_bytes <= m.memory_bytes);
    const bool has_sys = access("/sys/devices/system/cpu/cpu0/topology/thread_siblings_list", R_OK) == 0;
    CHECK(m.from_hwloc == (has_sys && strstr(loxo_build_features(), "hwloc off") == NULL));
    CHECK_OK(loxo_machine_get(test_context, &again));
    CHECK_EQUAL(again.l2_bytes, m.l2_bytes);
    CHECK_EQUAL(again.n_cores, m.n_cores);
    CHECK_STATUS(test_context, loxo_machine_get(test_context, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(NULL, loxo_machine_get(NULL, &m), LOXO_ERR_ARGUMENT);
}

TEST(looking_binds_nothing)
{
    cpu_set_t before, after;
    loxo_machine m;
    CPU_ZERO(&before);
    CPU_ZERO(&after);
    CHECK(sched_getaffinity(0, sizeof before, &before) == 0);
    CHECK_OK(loxo_machine_get(test_context, &m));
    CHECK(sched_getaffinity(0, sizeof after, &after) == 0);
    CHECK(CPU_EQUAL(&before, &after));
}

/* Bound to one processor, there is one core and one NUMA node. */
TEST(what_this_process_may_use)
{
    cpu_set_t before, one;
    loxo_machine m;
    size_t cpu = 0;
    CPU_ZERO(&before);
    CPU_ZERO(&one);
    CHECK(sched_getaffinity(0, sizeof before, &before) == 0);
    while (!CPU_ISSET(cpu, &before))
        ++cpu;
    CPU_SET(cpu, &one);
    CHECK(sched_setaffinity(0, sizeof one, &one) == 0);
    const loxo_status status = loxo_machine_get(test_context, &m);
    CHECK(sched_setaffinity(0, sizeof before, &before) == 0);
    CHECK_EQUAL(status, LOXO_OK);
    CHECK_EQUAL(m.n_processors, 1);
    CHECK_EQUAL(m.n_cores, 1);
}
