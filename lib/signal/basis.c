/* basis.c: principal components of a small number of high-dimensional poses: the eigenvectors of the n x n Gram
 * matrix give them at the cost of two products.
 *
 * Rounding of the Gram matrix skews basis vectors of small variance by up to its square root; one pass of Cholesky QR
 * makes them orthogonal (1e-4 becomes 1e-15). Coordinates also follow from the Gram matrix, except those of small
 * variance, which are computed as products of vectors. The meaning of the numbers of a pose does not matter here.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "numeric/lapack.h"
#include "signal/rows_kernel.h"
#include "signal/signal.h"

#include <math.h>
#include <stdlib.h>
#include <sys/mman.h>

enum {
    TILE = 128,    /* rows per tile of a Gram matrix */
    STRIPE = 3072, /* numbers of a pose processed at a time: a multiple of 3 */
    SHORT = 512    /* the same for a tile, of which a stripe stays in the cache */
};

void vgi_basis_clear(vgi_basis *b)
{
    free(b->mean);
    free(b->centred);
    free(b->vectors);
    free(b->x);
    free(b->value);
    *b = (vgi_basis){0};
}

typedef struct job {
    vgi_basis *b;
    const double *rows; /* for a Gram matrix */
    size_t nrows, length;
    double *gram;
    const double *weight; /* rank x n: vectors = weight * centred */
    const double *inverse; /* rank x rank, lower, packed */
    double *const *to;     /* the vectors */
    const double *x;      /* for an error */
    size_t stride, m;
    size_t first;         /* of the stripes measured at a time */
    double *room, *square, *sums;
} job;

static size_t stripes(size_t d)
{
    return (d + STRIPE - 1) / STRIPE;
}

static size_t width_of(size_t d, size_t stripe)
{
    return d - stripe * STRIPE < STRIPE ? d - stripe * STRIPE : STRIPE;
}

/* ---- Gram matrices, tile by tile ---- */

/* A tile on the diagonal: its lower triangle. */
static void gram_of_rows(size_t n, size_t d, const double *rows, double *g, size_t ldg)
{
    for (size_t i = 0; i < n; i++) memset(g + i * ldg, 0, (i + 1) * sizeof *g);
    for (size_t first = 0; first < d; first += SHORT)
        vgi_rows_kernel_now()->gram(n, d - first < SHORT ? d - first : SHORT, rows + first, d, g, ldg);
}

static void gram_tile(void *context, size_t index)
{
    job *j = context;
    size_t row = 0, n = j->nrows, d = j->length;
    while ((row + 1) * (row + 2) / 2 <= index) row++;
    size_t column = index - row * (row + 1) / 2, i = row * TILE, k = column * TILE;
    size_t height = n - i < TILE ? n - i : TILE, width = n - k < TILE ? n - k : TILE;
    if (row == column) gram_of_rows(height, d, j->rows + i * d, j->gram + i * n + k, n);
    else vgi_product_double_transposed(height, width, d, j->rows + i * d, d, j->rows + k * d, d, j->gram + i * n + k, n);
}

void vgi_gram(size_t n, size_t d, const double *rows, double *g, int threads)
{
    size_t tiles = (n + TILE - 1) / TILE;
    vgi_parallel(threads, tiles * (tiles + 1) / 2, gram_tile, &(job){.rows = rows, .nrows = n, .length = d, .gram = g});
    for (size_t i = 0; i < n; i++)
        for (size_t k = i + 1; k < n; k++) g[i * n + k] = g[k * n + i];
}

/* ---- eigenvectors, as rows divided by the root of the eigenvalue ---- */

static int find_weights(vgi_basis *b, const double *g, double *weight, vg_err *e)
{
    size_t n = b->n;
    double *copy = vgi_copy_array(g, n * n, sizeof *g, e);
    int r = copy ? vgi_eigen(n, copy, n, b->value, weight, e) : VG_ENOMEM;
    free(copy);
    if (r < 0) return r;
    while (b->rank + 1 < n && b->value[b->rank] > 1e-14 * b->value[0]) b->rank++;
    for (size_t j = 0; j < b->rank; j++)
        for (size_t i = 0; i < n; i++) weight[j * n + i] /= sqrt(b->value[j]);
    return VG_OK;
}

