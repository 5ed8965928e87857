/* solve_kernel.c: L L' x = b over a supernodal factor, 24 right-hand sides (8 poses) interleaved.
 *
 * A sparse triangular solve is bound by loads and stores of x: column by column, every entry of the factor costs a
 * load and a store of its row of x. Here the columns of a supernode share their rows: a row is loaded once, updated
 * with all columns of the supernode in registers, and stored once. A few rows (forward) or columns (backward) are
 * processed together, so that their common data is also loaded once. Their number depends on the registers, most of
 * which hold their sums. This file also copies numbers from poses to rows and back. Assembly and factorisation are in
 * reconstruct.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/solve_kernel.h"
#include "core/wide.h"

/* A row is 24 numbers: SHARES times SPAN vectors. The sums of TOGETHER rows of one share are in registers at a time:
 * 4 x 3 of 32 (AVX-512), 2 x 6 of 16 (AVX2), 2 x 12 of 32 (NEON), 2 x 6 of 16 twice (SSE2). */
#if VGI_WIDTH == 8
enum { SPAN = 3, TOGETHER = 4 };
#elif VGI_WIDTH == 4 || !defined(__aarch64__)
enum { SPAN = 6, TOGETHER = 2 };
#else
enum { SPAN = 12, TOGETHER = 2 };
#endif
enum { ROW = 3 * VGI_LANES, SHARE = SPAN * VGI_WIDTH, SHARES = ROW / SHARE };

typedef struct sums {
    vgi_wide at[SPAN];
} sums;

VGI_INLINE sums load_sums(const double *row)
{
    sums s;
#pragma GCC unroll 12
    for (int c = 0; c < SPAN; c++) s.at[c] = vgi_load(row + c * VGI_WIDTH);
    return s;
}

VGI_INLINE void store_sums(double *row, const sums *s)
{
#pragma GCC unroll 12
    for (int c = 0; c < SPAN; c++) vgi_store(row + c * VGI_WIDTH, s->at[c]);
}

/* s[i] -= entry[i * apart] row, for n sums. Each number of the row is loaded once for all of them. */
VGI_INLINE void subtract_scaled(sums *s, int n, const double *entry, size_t apart, const double *row)
{
    vgi_wide factor[TOGETHER];
#pragma GCC unroll 4
    for (int i = 0; i < n; i++) factor[i] = vgi_same(entry[(size_t)i * apart]);
#pragma GCC unroll 12
    for (int c = 0; c < SPAN; c++) {
        vgi_wide x = vgi_load(row + c * VGI_WIDTH);
#pragma GCC unroll 4
        for (int i = 0; i < n; i++) s[i].at[c] -= factor[i] * x;
    }
}

VGI_INLINE void scale_sums(sums *s, double factor)
{
    vgi_wide f = vgi_same(factor);
#pragma GCC unroll 12
    for (int c = 0; c < SPAN; c++) s->at[c] *= f;
}

/* Row i of the factor for n rows: target[i] -= sum over k < columns of l[k stride + i] x[k]. */
VGI_INLINE void eliminate_rows(const double *l, size_t stride, size_t columns, const double *x, double *const *target,
                               int n)
{
    sums s[TOGETHER];
#pragma GCC unroll 4
    for (int i = 0; i < n; i++) s[i] = load_sums(target[i]);
    for (size_t k = 0; k < columns; k++) subtract_scaled(s, n, l + k * stride, 1, x + k * ROW);
#pragma GCC unroll 4
    for (int i = 0; i < n; i++) store_sums(target[i], &s[i]);
}

/* The first rows of a supernode, its own columns: two rows are updated with the columns before them, then the second
 * with the first. */
