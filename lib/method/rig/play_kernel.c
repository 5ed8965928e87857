/* play_kernel.c: scatters the product of a map to the poses.
 * Blocks of rows that fit the first-level cache are written to one pose after the other. A point is written as four
 * numbers; the next point overwrites the fourth. The last point of a block is written as three.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/play_kernel.h"
#include "core/wide.h"

enum { ROWS_AT_ONCE = 32 };

#if VGI_WIDTH == 2
enum { PIECES = 2 };
typedef vgi_pair piece;
typedef vgi_pair_at piece_at;
#else
enum { PIECES = 1 };
typedef double piece __attribute__((vector_size(32)));
typedef double piece_at __attribute__((vector_size(32), aligned(8), may_alias));
#endif
enum { SIZE = 4 / PIECES };
typedef float singles_at __attribute__((vector_size(4 * SIZE), aligned(4), may_alias));

typedef struct point {
    piece at[PIECES];
} point;

VGI_INLINE point point_of(const double *p)
{
    point a;
#pragma GCC unroll 2
    for (int i = 0; i < PIECES; i++) a.at[i] = *(const piece_at *)(p + SIZE * i);
    return a;
}

VGI_INLINE void put_point(double *to, const void *from, bool single, point root)
{
#pragma GCC unroll 2
    for (int i = 0; i < PIECES; i++) {
        piece x;
        if (single) x = __builtin_convertvector(*(const singles_at *)((const float *)from + SIZE * i), piece);
        else x = *(const piece_at *)((const double *)from + SIZE * i);
        *(piece_at *)(to + SIZE * i) = x + root.at[i];
    }
}

VGI_INLINE void spread_poses(const void *product, bool single, size_t rows, size_t n, const double (*roots)[3],
                       double *const *vertices, size_t first)
{
    size_t size = single ? sizeof(float) : sizeof(double), stride = 3 * n;
    for (size_t v = 0; v < rows; v += ROWS_AT_ONCE) {
        size_t some = rows - v < ROWS_AT_ONCE ? rows - v : ROWS_AT_ONCE;
        for (size_t k = 0; k < n; k++) {
            const double four[4] = {roots[k][0], roots[k][1], roots[k][2], 0};
            const char *from = (const char *)product + (v * stride + 3 * k) * size;
            double *to = vertices[k] + 3 * (first + v);
            point root = point_of(four);
            for (size_t i = 0; i + 1 < some; i++) put_point(to + 3 * i, from + i * stride * size, single, root);
            from += (some - 1) * stride * size, to += 3 * (some - 1);
            for (size_t a = 0; a < 3; a++) {
                double x = single ? (double)((const float *)(const void *)from)[a] : ((const double *)(const void *)from)[a];
                to[a] = x + four[a];
            }
        }
    }
}

static void spread_single(const float *product, size_t rows, size_t n, const double (*roots)[3],
                          double *const *vertices, size_t first)
{
    spread_poses(product, true, rows, n, roots, vertices, first);
}

static void spread_double(const double *product, size_t rows, size_t n, const double (*roots)[3],
                          double *const *vertices, size_t first)
{
    spread_poses(product, false, rows, n, roots, vertices, first);
}

const vgi_play_kernel VGI_OF_SET(vgi_play_kernel) = {spread_single, spread_double};
