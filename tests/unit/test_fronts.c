/* test_fronts.c: the factors of what is left when rows of a matrix are held solve the same systems as Gaussian
 * elimination of the dense matrix, whichever rows are held; what is not definite is refused. Leaves out the solvers of
 * poses that use them (test_reconstruct.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "dense.h"
#include "numeric/fronts.h"

enum { SIDE = 13, GRID = SIDE * SIDE, N = GRID + 4, MOST = 12 * N };

/* A matrix in two pieces, as fronts take it, and whole. */
typedef struct system {
    vgi_sparse whole, inner; /* inner: without the border, or whole */
    vgi_cholesky *c;
    vgi_border border;
    vgi_fronts *f;
    uint32_t row_of[N]; /* per row of the whole: its row among those of the fronts */
} system_of;

static void put_edge(vgi_triplets *t, size_t i, size_t j, double weight)
{
    vgi_triplets_put(t, i, i, weight);
    vgi_triplets_put(t, j, j, weight);
    vgi_triplets_put(t, i, j, -weight);
}

/* The Laplacian of a grid with diagonals and of a path of four, which is not joined to it; the path, and the grid
 * unless it is to be singular, have something more in one diagonal entry. */
static vgi_sparse make_laplacian(bool singular)
{
    vgi_triplets t;
    vgi_sparse a;
    vg_err e;
    CHECK(vgi_triplets_make(&t, MOST, &e) == VG_OK);
    for (size_t y = 0; y < SIDE; y++)
        for (size_t x = 0; x < SIDE; x++) {
            size_t i = y * SIDE + x;
            if (x + 1 < SIDE) put_edge(&t, i, i + 1, 1.5 + noise());
            if (y + 1 < SIDE) put_edge(&t, i, i + SIDE, 1.5 + noise());
            if (x + 1 < SIDE && y + 1 < SIDE) put_edge(&t, i, i + SIDE + 1, 1.5 + noise());
        }
    for (size_t i = GRID; i + 1 < N; i++) put_edge(&t, i, i + 1, 1.5 + noise());
    vgi_triplets_put(&t, N - 1, N - 1, 1);
    if (!singular) vgi_triplets_put(&t, SIDE, SIDE, 1);
    CHECK(vgi_triplets_sum(&t, N, &a, &e) == VG_OK);
    vgi_triplets_clear(&t);
    return a;
}

/* Split a: row `out` becomes the border. */
static void split(system_of *s, size_t out)
{
    vgi_triplets t;
    vg_err e;
    const vgi_sparse *a = &s->whole;
    CHECK(vgi_triplets_make(&t, MOST, &e) == VG_OK);
    s->border.row = room(a->n, sizeof *s->border.row), s->border.value = room(a->n, sizeof *s->border.value);
    for (size_t j = 0; j < a->n; j++)
        for (int k = a->start[j]; k < a->start[j + 1]; k++) {
            size_t i = (size_t)a->row[k], other = i == out ? j : i;
            if (i == out && j == out) s->border.diagonal = a->value[k];
            else if (i != out && j != out) vgi_triplets_put(&t, i - (i > out), j - (j > out), a->value[k]);
            else s->border.row[s->border.n] = (uint32_t)(other - (other > out)), s->border.value[s->border.n++] = a->value[k];
        }
    CHECK(vgi_triplets_sum(&t, a->n - 1, &s->inner, &e) == VG_OK);
    vgi_triplets_clear(&t);
}

/* out: the row that is the border, or N: there is none. */
static system_of make_system(vgi_sparse whole, size_t out)
{
    system_of s = {.whole = whole};
    vg_err e;
    if (out < whole.n) split(&s, out);
    const vgi_sparse *a = out < whole.n ? &s.inner : &s.whole;
    CHECK(vgi_cholesky_new(&s.c, a, NULL, &e) == VG_OK && vgi_cholesky_factorize(s.c, a, &e) == VG_OK);
    CHECK(vgi_fronts_new(&s.f, a, s.c, out < whole.n ? &s.border : NULL, &e) == VG_OK);
    for (size_t i = 0; i < a->n; i++) {
        size_t row = (size_t)vgi_cholesky_order(s.c)[i];
        s.row_of[row + (row >= out)] = (uint32_t)i;
    }
    if (out < whole.n) s.row_of[out] = (uint32_t)a->n;
    return s;
}