/* ---- vectors ---- */

static void multiply_stripe(void *context, size_t s)
{
    job *j = context;
    vgi_basis *b = j->b;
    vgi_product_double(b->rank, width_of(b->d, s), b->n, j->weight, b->n, b->centred + s * STRIPE, b->d,
                       b->vectors + s * STRIPE, b->d);
}

static void straighten_stripe(void *context, size_t s)
{
    job *j = context;
    vgi_basis *b = j->b;
    vgi_product p = {.rows = b->rank, .depth = b->rank, .first = s * STRIPE, .end = s * STRIPE + width_of(b->d, s),
                     .a = j->inverse, .lower = true, .b = b->vectors, .ldb = b->d, .to = j->to,
                     .room = j->room + s * b->rank * VGI_TILE};
    vgi_rows_kernel_now()->multiply(&p);
}

/* vectors := factor^-1 vectors. The factor is near 1, so that its inverse is as good as solving. */
static int straighten(vgi_basis *b, const double *factor, int threads, vg_err *e)
{
    size_t rank = b->rank;
    double *inverse = vgi_array(rank * rank, sizeof *inverse, e), *packed = vgi_array(vgi_packed(rank, rank), sizeof *packed, e);
    double **to = vgi_array(rank, sizeof *to, e), *room = vgi_array_raw(stripes(b->d) * rank, VGI_TILE * sizeof *room, e);
    int r = inverse && packed && to && room ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        for (size_t i = 0; i < rank; i++) inverse[i * rank + i] = 1, to[i] = b->vectors + i * b->d;
        vgi_solve_lower(rank, factor, rank, inverse);
        vgi_pack_rows(rank, rank, inverse, packed);
        vgi_parallel(threads, stripes(b->d), straighten_stripe,
                     &(job){.b = b, .inverse = packed, .to = to, .room = room});
    }
    free(inverse);
    free(packed);
    free(to);
    free(room);
    return r;
}

/* weight := factor^-1 weight, so that still vectors = weight * centred */
static int make_vectors(vgi_basis *b, double *weight, int threads, vg_err *e)
{
    size_t rank = b->rank;
    double *g = vgi_array(rank * rank, sizeof *g, e);
    if (!g) return VG_ENOMEM;
    vgi_parallel(threads, stripes(b->d), multiply_stripe, &(job){.b = b, .weight = weight});
    vgi_gram(rank, b->d, b->vectors, g, threads);
    int r = vgi_spd_factor(rank, g)
                ? straighten(b, g, threads, e)
                : vg_fail(e, VG_EINPUT, "the poses cannot be told apart from their rounding errors");
    if (r == VG_OK) vgi_solve_lower(rank, g, b->n, weight);
    free(g);
    return r;
}

static void make_coordinates(vgi_basis *b, const double *g, const double *weight)
{
    size_t large = 0;
    while (large < b->rank && b->value[large] > 1e-6 * b->value[0]) large++;
    vgi_product_double_transposed(b->n, large, b->n, g, b->n, weight, b->n, b->x, b->rank);
    if (large < b->rank)
        vgi_product_double_transposed(b->n, b->rank - large, b->d, b->centred, b->d, b->vectors + large * b->d, b->d,
                                      b->x + large, b->rank);
}

static int centre(vgi_basis *b, vg_err *e)
{
    if (!(b->mean = vgi_array(b->d, sizeof *b->mean, e))) return VG_ENOMEM;
    vgi_rows_kernel_now()->centre(b->n, b->d, b->centred, b->d, b->mean);
    return VG_OK;
}

/* Memory for the vectors, on huge pages if available: a third of the time was spent on the first touch of small
 * ones. */
static double *large_array(size_t n, vg_err *e)
{
    enum { LARGE = 1 << 21 };
    double *x = vgi_array_raw(n, sizeof *x, e);
    uintptr_t first = ((uintptr_t)x + LARGE - 1) / LARGE * LARGE, end = ((uintptr_t)x + n * sizeof *x) / LARGE * LARGE;
    if (x && end > first) (void)madvise((void *)first, end - first, MADV_HUGEPAGE); /* failure does no harm */
    return x;
}

