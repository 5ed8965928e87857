/* map.c: fits a map from patch transforms to vertices (T 6.3), by least squares throughout.
 *
 * In pose k patch p moves by A x + t, the best similarity of its vertices. Corner i of patch p has the vector A u_i,
 * with the best u_i over the poses: u_i = (sum A' d) / (sum b^2). u_i is stored as a quaternion that rotates and
 * scales the reference vector into it, so that it applies to other bodies: the mean rotation H of the face relative
 * to its patch (which minimises sum |A H - F|, F the rotation of the face), then the smallest rotation to u_i. A few
 * vertices near the centre of each patch move rigidly with the patch. Vectors and held vertices are reconstructed
 * once for each component of each A and t (map_parts.c).
 *
 * The residual of each vertex is fitted by a ridge regression on the A of its own patch and of the neighbours,
 * because skin between two bones does not move rigidly.
 *
 * If only the A are known, the t follow from hinges (points that two adjacent patches move alike) plus a correction:
 * a ridge regression of the error of the hinges on the A of all patches. Its strength is the one that predicts
 * left-out poses best.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/face.h"
#include "numeric/lapack.h"
#include "method/rig/map_kernel.h"
#include "method/rig/map_parts.h"
#include "method/patches/pieces.h"
#include "numeric/blas.h"
#include "numeric/polar.h"
#include "numeric/sets.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

enum { CHUNK = 256, LEAST_FACES = 3, MOST_TRIED = 48, NEAR = 7 };
#define NOBODY UINT32_MAX

/* A patch and the neighbours that share most vertices with it. */
typedef struct vicinity {
    size_t n;
    uint32_t patch[NEAR], shared[NEAR];
} vicinity;

struct vg_map_fitter {
    const vg_head *h;
    vg_patches patches;   /* the connected pieces of the patches of h */
    vg_graph *g;
    int threads;
    double hold;
    uint32_t *of_face;    /* patch of each face of the graph */
    vgi_shape shape;
    vgi_turns turns;      /* of the faces of the graph */
    double *pull;         /* 3 per corner: sum of A' d */
    double *turn;         /* 9 per face: sum of R' F */
    double *b2;           /* per patch: sum of b^2 */
    size_t nheld;
    uint32_t *held, *held_patch;
    double *held_pull;    /* 3 per held vertex: sum of A' (x - t) */
    vicinity *near;       /* per patch */
    uint32_t *owner;      /* per vertex: its patch; NOBODY if it is in no face */
    double *want;         /* 3 NEAR per vertex: sum of A' (x - t of the owner), for each patch of the vicinity */
    size_t poses, cap;
    vgi_motion *motion;   /* poses x patches */
    vgi_map_motion *lanes; /* per patch: the same of eight poses that are added */
};

/* ---- patches ---- */

/* Split patches into connected pieces; merge tiny pieces into the neighbour that shares most vertices. */
static int split_patches(vg_patches *patches, const vg_mesh *m, vg_err *e)
{
    uint32_t *label = patches->of_face, *piece = vgi_array(m->nf, sizeof *piece, e), *shared = NULL,
             (*pair)[2] = NULL;
    size_t n = 0, npairs = 0;
    if (!piece) return VG_ENOMEM;
    int r = vgi_connected_pieces(m, label, patches->n, piece, &n, e);
    if (r == VG_OK) r = vgi_neighbours(m, piece, &pair, &shared, &npairs, e);
    uint32_t *size = vgi_array(n, sizeof *size, e), *set = vgi_array(n, sizeof *set, e),
             *best = vgi_array(n, sizeof *best, e);
    if (!size || !set || !best) r = VG_ENOMEM;
    if (r == VG_OK && n > patches->n) { /* a patch that was connected from the start is kept, however small */
        for (size_t f = 0; f < m->nf; f++) size[piece[f]]++;
        vgi_sets_init(set, n);
        for (size_t i = 0; i < npairs; i++)
            for (int k = 0; k < 2; k++) {
                uint32_t a = pair[i][k];
                if (best[a] == 0 || shared[i] > shared[best[a] - 1]) best[a] = (uint32_t)i + 1;
            }
        for (size_t p = 0; p < n; p++)
            if (size[p] < LEAST_FACES && best[p]) vgi_sets_join(set, pair[best[p] - 1][0], pair[best[p] - 1][1]);
        for (size_t f = 0; f < m->nf; f++) label[f] = vgi_sets_find(set, piece[f]);
        r = vgi_connected_pieces(m, label, n, piece, &n, e);
    }
    if (r == VG_OK) {
        memcpy(label, piece, m->nf * sizeof *label);
        patches->n = n;
    }
    free(piece);
    free(shared);
    free(pair);
    free(size);
    free(set);
    free(best);
    return r;
}

