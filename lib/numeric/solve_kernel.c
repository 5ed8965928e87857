/* solve_kernel.c: L L' x = b over a supernodal factor, 24 right-hand sides (8 poses) interleaved.
 *
 * A sparse triangular solve is bound by loading and storing x: with one column at a time every entry of the factor
 * costs a load and a store of its row of x. Here the columns of a supernode share their rows, so a row is loaded
 * once, takes all the columns of the supernode while it stays in registers, and is stored once; a few rows (forward)
 * or columns (backward) go together, so that what they share is loaded once too. Also the way of the numbers from the
 * poses into the rows and back. Leaves out assembly and factorisation: reconstruct.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/solve_kernel.h"

#define INLINE static inline __attribute__((always_inline))

/* x[column k] for the head of the supernode; acc[i] -= L[i, k] x[k] for `n` rows starting at entry `l`, all
 * columns. */
INLINE void eliminate_rows(const double *l, size_t stride, size_t columns, const vgi_row *x, vgi_row *const *target,
                           int n)
{
    vgi_row acc[4];
#pragma GCC unroll 4
    for (int i = 0; i < n; i++) acc[i] = *target[i];
    for (size_t k = 0; k < columns; k++) {
        vgi_row xk = x[k];
#pragma GCC unroll 4
        for (int i = 0; i < n; i++) {
            double entry = l[k * stride + (size_t)i];
#pragma GCC unroll 3
            for (int c = 0; c < 3; c++) acc[i].xyz[c] -= entry * xk.xyz[c];
        }
    }
#pragma GCC unroll 4
    for (int i = 0; i < n; i++) *target[i] = acc[i];
}

/* The transposed: acc[k] -= sum over rows of L[row, k] x[row] for `n` columns starting at entry `l`. */
INLINE void gather_columns(const double *l, size_t stride, size_t nrows, const int *rows, const vgi_row *x,
                           vgi_row *target, int n)
{
    vgi_row acc[4];
#pragma GCC unroll 4
    for (int k = 0; k < n; k++) acc[k] = target[k];
    for (size_t i = 0; i < nrows; i++) {
        vgi_row xi = x[rows[i]];
#pragma GCC unroll 4
        for (int k = 0; k < n; k++) {
            double entry = l[(size_t)k * stride + i];
#pragma GCC unroll 3
            for (int c = 0; c < 3; c++) acc[k].xyz[c] -= entry * xi.xyz[c];
        }
    }
#pragma GCC unroll 4
    for (int k = 0; k < n; k++) target[k] = acc[k];
}

INLINE void scale(vgi_row *x, double factor)
{
    for (int c = 0; c < 3; c++) x->xyz[c] *= factor;
}

INLINE void forward(const vgi_factor *f, vgi_row *x, int width)
{
    for (size_t s = 0; s < f->supernodes; s++) {
        size_t first = (size_t)f->super[s], columns = (size_t)f->super[s + 1] - first;
        size_t nrows = (size_t)(f->pi[s + 1] - f->pi[s]), i = 0;
        const int *rows = f->rows + f->pi[s];
        const double *l = f->values + f->px[s];
        vgi_row *head = x + first, *target[4];
        for (; i < columns; i++) {
            target[0] = head + i;
            eliminate_rows(l + i, nrows, i, head, target, 1);
            scale(head + i, 1 / l[i * nrows + i]);
        }
        for (; i + (size_t)width <= nrows; i += (size_t)width) {
            for (int k = 0; k < width; k++) target[k] = x + rows[i + (size_t)k];
            eliminate_rows(l + i, nrows, columns, head, target, width);
        }
        for (; i < nrows; i++) {
            target[0] = x + rows[i];
            eliminate_rows(l + i, nrows, columns, head, target, 1);
        }
    }
}

