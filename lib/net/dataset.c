/* dataset.c: stores frames as features in binary32, normalises them, and expresses them in principal coordinates. The
 * steps of the root are a separate regression on the motion of the body.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/dataset.h"
#include "core/random.h"
#include "numeric/blas.h"
#include "signal/signal.h"

#include <math.h>
#include <stdlib.h>
#include <xxhash.h>

static const double least_width = 1e-3, least_sigma = 1e-7, least_scale = 0.02, least_change = 1e-3, change_scale = 2;
enum { LEAST_FRAMES = 4 };

/* ---- adding ---- */

int vgi_dataset_add(vgi_dataset *s, const double *features, size_t width, const double *root, const double *centroids,
                    const double *home, vg_err *e)
{
    if (vgi_grow(&s->features, &s->features_cap, (s->n + 1) * s->d, sizeof *s->features, e) < 0 ||
        vgi_grow(&s->home, &s->home_cap, (s->n + 1) * 3 * s->nv, sizeof *s->home, e) < 0 ||
        vgi_grow(&s->roots, &s->roots_cap, (s->n + 1) * 4, sizeof *s->roots, e) < 0 ||
        vgi_grow(&s->centroids, &s->centroids_cap, (s->n + 1) * 3 * s->parts, sizeof *s->centroids, e) < 0)
        return VG_ENOMEM;
    float *to = s->features + s->n * s->d;
    for (size_t i = 0; i < s->d; i++) to[i] = (float)(i % width >= 9 ? features[i] / s->diagonal : features[i]);
    for (size_t i = 0; i < 3 * s->nv; i++) s->home[s->n * 3 * s->nv + i] = (float)home[i];
    memcpy(s->roots + 4 * s->n, root, 4 * sizeof *root);
    memcpy(s->centroids + 3 * s->parts * s->n, centroids, 3 * s->parts * sizeof *centroids);
    s->digest = XXH64(to, s->d * sizeof *to, s->digest);
    if (!s->nsequences && vgi_dataset_cut(s, e) < 0) return VG_ENOMEM;
    s->n++;
    return VG_OK;
}

int vgi_dataset_cut(vgi_dataset *s, vg_err *e)
{
    if (s->nsequences && s->sequence[s->nsequences - 1] == s->n) return VG_OK;
    if (vgi_grow(&s->sequence, &s->sequences_cap, s->nsequences + 1, sizeof *s->sequence, e) < 0) return VG_ENOMEM;
    s->sequence[s->nsequences++] = s->n;
    return VG_OK;
}

void vgi_dataset_clear(vgi_dataset *s)
{
    free(s->features);
    free(s->home);
    free(s->roots);
    free(s->centroids);
    free(s->sequence);
    free(s->train.at);
    free(s->held.at);
    free(s->coordinates);
    *s = (vgi_dataset){0};
}

/* ---- division ---- */

int vgi_spans_add(vgi_spans *s, vgi_span span, vg_err *e)
{
    if (span.first >= span.end) return VG_OK;
    if (vgi_grow(&s->at, &s->cap, s->n + 1, sizeof *s->at, e) < 0) return VG_ENOMEM;
    s->at[s->n++] = span;
    return VG_OK;
}

size_t vgi_spans_frames(const vgi_spans *s)
{
    size_t n = 0;
    for (size_t i = 0; i < s->n; i++) n += s->at[i].end - s->at[i].first;
    return n;
}

/* reorder rows of `size` bytes: new row i is old row order[i] */
static int reorder(void *rows, size_t size, const size_t *order, size_t n, vg_err *e)
{
    char *copy = vgi_copy_array(rows, n, size, e);
    if (!copy) return VG_ENOMEM;
    for (size_t i = 0; i < n; i++) memcpy((char *)rows + i * size, copy + order[i] * size, size);
    free(copy);
    return VG_OK;
}

