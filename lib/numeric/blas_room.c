/* blas_room.c: whether there is memory for BLAS. A separate file, so that programs without BLAS can call it; there
 * the answer is always yes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include <sys/mman.h>

/* Address space that OpenBLAS reserves for each calling thread; it uses little of it. */
#define BLAS_ROOM ((size_t)129 << 20)

int openblas_get_num_threads(void) __attribute__((weak));

static bool has_room(size_t n)
{
    void *p = mmap(NULL, n, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    return p != MAP_FAILED && !munmap(p, n);
}

/* Half of the available memory is left for the rest of the work. */
int vg_threads_with_room(int most)
{
    if (!openblas_get_num_threads) return most;
    while (most > 0 && !has_room(2 * (size_t)most * BLAS_ROOM)) most--;
    return most;
}
