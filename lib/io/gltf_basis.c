/* gltf_basis.c: approximates many frames by few morph targets, with a singular value decomposition. Frames come from,
 * and are written in, gltf_morph.c.
 *
 * The matrix A has a row for each frame. Eigenvectors u of A A' give orthonormal directions u' A / sigma, onto which
 * each frame is projected. This is optimal on average over the vertices; the number of directions is chosen by the
 * largest error, which is measured.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_basis.h"

#include "numeric/blas.h"
#include "numeric/lapack.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_ROWS = 2048, BLOCK = 16, CHUNK = 4 << 20 }; /* BLOCK: frames projected at a time; CHUNK: numbers */

typedef struct making {
    const vgi_gltf_frames_in *in;
    vgi_gltf_basis *to;
    size_t width;       /* 3 nv */
    size_t rows;        /* frames used to find the directions */
    size_t count;       /* directions that may be needed */
    double *gram, *values, *vectors;
    float *frame, *block, *met;
    double tolerance;
} making;

/* The frame of row r. */
static size_t frame_of(const making *k, size_t r)
{
    return k->rows < 2 ? 0 : r * (k->in->frames - 1) / (k->rows - 1);
}

/* ---- directions ---- */

static int load_columns(const making *k, size_t from, size_t n, double *to, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < k->rows && r == VG_OK; i++) {
        r = k->in->load(k->in->context, frame_of(k, i), k->frame, e);
        for (size_t c = 0; c < n; c++) to[i * n + c] = k->frame[from + c];
    }
    return r;
}

static size_t columns_at_once(const making *k)
{
    const size_t n = CHUNK / k->rows;
    return n < k->width ? n : k->width;
}

static int add_gram(making *k, vg_err *e)
{
    const size_t step = columns_at_once(k), square = k->rows * k->rows;
    double *some = vgi_array_raw(k->rows * step, sizeof *some, e), *part = vgi_array(square, sizeof *part, e);
    int r = some && part ? VG_OK : VG_ENOMEM;
    for (size_t from = 0; from < k->width && r == VG_OK; from += step) {
        const size_t n = k->width - from < step ? k->width - from : step;
        if ((r = load_columns(k, from, n, some, e)) < 0) break;
        vgi_product_gram(k->rows, n, some, n, part, k->rows);
        for (size_t i = 0; i < square; i++) k->gram[i] += part[i];
    }
    free(some);
    free(part);
    return r;
}

/* Enough directions that no vertex of these frames can be off by more than the tolerance. */
static void count_directions(making *k, size_t most)
{
    double left = 0;
    size_t n = k->rows;
    while (n > 1 && left + fmax(k->values[n - 1], 0) <= k->tolerance * k->tolerance) left += fmax(k->values[--n], 0);
    while (n > 1 && !(k->values[n - 1] > 1e-13 * k->values[0])) n--;
    k->count = n < most ? n : most;
}

/* targets := the first `count` directions */
static int make_directions(making *k, vg_err *e)
{
    const size_t step = columns_at_once(k);
    double *some = vgi_array_raw(k->rows * step, sizeof *some, e);
    double *part = vgi_array_raw(k->count * step, sizeof *part, e);
    k->to->targets = vgi_array_raw(k->count, k->width * sizeof *k->to->targets, e);
    int r = some && part && k->to->targets ? VG_OK : VG_ENOMEM;
    for (size_t from = 0; from < k->width && r == VG_OK; from += step) {
        const size_t n = k->width - from < step ? k->width - from : step;
        if ((r = load_columns(k, from, n, some, e)) < 0) break;
        vgi_product_double(k->count, n, k->rows, k->vectors, k->rows, some, n, part, n);
        for (size_t t = 0; t < k->count; t++) {
            const double size = k->values[t] > 0 ? 1 / sqrt(k->values[t]) : 0;
            for (size_t c = 0; c < n; c++) k->to->targets[t * k->width + from + c] = (float)(size * part[t * n + c]);
        }
    }
    free(some);
    free(part);
    return r;
}

/* ---- all frames ---- */

static int load_block(const making *k, size_t from, size_t n, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < n && r == VG_OK; i++)
        r = k->in->load(k->in->context, from + i, k->block + i * k->width, e);
    return r;
}

static size_t block_at(const making *k, size_t from)
{
    return k->in->frames - from < BLOCK ? k->in->frames - from : BLOCK;
}

static int project(making *k, vg_err *e)
{
    vgi_gltf_basis *b = k->to;
    b->weights = vgi_array_raw(k->in->frames, k->count * sizeof *b->weights, e);
    int r = b->weights ? VG_OK : VG_ENOMEM;
    for (size_t from = 0; from < k->in->frames && r == VG_OK; from += BLOCK) {
        const size_t n = block_at(k, from);
        if ((r = load_block(k, from, n, e)) < 0) break;
        vgi_product_single_transposed(n, k->count, k->width, k->block, k->width, b->targets, k->width,
                                      b->weights + from * k->count, k->count);
    }
    return r;
}

static double largest_distance(const float *a, const float *b, size_t width)
{
    double most = 0;
    for (size_t i = 0; i < width; i += 3) {
        const double x = (double)a[i] - b[i], y = (double)a[i + 1] - b[i + 1], z = (double)a[i + 2] - b[i + 2];
        const double square = x * x + y * y + z * z;
        if (!(square <= most)) most = square;
    }
    return sqrt(most);
}

