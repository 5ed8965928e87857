/* decompose.c: skinning decomposition: bones, weights and motions from poses alone (MATH 6; Le and Deng 2012).
 *
 * First the vertices are clustered by rigid motion. The cluster with the largest error is split, and vertices move to
 * the cluster whose motion fits them best, until there are more clusters than wanted bones. Then the clusters with
 * the most similar motions are merged. Each cluster becomes a bone. Finally weights and motions are fitted
 * alternately. Motions for given weights are in free_bones.c, weights for given motions in skin.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/free_bones.h"
#include "method/rig/learn.h"
#include "method/rig/skin.h"
#include "numeric/polar.h"
#include "numeric/stats.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SOME = 4096, LLOYD = 4, CHUNK = 256 };
/* Split into twice the wanted number of clusters, but at most EXTRA more, then merge. Above MOST_MERGED clusters
 * nothing is merged, because merging examines every pair. */
enum { EXTRA = 64, MOST_MERGED = 256 };
static const double EXACT = 1e-12; /* relative to the mean square of the vertices: a smaller error counts as zero */

/* A partition of a set of vertices into clusters. Cluster j is bone j of a rig that has no skeleton yet. */
typedef struct dividing {
    vgi_learning *l;
    size_t n;          /* number of clusters */
    double *at;        /* 3 per cluster: centroid of its vertices in the reference pose */
    double *cost;      /* per cluster: sum of squared distances */
    size_t *size, *worst; /* number of vertices; the vertex that seeds a new cluster, + 1 */
    double spread;        /* mean over the vertices of the squared distance from the centroid, summed over the poses */
    vgi_rig_sums sums;
} dividing;

static uint32_t *cluster_of(const dividing *d, size_t v)
{
    return &d->l->rig.skin_bone[VG_SKIN * v];
}

static void find_centroids(dividing *d)
{
    memset(d->at, 0, 3 * d->n * sizeof *d->at);
    memset(d->size, 0, d->n * sizeof *d->size);
    for (size_t v = 0; v < d->l->nv; v++) {
        size_t j = *cluster_of(d, v);
        vgi_add(d->at + 3 * j, d->l->reference + 3 * v);
        d->size[j]++;
    }
    for (size_t j = 0; j < d->n; j++)
        for (size_t k = 0; k < 3 && d->size[j]; k++) d->at[3 * j + k] /= (double)d->size[j];
}

/* Squared distance of vertex v from its position under bone j, summed over the poses. */
static double rigid_cost(const dividing *d, size_t v, size_t j)
{
    const vgi_rig_sums *s = &d->sums;
    size_t width = 4 * s->n;
    const double *p = d->l->reference + 3 * v, *at = s->at + 3 * j, *y = s->pull + v * width + 4 * j;
    const double *c = s->cross + 4 * j * width + 4 * j;
    const double q[4] = {p[0] - at[0], p[1] - at[1], p[2] - at[2], 1};
    double sum = s->square[v];
    for (size_t i = 0; i < 4; i++) {
        const double *row = c + i * width;
        sum += q[i] * (row[0] * q[0] + row[1] * q[1] + row[2] * q[2] + row[3] - 2 * y[i]);
    }
    return sum > 0 ? sum : 0;
}

static void assign_chunk(void *context, size_t task)
{
    const dividing *d = context;
    size_t first = task * CHUNK, last = first + CHUNK < d->l->nv ? first + CHUNK : d->l->nv;
    for (size_t v = first; v < last; v++) {
        size_t best = *cluster_of(d, v);
        double least = rigid_cost(d, v, best);
        for (size_t j = 0; j < d->n; j++) {
            double cost = rigid_cost(d, v, j);
            if (cost < least) least = cost, best = j;
        }
        *cluster_of(d, v) = (uint32_t)best;
        d->l->left[v] = least;
    }
}

/* Fit the motions of the clusters, assign each vertex to the cluster with the least error, and sum the errors per
 * cluster. */