typedef struct candidate {
    double far; /* squared distance from the patch's centre */
    uint32_t vertex, patch;
} candidate;

static int by_distance(const void *a, const void *b)
{
    const candidate *x = a, *y = b;
    return x->far != y->far ? (x->far < y->far ? -1 : 1) : x->vertex < y->vertex ? -1 : x->vertex > y->vertex;
}

static int by_vertex(const void *a, const void *b)
{
    const candidate *x = a, *y = b;
    return x->vertex < y->vertex ? -1 : x->vertex > y->vertex;
}

/* Hold the vertices nearest the centre of each patch, interior ones first. A vertex is held by one patch only. */
static int choose_held(vg_map_fitter *f, vg_err *e)
{
    const vgi_shape *s = &f->shape;
    const vg_graph *g = f->g;
    double d = vg_diagonal(f->h->body.reference, g->faces.nv);
    unsigned char *used = vgi_array(g->faces.nv, sizeof *used, e), *count = vgi_array(g->faces.nv, sizeof *count, e);
    candidate *list = vgi_array(g->faces.nv, sizeof *list, e), *chosen = vgi_array(g->faces.nv, sizeof *chosen, e);
    bool ok = used && count && list && chosen;
    for (size_t i = 0; ok && i < s->first[s->n]; i++)
        if (count[s->member[i]] < 2) count[s->member[i]]++;
    for (size_t p = 0; ok && p < s->n; p++) {
        size_t n = 0, want = (size_t)(f->hold * (s->first[p + 1] - s->first[p]) + 0.5);
        for (size_t i = s->first[p]; i < s->first[p + 1]; i++) {
            const double *l = s->local + 3 * i;
            uint32_t v = s->member[i];
            if (used[v] || !g->in_face[v]) continue;
            double border = count[v] > 1 ? 4 * d * d : 0; /* after all others */
            list[n++] = (candidate){l[0] * l[0] + l[1] * l[1] + l[2] * l[2] + border, v, (uint32_t)p};
        }
        if (n) qsort(list, n, sizeof *list, by_distance);
        for (size_t i = 0; i < n && i < (want ? want : 1); i++)
            chosen[f->nheld++] = list[i], used[list[i].vertex] = 1;
    }
    if (ok) {
        qsort(chosen, f->nheld, sizeof *chosen, by_vertex);
        f->held = vgi_array(f->nheld, sizeof *f->held, e),
        f->held_patch = vgi_array(f->nheld, sizeof *f->held_patch, e);
        f->held_pull = vgi_array(3 * f->nheld, sizeof *f->held_pull, e);
        ok = f->held && f->held_patch && f->held_pull;
    }
    for (size_t i = 0; ok && i < f->nheld; i++) f->held[i] = chosen[i].vertex, f->held_patch[i] = chosen[i].patch;
    free(used);
    free(count);
    free(list);
    free(chosen);
    return ok ? VG_OK : VG_ENOMEM;
}

/* Insert a neighbour, in descending order of shared vertices. */
static void come_near(vicinity *x, uint32_t patch, uint32_t shared)
{
    size_t at = x->n < NEAR ? x->n++ : shared > x->shared[NEAR - 1] ? NEAR - 1 : NEAR;
    for (; at < NEAR && at > 1 && shared > x->shared[at - 1]; at--)
        x->shared[at] = x->shared[at - 1], x->patch[at] = x->patch[at - 1];
    if (at < NEAR) x->shared[at] = shared, x->patch[at] = patch;
}