static int split_by_step(vgi_dataset *s, size_t step, vg_err *e)
{
    size_t *order = vgi_array_raw(s->n, sizeof *order, e), *first = NULL, cap = 0, n = 0, nfirst = 0;
    int r = order ? VG_OK : VG_ENOMEM;
    for (size_t q = 0; r == VG_OK && q < s->nsequences; q++) {
        size_t begin = s->sequence[q], end = q + 1 < s->nsequences ? s->sequence[q + 1] : s->n;
        for (size_t phase = 0; r == VG_OK && phase < step && begin + phase < end; phase++) {
            r = vgi_grow(&first, &cap, nfirst + 1, sizeof *first, e);
            if (r == VG_OK) first[nfirst++] = n;
            for (size_t i = begin + phase; i < end; i += step) order[n++] = i;
        }
    }
    if (r == VG_OK) r = reorder(s->features, s->d * sizeof *s->features, order, s->n, e);
    if (r == VG_OK) r = reorder(s->home, 3 * s->nv * sizeof *s->home, order, s->n, e);
    if (r == VG_OK) r = reorder(s->roots, 4 * sizeof *s->roots, order, s->n, e);
    if (r == VG_OK) r = reorder(s->centroids, 3 * s->parts * sizeof *s->centroids, order, s->n, e);
    free(order);
    if (r < 0) return free(first), r;
    free(s->sequence);
    s->sequence = first, s->sequences_cap = cap, s->nsequences = nfirst;
    return VG_OK;
}

/* First frame of the block of `held` frames. At least `before` frames are left before it, since that many are given when
 * judging. */
static size_t hold_from(size_t length, size_t held, size_t before, size_t hold_at, uint64_t seed, size_t sequence)
{
    size_t end = length - held;
    if (hold_at != VG_HOLD_BY_SEED) return hold_at < end ? hold_at : end;
    if (end <= before) return end;
    vgi_random r = vgi_random_start(seed, UINT64_MAX - sequence);
    return before + vgi_random_below(&r, end - before + 1);
}

/* Frames begin to end are every step-th one of a sequence, from its frame `phase`; block: what of that sequence is held out.
 * The block is the same in all phases, so that no frame between those that are held is learned from. */
static int divide_phase(vgi_dataset *s, size_t begin, size_t end, size_t phase, size_t step, const vgi_span *block, vg_err *e)
{
    size_t at = begin + (block->first > phase ? (block->first - phase + step - 1) / step : 0);
    size_t behind = begin + (block->end > phase ? (block->end - phase + step - 1) / step : 0);
    vgi_span whole[3] = {{begin, at, begin}, {at, behind, begin}, {behind, end, behind}};
    for (int i = 0; i < 3; i++)
        if (vgi_spans_add(i == 1 ? &s->held : &s->train, whole[i], e) < 0) return VG_ENOMEM;
    return VG_OK;
}

int vgi_dataset_divide(vgi_dataset *s, size_t step, double hold, size_t hold_at, uint64_t seed, vg_err *e)
{
    enum { BEFORE = 3 };
    size_t n = s->nsequences, number = 0, *start = vgi_array_raw(n + 1, sizeof *start, e);
    int r = start ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && n) memcpy(start, s->sequence, n * sizeof *start);
    if (r == VG_OK) start[n] = s->n;
    if (r == VG_OK && step > 1) r = split_by_step(s, step, e);
    for (size_t q = 0; r == VG_OK && q < n; q++) {
        size_t length = start[q + 1] - start[q], held = (size_t)(hold * (double)length + 0.5);
        vgi_span block = {.first = hold_from(length, held, BEFORE * step, hold_at, seed, q)};
        block.end = block.first + held;
        for (size_t phase = 0; r == VG_OK && phase < step && phase < length; phase++, number++) {
            size_t end = number + 1 < s->nsequences ? s->sequence[number + 1] : s->n;
            r = divide_phase(s, s->sequence[number], end, phase, step, &block, e);
        }
    }
    free(start);
    return r;
}