VGI_INLINE void eliminate_head(const double *l, size_t stride, size_t columns, double *head)
{
    size_t i = 0;
    for (; i + 2 <= columns; i += 2) {
        double *first = head + i * ROW, *second = first + ROW;
        sums s[2] = {load_sums(first), load_sums(second)};
        for (size_t k = 0; k < i; k++) subtract_scaled(s, 2, l + k * stride + i, 1, head + k * ROW);
        scale_sums(&s[0], 1 / l[i * stride + i]);
        store_sums(first, &s[0]);
        subtract_scaled(&s[1], 1, l + i * stride + i + 1, 1, first);
        scale_sums(&s[1], 1 / l[(i + 1) * stride + i + 1]);
        store_sums(second, &s[1]);
    }
    if (i == columns) return;
    sums s = load_sums(head + i * ROW);
    for (size_t k = 0; k < i; k++) subtract_scaled(&s, 1, l + k * stride + i, 1, head + k * ROW);
    scale_sums(&s, 1 / l[i * stride + i]);
    store_sums(head + i * ROW, &s);
}

VGI_INLINE void forward(const vgi_factor *f, double *x)
{
    for (size_t s = 0; s < f->supernodes; s++) {
        size_t first = (size_t)f->super[s], columns = (size_t)f->super[s + 1] - first;
        size_t nrows = (size_t)(f->pi[s + 1] - f->pi[s]), i = columns;
        const int *rows = f->rows + f->pi[s];
        const double *l = f->block[s];
        double *head = x + first * ROW, *target[TOGETHER];
        eliminate_head(l, nrows, columns, head);
        for (; i + TOGETHER <= nrows; i += TOGETHER) {
            for (size_t k = 0; k < TOGETHER; k++) target[k] = x + (size_t)rows[i + k] * ROW;
            eliminate_rows(l + i, nrows, columns, head, target, TOGETHER);
        }
        for (; i < nrows; i++) {
            target[0] = x + (size_t)rows[i] * ROW;
            eliminate_rows(l + i, nrows, columns, head, target, 1);
        }
    }
}

/* Backward, the rows of a column are processed from last to first, for any number of columns together, here and for
 * one pose. So both give the same bits. */

/* s[k] -= sum over rows below the head of l[k stride + row] x[row], for n columns. */
VGI_INLINE void gather_below(sums *s, int n, const double *l, size_t stride, size_t columns, const int *rows,
                             const double *x)
{
    for (size_t i = stride; i-- > columns;) subtract_scaled(s, n, l + i, stride, x + (size_t)rows[i] * ROW);
}

/* Finish columns k .. k + n - 1 of a supernode in turn; those after them are done. */
VGI_INLINE void finish_columns(const double *l, size_t stride, size_t columns, const int *rows, const double *x,
                               double *head, size_t k, int n)
{
    sums s[TOGETHER];
    l += k * stride;
#pragma GCC unroll 4
    for (int i = 0; i < n; i++) s[i] = load_sums(head + (k + (size_t)i) * ROW);
    gather_below(s, n, l, stride, columns, rows, x);
    for (size_t j = columns; j-- > k + (size_t)n;) subtract_scaled(s, n, l + j, stride, head + j * ROW);
#pragma GCC unroll 4
    for (int i = n; i-- > 0;) {
        double *at = head + (k + (size_t)i) * ROW;
#pragma GCC unroll 4
        for (int j = n; j-- > i + 1;)
            subtract_scaled(&s[i], 1, l + (size_t)i * stride + k + (size_t)j, 0, head + (k + (size_t)j) * ROW);
        scale_sums(&s[i], 1 / l[(size_t)i * stride + k + (size_t)i]);
        store_sums(at, &s[i]);
    }
}

VGI_INLINE void backward(const vgi_factor *f, double *x)
{
    for (size_t s = f->supernodes; s-- > 0;) {
        size_t first = (size_t)f->super[s], columns = (size_t)f->super[s + 1] - first, k = columns;
        size_t nrows = (size_t)(f->pi[s + 1] - f->pi[s]);
        const int *rows = f->rows + f->pi[s];
        const double *l = f->block[s];
        double *head = x + first * ROW;
        for (; k >= TOGETHER; k -= TOGETHER)
            finish_columns(l, nrows, columns, rows, x, head, k - TOGETHER, TOGETHER);
        for (; k > 0; k--) finish_columns(l, nrows, columns, rows, x, head, k - 1, 1);
    }
}

