/* segment.c: segmentation into faces that rotate alike, by K-means over their rotations (T 6.2), and connected
 * patches made of them. Rotations of faces are in polar.c, connected pieces in pieces.c, merging in join.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/random.h"
#include "method/patches/join.h"
#include "method/patches/pieces.h"
#include "method/patches/segment_kernel.h"
#include "numeric/blas.h"
#include "numeric/polar.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

enum {
    WIDTH = 1024,  /* most features per face */
    NARROW = 128,  /* features per face at first */
    ROUNDS = 40,
    CHUNK = 256,   /* faces per task */
    STRIPE = 64    /* dimensions per task */
};
#define NONE UINT32_MAX
static const double enough = 10; /* degrees, for the choice of the number of patches */

enum { FLOATS = 16 }; /* rows of features are multiples of this */

struct vg_segmenter {
    const vg_mesh *mesh;
    vgi_turns turns;
    int threads;
    size_t poses;
    float *feature; /* nf x width */
    size_t width;   /* grows with the poses; cut to the used width at the end */
};

int vg_segmenter_new(vg_segmenter **out, const vg_mesh *m, const double *reference, int threads, vg_err *e)
{
    *out = NULL;
    if (m->nf == 0) return vg_fail(e, VG_EINPUT, "there are no faces to make patches of");
    vg_segmenter *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->mesh = m, s->threads = threads, s->width = NARROW;
    int r = vgi_turns_make(&s->turns, m->nf, m->start, m->vert, reference, e);
    size_t n;
    if (r == VG_OK && !vgi_mul(m->nf, NARROW, &n))
        r = vg_fail(e, VG_ENOMEM, "not enough memory for %zu faces", m->nf);
    if (r == VG_OK && !(s->feature = vgi_array(n, sizeof *s->feature, e))) r = VG_ENOMEM;
    if (r < 0) vg_segmenter_free(out);
    return r;
}

void vg_segmenter_free(vg_segmenter **s)
{
    if (!*s) return;
    vgi_turns_clear(&(*s)->turns);
    free((*s)->feature);
    free(*s);
    *s = NULL;
}

/* ---- features ---- */

enum { GROUPS = 4 }; /* of lanes that are added together */

typedef struct adding { /* up to GROUPS x VGI_LANES poses */
    vg_segmenter *s;
    const double *const *poses;
    size_t n;
    uint32_t at[9 * VGI_LANES * GROUPS]; /* the feature to which entry i of pose k is added, and its sign */
    float sign[9 * VGI_LANES * GROUPS];
} adding;

/* All poses of a face one after another: its row of features, of 4 KiB, stays near. */
static void add_chunk(void *context, size_t i)
{
    const adding *a = context;
    const vg_segmenter *s = a->s;
    size_t first = i * CHUNK, last = first + CHUNK < s->turns.nf ? first + CHUNK : s->turns.nf;
    for (size_t f = first; f < last; f++)
        for (size_t p = 0; p < a->n; p += VGI_LANES) {
            size_t lanes = a->n - p < VGI_LANES ? a->n - p : VGI_LANES;
            const double *poses[VGI_LANES];
            vgi_lanes r[9];
            for (size_t k = 0; k < VGI_LANES; k++) poses[k] = a->poses[p + (k < lanes ? k : lanes - 1)];
            vgi_turns_measure(&s->turns, f, poses, r);
            vgi_segment_kernel_now()->add(r, lanes, a->at + 9 * p, a->sign + 9 * p, s->feature + f * s->width);
        }
}

/* Width of rows: at least `numbers`, at least WIDTH. */
static int widen_rows(vg_segmenter *s, uint64_t numbers, vg_err *e)
{
    size_t nf = s->turns.nf, width = s->width, old = s->width, n;
    while (width < numbers && width < WIDTH) width *= 2;
    if (width == old) return VG_OK;
    float *wider = vgi_mul(nf, width * sizeof *wider, &n) ? realloc(s->feature, n) : NULL;
    if (!wider) return vg_fail(e, VG_ENOMEM, "not enough memory for %zu numbers of %zu faces each", width, nf);
    for (size_t f = nf; f-- > 0;) {
        memmove(wider + f * width, wider + f * old, old * sizeof *wider);
        memset(wider + f * width + old, 0, (width - old) * sizeof *wider);
    }
    s->feature = wider, s->width = width;
    return VG_OK;
}

