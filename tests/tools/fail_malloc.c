/* fail_malloc.c: to be preloaded: one allocation of a program fails. Counting begins at main, since what the loader
 * and the constructors of libraries do is not ours; what libraries allocate later for us counts.
 *
 *   FAIL_MALLOC=N    allocation number N, from 1, fails;  N+: and all after it
 *   FAIL_COUNT=FILE  how many there were is written there at exit
 *   FAIL_SPARE=A,B   what is asked for in calls of libraries with these in their file names neither counts nor fails
 *   FAIL_WHERE=1     where the first one failed goes to standard error
 *
 * Works under AddressSanitizer too (verify_asan_link_order=0): what is not refused goes on to the next malloc, its
 * own.
 * Leaves out mmap and what C++ operators do.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef int main_function(int, char **, char **);

int __libc_start_main(main_function *main, int argc, char **argv, void (*init)(void), void (*fini)(void),
                      void (*rtld_fini)(void), void *stack_end);

static main_function *true_main;
static atomic_ulong calls;
static unsigned long failing; /* 0: none */
static bool all_after, tell_where;
static _Thread_local bool armed_here = true; /* not while we allocate ourselves */
static bool armed;

/* dlsym may itself allocate, before there is anything to give it. */
static union {
    char bytes[1 << 16];
    max_align_t aligned;
} early;
static size_t early_used;

static void *early_alloc(size_t n)
{
    n = (n + sizeof(max_align_t) - 1) / sizeof(max_align_t) * sizeof(max_align_t);
    if (n > sizeof early.bytes - early_used) return NULL;
    early_used += n;
    return early.bytes + early_used - n;
}

static bool is_early(const void *p)
{
    return (const char *)p >= early.bytes && (const char *)p < early.bytes + sizeof early.bytes;
}

/* volatile: dlsym is declared as a function that does not come back here, but it does */
static volatile bool looking;
static void *next(void **cached, const char *name)
{
    if (*cached || looking) return *cached;
    looking = true;
    *cached = dlsym(RTLD_NEXT, name);
    looking = false;
    return *cached;
}

static void show_where(void)
{
    void *frames[32];
    armed_here = false;
    backtrace_symbols_fd(frames, backtrace(frames, 32), STDERR_FILENO);
    armed_here = true;
}

/* ---- who is spared ---- */

static struct range {
    uintptr_t from, to;
} spared[8];
static size_t nspared;

static int find_spared(struct dl_phdr_info *info, size_t size, void *name)
{
    (void)size;
    if (!strstr(info->dlpi_name, name) || nspared == sizeof spared / sizeof *spared) return 0;
    struct range *r = &spared[nspared++];
    r->from = r->to = info->dlpi_addr;
    for (int i = 0; i < info->dlpi_phnum; i++) {
        uintptr_t end = info->dlpi_addr + info->dlpi_phdr[i].p_vaddr + info->dlpi_phdr[i].p_memsz;
        if (info->dlpi_phdr[i].p_type == PT_LOAD && end > r->to) r->to = end;
    }
    return 0;
}

static void find_all_spared(const char *names)
{
    char copy[256];
    snprintf(copy, sizeof copy, "%s", names);
    for (char *save, *name = strtok_r(copy, ",", &save); name; name = strtok_r(NULL, ",", &save))
        dl_iterate_phdr(find_spared, name);
}

/* Under AddressSanitizer this is what a new thread begins with, and it stops the program when that fails. */
static void spare_function(const char *name)
{
    Dl_info info;
    const ElfW(Sym) *symbol = NULL;
    void *at = dlsym(RTLD_DEFAULT, name);
    if (!at || !dladdr1(at, &info, (void **)&symbol, RTLD_DL_SYMENT) || !symbol) return;
    if (nspared == sizeof spared / sizeof *spared) return;
    spared[nspared++] = (struct range){(uintptr_t)at, (uintptr_t)at + symbol->st_size};
}

static bool is_spared(void)
{
    void *frames[48];
    if (!nspared) return false;
    armed_here = false;
    int n = backtrace(frames, 48);
    armed_here = true;
    for (int i = 0; i < n; i++)
        for (size_t k = 0; k < nspared; k++)
            if ((uintptr_t)frames[i] >= spared[k].from && (uintptr_t)frames[i] < spared[k].to) return true;
    return false;
}

static bool refused(void)
{
    if (!armed || !armed_here || is_spared()) return false;
    unsigned long n = atomic_fetch_add(&calls, 1) + 1;
    if (!failing || !(n == failing || (all_after && n > failing))) return false;
    if (tell_where && n == failing) show_where();
    errno = ENOMEM;
    return true;
}

void *malloc(size_t n)
{
    static void *true_malloc;
    void *(*f)(size_t) = next(&true_malloc, "malloc");
    return !f ? early_alloc(n) : refused() ? NULL : f(n);
}

void *calloc(size_t n, size_t size)
{
    static void *true_calloc;
    void *(*f)(size_t, size_t) = next(&true_calloc, "calloc");
    return !f ? early_alloc(n * size) : refused() ? NULL : f(n, size);
}

void *realloc(void *p, size_t n)
{
    static void *true_realloc;
    void *(*f)(void *, size_t) = next(&true_realloc, "realloc");
    return !f ? NULL : refused() ? NULL : f(p, n);
}

int posix_memalign(void **p, size_t alignment, size_t n)
{
    static void *true_memalign;
    int (*f)(void **, size_t, size_t) = next(&true_memalign, "posix_memalign");
    return !f || refused() ? ENOMEM : f(p, alignment, n);
}

void *aligned_alloc(size_t alignment, size_t n)
{
    static void *true_aligned;
    void *(*f)(size_t, size_t) = next(&true_aligned, "aligned_alloc");
    return !f || refused() ? NULL : f(alignment, n);
}

void free(void *p)
{
    static void *true_free;
    void (*f)(void *) = next(&true_free, "free");
    if (f && !is_early(p)) f(p);
}

static void write_count(void)
{
    const char *path = getenv("FAIL_COUNT");
    char text[32];
    armed = false;
    int fd = path ? open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666) : -1;
    int n = snprintf(text, sizeof text, "%lu\n", atomic_load(&calls));
    if (fd >= 0 && write(fd, text, (size_t)n) == n) close(fd);
}

/* The programs end by _exit. */
void _exit(int status)
{
    write_count();
    void *(*f)(int) = NULL;
    *(void **)&f = dlsym(RTLD_NEXT, "_exit");
    f(status);
    abort();
}

static int armed_main(int argc, char **argv, char **environment)
{
    const char *text = getenv("FAIL_MALLOC");
    void *warm[2];
    backtrace(warm, 2); /* loads what it needs */
    if (text) failing = strtoul(text, NULL, 10), all_after = strchr(text, '+') != NULL;
    tell_where = getenv("FAIL_WHERE") != NULL;
    if (getenv("FAIL_SPARE")) find_all_spared(getenv("FAIL_SPARE"));
    spare_function("pthread_getattr_np");
    unsetenv("LD_PRELOAD");
    armed = true;
    return true_main(argc, argv, environment);
}

int __libc_start_main(main_function *main, int argc, char **argv, void (*init)(void), void (*fini)(void),
                      void (*rtld_fini)(void), void *stack_end)
{
    int (*f)(main_function *, int, char **, void (*)(void), void (*)(void), void (*)(void), void *) = NULL;
    *(void **)&f = dlsym(RTLD_NEXT, "__libc_start_main");
    true_main = main;
    return f(armed_main, argc, argv, init, fini, rtld_fini, stack_end);
}
