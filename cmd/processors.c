/* processors.c: the number of processors that this process may use, by its affinity mask and its control groups;
 * and hides all but one from libraries while they are loaded. lib/core/threads.c uses the number.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "processors.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

/* When OpenBLAS is loaded it starts a thread per processor. They spin, take 128 MB of address space each, and are
 * retried for ever without it. They are of no use here, because the programs' own threads make one product each.
 * Before the libraries' constructors only system calls may run. */
static struct {
    unsigned long all[1024 / sizeof(long)];
    long bytes; /* of the mask; not positive: nothing was hidden */
} processors;

static void hide_processors(void)
{
    enum { BITS = 8 * sizeof(long) };
    unsigned long one[sizeof processors.all / sizeof(long)] = {0};
    unsigned here;
    long bytes = syscall(SYS_sched_getaffinity, 0, sizeof processors.all, processors.all);
    if (bytes <= 0 || syscall(SYS_getcpu, &here, NULL, NULL) || here >= 8 * (unsigned long)bytes) return;
    one[here / BITS] = 1ul << here % BITS;
    if (!syscall(SYS_sched_setaffinity, 0, (size_t)bytes, one)) processors.bytes = bytes;
}
__attribute__((section(".preinit_array"), used)) static void (*const before_libraries)(void) = hide_processors;

__attribute__((constructor)) static void show_processors(void)
{
    if (processors.bytes > 0) syscall(SYS_sched_setaffinity, 0, (size_t)processors.bytes, processors.all);
}

static bool read_line(const char *path, char *line, size_t n)
{
    FILE *f = fopen(path, "re");
    if (!f) return false;
    bool ok = fgets(line, (int)n, f) != NULL;
    fclose(f);
    return ok;
}

/* The CPUs that one control group allows; a large number without a limit. */
static double group_limit(const char *directory)
{
    char path[PATH_MAX + 32], line[64];
    long long quota, period;
    snprintf(path, sizeof path, "%s/cpu.max", directory); /* version 2: "QUOTA PERIOD" or "max PERIOD" */
    bool found = read_line(path, line, sizeof line) && sscanf(line, "%lld %lld", &quota, &period) == 2;
    if (found && quota > 0 && period > 0) return (double)quota / (double)period;
    snprintf(path, sizeof path, "%s/cpu.cfs_quota_us", directory); /* version 1 */
    if (!read_line(path, line, sizeof line) || sscanf(line, "%lld", &quota) != 1 || quota <= 0) return INFINITY;
    snprintf(path, sizeof path, "%s/cpu.cfs_period_us", directory);
    if (!read_line(path, line, sizeof line) || sscanf(line, "%lld", &period) != 1 || period <= 0) return INFINITY;
    return (double)quota / (double)period;
}

/* The limit is the lowest of the group and its parents. In a container the path may name groups that are not
 * visible; then only the root counts, which is the container's own. */
static double path_limit(const char *root, const char *group)
{
    char path[PATH_MAX];
    if (snprintf(path, sizeof path, "%s%s", root, group) >= (int)sizeof path) return INFINITY;
    double limit = INFINITY;
    for (;;) {
        limit = fmin(limit, group_limit(path));
        char *slash = strrchr(path, '/');
        if (!slash || (size_t)(slash - path) < strlen(root)) return limit;
        *slash = 0;
    }
}

static double cgroup_limit(void)
{
    FILE *f = fopen("/proc/self/cgroup", "re");
    if (!f) return INFINITY;
    double limit = INFINITY;
    char line[PATH_MAX];
    while (fgets(line, sizeof line, f)) { /* "NUMBER:CONTROLLERS:PATH" */
        line[strcspn(line, "\n")] = 0;
        char *controllers = strchr(line, ':'), *group = controllers ? strchr(controllers + 1, ':') : NULL;
        if (!group) continue;
        *controllers++ = 0, *group++ = 0;
        if (!*controllers) {
            limit = fmin(limit, path_limit("/sys/fs/cgroup", group));
        } else if (!strncmp(controllers, "cpu,", 4) || strstr(controllers, ",cpu,") || !strcmp(controllers, "cpu") ||
                   !strcmp(controllers, "cpuacct,cpu")) {
            char root[PATH_MAX + 32];
            snprintf(root, sizeof root, "/sys/fs/cgroup/%s", controllers);
            limit = fmin(limit, path_limit(root, group));
        }
    }
    fclose(f);
    return limit;
}

static int affinity_count(void)
{
    for (int cpus = 1024; cpus <= 1 << 20; cpus *= 4) { /* the mask must be as large as the kernel's */
        cpu_set_t *set = CPU_ALLOC((size_t)cpus);
        if (!set) break;
        int r = sched_getaffinity(0, CPU_ALLOC_SIZE((size_t)cpus), set);
        int n = r ? 0 : CPU_COUNT_S(CPU_ALLOC_SIZE((size_t)cpus), set);
        CPU_FREE(set);
        if (n > 0) return n;
        if (errno != EINVAL) break;
    }
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    return n > 0 ? (int)n : 1;
}

int processors_count(int most)
{
    double n = fmin(affinity_count(), ceil(cgroup_limit() - 0.01));
    return n < 1 ? 1 : n > most ? most : (int)n;
}