/* The first entries have a feature of their own; each later entry is added to a random feature with a random sign. */
int vg_segmenter_add(vg_segmenter *s, size_t n, const double *const *poses, vg_err *e)
{
    int r = widen_rows(s, 9 * ((uint64_t)s->poses + n), e);
    if (r < 0) return r;
    for (size_t p = 0; p < n; p += VGI_LANES * GROUPS) {
        adding a = {.s = s, .poses = poses + p, .n = n - p < VGI_LANES * GROUPS ? n - p : VGI_LANES * GROUPS};
        for (size_t k = 0; k < 9 * a.n; k++) {
            uint64_t index = 9 * (uint64_t)s->poses + k, chance = vgi_random_mix(index);
            a.at[k] = (uint32_t)(index < WIDTH ? index : chance % WIDTH);
            a.sign[k] = index < WIDTH || chance >> 63 ? 1 : -1;
        }
        vgi_parallel(s->threads, (s->turns.nf + CHUNK - 1) / CHUNK, add_chunk, &a);
        s->poses += a.n;
    }
    return VG_OK;
}

/* Cut rows to the features in use, rounded up to whole vectors. */
static void cut_down(vg_segmenter *s)
{
    size_t used = 9 * s->poses < WIDTH ? 9 * s->poses : WIDTH, width = (used + FLOATS - 1) / FLOATS * FLOATS;
    if (width == 0) width = FLOATS;
    if (width >= s->width) return;
    for (size_t f = 1; f < s->turns.nf; f++)
        memmove(s->feature + f * width, s->feature + f * s->width, width * sizeof *s->feature);
    s->width = width;
}

/* ---- K-means ---- */

typedef struct clustering {
    const vg_segmenter *s;
    size_t n, k;           /* number of faces, of patches */
    uint32_t *label;
    float *nearest;        /* squared distance to the nearest centre */
    float *norm;           /* per face: squared length of its feature */
    float *centre;         /* most x width */
    float *centre_norm;
    double *total;         /* most x width: sums of features over the faces, as labelled */
    uint32_t *counted;     /* in this array; NONE: not counted yet */
    uint32_t *moved;       /* faces whose label has changed since */
    size_t nmoved;
    double *sums;          /* per chunk of faces */
    uint32_t *sizes;
    float *products;       /* per worker: CHUNK x most */
    size_t workers;
    atomic_size_t next;    /* next chunk to process */
    size_t most, changed;
    uint32_t *chunk_changed;
    const float *fresh;    /* the most recent centre */
    uint32_t fresh_label;
} clustering;

static size_t chunks(const clustering *c)
{
    return (c->n + CHUNK - 1) / CHUNK;
}

static float inner_product(const float *a, const float *b, size_t n)
{
    return vgi_segment_kernel_now()->inner(a, b, n);
}

/* Update distances with the most recent centre, and sum the nearest distances chunk by chunk, so that the sum does
 * not depend on the number of threads. */
static void near_chunk(void *context, size_t i)
{
    clustering *c = context;
    size_t first = i * CHUNK, last = first + CHUNK < c->n ? first + CHUNK : c->n, width = c->s->width;
    float square = inner_product(c->fresh, c->fresh, width);
    double sum = 0;
    for (size_t f = first; f < last; f++) {
        float d = c->norm[f] + square - 2 * inner_product(c->s->feature + f * width, c->fresh, width);
        if (!(d > 1e-6f * (c->norm[f] + square))) d = 0; /* a smaller distance is rounding error */
        if (d < c->nearest[f]) c->nearest[f] = d, c->label[f] = c->fresh_label;
        sum += (double)c->nearest[f];
    }
    c->sums[i] = sum;
}

static double add_up(const clustering *c)
{
    double sum = 0;
    for (size_t i = 0; i < chunks(c); i++) sum += c->sums[i];
    return sum;
}

/* The face at which the cumulative sum of squared distances exceeds `at`. */
static size_t draw_face(const clustering *c, double at)
{
    size_t i = 0, last = 0;
    while (i + 1 < chunks(c) && at >= c->sums[i]) at -= c->sums[i++];
    for (size_t f = i * CHUNK; f < c->n; f++) {
        if (!(c->nearest[f] > 0)) continue;
        last = f;
        if ((at -= (double)c->nearest[f]) < 0) break;
    }
    return last;
}