/* Sort the neighbours of each patch in descending order of shared vertices. */
static int find_near(vg_map_fitter *f, vg_err *e)
{
    const vg_graph *g = f->g;
    size_t n = f->shape.n, npairs = 0;
    uint32_t (*pair)[2], *shared;
    f->near = vgi_array(n, sizeof *f->near, e), f->owner = vgi_array(g->faces.nv, sizeof *f->owner, e);
    f->want = vgi_array(g->faces.nv, 3 * NEAR * sizeof *f->want, e);
    if (!f->near || !f->owner || !f->want) return VG_ENOMEM;
    int r = vgi_neighbours(&g->faces, f->of_face, &pair, &shared, &npairs, e);
    if (r < 0) return r;
    for (size_t p = 0; p < n; p++) f->near[p] = (vicinity){.n = 1, .patch = {(uint32_t)p}};
    for (size_t i = 0; i < npairs; i++)
        for (int k = 0; k < 2; k++) come_near(&f->near[pair[i][k]], pair[i][1 - k], shared[i]);
    memset(f->owner, 0xff, g->faces.nv * sizeof *f->owner);
    for (size_t p = n; p-- > 0;)
        for (size_t i = f->shape.first[p]; i < f->shape.first[p + 1]; i++) f->owner[f->shape.member[i]] = (uint32_t)p;
    free(pair);
    free(shared);
    return VG_OK;
}

int vg_map_fitter_new(vg_map_fitter **out, const vg_head *h, double hold, int threads, vg_err *e)
{
    *out = NULL;
    if (!h->body.patches.n || !h->body.mesh.nf)
        return vg_fail(e, VG_EINPUT, "there are no patches: make them with vg-segment");
    if (!h->links.chosen) return vg_fail(e, VG_EARG, "the links are not chosen: call vg_head_prepare_vectors first");
    vg_map_fitter *f = *out = vgi_array(1, sizeof *f, e);
    if (!f) return VG_ENOMEM;
    f->h = h, f->threads = threads, f->hold = hold;
    int r = vg_patches_copy(&f->patches, &h->body.patches, h->body.mesh.nf, e);
    if (r == VG_OK) r = split_patches(&f->patches, &h->body.mesh, e);
    if (r == VG_OK) r = vg_head_graph(&f->g, h, e);
    if (r == VG_OK && !(f->of_face = vgi_graph_patches(h, &f->patches, f->g, e))) r = VG_ENOMEM;
    if (r == VG_OK) r = vgi_shape_make(&f->shape, &h->body.mesh, &f->patches, h->body.reference, e);
    if (r == VG_OK) r = vgi_turns_make(&f->turns, f->g->faces.nf, f->g->faces.start, f->g->faces.vert, h->body.reference, e);
    if (r == VG_OK) r = choose_held(f, e);
    if (r == VG_OK) r = find_near(f, e);
    if (r == VG_OK) {
        f->pull = vgi_array(3 * vg_graph_corners(f->g), sizeof *f->pull, e);
        f->turn = vgi_array(9 * f->g->faces.nf, sizeof *f->turn, e);
        f->b2 = vgi_array(f->patches.n, sizeof *f->b2, e);
        f->lanes = vgi_array(f->patches.n, sizeof *f->lanes, e);
        if (!f->pull || !f->turn || !f->b2 || !f->lanes) r = VG_ENOMEM;
    }
    if (r < 0) vg_map_fitter_free(out);
    return r;
}

void vg_map_fitter_free(vg_map_fitter **out)
{
    vg_map_fitter *f = *out;
    if (!f) return;
    vg_patches_clear(&f->patches);
    vg_graph_free(&f->g);
    vgi_shape_clear(&f->shape);
    vgi_turns_clear(&f->turns);
    free(f->of_face);
    free(f->pull);
    free(f->turn);
    free(f->b2);
    free(f->lanes);
    free(f->held);
    free(f->held_patch);
    free(f->held_pull);
    free(f->near);
    free(f->owner);
    free(f->want);
    free(f->motion);
    free(f);
    *out = NULL;
}

/* ---- poses ---- */

typedef struct adding {
    vg_map_fitter *f;
    const double *poses[VGI_LANES];
    size_t lanes;
    vgi_motion *motion; /* lanes x patches */
} adding;