int vgi_spans_coordinates(const vgi_spans *spans, const vgi_dataset *s, vgi_frames *f, vg_err *e)
{
    size_t n = vgi_spans_frames(spans), k = s->rank, *start = vgi_array(spans->n + 1, sizeof *start, e);
    double *row = vgi_array_raw(n * k, sizeof *row, e);
    if (!start || !row) return free(start), free(row), VG_ENOMEM;
    for (size_t i = 0; i < spans->n; i++) {
        size_t length = spans->at[i].end - spans->at[i].first;
        memcpy(row + start[i] * k, s->coordinates + spans->at[i].first * k, length * k * sizeof *row);
        start[i + 1] = start[i] + length;
    }
    *f = (vgi_frames){k, n, spans->n, row, start};
    return VG_OK;
}

/* ---- coordinates ---- */

/* number k of n's input from that of the features */
static double normal_number(const vg_network *n, size_t k, double q)
{
    static const double reach = 0.95;
    size_t group = k % n->width >= 3;
    double scale = 2 * reach / (n->high[group] - n->low[group]);
    return (q - n->low[group]) * scale - reach;
}

void vgi_dataset_normalise(vgi_dataset *s, const vg_network *n)
{
    for (size_t i = 0; i < s->n; i++)
        for (size_t k = 0; k < s->d; k++) {
            float *q = s->features + i * s->d + k;
            *q = (float)normal_number(n, k, (double)*q);
        }
    s->normal = true;
}

void vgi_dataset_normalised(const vgi_dataset *s, const vg_network *n, size_t i, double *x)
{
    const float *q = s->features + i * s->d;
    for (size_t k = 0; k < s->d; k++) x[k] = s->normal ? (double)q[k] : normal_number(n, k, (double)q[k]);
}

static void find_range(const vgi_dataset *s, vg_network *n)
{
    double sum = 0;
    size_t steps = 0;
    for (int g = 0; g < 2; g++) n->low[g] = INFINITY, n->high[g] = -INFINITY;
    for (size_t i = 0; i < s->train.n; i++)
        for (size_t t = s->train.at[i].first; t < s->train.at[i].end; t++)
            for (size_t k = 0; k < s->d; k++) {
                size_t g = k % n->width >= 3;
                double q = (double)s->features[t * s->d + k];
                n->low[g] = fmin(n->low[g], q), n->high[g] = fmax(n->high[g], q);
            }
    for (int g = 0; g < 2; g++) n->high[g] = fmax(n->high[g], n->low[g] + least_width);
    for (size_t i = 0; i < s->train.n; i++)
        for (size_t t = s->train.at[i].first; t + 1 < s->train.at[i].end; t++, steps++) {
            const float *q = s->features + t * s->d;
            double frame = 0;
            for (size_t k = 0; k < s->d; k++) {
                size_t g = k % n->width >= 3;
                frame += fabs((double)q[k + s->d] - (double)q[k]) * 1.9 / (n->high[g] - n->low[g]);
            }
            sum += frame / (double)s->d;
        }
    n->change = steps ? sum / (double)steps : 0;
}