static void clear(system_of *s)
{
    vgi_fronts_free(&s->f);
    CHECK(!s->f);
    vgi_cholesky_free(&s->c);
    vgi_sparse_clear(&s->whole);
    vgi_sparse_clear(&s->inner);
    free(s->border.row);
    free(s->border.value);
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
static double apart(const system_of *s, const bool *held, const vgi_held_factor *f)
{
    enum { COLUMNS = 3 * VGI_LANES };
    size_t number[N], n;
    double *d = dense_of(&s->whole, held, number, &n), *want = room(COLUMNS * n, sizeof *want), worst = 0;
    vgi_row *x = aligned_alloc(64, (n + 1) * sizeof *x);
    double *one = aligned_alloc(64, (n / 2 + 1) * 8 * sizeof *one);
    CHECK(x && one && f->factor.n == n);
    for (size_t i = 0; i < s->whole.n; i++) {
        uint32_t row = f->row[s->row_of[i]];
        CHECK((row == UINT32_MAX) == held[i]);
        if (held[i]) continue;
        one[4 * row + 3] = 0;
        for (size_t c = 0; c < COLUMNS; c++) {
            double b = want[number[i] * COLUMNS + c] = noise();
            x[row].xyz[c / VGI_LANES][c % VGI_LANES] = b;
            if (c % VGI_LANES == 2) one[4 * row + c / VGI_LANES] = b;
        }
    }
    eliminate(d, want, n, COLUMNS);
    vgi_factor_solve(&f->factor, x);
    vgi_factor_solve_one(&f->factor, one);
    for (size_t i = 0; i < s->whole.n; i++)
        for (size_t c = 0; c < COLUMNS && !held[i]; c++) {
            uint32_t row = f->row[s->row_of[i]];
            double w = want[number[i] * COLUMNS + c], size = 1 + fabs(w);
            worst = fmax(worst, fabs(x[row].xyz[c / VGI_LANES][c % VGI_LANES] - w) / size);
            if (c % VGI_LANES == 2) worst = fmax(worst, fabs(one[4 * row + c / VGI_LANES] - w) / size);
        }
    free(d), free(want), free(x), free(one);
    return worst;
}

/* Condition numbers are below 1e4: 1e-11 is ten times what rounding may leave. */
static void check_held(const system_of *s, const bool *held)
{
    vgi_held_factor h;
    vg_err e;
    bool of_fronts[N];
    for (size_t i = 0; i < s->whole.n; i++) of_fronts[s->row_of[i]] = held[i];
    bool made = vgi_fronts_hold(s->f, of_fronts, &h, &e) == VG_OK;
    CHECK(made);
    if (!made) return;
    CHECK_NEAR(apart(s, held, &h), 0, 1e-11);
    vgi_held_factor_clear(&h);
    CHECK(!h.values && !h.row);
}

/* Every twelfth row of the grid and those around the border, alone and with the border. */
static void test_one_row(void)
{
    static const size_t borders[] = {0, 5, GRID / 2, GRID - 1};
    for (size_t k = 0; k < 4; k++) {
        system_of s = make_system(make_laplacian(true), borders[k]);
        for (size_t i = 0; i < GRID; i += 1 + (i > 30 ? i % 12 : 0)) {
            bool held[N] = {false};
            held[i] = true;
            check_held(&s, held);
            held[borders[k]] = held[GRID + i % 4] = true;
            check_held(&s, held);
        }
        clear(&s);
    }
}

/* Few, many, nearly all rows at random; whole lines of the grid; all rows. */
static void check_many(const system_of *s)
{
    for (int of_ten = 1; of_ten <= 9; of_ten++) {
        bool held[N] = {false};
        held[of_ten] = true;
        for (size_t i = 0; i < N; i++)
            if (noise() < 0.2 * of_ten - 1) held[i] = true;
        check_held(s, held);
    }
    for (size_t line = 0; line < SIDE; line += 3) {
        bool row[N] = {false}, column[N] = {false};
        row[N - 1] = true;
        for (size_t i = 0; i < SIDE; i++) row[line * SIDE + i] = column[i * SIDE + line] = true;
        check_held(s, row);
        check_held(s, column);
    }
    bool all[N];
    for (size_t i = 0; i < N; i++) all[i] = true;
    check_held(s, all);
}

static void test_many_rows(void)
{
    system_of s = make_system(make_laplacian(true), SIDE + 2);
    check_many(&s);
    clear(&s);
}

static void test_without_border(void)
{
    system_of s = make_system(make_laplacian(false), N);
    const bool none[N] = {false};
    check_held(&s, none);
    check_many(&s);
    clear(&s);
}

/* Three rows, each coupled to both others; the border has a negative diagonal: fine while it is held. */
static void test_indefinite(void)
{
    static const double diagonal[3] = {4, 4, -1};
    vgi_triplets t;
    vgi_sparse a;
    vgi_held_factor h;
    vg_err e;
    CHECK(vgi_triplets_make(&t, 6, &e) == VG_OK);
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j <= i; j++) vgi_triplets_put(&t, i, j, i == j ? diagonal[i] : 1);
    CHECK(vgi_triplets_sum(&t, 3, &a, &e) == VG_OK);
    vgi_triplets_clear(&t);
    system_of s = make_system(a, 2);
    CHECK(vgi_fronts_hold(s.f, (const bool[3]){true, false, false}, &h, &e) == VG_EINPUT && !h.values);
    check_held(&s, (const bool[3]){false, false, true});
    clear(&s);
}

TESTS({"one held row", test_one_row}, {"many held rows", test_many_rows}, {"no border", test_without_border},
      {"what is left must be definite", test_indefinite})