static void measure_patch(void *context, size_t p)
{
    const adding *a = context;
    size_t n = a->f->shape.n;
    vgi_map_motion *to = &a->f->lanes[p];
    for (size_t k = 0; k < a->lanes; k++) {
        vgi_motion *m = &a->motion[k * n + p];
        vgi_shape_measure(&a->f->shape, p, a->poses[k], m);
        double share = 1 / sqrt(m->b2);
        for (size_t i = 0; i < 9; i++) to->a[i][k] = m->a[i], to->rotation[i][k] = m->a[i] * share;
        for (size_t i = 0; i < 3; i++) to->t[i][k] = m->t[i];
    }
    for (size_t k = a->lanes; k < VGI_LANES; k++) {
        for (size_t i = 0; i < 9; i++) to->a[i][k] = to->rotation[i][k] = 0;
        for (size_t i = 0; i < 3; i++) to->t[i][k] = 0;
    }
}

/* to += A' x */
static void add_back(const double a[9], const double x[3], double *to)
{
    double back[3];
    vgi_transposed_vector(a, x, back);
    vgi_add(to, back);
}

static void add_face(const adding *a, size_t face)
{
    const vg_map_fitter *f = a->f;
    const uint32_t *start = f->g->faces.start;
    size_t begin = start[face];
    vgi_lanes turn[9];
    vgi_turns_measure(&f->turns, face, a->poses, turn);
    vgi_map_kernel_now()->face(&f->lanes[f->of_face[face]], a->poses, f->g->faces.vert + begin, start[face + 1] - begin,
                               (const vgi_lanes *)turn, f->pull + 3 * begin, f->turn + 9 * face);
}

static void add_chunk(void *context, size_t i)
{
    const adding *a = context;
    size_t nf = a->f->g->faces.nf, first = i * CHUNK, last = first + CHUNK < nf ? first + CHUNK : nf;
    for (size_t f = first; f < last; f++) add_face(a, f);
}

static void add_held(const adding *a)
{
    vg_map_fitter *f = a->f;
    for (size_t k = 0; k < a->lanes; k++)
        for (size_t i = 0; i < f->nheld; i++) {
            const vgi_motion *m = &a->motion[k * f->shape.n + f->held_patch[i]];
            const double *x = a->poses[k] + 3 * (size_t)f->held[i];
            const double d[3] = {x[0] - m->t[0], x[1] - m->t[1], x[2] - m->t[2]};
            add_back(m->a, d, f->held_pull + 3 * i);
        }
}

static void want_chunk(void *context, size_t i)
{
    const adding *a = context;
    vg_map_fitter *f = a->f;
    size_t nv = f->g->faces.nv, first = i * CHUNK, last = first + CHUNK < nv ? first + CHUNK : nv;
    for (size_t v = first; v < last; v++) {
        if (f->owner[v] == NOBODY) continue;
        const vicinity *near = &f->near[f->owner[v]];
        vgi_map_kernel_now()->vertex(f->lanes, f->owner[v], near->patch, near->n, a->poses, v, f->want + 3 * NEAR * v);
    }
}

int vg_map_fitter_add(vg_map_fitter *f, size_t n, const double *const *poses, vg_err *e)
{
    size_t patches = f->shape.n;
    for (size_t p = 0; p < n; p += VGI_LANES) {
        adding a = {.f = f, .lanes = n - p < VGI_LANES ? n - p : VGI_LANES};
        for (size_t k = 0; k < VGI_LANES; k++) a.poses[k] = poses[p + (k < a.lanes ? k : a.lanes - 1)];
        int r = vgi_grow(&f->motion, &f->cap, (f->poses + a.lanes) * patches, sizeof *f->motion, e);
        if (r < 0) return r;
        a.motion = f->motion + f->poses * patches;
        vgi_parallel(f->threads, patches, measure_patch, &a);
        vgi_parallel(f->threads, (f->g->faces.nf + CHUNK - 1) / CHUNK, add_chunk, &a);
        vgi_parallel(f->threads, (f->g->faces.nv + CHUNK - 1) / CHUNK, want_chunk, &a);
        add_held(&a);
        for (size_t k = 0; k < a.lanes; k++)
            for (size_t q = 0; q < patches; q++) f->b2[q] += a.motion[k * patches + q].b2;
        f->poses += a.lanes;
    }
    return VG_OK;
}

/* ---- corners ---- */