static int find_basis(vgi_dataset *s, vg_network *n, size_t most, int threads, vg_err *e)
{
    vgi_basis b;
    size_t frames = vgi_spans_frames(&s->train), row = 0;
    double *x = vgi_array_raw(frames * s->d, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    for (size_t i = 0; i < s->train.n; i++)
        for (size_t t = s->train.at[i].first; t < s->train.at[i].end; t++) vgi_dataset_normalised(s, n, t, x + row++ * s->d);
    int r = vgi_basis_make(&b, x, frames, s->d, threads, e);
    if (r < 0) return r;
    while (s->rank < b.rank && s->rank < most && b.value[s->rank] > least_sigma * least_sigma * b.value[0]) s->rank++;
    n->rank = s->rank;
    n->mean = vgi_copy_array(b.mean, s->d, sizeof *b.mean, e);
    n->basis = vgi_array_raw(s->rank * s->d, sizeof *n->basis, e);
    for (size_t i = 0; n->basis && i < s->rank * s->d; i++) n->basis[i] = (float)b.vectors[i];
    vgi_basis_clear(&b);
    if (!n->mean || !n->basis) return VG_ENOMEM;
    return s->rank ? VG_OK : vg_fail(e, VG_EINPUT, "the poses do not move: there is nothing to learn");
}

typedef struct encoding {
    vgi_dataset *s;
    const vg_network *n;
    int failed;
} encoding;

static void encode_frame(void *context, size_t i)
{
    encoding *j = context;
    double *x = vgi_array_raw(j->s->d, sizeof *x, NULL);
    if (!x) {
        __atomic_store_n(&j->failed, 1, __ATOMIC_RELAXED);
        return;
    }
    vgi_dataset_normalised(j->s, j->n, i, x);
    vgi_network_encode(j->n, x, j->s->coordinates + i * j->s->rank);
    free(x);
}

static int encode_all(vgi_dataset *s, const vg_network *n, int threads, vg_err *e)
{
    encoding j = {s, n, 0};
    s->coordinates = vgi_array_raw(s->n * s->rank, sizeof *s->coordinates, e);
    if (!s->coordinates) return VG_ENOMEM;
    vgi_parallel(threads, s->n, encode_frame, &j);
    return j.failed ? vg_fail(e, VG_ENOMEM, "out of memory: coordinates of the frames") : VG_OK;
}

/* standard deviation and range of coordinate k, or of its change */
static double coordinate_range(const vgi_dataset *s, size_t k, bool change, double range[2])
{
    double sum = 0, squares = 0;
    size_t n = 0;
    range[0] = INFINITY, range[1] = -INFINITY;
    for (size_t i = 0; i < s->train.n; i++)
        for (size_t t = s->train.at[i].first; t + change < s->train.at[i].end; t++, n++) {
            double c = s->coordinates[t * s->rank + k], x = change ? s->coordinates[(t + 1) * s->rank + k] - c : c;
            range[0] = fmin(range[0], c), range[1] = fmax(range[1], c);
            sum += x, squares += x * x;
        }
    double mean = n ? sum / (double)n : 0;
    return n ? sqrt(fmax(squares / (double)n - mean * mean, 0)) : 0;
}

static int find_scales(vgi_dataset *s, vg_network *n, vg_err *e)
{
    size_t k = s->rank;
    double ignored[2], first_change = coordinate_range(s, 0, true, ignored);
    n->scale = vgi_array(2 * k, sizeof *n->scale, e), n->range = vgi_array(2 * k, sizeof *n->range, e);
    if (!n->scale || !n->range) return VG_ENOMEM;
    s->sigma = coordinate_range(s, 0, false, ignored);
    for (size_t i = 0; i < k; i++) {
        double range[2], own = coordinate_range(s, i, false, range);
        n->scale[i] = fmax(own, least_scale * s->sigma);
        n->scale[k + i] = change_scale * fmax(coordinate_range(s, i, true, ignored), least_change * first_change);
        n->range[i] = range[0], n->range[k + i] = range[1];
    }
    return VG_OK;
}

int vgi_dataset_find_coordinates(vgi_dataset *s, vg_network *n, size_t most, int threads, vg_err *e)
{
    size_t frames = vgi_spans_frames(&s->train);
    if (frames < LEAST_FRAMES)
        return vg_fail(e, VG_EINPUT, "%zu frames are left for training: at least %d are needed", frames, LEAST_FRAMES);
    find_range(s, n);
    int r = find_basis(s, n, most, threads, e);
    if (r == VG_OK) r = encode_all(s, n, threads, e);
    return r == VG_OK ? find_scales(s, n, e) : r;
}
