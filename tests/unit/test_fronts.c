/* test_fronts.c: the factors of what is left when rows of a matrix are held solve the same systems as Gaussian
 * elimination of the dense matrix, whichever rows are held; what is not definite is refused. Leaves out the solvers of
 * poses that use them (test_reconstruct.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "dense.h"
#include "numeric/fronts.h"

enum { SIDE = 13, GRID = SIDE * SIDE, N = GRID + 4 };

static void put_edge(vgi_triplets *t, size_t i, size_t j, double weight)
{
    vgi_triplets_put(t, i, i, weight);
    vgi_triplets_put(t, j, j, weight);
    vgi_triplets_put(t, i, j, -weight);
}

/* The Laplacian of a grid with diagonals and of a path of four: two components, singular as a whole. */
static vgi_sparse make_laplacian(void)
{
    vgi_triplets t;
    vgi_sparse a;
    vg_err e;
    CHECK(vgi_triplets_make(&t, 12 * N, &e) == VG_OK);
    for (size_t y = 0; y < SIDE; y++)
        for (size_t x = 0; x < SIDE; x++) {
            size_t i = y * SIDE + x;
            if (x + 1 < SIDE) put_edge(&t, i, i + 1, 1.5 + noise());
            if (y + 1 < SIDE) put_edge(&t, i, i + SIDE, 1.5 + noise());
            if (x + 1 < SIDE && y + 1 < SIDE) put_edge(&t, i, i + SIDE + 1, 1.5 + noise());
        }
    for (size_t i = GRID; i + 1 < N; i++) put_edge(&t, i, i + 1, 1.5 + noise());
    CHECK(vgi_triplets_sum(&t, N, &a, &e) == VG_OK);
    vgi_triplets_clear(&t);
    return a;
}

/* The rows of a that are not held, as a dense matrix, and their numbers. */
static double *dense_of(const vgi_sparse *a, const bool *held, size_t *number, size_t *n)
{
    *n = 0;
    for (size_t i = 0; i < a->n; i++) number[i] = held[i] ? SIZE_MAX : (*n)++;
    double *d = room(*n * *n, sizeof *d);
    for (size_t j = 0; j < a->n; j++)
        for (int k = a->start[j]; k < a->start[j + 1]; k++) {
            size_t p = number[j], q = number[a->row[k]];
            if (p != SIZE_MAX && q != SIZE_MAX) d[p * *n + q] = d[q * *n + p] = a->value[k];
        }
    return d;
}

/* The farthest that the solution for eight poses or the one for one pose is from that of Gaussian elimination, which
 * is made of the same right-hand sides. */
static double apart(const vgi_sparse *a, const bool *held, const vgi_held_factor *f)
{
    enum { COLUMNS = 3 * VGI_LANES };
    size_t number[N], n;
    double *d = dense_of(a, held, number, &n), *want = room(COLUMNS * n, sizeof *want), worst = 0;
    vgi_row *x = room(n, sizeof *x);
    double *one = room(4 * n, sizeof *one);
    CHECK(f->factor.n == n);
    for (size_t i = 0; i < a->n; i++) {
        CHECK((f->row[i] == UINT32_MAX) == held[i]);
        if (held[i]) continue;
        for (size_t c = 0; c < COLUMNS; c++) {
            double b = want[number[i] * COLUMNS + c] = noise();
            x[f->row[i]].xyz[c / VGI_LANES][c % VGI_LANES] = b;
            if (c % VGI_LANES == 2) one[4 * f->row[i] + c / VGI_LANES] = b;
        }
    }
    eliminate(d, want, n, COLUMNS);
    vgi_factor_solve(&f->factor, x);
    vgi_factor_solve_one(&f->factor, one);
    for (size_t i = 0; i < a->n; i++)
        for (size_t c = 0; c < COLUMNS && !held[i]; c++) {
            double w = want[number[i] * COLUMNS + c], size = 1 + fabs(w);
            worst = fmax(worst, fabs(x[f->row[i]].xyz[c / VGI_LANES][c % VGI_LANES] - w) / size);
            if (c % VGI_LANES == 2) worst = fmax(worst, fabs(one[4 * f->row[i] + c / VGI_LANES] - w) / size);
        }
    free(d), free(want), free(x), free(one);
    return worst;
}

/* Condition numbers are below 1e4: 1e-11 is a hundred times what rounding leaves. */
static void check_held(const vgi_fronts *f, const vgi_sparse *a, const bool *held)
{
    vgi_held_factor h;
    vg_err e;
    bool made = vgi_fronts_hold(f, held, &h, &e) == VG_OK;
    CHECK(made);
    if (!made) return;
    CHECK_NEAR(apart(a, held, &h), 0, 1e-11);
    vgi_held_factor_clear(&h);
    CHECK(!h.values && !h.row);
}

/* Every row of the grid alone, first and last; both components hold one row at least. */
static void test_one_row(void)
{
    vgi_sparse a = make_laplacian();
    vgi_fronts *f;
    vg_err e;
    CHECK(vgi_fronts_new(&f, &a, &e) == VG_OK);
    for (size_t i = 0; i < GRID; i += i % 12 ? 12 - i % 12 : 1) {
        bool held[N] = {false};
        held[i] = held[GRID + i % 4] = true;
        check_held(f, &a, held);
    }
    vgi_fronts_free(&f);
    CHECK(!f);
    vgi_sparse_clear(&a);
}

/* Few, many, nearly all rows at random; whole lines of the grid; all rows. */
static void test_many_rows(void)
{
    vgi_sparse a = make_laplacian();
    vgi_fronts *f;
    vg_err e;
    CHECK(vgi_fronts_new(&f, &a, &e) == VG_OK);
    for (int of_ten = 1; of_ten <= 9; of_ten++) {
        bool held[N] = {false};
        held[of_ten] = held[GRID] = true;
        for (size_t i = 0; i < N; i++)
            if (noise() < 0.2 * of_ten - 1) held[i] = true;
        check_held(f, &a, held);
    }
    for (size_t line = 0; line < SIDE; line += 3) {
        bool row[N] = {false}, column[N] = {false};
        row[N - 1] = column[N - 2] = true;
        for (size_t i = 0; i < SIDE; i++) row[line * SIDE + i] = column[i * SIDE + line] = true;
        check_held(f, &a, row);
        check_held(f, &a, column);
    }
    bool all[N];
    for (size_t i = 0; i < N; i++) all[i] = true;
    check_held(f, &a, all);
    vgi_fronts_free(&f);
    vgi_sparse_clear(&a);
}

/* Three rows, each coupled to both others, one of them with a negative diagonal: fine while that one is held. */
static void test_indefinite(void)
{
    static const double diagonal[3] = {4, -1, 4};
    vgi_triplets t;
    vgi_sparse a;
    vgi_fronts *f;
    vgi_held_factor h;
    vg_err e;
    CHECK(vgi_triplets_make(&t, 6, &e) == VG_OK);
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j <= i; j++) vgi_triplets_put(&t, i, j, i == j ? diagonal[i] : 1);
    CHECK(vgi_triplets_sum(&t, 3, &a, &e) == VG_OK && vgi_fronts_new(&f, &a, &e) == VG_OK);
    CHECK(vgi_fronts_hold(f, (const bool[3]){true, false, false}, &h, &e) == VG_EINPUT && !h.values);
    check_held(f, &a, (const bool[3]){false, true, false});
    vgi_fronts_free(&f);
    vgi_sparse_clear(&a);
    vgi_triplets_clear(&t);
}

TESTS({"one held row", test_one_row}, {"many held rows", test_many_rows},
      {"what is left must be definite", test_indefinite})