static void add_centre(clustering *c, size_t face)
{
    size_t width = c->s->width;
    float *to = c->centre + c->k * width;
    memcpy(to, c->s->feature + face * width, width * sizeof *to);
    c->fresh = to, c->fresh_label = (uint32_t)c->k++;
    vgi_parallel(c->s->threads, chunks(c), near_chunk, c);
}

/* k-means++ (Arthur and Vassilvitskii 2007). */
static void seed_centres(clustering *c, size_t k, uint64_t seed)
{
    add_centre(c, (size_t)(vgi_random_mix(seed) % c->n));
    while (c->k < k) {
        double sum = add_up(c), share = (double)(vgi_random_mix(seed ^ vgi_random_mix(c->k)) >> 11) * 0x1p-53;
        if (!(sum > 0)) break; /* every face equals one of the centres */
        size_t face = draw_face(c, share * sum);
        if (!(c->nearest[face] > 0)) break;
        add_centre(c, face);
    }
}

static void assign_chunk(clustering *c, size_t i, float *dot)
{
    size_t first = i * CHUNK, n = c->n - first < CHUNK ? c->n - first : CHUNK, width = c->s->width;
    vgi_product_single_transposed(n, c->k, width, c->s->feature + first * width, width, c->centre, width, dot,
                                  c->most);
    double sum = 0;
    uint32_t changed = 0;
    for (size_t f = 0; f < n; f++) {
        uint32_t best = 0;
        float least = INFINITY;
        for (size_t k = 0; k < c->k; k++) {
            float d = c->centre_norm[k] - 2 * dot[f * c->most + k];
            if (d < least) least = d, best = (uint32_t)k;
        }
        least += c->norm[first + f];
        changed += c->label[first + f] != best;
        c->label[first + f] = best;
        c->nearest[first + f] = least > 0 ? least : 0;
        sum += (double)c->nearest[first + f];
    }
    c->sums[i] = sum, c->chunk_changed[i] = changed;
}

static void assign_chunks(void *context, size_t worker)
{
    clustering *c = context;
    for (size_t i; (i = atomic_fetch_add(&c->next, 1)) < chunks(c);)
        assign_chunk(c, i, c->products + worker * CHUNK * c->most);
}

static void mean_stripe(void *context, size_t i)
{
    const clustering *c = context;
    size_t width = c->s->width, first = i * STRIPE, n = width - first < STRIPE ? width - first : STRIPE;
    for (size_t m = 0; m < c->nmoved; m++) {
        uint32_t f = c->moved[m], before = c->counted[f];
        const float *x = c->s->feature + f * width + first;
        double *to = c->total + c->label[f] * width + first,
               *from = before == NONE ? NULL : c->total + before * width + first;
        vgi_segment_kernel_now()->move(x, n, to, from);
    }
    for (size_t k = 0; k < c->k; k++) {
        double share = c->sizes[k] ? 1 / (double)c->sizes[k] : 0;
        for (size_t j = first; j < first + n; j++)
            c->centre[k * width + j] = (float)(share * c->total[k * width + j]);
    }
}

/* In later rounds few faces change; only those are updated. */
static void find_means(clustering *c)
{
    c->nmoved = 0;
    for (size_t f = 0; f < c->n; f++)
        if (c->label[f] != c->counted[f]) c->moved[c->nmoved++] = (uint32_t)f;
    vgi_parallel(c->s->threads, (c->s->width + STRIPE - 1) / STRIPE, mean_stripe, c);
    memcpy(c->counted, c->label, c->n * sizeof *c->counted);
}

/* call before labels are renumbered */
static void forget_means(clustering *c)
{
    memset(c->counted, 0xff, c->n * sizeof *c->counted);
    memset(c->total, 0, c->most * c->s->width * sizeof *c->total);
}

/* An empty patch takes the face with the largest distance to its centre. */
static void fill_empty(clustering *c)
{
    memset(c->sizes, 0, c->k * sizeof *c->sizes);
    for (size_t f = 0; f < c->n; f++) c->sizes[c->label[f]]++;
    for (size_t k = 0; k < c->k; k++) {
        if (c->sizes[k]) continue;
        size_t worst = c->n;
        for (size_t f = 0; f < c->n; f++)
            if (c->sizes[c->label[f]] > 1 && (worst == c->n || c->nearest[f] > c->nearest[worst])) worst = f;
        if (worst == c->n) continue;
        c->sizes[c->label[worst]]--;
        c->label[worst] = (uint32_t)k, c->nearest[worst] = 0, c->sizes[k] = 1;
    }
}