int vgi_basis_make(vgi_basis *b, double *poses, size_t n, size_t d, int threads, vg_err *e)
{
    int r = VG_ENOMEM;
    vgi_blas_alone();
    double *g = NULL, *weight = NULL;
    *b = (vgi_basis){.n = n, .d = d, .centred = poses};
    if (centre(b, e) < 0 || !(g = vgi_array(n * n, sizeof *g, e)) || !(weight = vgi_array(n * n, sizeof *weight, e)) ||
        !(b->value = vgi_array(n, sizeof *b->value, e)))
        goto out;
    vgi_gram(n, d, poses, g, threads);
    if ((r = find_weights(b, g, weight, e)) < 0) goto out;
    r = VG_ENOMEM;
    size_t size;
    if (!vgi_mul(b->rank, d, &size) || !(b->vectors = large_array(size, e)) ||
        !(b->x = vgi_array(n * b->rank, sizeof *b->x, e)))
        goto out;
    r = VG_OK;
    if (b->rank && (r = make_vectors(b, weight, threads, e)) == VG_OK) make_coordinates(b, g, weight);
out:
    vgi_blas_shared();
    free(g);
    free(weight);
    if (r < 0) vgi_basis_clear(b);
    return r;
}

/* ---- errors ---- */

static void measure_stripe(void *context, size_t index)
{
    job *j = context;
    const vgi_basis *b = j->b;
    size_t s = j->first + index, width = width_of(b->d, s), n = b->n;
    double *fitted = j->room + index * STRIPE * n, *most = j->square + s * n;
    if (j->m)
        vgi_product_double(n, width, j->m, j->x, j->stride, b->vectors + s * STRIPE, b->d, fitted, width);
    else memset(fitted, 0, n * width * sizeof *fitted);
    for (size_t i = 0; i < n; i++) {
        const double *a = b->centred + i * b->d + s * STRIPE, *f = fitted + i * width;
        double sum = 0, largest = 0;
        for (size_t c = 0; c + 2 < width; c += 3) {
            double x = a[c] - f[c], y = a[c + 1] - f[c + 1], z = a[c + 2] - f[c + 2], square = x * x + y * y + z * z;
            sum += square;
            largest = square > largest ? square : largest;
        }
        most[i] = largest;
        j->sums[s * n + i] = sum;
    }
}

int vgi_basis_error(const vgi_basis *b, const double *x, size_t stride, size_t m, int threads, vgi_error *error,
                    vg_err *e)
{
    size_t n = b->n, count = stripes(b->d);
    size_t group = (size_t)threads < count ? (size_t)threads : count;
    int r = VG_ENOMEM;
    double *room = vgi_array_raw(group * n, STRIPE * sizeof *room, e), *square = vgi_array(n * count, sizeof *square, e);
    double *sums = vgi_array(n * count, sizeof *sums, e), total = 0;
    vgi_blas_alone();
    if (!room || !square || !sums) goto out;
    job j = {.b = (vgi_basis *)b, .x = x, .stride = stride, .m = m, .room = room, .square = square, .sums = sums};
    for (; j.first < count; j.first += group)
        vgi_parallel(threads, count - j.first < group ? count - j.first : group, measure_stripe, &j);
    error->most = 0;
    for (size_t i = 0; i < n; i++) {
        double largest = 0;
        for (size_t s = 0; s < count; s++) {
            largest = fmax(largest, square[s * n + i]);
            total += sums[s * n + i];
        }
        if (error->of_frame) error->of_frame[i] = sqrt(largest);
        error->most = fmax(error->most, sqrt(largest));
    }
    const size_t nv = b->d / 3;
    error->rms = nv ? sqrt(total / (double)n / (double)nv) : 0;
    r = VG_OK;
out:
    vgi_blas_shared();
    free(room);
    free(square);
    free(sums);
    return r;
}