static int assign(dividing *d, vg_err *e)
{
    vg_free_bones *bones = NULL;
    vgi_learning *l = d->l;
    find_centroids(d);
    int r = vg_free_bones_new(&bones, &l->rig, l->nv, l->reference, l->threads, e);
    if (r == VG_OK) vg_free_bones_fit(bones, l->n, (const double *const *)l->poses, l->transforms);
    vg_free_bones_free(&bones);
    if (r == VG_OK) r = vgi_rig_sums_make(&d->sums, l->nv, d->n, d->at, NULL, e);
    if (r == VG_OK) {
        vgi_rig_sums_add(&d->sums, l->n, (const double *const *)l->poses, (const double *const *)l->transforms,
                         l->threads);
        vgi_parallel(l->threads, (l->nv + CHUNK - 1) / CHUNK, assign_chunk, d);
        d->spread = vgi_mean(d->sums.square, l->nv);
    }
    vgi_rig_sums_clear(&d->sums);
    return r;
}

/* For each cluster: its error, and the vertex with the largest product of error and squared distance from the
 * centroid. */
static void weigh_clusters(dividing *d)
{
    memset(d->cost, 0, d->n * sizeof *d->cost);
    memset(d->worst, 0, d->n * sizeof *d->worst);
    find_centroids(d);
    for (size_t v = 0; v < d->l->nv; v++) {
        size_t j = *cluster_of(d, v), *worst = &d->worst[j];
        const double *x = d->l->reference + 3 * v, *at = d->at + 3 * j;
        d->cost[j] += d->l->left[v];
        double far = vgi_square(x, at) * d->l->left[v];
        if (!*worst || far > vgi_square(d->l->reference + 3 * (*worst - 1), at) * d->l->left[*worst - 1])
            *worst = v + 1;
    }
}

/* Split cluster j: the vertices nearer to its worst vertex than to its centroid form a new one. */
static void divide(dividing *d, size_t j)
{
    const double *from = d->at + 3 * j, *to = d->l->reference + 3 * (d->worst[j] - 1);
    for (size_t v = 0; v < d->l->nv; v++) {
        const double *x = d->l->reference + 3 * v;
        if (*cluster_of(d, v) == j && vgi_square(x, to) < vgi_square(x, from)) *cluster_of(d, v) = (uint32_t)d->n;
    }
    d->n++;
}

/* Split the clusters with the largest errors, at most as many as exist. Returns false if none can be split. */
static bool divide_some(dividing *d, size_t wanted)
{
    enum { LEAST = 6 }; /* fewest vertices of a cluster that is split */
    size_t before = d->n, room = wanted - before < before ? wanted - before : before;
    weigh_clusters(d);
    for (size_t i = 0; i < room; i++) {
        size_t most = before;
        for (size_t j = 0; j < before; j++)
            if (d->size[j] >= LEAST && d->cost[j] > EXACT * d->spread * (double)d->size[j] &&
                (most == before || d->cost[j] > d->cost[most]))
                most = j;
        if (most == before) break;
        divide(d, most);
        d->cost[most] = 0;
    }
    return d->n > before;
}

/* Remove empty clusters. */
static void drop_empty(dividing *d)
{
    size_t n = 0;
    find_centroids(d);
    for (size_t j = 0; j < d->n; j++) {
        if (!d->size[j]) continue;
        for (size_t v = 0; v < d->l->nv && n != j; v++)
            if (*cluster_of(d, v) == j) *cluster_of(d, v) = (uint32_t)n;
        n++;
    }
    d->n = n;
}

/* Fit motions and assign vertices alternately. */
static int settle_clusters(dividing *d, vg_err *e)
{
    int r = VG_OK;
    for (int i = 0; r == VG_OK && i < LLOYD; i++) {
        d->l->rig.nbones = d->n;
        r = assign(d, e);
        drop_empty(d);
    }
    return r;
}

/* ---- merging ---- */

/* The moments that determine the error of a rigid motion. The moments of a union are the sum. */
typedef struct moments {
    double n, p[3], square; /* number of vertices; sum of their reference positions relative to the centroid; sum of
                             * the squares */
} moments;