static void fit_corners(const vg_map_fitter *f, vg_map *m)
{
    const vg_graph *g = f->g;
    for (size_t face = 0; face < g->faces.nf; face++) {
        double h[9], q[4];
        vgi_fit_rotation(f->turn + 9 * face, h);
        vg_quat_from_matrix(h, q);
        for (size_t c = g->faces.start[face]; c < g->faces.start[face + 1]; c++) {
            const double *r = f->turns.vector + 3 * c;
            double u[3], turned[3], rest[4] = {1, 0, 0, 0}, u2 = 0, r2 = 0;
            vg_quat_apply(q, r, turned);
            for (size_t k = 0; k < 3; k++) {
                u[k] = f->pull[3 * c + k] / f->b2[f->of_face[face]];
                u2 += u[k] * u[k], r2 += r[k] * r[k];
            }
            /* otherwise it has no direction and rotates with its face */
            if (r2 > 0 && u2 > 1e-18 * r2) vg_quat_between(turned, u, rest);
            vg_quat_multiply(rest, q, m->corner + 4 * c);
        }
    }
}

/* The point c that patches i and j move alike, by least squares over the poses. Where the poses do not determine it,
 * it is near their shared vertices. */
static void fit_hinge(const vg_map_fitter *f, size_t i, size_t j, const double middle[3], double c[3], double *miss)
{
    static const double firmness = 0.01;
    size_t n = f->shape.n;
    double s[9] = {0}, y[3] = {0, 0, 0};
    for (size_t k = 0; k < f->poses; k++) {
        const vgi_motion *a = &f->motion[k * n + i], *b = &f->motion[k * n + j];
        double d[9], at_a[3], at_b[3], gap[3];
        for (int q = 0; q < 9; q++) d[q] = a->a[q] - b->a[q];
        vgi_move_point(a, middle, at_a);
        vgi_move_point(b, middle, at_b);
        vgi_subtract(at_b, at_a, gap);
        add_back(d, gap, y);
        for (int p = 0; p < 3; p++)
            for (int q = 0; q < 3; q++)
                for (int t = 0; t < 3; t++) s[3 * p + q] += d[3 * t + p] * d[3 * t + q];
    }
    for (int q = 0; q < 3; q++) s[4 * q] += firmness * (double)f->poses;
    if (vgi_spd_factor(3, s)) vgi_spd_solve(3, s, 1, y);
    else y[0] = y[1] = y[2] = 0;
    vgi_sum(middle, y, c);
    *miss = 0;
    for (size_t k = 0; k < f->poses; k++) {
        double at_a[3], at_b[3];
        vgi_move_point(&f->motion[k * n + i], c, at_a);
        vgi_move_point(&f->motion[k * n + j], c, at_b);
        for (int q = 0; q < 3; q++) *miss += (at_a[q] - at_b[q]) * (at_a[q] - at_b[q]) / (double)f->poses;
    }
}

static int fit_hinges(const vg_map_fitter *f, vg_map *m, vg_err *e)
{
    static const double least = 2e-3; /* in D: precision with which a hinge can be known */
    static const double nothing = 1e-12; /* weight of a hinge whose error is thousands of D, or not finite */
    const vg_graph *g = f->g;
    uint32_t (*pair)[2], *shared;
    double d = vg_diagonal(f->h->body.reference, g->faces.nv);
    int r = vgi_neighbours(&g->faces, f->of_face, &pair, &shared, &m->nhinges, e);
    if (r < 0) return r;
    m->hinge = (uint32_t *)pair;
    m->hinge_at = vgi_array(3 * m->nhinges, sizeof *m->hinge_at, e);
    m->hinge_weight = vgi_array(m->nhinges, sizeof *m->hinge_weight, e);
    double *middle = vgi_array(3 * m->nhinges, sizeof *middle, e);
    if (!m->hinge_at || !m->hinge_weight || !middle) r = VG_ENOMEM;
    if (r == VG_OK)
        r = vgi_shared_points(&g->faces, f->of_face, m->hinge, m->nhinges, f->h->body.reference,
                              middle, e);
    for (size_t i = 0; r == VG_OK && i < m->nhinges; i++) {
        double miss;
        fit_hinge(f, pair[i][0], pair[i][1], middle + 3 * i, m->hinge_at + 3 * i, &miss);
        m->hinge_weight[i] = d > 0 ? shared[i] / (miss / (d * d) + least * least) * least * least : 1;
        if (!(m->hinge_weight[i] >= nothing)) m->hinge_weight[i] = nothing;
    }
    free(middle);
    free(shared);
    return r;
}