static size_t iterate(clustering *c, double *objective)
{
    double before = INFINITY;
    size_t round = 0;
    for (; round < ROUNDS; round++) {
        fill_empty(c);
        find_means(c);
        for (size_t k = 0; k < c->k; k++)
            c->centre_norm[k] = inner_product(c->centre + k * c->s->width, c->centre + k * c->s->width, c->s->width);
        vgi_blas_alone();
        atomic_store(&c->next, 0);
        vgi_parallel(c->s->threads, c->workers, assign_chunks, c);
        vgi_blas_shared();
        *objective = add_up(c);
        c->changed = 0;
        for (size_t i = 0; i < chunks(c); i++) c->changed += c->chunk_changed[i];
        if (c->changed == 0 || *objective > before * (1 - 1e-4)) break;
        before = *objective;
    }
    fill_empty(c);
    return round;
}

/* |R - S|^2 is 8 sin^2(angle / 2) for each pose. */
static double angle_of(const clustering *c, double objective)
{
    double square = c->s->poses ? objective / (8.0 * (double)c->n * (double)c->s->poses) : 0;
    return 2 * asin(sqrt(square < 1 ? square : 1)) * 57.29577951308232;
}

static void clear_clustering(clustering *c)
{
    free(c->label);
    free(c->nearest);
    free(c->norm);
    free(c->centre);
    free(c->centre_norm);
    free(c->total);
    free(c->counted);
    free(c->moved);
    free(c->sums);
    free(c->sizes);
    free(c->products);
    free(c->chunk_changed);
}

static int make_clustering(clustering *c, const vg_segmenter *s, size_t most, vg_err *e)
{
    size_t n = s->turns.nf;
    *c = (clustering){.s = s, .n = n, .most = most};
    c->workers = (size_t)s->threads < chunks(c) ? (size_t)s->threads : chunks(c);
    c->label = vgi_array(n, sizeof *c->label, e);
    c->nearest = vgi_array(n, sizeof *c->nearest, e);
    c->norm = vgi_array(n, sizeof *c->norm, e);
    c->centre = vgi_array(most, s->width * sizeof *c->centre, e);
    c->centre_norm = vgi_array(most, sizeof *c->centre_norm, e);
    c->total = vgi_array_raw(most, s->width * sizeof *c->total, e);
    c->counted = vgi_array_raw(n, sizeof *c->counted, e);
    c->moved = vgi_array_raw(n, sizeof *c->moved, e);
    c->sums = vgi_array(chunks(c), sizeof *c->sums, e);
    c->sizes = vgi_array(most, sizeof *c->sizes, e);
    c->products = vgi_array_raw(c->workers * CHUNK, most * sizeof *c->products, e);
    c->chunk_changed = vgi_array(chunks(c), sizeof *c->chunk_changed, e);
    if (!c->label || !c->nearest || !c->norm || !c->centre || !c->centre_norm || !c->total || !c->counted ||
        !c->moved || !c->sums || !c->sizes || !c->products || !c->chunk_changed) {
        clear_clustering(c);
        return VG_ENOMEM;
    }
    forget_means(c);
    for (size_t f = 0; f < n; f++) {
        const float *x = s->feature + f * s->width;
        c->norm[f] = inner_product(x, x, s->width), c->nearest[f] = INFINITY;
    }
    return VG_OK;
}

/* ---- pieces ---- */