enum { PER_POSE = 13 }; /* sum of y p', row-major; sum of y; sum of squares of y; y is relative to the centroid of the
                         * pose */

typedef struct merging {
    dividing *d;
    moments *of;  /* n */
    double *pose; /* n x poses x PER_POSE */
    double *cost; /* n x n: increase of the error when two clusters are merged, for row < column */
    double *own;  /* n: error of each cluster */
    bool *gone;
} merging;

static double *pose_sums(const merging *m, size_t j, size_t k)
{
    return m->pose + (j * m->d->l->n + k) * PER_POSE;
}

static void sum_moments(merging *m)
{
    const vgi_learning *l = m->d->l;
    double centre[3], y[3], p[3];
    for (size_t k = 0; k <= l->n; k++) { /* the last one is the reference pose */
        vg_centroid(k < l->n ? l->poses[k] : l->reference, l->nv, centre);
        double reference[3];
        vg_centroid(l->reference, l->nv, reference);
        for (size_t v = 0; v < l->nv; v++) {
            size_t j = *cluster_of(m->d, v);
            vgi_subtract(l->reference + 3 * v, reference, p);
            if (k == l->n) {
                moments *to = &m->of[j];
                to->n++, to->square += vgi_dot(p, p);
                vgi_add(to->p, p);
                continue;
            }
            double *to = pose_sums(m, j, k);
            vgi_subtract(l->poses[k] + 3 * v, centre, y), vgi_add(to + 9, y);
            vgi_add_outer(to, 1, y, p);
            to[12] += vgi_dot(y, y);
        }
    }
}

/* Error of the best rigid motions of clusters i and j merged; for j == i, of one cluster. */
static double cost_together(const merging *m, size_t i, size_t j)
{
    bool two = i != j;
    const moments *a = &m->of[i], *b = &m->of[j];
    double sum = 0, n = a->n + (two ? b->n : 0), p[3], square = a->square + (two ? b->square : 0);
    for (size_t c = 0; c < 3; c++) p[c] = a->p[c] + (two ? b->p[c] : 0);
    for (size_t k = 0; k < m->d->l->n; k++) {
        const double *x = pose_sums(m, i, k), *y = pose_sums(m, j, k);
        double all[PER_POSE], r[9], along = 0;
        for (size_t q = 0; q < PER_POSE; q++) all[q] = x[q] + (two ? y[q] : 0);
        vgi_add_outer(all, -1 / n, all + 9, p);
        vgi_fit_rotation(all, r);
        for (size_t q = 0; q < 9; q++) along += r[q] * all[q];
        sum += all[12] - vgi_dot(all + 9, all + 9) / n + square - vgi_dot(p, p) / n - 2 * along;
    }
    return sum;
}

static void cost_row(void *context, size_t i)
{
    const merging *m = context;
    for (size_t j = i + 1; j < m->d->n; j++)
        if (!m->gone[i] && !m->gone[j])
            m->cost[i * m->d->n + j] = cost_together(m, i, j) - m->own[i] - m->own[j];
}

/* Merge cluster j into cluster i < j. */
static void merge_pair(merging *m, size_t i, size_t j)
{
    size_t n = m->d->n;
    m->gone[j] = true;
    m->of[i].n += m->of[j].n, m->of[i].square += m->of[j].square;
    vgi_add(m->of[i].p, m->of[j].p);
    for (size_t q = 0; q < m->d->l->n * PER_POSE; q++) pose_sums(m, i, 0)[q] += pose_sums(m, j, 0)[q];
    m->own[i] = cost_together(m, i, i);
    for (size_t v = 0; v < m->d->l->nv; v++)
        if (*cluster_of(m->d, v) == j) *cluster_of(m->d, v) = (uint32_t)i;
    for (size_t k = 0; k < n; k++) {
        if (m->gone[k] || k == i) continue;
        m->cost[(k < i ? k : i) * n + (k < i ? i : k)] = cost_together(m, i, k) - m->own[i] - m->own[k];
    }
}