/* Error of the hinges in pose k: delta (3 x n) = t - root - place A. */
static void hinge_errors(const vg_map_fitter *f, const vg_map *m, size_t k, double *delta)
{
    size_t n = m->n;
    const vgi_motion *motion = f->motion + k * n;
    double root[3] = {0, 0, 0};
    for (size_t p = 0; p < n; p++) {
        double at[3];
        vgi_move_point(&motion[p], m->centre + 3 * p, at);
        vgi_add_scaled(root, m->share[p], at);
    }
    for (size_t p = 0; p < n; p++)
        for (size_t c = 0; c < 3; c++) {
            double sum = motion[p].t[c] - root[c];
            const double *g = m->place + p * 3 * n;
            for (size_t j = 0; j < n; j++)
                for (size_t q = 0; q < 3; q++) sum -= motion[j].a[3 * c + q] * g[3 * j + q];
            delta[c * n + p] = sum;
        }
}

static void row_of(const vg_map_fitter *f, size_t k, size_t c, double *row)
{
    for (size_t p = 0; p < f->shape.n; p++)
        for (size_t q = 0; q < 3; q++) row[3 * p + q] = f->motion[k * f->shape.n + p].a[3 * c + q];
}

typedef struct ridge {
    const vg_map_fitter *f;
    const vg_map *m;
    size_t n, width; /* number of patches; 3 n */
    double *s;       /* width x width: sum of rows' row; lower triangle */
    double *y;       /* width x n: sum of row' delta */
    double *l, *g;   /* factor and solution for one strength */
    double *delta, *work;
} ridge;

static void sum_rows(ridge *x)
{
    size_t w = x->width, n = x->n;
    for (size_t k = 0; k < x->f->poses; k++) {
        hinge_errors(x->f, x->m, k, x->delta);
        for (size_t c = 0; c < 3; c++) {
            row_of(x->f, k, c, x->work);
            for (size_t i = 0; i < w; i++) {
                for (size_t j = 0; j <= i; j++) x->s[i * w + j] += x->work[i] * x->work[j];
                for (size_t p = 0; p < n; p++) x->y[i * n + p] += x->work[i] * x->delta[c * n + p];
            }
        }
    }
    for (size_t c = 0; c < 3; c++) /* the reference pose, where the error is 0 */
        for (size_t i = c; i < w; i += 3)
            for (size_t j = c; j <= i; j += 3) x->s[i * w + j] += 1;
}

static bool solve_ridge(ridge *x, double strength)
{
    size_t w = x->width;
    memcpy(x->l, x->s, w * w * sizeof *x->l);
    memcpy(x->g, x->y, w * x->n * sizeof *x->g);
    for (size_t i = 0; i < w; i++) x->l[i * w + i] += strength;
    if (!vgi_spd_factor(w, x->l)) return false;
    vgi_spd_solve(w, x->l, x->n, x->g);
    return true;
}

/* The squared error of a pose predicted by the fit of all others: the residual through (I - H)^-1,
 * H = rows S^-1 rows'. */
static double left_out(ridge *x, size_t k)
{
    size_t w = x->width, n = x->n;
    double *rows = x->work, *solved = x->work + 3 * w, h[9], c[9], sum = 0;
    hinge_errors(x->f, x->m, k, x->delta);
    for (size_t i = 0; i < 3; i++) row_of(x->f, k, i, rows + i * w);
    for (size_t i = 0; i < w; i++)
        for (size_t q = 0; q < 3; q++) solved[3 * i + q] = rows[q * w + i];
    vgi_spd_solve(w, x->l, 3, solved);
    for (size_t i = 0; i < 3; i++)
        for (size_t q = 0; q < 3; q++) {
            h[3 * i + q] = i == q;
            for (size_t j = 0; j < w; j++) h[3 * i + q] -= rows[i * w + j] * solved[3 * j + q];
        }
    memcpy(c, h, sizeof c);
    if (!vgi_spd_factor(3, c)) return INFINITY;
    for (size_t p = 0; p < n; p++) {
        double r[3];
        for (size_t i = 0; i < 3; i++) {
            r[i] = x->delta[i * n + p];
            for (size_t j = 0; j < w; j++) r[i] -= rows[i * w + j] * x->g[j * n + p];
        }
        vgi_spd_solve(3, c, 1, r);
        sum += x->m->share[p] * vgi_dot(r, r);
    }
    return sum;
}