/* Error with the first n directions. Stops once it exceeds `enough`. */
static int measure_error(making *k, size_t n, double enough, double *error, vg_err *e)
{
    int r = VG_OK;
    *error = 0;
    for (size_t from = 0; from < k->in->frames && r == VG_OK && *error <= enough; from += BLOCK) {
        const size_t some = block_at(k, from);
        if ((r = load_block(k, from, some, e)) < 0) break;
        vgi_product_single(some, k->width, n, k->to->weights + from * k->count, k->count, k->to->targets, k->width,
                           k->met, k->width);
        for (size_t i = 0; i < some; i++)
            *error = fmax(*error, largest_distance(k->block + i * k->width, k->met + i * k->width, k->width));
    }
    return r;
}

/* The smallest sufficient number. */
static int choose_count(making *k, vg_err *e)
{
    size_t low = 0, high = k->count; /* low is insufficient, high may be sufficient */
    double error;
    int r = VG_OK;
    while (high - low > 1 && r == VG_OK) {
        const size_t mid = low + (high - low) / 2;
        r = measure_error(k, mid, k->tolerance, &error, e);
        if (error <= k->tolerance) high = mid;
        else low = mid;
    }
    k->to->n = high;
    return r < 0 ? r : measure_error(k, high, HUGE_VAL, &k->to->error, e);
}

/* Compact the weights, and scale so that the largest weight of each target is 1. */
static void scale_weights(making *k)
{
    vgi_gltf_basis *b = k->to;
    for (size_t i = 0; i < k->in->frames; i++)
        memmove(b->weights + i * b->n, b->weights + i * k->count, b->n * sizeof *b->weights);
    for (size_t t = 0; t < b->n; t++) {
        float most = 0;
        for (size_t i = 0; i < k->in->frames; i++) most = fmaxf(most, fabsf(b->weights[i * b->n + t]));
        if (!(most > 0)) continue;
        for (size_t i = 0; i < k->in->frames; i++) b->weights[i * b->n + t] /= most;
        for (size_t c = 0; c < k->width; c++) b->targets[t * k->width + c] *= most;
    }
}

static bool are_finite(const float *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i])) return false;
    return true;
}

/* Sums of displacements near the limit of binary32 would overflow. */
static int check_range(const making *k, vg_err *e)
{
    const vgi_gltf_basis *b = k->to;
    if (are_finite(b->targets, b->n * k->width) && are_finite(b->weights, b->n * k->in->frames)) return VG_OK;
    return vg_fail(e, VG_EINPUT, "the frames are too large to be mixed in binary32");
}

static int make_all(making *k, size_t most, vg_err *e)
{
    k->gram = vgi_array(k->rows, k->rows * sizeof *k->gram, e);
    k->values = vgi_array(k->rows, sizeof *k->values, e);
    k->vectors = vgi_array(k->rows, k->rows * sizeof *k->vectors, e);
    k->frame = vgi_array_raw(k->width, sizeof *k->frame, e);
    k->block = vgi_array_raw(k->width, BLOCK * sizeof *k->block, e);
    k->met = vgi_array_raw(k->width, BLOCK * sizeof *k->met, e);
    if (!k->gram || !k->values || !k->vectors || !k->frame || !k->block || !k->met) return VG_ENOMEM;
    int r = add_gram(k, e);
    if (r == VG_OK) r = vgi_eigen(k->rows, k->gram, k->rows, k->values, k->vectors, e);
    if (r < 0) return r;
    count_directions(k, most);
    r = make_directions(k, e);
    if (r == VG_OK) r = project(k, e);
    if (r == VG_OK) r = choose_count(k, e);
    if (r < 0) return r;
    scale_weights(k);
    return check_range(k, e);
}

int vgi_gltf_basis_make(vgi_gltf_basis *b, const vgi_gltf_frames_in *in, size_t most, double tolerance, vg_err *e)
{
    making k = {.in = in, .to = b, .width = 3 * in->nv, .tolerance = tolerance};
    k.rows = in->frames < MOST_ROWS ? in->frames : MOST_ROWS;
    *b = (vgi_gltf_basis){0};
    int r = make_all(&k, most, e);
    void *const arrays[] = {k.gram, k.values, k.vectors, k.frame, k.block, k.met};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    if (r < 0) vgi_gltf_basis_clear(b);
    return r;
}

int vgi_gltf_basis_solve(const vgi_gltf_basis *b, size_t frames, double **solved, vg_err *e)
{
    const size_t n = b->n;
    const float *weights = b->weights;
    double *gram = vgi_array(n, n * sizeof *gram, e), *to = vgi_array(n, frames * sizeof *to, e), trace = 0;
    int r = gram && to ? VG_OK : VG_ENOMEM;
    for (size_t f = 0; f < frames && r == VG_OK; f++)
        for (size_t s = 0; s < n; s++) {
            const double a = weights[f * n + s];
            to[s * frames + f] = a;
            for (size_t t = 0; t <= s; t++) gram[s * n + t] += a * weights[f * n + t];
        }
    for (size_t s = 0; s < n && r == VG_OK; s++) trace += gram[s * n + s];
    const double ridge = trace > 0 ? 1e-12 * trace : 1; /* 0: all weights have vanished in binary32 */
    for (size_t s = 0; s < n && r == VG_OK; s++) gram[s * n + s] += ridge;
    if (r == VG_OK && n && !vgi_spd_factor(n, gram)) r = vg_fail(e, VG_EINPUT, "the frames cannot be mixed");
    if (r == VG_OK) vgi_spd_solve(n, gram, frames, to);
    free(gram);
    if (r < 0) free(to);
    else *solved = to;
    return r;
}

void vgi_gltf_basis_clear(vgi_gltf_basis *b)
{
    free(b->targets);
    free(b->weights);
    *b = (vgi_gltf_basis){0};
}