static void merge_down(merging *m, size_t wanted)
{
    size_t n = m->d->n;
    for (size_t left = n; left > wanted; left--) {
        size_t a = n, b = n;
        for (size_t i = 0; i < n; i++)
            for (size_t j = i + 1; j < n; j++)
                if (!m->gone[i] && !m->gone[j] && (a == n || m->cost[i * n + j] < m->cost[a * n + b])) a = i, b = j;
        merge_pair(m, a, b);
    }
}

static int merge(dividing *d, size_t wanted, vg_err *e)
{
    merging m = {.d = d};
    m.of = vgi_array(d->n, sizeof *m.of, e), m.own = vgi_array(d->n, sizeof *m.own, e);
    m.pose = vgi_array(d->n * d->l->n, PER_POSE * sizeof *m.pose, e);
    m.cost = vgi_array(d->n, d->n * sizeof *m.cost, e), m.gone = vgi_array(d->n, sizeof *m.gone, e);
    bool ok = m.of && m.own && m.pose && m.cost && m.gone;
    if (ok) {
        sum_moments(&m);
        for (size_t i = 0; i < d->n; i++) m.own[i] = cost_together(&m, i, i);
        vgi_parallel(d->l->threads, d->n, cost_row, &m);
        merge_down(&m, wanted);
        drop_empty(d);
    }
    free(m.of);
    free(m.own);
    free(m.pose);
    free(m.cost);
    free(m.gone);
    return ok ? VG_OK : VG_ENOMEM;
}

/* ---- clusters ---- */

/* The largest number of clusters before merging. */
static size_t most_clusters(size_t wanted, size_t nv)
{
    size_t extra = wanted > MOST_MERGED ? 0 : wanted < EXTRA ? wanted : EXTRA;
    return wanted + extra < nv ? wanted + extra : nv;
}

static int divide_all(dividing *d, size_t wanted, vg_err *e)
{
    size_t most = most_clusters(wanted, d->l->nv);
    d->n = 1;
    for (size_t v = 0; v < d->l->nv; v++) d->l->rig.skin_weight[VG_SKIN * v] = 1;
    int r = settle_clusters(d, e);
    while (r == VG_OK && d->n < most && divide_some(d, most)) r = settle_clusters(d, e);
    if (r == VG_OK && d->n > wanted) {
        r = merge(d, wanted, e);
        if (r == VG_OK) r = settle_clusters(d, e);
    }
    return r;
}

/* A skeleton of unconnected joints at the cluster centroids. */
static int make_rig(vg_rig *rig, size_t n, const double *at, vg_err *e)
{
    static const uint8_t channels[6] = {1, 2, 3, 4, 5, 6};
    vg_skeleton s = {.joints = vgi_array(n, sizeof *s.joints, e)};
    double *turns = vgi_array(n, 4 * sizeof *turns, e);
    int r = s.joints && turns ? VG_OK : VG_ENOMEM;
    for (size_t j = 0; r == VG_OK && j < n; j++, s.njoints++) {
        char name[32];
        int length = snprintf(name, sizeof name, "bone%03zu", j + 1);
        vg_joint *joint = &s.joints[j];
        *joint = (vg_joint){.parent = UINT32_MAX, .nchannels = 6};
        memcpy(joint->channels, channels, sizeof channels);
        memcpy(joint->offset, at + 3 * j, sizeof joint->offset);
        turns[4 * j] = 1;
        if (!(joint->name = vgi_copy_string(name, (size_t)length, e))) r = VG_ENOMEM;
    }
    if (r == VG_OK) r = vg_rig_make(rig, &s, at, turns, e);
    vg_skeleton_clear(&s);
    free(turns);
    return r;
}