/* Correct the positions from hinges by regression, if this predicts left-out poses better. */
static int correct_place(const vg_map_fitter *f, vg_map *m, vg_err *e)
{
    static const double strengths[] = {1e-4, 1e-3, 1e-2, 0.1, 1};
    size_t n = m->n, w = 3 * n, tried = f->poses < MOST_TRIED ? f->poses : MOST_TRIED;
    ridge x = {.f = f, .m = m, .n = n, .width = w};
    x.s = vgi_array(w, w * sizeof(double), e), x.l = vgi_array(w, w * sizeof(double), e);
    x.y = vgi_array(w, n * sizeof(double), e), x.g = vgi_array(w, n * sizeof(double), e);
    x.delta = vgi_array(w, sizeof(double), e), x.work = vgi_array(6 * w, sizeof(double), e);
    bool ok = x.s && x.l && x.y && x.g && x.delta && x.work;
    if (ok) {
        double least = 0, best = -1, trace = 0;
        sum_rows(&x);
        for (size_t i = 0; i < w; i++) trace += x.s[i * w + i] / (double)w;
        for (size_t i = 0; i < tried; i++) { /* first without correction */
            hinge_errors(f, m, i * f->poses / tried, x.delta);
            for (size_t p = 0; p < n; p++)
                for (size_t c = 0; c < 3; c++) least += m->share[p] * x.delta[c * n + p] * x.delta[c * n + p];
        }
        for (size_t i = 0; i < sizeof strengths / sizeof *strengths; i++) {
            double sum = 0;
            if (!solve_ridge(&x, strengths[i] * trace)) continue;
            for (size_t k = 0; k < tried; k++) sum += left_out(&x, k * f->poses / tried);
            if (sum < least) least = sum, best = strengths[i];
        }
        if (best >= 0 && solve_ridge(&x, best * trace))
            for (size_t p = 0; p < n; p++)
                for (size_t i = 0; i < w; i++) m->place[p * w + i] += x.g[i * n + p];
    }
    free(x.s);
    free(x.l);
    free(x.y);
    free(x.g);
    free(x.delta);
    free(x.work);
    return ok ? VG_OK : VG_ENOMEM;
}

/* ---- skin ---- */

typedef struct skinning {
    const vg_map_fitter *f;
    vg_map *m;
    double strength;
    atomic_bool failed;
} skinning;

/* block (3 x 3, row stride) += A' B */
static void add_block(double *to, size_t stride, const double a[9], const double b[9])
{
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++) to[i * stride + j] += a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
}

/* Residual of the map so far, over the poses in `want` and the reference pose; then the regression that fits it. */
static void skin_patch(void *context, size_t p)
{
    skinning *x = context;
    const vg_map_fitter *f = x->f;
    const vicinity *near = &f->near[p];
    size_t n = f->shape.n, w = 3 * near->n, width = 4 * n;
    double s[9 * NEAR * NEAR] = {0}, z[3 * NEAR], *cross = calloc(w, width * sizeof *cross);
    if (!cross) {
        atomic_store(&x->failed, true);
        return;
    }
    for (size_t k = 0; k < f->poses; k++) {
        const vgi_motion *m = f->motion + k * n;
        for (size_t i = 0; i < near->n; i++) {
            const double *a = m[near->patch[i]].a;
            for (size_t j = 0; j <= i; j++) add_block(s + 3 * i * w + 3 * j, w, a, m[near->patch[j]].a);
            for (size_t q = 0; q < n; q++) {
                double *to = cross + 3 * i * width + 4 * q;
                const double d[3] = {m[q].t[0] - m[p].t[0], m[q].t[1] - m[p].t[1], m[q].t[2] - m[p].t[2]};
                add_block(to, width, a, m[q].a);
                for (size_t c = 0; c < 3; c++) to[c * width + 3] += a[c] * d[0] + a[3 + c] * d[1] + a[6 + c] * d[2];
            }
        }
    }
    for (size_t i = 0; i < w; i++) {
        for (size_t j = i % 3; j <= i; j += 3) s[i * w + j] += 1;
        for (size_t q = 0; q < n; q++) cross[i * width + 4 * q + i % 3] += 1;
        s[i * w + i] += x->strength * (double)(f->poses + 1);
    }
    bool ok = vgi_spd_factor(w, s);
    for (size_t v = 0; ok && v < f->g->faces.nv; v++) {
        if (f->owner[v] != p || !f->g->in_face[v]) continue;
        double *row = x->m->weights + v * width;
        for (size_t i = 0; i < w; i++) {
            z[i] = f->want[3 * NEAR * v + i] + f->h->body.reference[3 * v + i % 3];
            for (size_t j = 0; j < width; j++) z[i] -= cross[i * width + j] * row[j];
        }
        vgi_spd_solve(w, s, 1, z);
        for (size_t i = 0; i < w; i++) row[4 * near->patch[i / 3] + i % 3] += z[i];
    }
    free(cross);
}

