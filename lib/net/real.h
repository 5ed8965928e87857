/* real.h: the number type of a network. The library computes in binary32; the tests compile the same files a second
 * time in binary64 (VGI_NET_DOUBLE) to compare gradients with finite differences. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REAL_H
#define VG_REAL_H

#include "core/core.h"
#include "numeric/blas.h"

#include <stdlib.h>

#ifdef VGI_NET_DOUBLE
typedef double real;
#define NET(name) vgi_double_##name
#define NET_GEMM vgi_gemm_double
#else
typedef float real;
#define NET(name) vgi_single_##name
#define NET_GEMM vgi_gemm_single
#endif

/* Eight chains side by side: a row of every matrix here is one number of a frame, or of a layer, in eight chains. */
enum { NET_LANES = 8 };
typedef real net_lanes __attribute__((vector_size(NET_LANES * sizeof(real))));

/* net_array: n zeroed rows of eight chains, aligned for vectors; free(). */
static inline net_lanes *net_array(size_t rows, vg_err *e)
{
    size_t bytes;
    net_lanes *p = vgi_mul(rows + 1, sizeof *p, &bytes) ? aligned_alloc(sizeof(net_lanes), bytes) : NULL;
    if (p) memset(p, 0, bytes);
    else vg_fail(e, VG_ENOMEM, "out of memory: a network needs %zu rows of eight chains", rows);
    return p;
}

#endif