/* Connected patches: connected pieces of one label, merged with neighbours that rotate alike until k are left. */
static int connect(const vg_segmenter *s, uint32_t *label, size_t nlabels, size_t k, size_t *count, vg_err *e)
{
    const vg_mesh *m = s->mesh;
    size_t width = s->width;
    vgi_joining j = {.width = width};
    uint32_t *piece = vgi_array_raw(m->nf, sizeof *piece, e), *shared = NULL, *set = NULL;
    if (!piece) return VG_ENOMEM;
    int r = vgi_connected_pieces(m, label, nlabels, piece, &j.n, e);
    if (r == VG_OK) r = vgi_neighbours(m, piece, &j.pair, &shared, &j.npairs, e);
    if (r == VG_OK) {
        j.mean = vgi_array(j.n, width * sizeof *j.mean, e), j.size = vgi_array(j.n, sizeof *j.size, e);
        set = vgi_array_raw(j.n, sizeof *set, e);
        if (!j.mean || !j.size || !set) r = VG_ENOMEM;
    }
    if (r == VG_OK) {
        for (size_t f = 0; f < m->nf; f++) {
            j.size[piece[f]]++;
            for (size_t i = 0; i < width; i++) j.mean[piece[f] * width + i] += (double)s->feature[f * width + i];
        }
        for (size_t i = 0; i < j.n * width; i++) j.mean[i] /= j.size[i / width];
        r = vgi_join_pieces(&j, k, set, e);
    }
    for (size_t f = 0; r == VG_OK && f < m->nf; f++) label[f] = set[piece[f]];
    if (r == VG_OK) r = vgi_connected_pieces(m, label, j.n, piece, count, e);
    if (r == VG_OK) memcpy(label, piece, m->nf * sizeof *label);
    free(piece);
    free(shared);
    free(set);
    free(j.pair);
    free(j.mean);
    free(j.size);
    return r;
}

/* Number patches by their first faces. */
static int renumber_patches(uint32_t *label, size_t nf, size_t *k, vg_err *e)
{
    uint32_t *number = vgi_array_raw(*k, sizeof *number, e);
    if (!number) return VG_ENOMEM;
    memset(number, 0xff, *k * sizeof *number);
    uint32_t n = 0;
    for (size_t f = 0; f < nf; f++) {
        if (number[label[f]] == UINT32_MAX) number[label[f]] = n++;
        label[f] = number[label[f]];
    }
    free(number);
    *k = n;
    return VG_OK;
}

/* K-means steps within the merged patches. */
static double objective_of(clustering *c, size_t k)
{
    c->k = k;
    forget_means(c);
    fill_empty(c);
    find_means(c);
    double sum = 0;
    for (size_t f = 0; f < c->n; f++) {
        const float *m = c->centre + c->label[f] * c->s->width, *x = c->s->feature + f * c->s->width;
        double d = (double)c->norm[f] + (double)inner_product(m, m, c->s->width) - 2 * (double)inner_product(x, m, c->s->width);
        sum += d > 0 ? d : 0;
    }
    return sum;
}

static int cut_patches(clustering *c, size_t k, uint64_t seed, bool connected, vg_segment_stats *report, vg_err *e)
{
    double objective = 0;
    int r = VG_OK;
    seed_centres(c, k, seed);
    report->rounds += iterate(c, &objective);
    size_t n = c->k;
    if (connected) {
        size_t pieces = n;
        r = connect(c->s, c->label, n, k, &pieces, e);
        if (r == VG_OK && pieces > c->most) { /* more components than requested patches: make room for all of them */
            clustering larger;
            if ((r = make_clustering(&larger, c->s, pieces, e)) < 0) return r;
            memcpy(larger.label, c->label, c->n * sizeof *c->label);
            clear_clustering(c);
            *c = larger;
        }
        n = pieces;
    }
    if (r == VG_OK) r = renumber_patches(c->label, c->n, &n, e);
    if (r < 0) return r;
    report->patches = n;
    report->angle = angle_of(c, connected ? objective_of(c, n) : objective);
    return VG_OK;
}

int vg_segmenter_cut(vg_segmenter *s, size_t patches, uint64_t seed, bool connected, vg_patches *out,
                     vg_segment_stats *report, vg_err *e)
{
    static const size_t steps[] = {4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256};
    size_t nsteps = sizeof steps / sizeof *steps;
    *out = (vg_patches){0};
    *report = (vg_segment_stats){0};
    cut_down(s);
    for (size_t i = 0;; i++) {
        clustering c;
        size_t k = patches ? patches : steps[i];
        if (k > s->turns.nf) k = s->turns.nf;
        int r = make_clustering(&c, s, k, e);
        if (r < 0) return r;
        r = cut_patches(&c, k, seed, connected, report, e);
        bool done = patches || report->angle <= enough || i + 1 == nsteps || k == s->turns.nf;
        if (r == VG_OK && done) {
            out->n = report->patches, out->of_face = c.label;
            c.label = NULL;
        }
        clear_clustering(&c);
        if (r < 0 || done) return r;
    }
}