static void solve_poses(const vgi_factor *f, vgi_row *x)
{
    for (size_t share = 0; share < SHARES; share++) {
        forward(f, (double *)x + share * SHARE);
        backward(f, (double *)x + share * SHARE);
    }
}

/* ---- one pose ---- */

/* A row is x, y, z and 0: one vector of four, or two of two. */
#if VGI_WIDTH == 2
typedef vgi_wide piece;
typedef vgi_wide_at piece_at;
enum { PIECES = 2, MANY = 4 };
#else
typedef double piece __attribute__((vector_size(32)));
typedef double piece_at __attribute__((vector_size(32), aligned(8), may_alias));
enum { PIECES = 1, MANY = 8 }; /* rows or columns together: as many as there are additions in flight */
#endif
enum { POINT = 4 };

typedef struct point {
    piece at[PIECES];
} point;

VGI_INLINE point load_point(const double *p)
{
    point x;
#pragma GCC unroll 2
    for (int c = 0; c < PIECES; c++) x.at[c] = ((const piece_at *)p)[c];
    return x;
}

VGI_INLINE void store_point(double *p, const point *x)
{
#pragma GCC unroll 2
    for (int c = 0; c < PIECES; c++) ((piece_at *)p)[c] = x->at[c];
}

VGI_INLINE void subtract_point(point *s, double factor, const point *x)
{
#pragma GCC unroll 2
    for (int c = 0; c < PIECES; c++) s->at[c] -= factor * x->at[c];
}

VGI_INLINE void scale_point(point *s, double factor)
{
#pragma GCC unroll 2
    for (int c = 0; c < PIECES; c++) s->at[c] *= factor;
}

/* n rows below a supernode: x[rows[i]] -= sum over k < columns of l[k stride + i] head[k]. */
VGI_INLINE void eliminate_points(const double *l, size_t stride, size_t columns, const double *head, const int *rows,
                                 double *x, int n)
{
    point s[MANY];
#pragma GCC unroll 8
    for (int i = 0; i < n; i++) s[i] = load_point(x + (size_t)rows[i] * POINT);
    for (size_t k = 0; k < columns; k++, l += stride) {
        point h = load_point(head + k * POINT);
#pragma GCC unroll 8
        for (int i = 0; i < n; i++) subtract_point(&s[i], l[i], &h);
    }
#pragma GCC unroll 8
    for (int i = 0; i < n; i++) store_point(x + (size_t)rows[i] * POINT, &s[i]);
}

VGI_INLINE void forward_one(const vgi_factor *f, double *x)
{
    for (size_t s = 0; s < f->supernodes; s++) {
        size_t columns = (size_t)(f->super[s + 1] - f->super[s]), nrows = (size_t)(f->pi[s + 1] - f->pi[s]), i = columns;
        const int *rows = f->rows + f->pi[s];
        const double *l = f->block[s];
        double *head = x + (size_t)f->super[s] * POINT;
        for (size_t k = 0; k < columns; k++) {
            point h = load_point(head + k * POINT);
            scale_point(&h, 1 / l[k * nrows + k]);
            store_point(head + k * POINT, &h);
            for (size_t j = k + 1; j < columns; j++) {
                point t = load_point(head + j * POINT);
                subtract_point(&t, l[k * nrows + j], &h);
                store_point(head + j * POINT, &t);
            }
        }
        for (; i + MANY <= nrows; i += MANY) eliminate_points(l + i, nrows, columns, head, rows + i, x, MANY);
        for (; i + 2 <= nrows; i += 2) eliminate_points(l + i, nrows, columns, head, rows + i, x, 2);
        for (; i < nrows; i++) eliminate_points(l + i, nrows, columns, head, rows + i, x, 1);
    }
}

