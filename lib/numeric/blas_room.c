/* blas_room.c: is there room for BLAS? A file beside blas.c, so that programs can ask which do not load BLAS at all: to
 * these the answer is yes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include <sys/mman.h>

/* What OpenBLAS sets aside for each thread that calls it: address space, of which it uses little. */
#define BLAS_ROOM ((size_t)129 << 20)

int openblas_get_num_threads(void) __attribute__((weak));

static bool has_room(size_t n)
{
    void *p = mmap(NULL, n, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    return p != MAP_FAILED && !munmap(p, n);
}

/* Half of what there is stays for the rest of the work. */
int vg_threads_with_room(int most)
{
    if (!openblas_get_num_threads) return most;
    while (most > 0 && !has_room(2 * (size_t)most * BLAS_ROOM)) most--;
    return most;
}