INLINE void backward(const vgi_factor *f, vgi_row *x, int width)
{
    for (size_t s = f->supernodes; s-- > 0;) {
        size_t first = (size_t)f->super[s], columns = (size_t)f->super[s + 1] - first;
        size_t nrows = (size_t)(f->pi[s + 1] - f->pi[s]), k = 0;
        const int *rows = f->rows + f->pi[s];
        const double *l = f->values + f->px[s];
        vgi_row *head = x + first;
        for (; k + (size_t)width <= columns; k += (size_t)width)
            gather_columns(l + k * nrows + columns, nrows, nrows - columns, rows + columns, x, head + k, width);
        for (; k < columns; k++)
            gather_columns(l + k * nrows + columns, nrows, nrows - columns, rows + columns, x, head + k, 1);
        for (k = columns; k-- > 0;) {
            gather_columns(l + k * nrows + k + 1, nrows, columns - k - 1, rows + k + 1, x, head + k, 1);
            scale(head + k, 1 / l[k * nrows + k]);
        }
    }
}

/* Rows are met in the order of vertices, which is not theirs: ask for the lines of one ahead. */
INLINE void ask(const vgi_row *x, const uint32_t *row, size_t v, size_t nv, size_t rows)
{
    enum { AHEAD = 8 };
    if (v + AHEAD >= nv || row[v + AHEAD] >= rows) return;
    const char *p = (const char *)&x[row[v + AHEAD]];
    for (size_t i = 0; i < sizeof *x; i += 64) __builtin_prefetch(p + i, 1);
}

INLINE void load_rows(vgi_row *x, const uint32_t *row, size_t nv, size_t rows, const double *const *rhs)
{
    for (size_t v = 0; v < nv; v++) {
        ask(x, row, v, nv, rows);
        if (row[v] >= rows) continue;
        vgi_row *to = &x[row[v]];
        for (size_t c = 0; c < 3; c++) to->xyz[c] = vgi_gather(rhs, 3 * v + c);
    }
}

INLINE void add_rows(const vgi_row *x, const uint32_t *row, size_t nv, size_t rows, double *const *pose, size_t lanes)
{
    for (size_t v = 0; v < nv; v++) {
        ask(x, row, v, nv, rows);
        if (row[v] >= rows) continue;
        const double *from = (const double *)&x[row[v]];
        for (size_t k = 0; k < lanes; k++)
            for (size_t c = 0; c < 3; c++) pose[k][3 * v + c] += from[c * VGI_LANES + k];
    }
}

/* How many rows fit into the registers at once differs with their number and width. */
#if defined(__x86_64__)
#define AVX512 __attribute__((target("avx512f,avx512dq,fma")))
#define AVX2 __attribute__((target("avx2,fma")))

AVX512 static void solve_avx512(const vgi_factor *f, vgi_row *x)
{
    forward(f, x, 4);
    backward(f, x, 4);
}

AVX512 static void load_avx512(vgi_row *x, const uint32_t *row, size_t nv, size_t rows, const double *const *rhs)
{
    load_rows(x, row, nv, rows, rhs);
}

AVX2 static void solve_avx2(const vgi_factor *f, vgi_row *x)
{
    forward(f, x, 2);
    backward(f, x, 2);
}

static bool has_avx512(void)
{
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
}

static bool has_avx2(void)
{
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}
#endif

void vgi_factor_solve(const vgi_factor *f, vgi_row *x)
{
#if defined(__x86_64__)
    if (has_avx512()) return solve_avx512(f, x);
    if (has_avx2()) return solve_avx2(f, x);
#endif
    forward(f, x, 1);
    backward(f, x, 1);
}

void vgi_load_rows(vgi_row *x, const uint32_t *row, size_t nv, size_t rows, const double *const *rhs)
{
#if defined(__x86_64__)
    if (has_avx512()) return load_avx512(x, row, nv, rows, rhs);
#endif
    load_rows(x, row, nv, rows, rhs);
}

void vgi_add_rows(const vgi_row *x, const uint32_t *row, size_t nv, size_t rows, double *const *pose, size_t lanes)
{
    add_rows(x, row, nv, rows, pose, lanes);
}