/* Columns k .. k + n - 1 of a supernode; those after them are done. */
VGI_INLINE void finish_points(const double *l, size_t stride, size_t columns, const int *rows, const double *x,
                              double *head, size_t k, int n)
{
    point s[MANY];
    l += k * stride;
#pragma GCC unroll 8
    for (int i = 0; i < n; i++) s[i] = load_point(head + (k + (size_t)i) * POINT);
    for (size_t j = stride; j-- > k + (size_t)n;) {
        point t = load_point(j < columns ? head + j * POINT : x + (size_t)rows[j] * POINT);
#pragma GCC unroll 8
        for (int i = 0; i < n; i++) subtract_point(&s[i], l[(size_t)i * stride + j], &t);
    }
#pragma GCC unroll 8
    for (int i = n; i-- > 0;) {
#pragma GCC unroll 8
        for (int j = n; j-- > i + 1;) subtract_point(&s[i], l[(size_t)i * stride + k + (size_t)j], &s[j]);
        scale_point(&s[i], 1 / l[(size_t)i * stride + k + (size_t)i]);
        store_point(head + (k + (size_t)i) * POINT, &s[i]);
    }
}

VGI_INLINE void backward_one(const vgi_factor *f, double *x)
{
    for (size_t s = f->supernodes; s-- > 0;) {
        size_t columns = (size_t)(f->super[s + 1] - f->super[s]), nrows = (size_t)(f->pi[s + 1] - f->pi[s]), k = columns;
        const int *rows = f->rows + f->pi[s];
        const double *l = f->block[s];
        double *head = x + (size_t)f->super[s] * POINT;
        for (; k >= MANY; k -= MANY) finish_points(l, nrows, columns, rows, x, head, k - MANY, MANY);
        for (; k >= 2; k -= 2) finish_points(l, nrows, columns, rows, x, head, k - 2, 2);
        if (k) finish_points(l, nrows, columns, rows, x, head, 0, 1);
    }
}

static void solve_one(const vgi_factor *f, double *x)
{
    forward_one(f, x);
    backward_one(f, x);
}

/* ---- from poses to rows and back ---- */

/* Prefetch rows, which are visited in vertex order instead of their own order. */
VGI_INLINE void ask(const vgi_row *x, const uint32_t *row, size_t v, size_t nv, size_t rows)
{
    enum { AHEAD = 8 };
    if (v + AHEAD >= nv || row[v + AHEAD] >= rows) return;
    const char *p = (const char *)&x[row[v + AHEAD]];
    for (size_t i = 0; i < sizeof *x; i += 64) __builtin_prefetch(p + i, 1);
}

static void load_rows(vgi_row *x, const uint32_t *row, size_t nv, size_t rows, const double *const *rhs)
{
    for (size_t v = 0; v < nv; v++) {
        ask(x, row, v, nv, rows);
        if (row[v] >= rows) continue;
        double *to = (double *)&x[row[v]];
#pragma GCC unroll 4
        for (size_t part = 0; part < VGI_PARTS; part++) {
            vgi_wide xyz[3];
            vgi_gather_point(rhs + part * VGI_WIDTH, 3 * v, xyz);
#pragma GCC unroll 3
            for (size_t c = 0; c < 3; c++) vgi_store(to + c * VGI_LANES + part * VGI_WIDTH, xyz[c]);
        }
    }
}

static void add_rows(const vgi_row *x, const uint32_t *row, size_t nv, size_t rows, double *const *pose, size_t lanes)
{
    for (size_t v = 0; v < nv; v++) {
        ask(x, row, v, nv, rows);
        if (row[v] >= rows) continue;
        const double *from = (const double *)&x[row[v]];
        for (size_t part = 0; part * VGI_WIDTH < lanes; part++) {
            size_t first = part * VGI_WIDTH, n = vgi_part_lanes(lanes, part);
            const double *now[VGI_WIDTH];
            for (size_t k = 0; k < VGI_WIDTH; k++) now[k] = pose[first + (k < n ? k : 0)];
            vgi_wide xyz[3];
            vgi_gather_point(now, 3 * v, xyz);
#pragma GCC unroll 3
            for (size_t c = 0; c < 3; c++) xyz[c] += vgi_load(from + c * VGI_LANES + first);
            vgi_scatter_point(pose + first, n, 3 * v, xyz);
        }
    }
}

const vgi_solve_kernel VGI_OF_SET(vgi_solve_kernel) = {solve_poses, solve_one, load_rows, add_rows};
