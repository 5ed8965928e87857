/* signal: how long the parts of fitting a signal take beside products of the same shape: the shape signal of 100 frames of
 * 17,329 vertices beside dsyrk and dgemm, and the pass over all sites of 295 frames beside its operations at the speed of
 * dgemm. Prints both ratios, the least of several runs in turn, on one thread, in seconds of the processor: other programs
 * that run beside it disturb these least.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "signal/signal.h"

#include <cblas.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { FRAMES = 100, NUMBERS = 51987, SITES = 295, RUNS = 15 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *room(size_t n)
{
    void *p = calloc(n, sizeof(double));
    if (!p) exit(4);
    return p;
}

static uint64_t state = 1;
static double number(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53 - 0.5;
}

/* ---- the shape signal ---- */

static double time_basis(const double *poses)
{
    vgi_basis b;
    vg_err e;
    double *copy = room((size_t)FRAMES * NUMBERS);
    memcpy(copy, poses, (size_t)FRAMES * NUMBERS * sizeof *copy);
    double begin = now();
    if (vgi_basis_make(&b, copy, FRAMES, NUMBERS, 1, &e) < 0) exit(1);
    double took = now() - begin;
    vgi_basis_clear(&b);
    return took;
}

static double time_products(const double *poses, double *g, double *h)
{
    double begin = now();
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasNoTrans, FRAMES, NUMBERS, 1, poses, NUMBERS, 0, g, FRAMES);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, FRAMES, NUMBERS, FRAMES, 1, g, FRAMES, poses, NUMBERS, 0, h, NUMBERS);
    return now() - begin;
}

static void compare_basis(void)
{
    double *poses = room((size_t)FRAMES * NUMBERS), *g = room(FRAMES * FRAMES), *h = room((size_t)FRAMES * NUMBERS);
    double ours = INFINITY, theirs = INFINITY;
    for (size_t i = 0; i < (size_t)FRAMES * NUMBERS; i++) poses[i] = number();
    for (int run = 0; run < RUNS; run++) {
        ours = fmin(ours, time_basis(poses));
        theirs = fmin(theirs, time_products(poses, g, h));
    }
    printf("shape signal of %d x %d: %.1f ms, dsyrk and dgemm %.1f ms: %.2f\n", FRAMES, NUMBERS, 1e3 * ours, 1e3 * theirs,
           ours / theirs);
    free(poses);
    free(g);
    free(h);
}

/* ---- all sites ---- */

static double time_sites(const double *p, const double *x, size_t m, size_t *sites)
{
    vgi_plate s;
    vg_err e;
    double begin = now();
    if (vgi_plate_order(&s, SITES, m, p, x, m, VGI_FARTHEST, &e) < 0) exit(1);
    double took = now() - begin;
    *sites = s.l;
    vgi_plate_clear(&s);
    return took;
}

static double time_dgemm(size_t n, const double *a, double *c)
{
    double begin = now();
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)n, (int)n, (int)n, 1, a, (int)n, a, (int)n, 0, c, (int)n);
    return now() - begin;
}

static void compare_sites(void)
{
    size_t n = SITES, m = SITES - 1, l = 0;
    double *p = room(2 * n), *x = room(n * m), *a = room(n * n), *c = room(n * n), ours = INFINITY, theirs = INFINITY;
    for (size_t i = 0; i < 2 * n; i++) p[i] = number();
    for (size_t i = 0; i < n * m; i++) x[i] = number();
    for (size_t i = 0; i < n * n; i++) a[i] = number();
    for (int run = 0; run < RUNS; run++) {
        ours = fmin(ours, time_sites(p, x, m, &l));
        theirs = fmin(theirs, time_dgemm(n, a, c));
    }
    /* each function is orthogonalised twice (less than 1e-3 is left of most, and once would lose as many digits), and
     * the residual is multiplied by it, and by that product */
    double k = (double)l, work = 4 * (double)n * k * k + 4 * (double)n * k * (double)m;
    theirs *= work / (2 * (double)n * (double)n * (double)n);
    printf("%zu sites of %zu frames, %zu coordinates: %.1f ms, the same operations in dgemm %.1f ms: %.2f\n", l, n, m, 1e3 * ours,
           1e3 * theirs, ours / theirs);
    free(p);
    free(x);
    free(a);
    free(c);
}

int main(void)
{
    vgi_blas_alone();
    compare_basis();
    compare_sites();
    vgi_blas_shared();
    return 0;
}