static int find_motions(vgi_learning *l, void *context, bool begun, vg_err *e)
{
    (void)context;
    vg_free_bones *x = NULL;
    int r = vg_free_bones_new(&x, &l->rig, l->nv, l->reference, l->threads, e);
    if (r == VG_OK) vgi_free_bones_continue(x, l->n, (const double *const *)l->poses, l->transforms, begun);
    vg_free_bones_free(&x);
    return r;
}

static int find_clusters(vgi_learning *l, size_t wanted, dividing *d, vg_err *e)
{
    size_t most = most_clusters(wanted, l->nv);
    d->cost = vgi_array(most, sizeof *d->cost, e);
    d->size = vgi_array(most, sizeof *d->size, e), d->worst = vgi_array(most, sizeof *d->worst, e);
    l->rig.skin_bone = vgi_array(l->nv, VG_SKIN * sizeof *l->rig.skin_bone, e);
    l->rig.skin_weight = vgi_array(l->nv, VG_SKIN * sizeof *l->rig.skin_weight, e);
    /* without a skeleton, the transform of bone j is that of joint j */
    l->rig.bone = vgi_array_raw(most, sizeof *l->rig.bone, e), l->rig.at = d->at;
    bool ok = d->cost && d->size && d->worst && l->rig.skin_bone && l->rig.skin_weight && l->rig.bone;
    for (size_t j = 0; ok && j < most; j++) l->rig.bone[j] = (uint32_t)j;
    int r = ok ? divide_all(d, wanted, e) : VG_ENOMEM;
    free(l->rig.bone);
    free(d->cost);
    free(d->size);
    free(d->worst);
    l->rig.bone = NULL, l->rig.at = NULL;
    return r;
}

/* Fit clusters, a rig, weights and motions on a subset of the vertices, then on all. */
static int decompose(vgi_learning *l, vg_rig *rig, size_t nv, const double *reference, size_t wanted, size_t n,
                     const double *const *poses, double *miss, vg_err *e)
{
    dividing d = {.l = l, .at = l->at};
    int r = vgi_learning_gather(l, nv, reference, n, poses, SOME, e);
    if (r == VG_OK) r = find_clusters(l, wanted, &d, e);
    if (r == VG_OK) r = make_rig(rig, d.n, d.at, e);
    if (r < 0) return r;
    uint32_t *bone = l->rig.skin_bone;
    double *weight = l->rig.skin_weight;
    l->rig = *rig, l->rig.skin_bone = bone, l->rig.skin_weight = weight;
    r = vgi_learning_alternate(l, find_motions, NULL, false, miss, e);
    vgi_learning_clear(l);
    if (r == VG_OK) r = vgi_learning_gather(l, nv, reference, n, poses, nv, e);
    if (r == VG_OK) r = vgi_learning_weights(l, miss, e);
    if (r == VG_OK) r = vgi_learning_alternate(l, find_motions, NULL, true, miss, e);
    return r;
}

int vg_rig_decompose(vg_rig *rig, size_t nv, const double *reference, size_t bones, size_t n,
                     const double *const *poses, int threads, double *miss, vg_err *e)
{
    *rig = (vg_rig){0};
    if (!bones || bones > nv)
        return vg_fail(e, VG_EARG, "%zu vertices can have 1 to %zu bones, not %zu", nv, nv, bones);
    if (!n) return vg_fail(e, VG_EINPUT, "there are no poses to find bones in");
    vgi_learning l = {.threads = threads};
    size_t most = most_clusters(bones, nv);
    double *space = vgi_array(n, 7 * most * sizeof *space, e);
    l.transforms = vgi_array(n, sizeof *l.transforms, e);
    l.at = vgi_array(3 * most, sizeof *l.at, e);
    int r = space && l.transforms && l.at ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < n; i++) l.transforms[i] = space + 7 * most * i;
    if (r == VG_OK) r = decompose(&l, rig, nv, reference, bones, n, poses, miss, e);
    if (r == VG_OK) vgi_learning_keep(&l, rig);
    vgi_learning_clear(&l);
    free(space);
    free(l.transforms);
    free(l.at);
    if (r < 0) vg_rig_clear(rig);
    return r;
}