static int fit_skin(const vg_map_fitter *f, vg_map *m, vg_err *e)
{
    skinning x = {.f = f, .m = m, .strength = 0.003};
    vgi_parallel(f->threads, f->shape.n, skin_patch, &x);
    return atomic_load(&x.failed) ? vg_fail(e, VG_ENOMEM, "not enough memory to fit %zu patches", f->shape.n) : VG_OK;
}

static int make_arrays(vg_map *m, const vg_map_fitter *f, vg_err *e)
{
    size_t n = f->shape.n;
    *m = (vg_map){.n = n,
                  .nv = f->g->faces.nv,
                  .kind = VG_MAP_PATCHES,
                  .size = 1,
                  .ncorners = vg_graph_corners(f->g),
                  .per_corner = 1,
                  .nheld = f->nheld};
    m->place = vgi_array(n, 3 * n * sizeof *m->place, e);
    m->centre = vgi_copy_array(f->shape.centre, 3 * n, sizeof *m->centre, e);
    m->home_centre = vgi_copy_array(f->shape.centre, 3 * n, sizeof *m->centre, e);
    m->share = vgi_array(n, sizeof *m->share, e);
    m->corner = vgi_array(4 * m->ncorners, sizeof *m->corner, e);
    m->held = vgi_copy_array(f->held, f->nheld, sizeof *m->held, e);
    m->held_patch = vgi_copy_array(f->held_patch, f->nheld, sizeof *m->held_patch, e);
    m->held_at = vgi_array(3 * f->nheld, sizeof *m->held_at, e);
    if (!m->place || !m->centre || !m->home_centre || !m->share || !m->corner || !m->held || !m->held_patch ||
        !m->held_at)
        return VG_ENOMEM;
    for (size_t p = 0; p < n; p++)
        m->share[p] = (double)(f->shape.first[p + 1] - f->shape.first[p]) / (double)f->shape.first[n];
    for (size_t i = 0; i < f->nheld; i++)
        vgi_divided(f->held_pull + 3 * i, f->b2[f->held_patch[i]], m->held_at + 3 * i);
    return VG_OK;
}

int vg_map_fitter_finish(vg_map_fitter *f, vg_patches *patches, vg_map *m, vg_err *e)
{
    const vgi_map_body body = {.reference = f->h->body.reference};
    *patches = (vg_patches){0}, *m = (vg_map){0};
    if (!f->poses) return vg_fail(e, VG_EINPUT, "there are no poses to fit a map to");
    vgi_blas_alone();
    int r = make_arrays(m, f, e);
    if (r == VG_OK) fit_corners(f, m);
    if (r == VG_OK) r = vgi_map_collapse(m, &body, f->g, f->of_face, f->turns.vector, f->threads, e);
    if (r == VG_OK) r = fit_skin(f, m, e);
    if (r == VG_OK) r = fit_hinges(f, m, e);
    if (r == VG_OK) r = vgi_place_by_hinges(m, m->centre, m->place, e);
    if (r == VG_OK) r = correct_place(f, m, e);
    vgi_blas_shared();
    if (r == VG_OK) r = vg_patches_copy(patches, &f->patches, f->h->body.mesh.nf, e);
    if (r < 0) vg_map_clear(m);
    return r;
}
