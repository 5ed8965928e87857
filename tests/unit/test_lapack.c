/* test_lapack.c: definite systems against elimination, eigenvalues against the closed form of a chain; the same numbers from several threads at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/lapack.h"
#include "dense.h"
#include "numeric/blas.h"
#include "test.h"

static const double PI = 3.14159265358979323846;

static double *random_matrix(size_t m, size_t n)
{
    double *a = room(m * n, sizeof(double));
    for (size_t i = 0; i < m * n; i++) a[i] = noise();
    return a;
}

static double *copy_of(const double *a, size_t n)
{
    double *c = room(n, sizeof(double));
    memcpy(c, a, n * sizeof *a);
    return c;
}

/* Larger and smaller than the blocks of the factorisation, against elimination; what is not definite is refused. */
static void definite_systems(void)
{
    static const size_t sizes[] = {1, 3, 64, 65, 150};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (size_t m = 1; m < 4; m++) {
            size_t n = sizes[i];
            double *b = random_matrix(n, n), *a = room(n * n, sizeof(double)), *l = room(n * n, sizeof(double));
            for (size_t p = 0; p < n; p++)
                for (size_t q = 0; q < n; q++) {
                    a[p * n + q] = p == q;
                    for (size_t k = 0; k < n; k++) a[p * n + q] += b[p * n + k] * b[q * n + k];
                    l[p * n + q] = q <= p ? a[p * n + q] : NAN; /* only the lower triangle is read */
                }
            double *x = random_matrix(n, m), *truth = copy_of(x, n * m);
            CHECK(vgi_spd_factor(n, l));
            vgi_spd_solve(n, l, m, x);
            memcpy(l, a, n * n * sizeof *l);
            l[n * n - 1] -= 1e3 * (double)n;
            CHECK(!vgi_spd_factor(n, l));
            eliminate(a, truth, n, m);
            for (size_t k = 0; k < n * m; k++) CHECK_NEAR(x[k], truth[k], 1e-10);
            free(b), free(a), free(l), free(x), free(truth);
        }
}

/* The Laplacian of a chain of n vertices, in the lower triangle, which alone is read; its eigenvalues are 2 - 2 cos(pi k / n), k = 0..n-1, and
 * vertex i of eigenvector k is in proportion to cos(pi k (i + 1/2) / n). */
static double *chain_of(size_t n)
{
    double *a = room(n * n, sizeof(double));
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++)
            a[i * n + k] = k > i ? 1e9 : k + 1 == i ? -1 : k == i ? (double)(i > 0) + (i + 1 < n) : 0;
    return a;
}

static void check_chain(size_t n, size_t count)
{
    vg_err e = {0};
    double *a = chain_of(n), *values = room(count, sizeof(double)), *vectors = room(count * n, sizeof(double));
    CHECK(vgi_eigen(n, a, count, values, vectors, &e) == VG_OK);
    for (size_t i = 0; i < count; i++) {
        size_t k = n - 1 - i, most = 0;
        double scale = sqrt((k ? 2.0 : 1.0) / (double)n), dot = 0;
        CHECK_NEAR(values[i], 2 - 2 * cos(PI * (double)k / (double)n), 1e-13);
        for (size_t j = 0; j < n; j++) {
            dot += vectors[i * n + j] * scale * cos(PI * (double)k * ((double)j + 0.5) / (double)n);
            if (fabs(vectors[i * n + j]) > fabs(vectors[i * n + most])) most = j;
        }
        CHECK_NEAR(fabs(dot), 1, 1e-12);
        CHECK(vectors[i * n + most] > 0);
    }
    free(a), free(values), free(vectors);
}

static void eigenpairs_of_a_chain(void)
{
    check_chain(1, 1);
    check_chain(12, 12);
    check_chain(150, 5);
    check_chain(150, 150);
    vg_err e = {0};
    double *a = chain_of(5), value;
    CHECK(vgi_eigen(5, a, 0, &value, NULL, &e) == VG_OK);
    free(a);
    double b[4] = {1, NAN, NAN, 1};
    CHECK(vgi_eigen(2, b, 1, &value, NULL, &e) == VG_EINPUT);
}

enum { TASKS = 32, SIZE = 60 };

static void solve_one(void *context, size_t i)
{
    double *values = (double *)context + i * SIZE, *a = room(SIZE * SIZE, sizeof(double));
    vg_err e = {0};
    for (size_t k = 0; k < SIZE; k++)
        for (size_t j = 0; j <= k; j++) a[k * SIZE + j] = sin((double)(k * k + j + i % 2));
    if (vgi_eigen(SIZE, a, SIZE, values, NULL, &e)) values[0] = NAN;
    free(a);
}

/* Every second task has the same matrix: its answer is the same to the last bit, whatever runs beside it. */
static void threads_agree(void)
{
    double *values = room(TASKS * SIZE, sizeof(double));
    vgi_blas_alone();
    vgi_parallel(4, TASKS, solve_one, values);
    vgi_blas_shared();
    for (size_t i = 2; i < TASKS; i++)
        CHECK(!memcmp(values + i * SIZE, values + i % 2 * SIZE, SIZE * sizeof *values));
    CHECK(values[0] != values[SIZE] && values[0] > values[1]);
    free(values);
}

TESTS({"definite systems", definite_systems}, {"eigenpairs of a chain", eigenpairs_of_a_chain}, {"threads agree", threads_agree})
