/* isa.c: chooses the instruction set of the numeric kernels, once, before main or by name.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/isa.h"

int vgi_isa;

#if defined(__x86_64__)
static const char *const names[] = {"sse2", "avx2", "avx512"};
#elif defined(__aarch64__)
static const char *const names[] = {"neon"};
#else
static const char *const names[] = {"plain"};
#endif
enum { SETS = sizeof names / sizeof *names };

/* Number of instruction sets that this machine supports; each one includes those before it. */
static size_t sets_here(void)
{
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return 1;
    if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512dq")) return 2;
#endif
    return SETS;
}

__attribute__((constructor)) static void choose_widest(void)
{
    vgi_isa = (int)sets_here() - 1;
}

const char *vg_isa(void)
{
    return names[vgi_isa];
}

const char *vg_isa_at(size_t i)
{
    return i < sets_here() ? names[i] : NULL;
}

static bool is_known(const char *name)
{
    static const char *const all[] = {"avx512", "avx2", "sse2", "neon"};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        if (!strcmp(name, all[i])) return true;
    return false;
}

int vg_isa_choose(const char *name, vg_err *e)
{
    size_t here = sets_here(), i = here - 1;
    if (name)
        for (i = 0; i < here && strcmp(name, names[i]) != 0; i++) continue;
    if (i == here && is_known(name))
        return vg_fail(e, VG_EARG, "this machine has no %s: its widest instruction set is %s", name, names[here - 1]);
    if (i == here)
        return vg_fail(e, VG_EARG, "an instruction set is avx512, avx2, sse2 or neon, not '%s'", name);
    vgi_isa = (int)i;
    return VG_OK;
}
