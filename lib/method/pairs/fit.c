/* fit.c: deforms one polygon surface until it lies on another, from ties (markers, seeds) and nearest points.
 *
 * The fit minimises how much the deformation changes from place to place. With L a graph Laplacian of the source whose
 * springs are as strong as they are short, s its rest positions, and R_v the rotation and mean stretch of the faces
 * around vertex v in the current fit, the objective is
 *
 *     sum over v of |(L x)_v - R_v (L s)_v|^2 / L_vv                     bending
 *       + a * sum over springs of |(x_u - x_v) - R_uv (s_u - s_v)|^2      stretching
 *       + sum of weight * |point of the source - its target|^2           ties, nearest points in both directions
 *
 * A similarity of the whole body costs nothing, and one that changes slowly from limb to limb costs little. Sumner
 * and Popovic (2004, section 5.1) ask the same of neighbouring triangles; this form has no extra unknowns and takes
 * faces with any number of corners. x, y and z share one matrix, factorised once per round; within a round R and the
 * nearest points follow the fit. R comes from the map of each face (its vectors, and its normal stretched by the
 * square root of its area), smoothed over a length by (1 + length^2 L)^-1: R of single faces would follow every dent
 * and keep the result rough.
 *
 * The nearest point of a vertex is the one whose position and normal together differ least (vgi_surface_alike): lips,
 * lids and nostrils then pull to their like, not to what happens to be nearest.
 *
 * Rough alignment of the meshes is in register.c, L with its matrices in springs.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/springs.h"
#include "numeric/face.h"
#include "model/incidence.h"
#include "numeric/stats.h"

#include <stdlib.h>

static const double REST = 1e-7;           /* pull to the current position, for vertices without other terms */
static const double IDENTITY_TRUST = 1e-6; /* where no face determines the deformation */

/* Lengths are in D. Results on real pairs do not change when these values change by up to a factor of two. */
static const double MARKER = 3;           /* weight of ties, relative to bending and stretching */
static const double STRETCH = 0.004;      /* length above which stretching counts more than bending */
static const double MOST_STRETCH = 2;     /* weight of stretching, relative to bending, on coarse meshes */
static const double FIRST_SPAN = 0.075;    /* radius over which a nearest point pulls its neighbourhood, in the first
                                             round */
static const double LAST_SPAN = 0.7;      /* and in the last round, in mean edge lengths */
static const double FIRST_LIMIT = 0.1, LAST_LIMIT = 0.02; /* nearest points farther away are ignored */
static const double TIED_LIMIT = 0.07;    /* the first limit at least, once ties have brought the surfaces together */
static const double TIMES_MEDIAN = 8;     /* the first limit, in medians of the distances after the ties */
static const double COSINE = 0.4;         /* least cosine of the angle between matching normals */
static const double REACH = 0.01;         /* normals that differ by 1 count as much as points at this distance, */
static const double SMOOTH = 0.1;         /* where adjacent normals differ by this at most; less on coarser meshes,
                                             whose normals are less certain */
static const double MAP_SPAN = 0.03;      /* length over which the maps of faces are smoothed */
static const double KEPT_STRETCH = 0.5;   /* exponent of a map's stretch: parts without constraints return to their
                                             own size */

enum {
    BLOCK = 256,     /* vertices or faces per task */
    TIED_SOLVES = 5, /* rounds from the ties alone */
    ROUNDS = 8,      /* rounds with nearest points, one factorisation each */
    SOLVES = 4       /* per round */
};

/* A target vertex pulls the nearest point of the source surface. */
typedef struct reverse {
    uint32_t face; /* of the source */
    double weight, share[VGI_SMALL_FACE]; /* of the face's corners, which are all joined by springs */
} reverse;

typedef struct fit {
    const vgi_fitting *in;
    const vg_mesh *m;
    vgi_incidence around;
    vgi_laplacian L;
    double *laplacian; /* nv x 3: L s */
    double *inverse;   /* nf x 9: (sum r r' + h n n')^-1, see prepare_faces() */
    double *h_normal;  /* nf x 3: h n, at rest */
    double *area;      /* nf: at rest */
    double *trust;     /* nf: 1 for a round face, 0 for one without area */
    size_t row;        /* of the maps that is being smoothed */
    double *face_map, *map; /* maps D of the faces; of the vertices, smooth and without shear */
    double edge;       /* mean length */
    double reach;      /* see REACH */
    vgi_cholesky *smoother; /* smoothing operator of the maps */
    bool *border;      /* nv: of the source */
    vgi_smoothness smooth; /* its matrix.value is the matrix to factorise */
    vgi_cholesky *solver;
    double *x, *rhs, *normal, *tmp; /* nv x 3 */
    double *pull;      /* nv: weight of the nearest point in this round; 0: none */
    double *goal;      /* nv x 3: the nearest point */
    double *goal_normal; /* nv x 3: there */
    double *distance;  /* nv */
    reverse *reverse;  /* per target vertex; weight 0: no pull */
    vgi_surface *now;  /* the source at the start of the round */
    double limit;
    double stretch;    /* weight of first differences */
    double tie;        /* weight of ties */
} fit;

/* ---- the matrix ---- */

static double *entry(const vgi_sparse *A, uint32_t a, uint32_t b)
{
    uint32_t column = a < b ? a : b;
    int row = (int)(a < b ? b : a), low = A->start[column], high = A->start[column + 1];
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (A->row[middle] <= row) low = middle;
        else high = middle;
    }
    return &A->value[low];
}

static int factorize_matrix(fit *t, vg_err *e)
{
    const vgi_smoothness *s = &t->smooth;
    const vgi_sparse *A = &s->matrix;
    for (int i = 0; i < A->start[A->n]; i++) A->value[i] = s->bending[i] + t->stretch * s->stretching[i];
    for (size_t v = 0; v < A->n; v++) A->value[A->start[v]] += t->L.sum[v] > 0 ? t->pull[v] + REST : 1;
    for (size_t i = 0; i < t->in->nties; i++) {
        const vgi_tie *tie = &t->in->tie[i];
        for (int a = 0; a < 3; a++)
            for (int b = 0; b <= a; b++) {
                double w = t->tie * tie->weight * tie->share[a] * tie->share[b];
                *entry(A, tie->vertex[a], tie->vertex[b]) += a != b && tie->vertex[a] == tie->vertex[b] ? 2 * w : w;
            }
    }
    for (size_t i = 0; i < t->in->target_mesh->nv; i++) {
        const reverse *p = &t->reverse[i];
        if (!(p->weight > 0)) continue;
        const uint32_t *vert = t->m->vert + t->m->start[p->face];
        for (size_t a = 0; a < t->m->start[p->face + 1] - t->m->start[p->face]; a++)
            for (size_t b = 0; b <= a; b++) *entry(A, vert[a], vert[b]) += p->weight * p->share[a] * p->share[b];
    }
    return vgi_cholesky_factorize(t->solver, A, e);
}

/* ---- deformation of the faces */

static void prepare_faces(fit *t)
{
    const vg_mesh *m = t->m;
    for (size_t f = 0; f < m->nf; f++) {
        const uint32_t *vert = m->vert + m->start[f];
        size_t r = m->start[f + 1] - m->start[f];
        double C[3], S[9] = {0}, n[3], *out = t->inverse + 9 * f;
        vgi_face_centre(t->in->rest, vert, r, C);
        for (size_t i = 0; i < r; i++) {
            double w[3];
            vgi_subtract(t->in->rest + 3 * (size_t)vert[i], C, w);
            vgi_add_outer(S, 1, w, w);
        }
        vgi_face_area(t->in->rest, vert, r, n);
        double area = vgi_length(n), h = 0.5 * (S[0] + S[4] + S[8]), c[9];
        t->area[f] = area;
        if (r == 2 || !(area > 0)) {
            t->trust[f] = r == 2 && h > 0;
            continue;
        }
        vgi_divide(n, area);
        vgi_scaled(h, n, t->h_normal + 3 * f);
        vgi_add_outer(S, h, n, n);
        double det = vgi_cofactors(S, c);
        t->trust[f] = det / (h * h * h); /* 4 l1 l2 / (l1 + l2)^2, with l1, l2 the eigenvalues in the plane */
        if (!(t->trust[f] > 1e-6)) {
            t->trust[f] = 0;
            continue;
        }
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++) out[3 * k + l] = c[3 * l + k] / det;
    }
}

static void bone_map(const double *x, const double *rest, const uint32_t *vert, double D[9])
{
    double r[3], d[3], q[4], unit[4];
    vgi_subtract(rest + 3 * (size_t)vert[1], rest + 3 * (size_t)vert[0], r);
    vgi_subtract(x + 3 * (size_t)vert[1], x + 3 * (size_t)vert[0], d);
    double a = vgi_length(d) / vgi_length(r);
    if (!(a > 0)) d[0] = r[0], d[1] = r[1], d[2] = r[2], a = 1e-6;
    vg_quat_between(r, d, q);
    double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) unit[k] = q[k] / size;
    vg_quat_matrix(unit, D);
    for (int k = 0; k < 9; k++) D[k] *= a;
}

static void map_face(fit *t, size_t f)
{
    const vg_mesh *m = t->m;
    const uint32_t *vert = m->vert + m->start[f];
    const double *x = t->x, *P = t->inverse + 9 * f;
    size_t r = m->start[f + 1] - m->start[f];
    double *D = t->face_map + 9 * f, C[3], S[9] = {0}, n[3];
    if (!(t->trust[f] > 0)) return;
    if (r == 2) {
        bone_map(x, t->in->rest, vert, D);
        return;
    }
    vgi_face_centre(x, vert, r, C);
    for (size_t i = 0; i < r; i++) {
        double d[3];
        vgi_subtract(x + 3 * (size_t)vert[i], C, d);
        vgi_add_outer(S, 1, d, t->in->rest + 3 * (size_t)vert[i]);
    }
    vgi_face_area(x, vert, r, n);
    double area = vgi_length(n);
    if (area > 0) vgi_add_outer(S, sqrt(area / t->area[f]) / area, n, t->h_normal + 3 * f);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) D[3 * i + k] = S[3 * i] * P[k] + S[3 * i + 1] * P[3 + k] + S[3 * i + 2] * P[6 + k];
}

static void map_faces(void *context, size_t block)
{
    fit *t = context;
    for (size_t f = block * BLOCK; f < t->m->nf && f < (block + 1) * BLOCK; f++) map_face(t, f);
}

/* Row t->row of the maps around each vertex, into tmp. */
static void add_maps(void *context, size_t block)
{
    const fit *t = context;
    for (size_t v = block * BLOCK; v < t->m->nv && v < (block + 1) * BLOCK; v++) {
        double *to = t->tmp + 3 * v;
        for (size_t k = 0; k < 3; k++) to[k] = k == t->row ? IDENTITY_TRUST : 0;
        for (uint32_t i = t->around.first[v]; i < t->around.first[v + 1]; i++) {
            size_t f = t->around.face[i];
            vgi_add_scaled(to, t->trust[f], t->face_map + 9 * f + 3 * t->row);
        }
    }
}

/* Maps of vertices: the mean of the adjacent faces' maps, weighted by trust and smoothed: (trust + length^2 L) D =
 * sum of trusted D. */
static int smooth_maps(fit *t, vg_err *e)
{
    size_t nv = t->m->nv;
    for (t->row = 0; t->row < 3; t->row++) {
        vgi_parallel(t->in->threads, (nv + BLOCK - 1) / BLOCK, add_maps, t);
        int r = vgi_cholesky_solve(t->smoother, t->tmp, e);
        if (r < 0) return r;
        for (size_t v = 0; v < nv; v++)
            for (size_t k = 0; k < 3; k++) t->map[9 * v + 3 * t->row + k] = t->tmp[3 * v + k];
    }
    return VG_OK;
}

/* The rotation nearest to m by Newton's iteration (Higham 1986), times most of the mean stretch. The identity if m
 * reverses orientation. */
static void drop_shear(double m[9])
{
    double q[9], c[9], det = vgi_cofactors(m, c), first = det;
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(q, m, sizeof q);
    memcpy(m, identity, sizeof identity);
    if (!(det > 1e-12)) return;
    for (int round = 0; round < 20; round++) {
        double change = 0, scale = 1 / cbrt(det), other = 1 / (det * scale);
        for (int k = 0; k < 9; k++) {
            double next = 0.5 * (q[k] * scale + c[k] * other);
            change += fabs(next - q[k]);
            q[k] = next;
        }
        det = vgi_cofactors(q, c);
        if (change < 1e-9) break;
        if (!(det > 0)) return;
    }
    double scale = pow(first, KEPT_STRETCH / 3);
    for (int k = 0; k < 9; k++) m[k] = q[k] * scale;
}

static void drop_shears(void *context, size_t block)
{
    const fit *t = context;
    for (size_t v = block * BLOCK; v < t->m->nv && v < (block + 1) * BLOCK; v++) drop_shear(t->map + 9 * v);
}

static int update_maps(fit *t, vg_err *e)
{
    vgi_parallel(t->in->threads, (t->m->nf + BLOCK - 1) / BLOCK, map_faces, t);
    int r = smooth_maps(t, e);
    if (r == VG_OK) vgi_parallel(t->in->threads, (t->m->nv + BLOCK - 1) / BLOCK, drop_shears, t);
    return r;
}

/* The smoothing operator of the maps: the matrix with first neighbours only. */
static int make_smoother(fit *t, vg_err *e)
{
    const vgi_laplacian *L = &t->L;
    size_t n = 0;
    double strength = MAP_SPAN / t->edge * MAP_SPAN / t->edge;
    vgi_sparse A = {.n = L->nv,
                    .start = vgi_array(L->nv + 1, sizeof(int), e),
                    .row = vgi_array(L->nv + L->first[L->nv], sizeof(int), e),
                    .value = vgi_array(L->nv + L->first[L->nv], sizeof(double), e)};
    int r = A.start && A.row && A.value ? VG_OK : VG_ENOMEM;
    for (size_t v = 0; v < L->nv && r == VG_OK; v++) {
        A.row[n] = (int)v, A.value[n] = IDENTITY_TRUST + strength * L->sum[v];
        for (uint32_t i = t->around.first[v]; i < t->around.first[v + 1]; i++)
            A.value[n] += t->trust[t->around.face[i]];
        n++;
        for (uint32_t i = L->first[v]; i < L->first[v + 1]; i++)
            if (L->to[i] > v) A.row[n] = (int)L->to[i], A.value[n++] = -strength * L->weight[i];
        A.start[v + 1] = (int)n;
    }
    if (r == VG_OK) r = vgi_cholesky_new(&t->smoother, &A, NULL, e);
    if (r == VG_OK) r = vgi_cholesky_factorize(t->smoother, &A, e);
    vgi_sparse_clear(&A);
    return r;
}

/* ---- one round ---- */

static void add_smoothness(fit *t)
{
    const vgi_laplacian *L = &t->L;
    double *wanted = t->tmp;
    for (size_t v = 0; v < L->nv; v++) {
        double *w = wanted + 3 * v;
        vgi_multiply_vector(t->map + 9 * v, t->laplacian + 3 * v, w);
        for (int k = 0; k < 3; k++) w[k] = L->sum[v] > 0 && !vgi_is_hub(L, v) ? w[k] / L->sum[v] : 0;
    }
    vgi_laplacian_apply(L, wanted, t->rhs);
    for (size_t v = 0; v < L->nv; v++) {
        double *to = t->rhs + 3 * v;
        for (uint32_t i = L->first[v]; i < L->first[v + 1]; i++) {
            size_t u = L->to[i];
            double d[3], a[3], b[3];
            vgi_subtract(t->in->rest + 3 * v, t->in->rest + 3 * u, d);
            vgi_multiply_vector(t->map + 9 * v, d, a);
            vgi_multiply_vector(t->map + 9 * u, d, b);
            vgi_add(a, b);
            vgi_add_scaled(to, t->stretch * L->weight[i] * 0.5, a);
        }
    }
}

static void add_pulls(fit *t)
{
    for (size_t v = 0; v < t->m->nv; v++) {
        bool isolated = !(t->L.sum[v] > 0);
        double w = isolated ? 1 : t->pull[v];
        const double *goal = isolated ? t->in->rest + 3 * v : t->goal + 3 * v;
        for (size_t k = 0; k < 3; k++) t->rhs[3 * v + k] += w * goal[k] + (isolated ? 0 : REST * t->x[3 * v + k]);
    }
    for (size_t i = 0; i < t->in->nties; i++) {
        const vgi_tie *tie = &t->in->tie[i];
        for (int a = 0; a < 3; a++)
            vgi_add_scaled(t->rhs + 3 * (size_t)tie->vertex[a], t->tie * tie->weight * tie->share[a], tie->point);
    }
}

static void add_reverse_pulls(fit *t)
{
    for (size_t i = 0; i < t->in->target_mesh->nv; i++) {
        const reverse *p = &t->reverse[i];
        if (!(p->weight > 0)) continue;
        const uint32_t *vert = t->m->vert + t->m->start[p->face];
        for (size_t a = 0; a < t->m->start[p->face + 1] - t->m->start[p->face]; a++)
            vgi_add_scaled(t->rhs + 3 * (size_t)vert[a], p->weight * p->share[a], t->in->target_points + 3 * i);
    }
}

static int solve_round(fit *t, vg_err *e)
{
    int r = update_maps(t, e);
    if (r < 0) return r;
    add_smoothness(t);
    add_pulls(t);
    add_reverse_pulls(t);
    r = vgi_cholesky_solve(t->solver, t->rhs, e);
    if (r == VG_OK) memcpy(t->x, t->rhs, 3 * t->m->nv * sizeof *t->x);
    return r;
}

/* Only border vertices of the source may use a nearest point on the border of the target; interior vertices would be
 * pulled to it from outside. */
static void find_near(void *context, size_t block)
{
    fit *t = context;
    size_t end = (block + 1) * BLOCK < t->m->nv ? (block + 1) * BLOCK : t->m->nv;
    for (size_t v = block * BLOCK; v < end; v++) {
        vgi_hit hit;
        const double *at = t->x + 3 * v, *normal = t->normal + 3 * v;
        double limit = t->limit * t->limit, known = vgi_square(at, t->goal + 3 * v), most = INFINITY;
        /* the previous result is an upper bound if its normal still matches */
        if (t->distance[v] < INFINITY && known < limit)
            most = (known + t->reach * t->reach * vgi_square(normal, t->goal_normal + 3 * v)) * (1 + 1e-9);
        t->distance[v] = INFINITY;
        if (!(t->L.sum[v] > 0) || (t->in->take_vertex && !t->in->take_vertex[v])) continue;
        bool found =
            most < INFINITY && vgi_surface_alike(t->in->target, at, normal, COSINE, t->reach, limit, most, &hit);
        if (!found && !vgi_surface_alike(t->in->target, at, normal, COSINE, t->reach, limit, INFINITY, &hit))
            continue;
        if (hit.border && !t->border[v]) continue;
        t->distance[v] = sqrt(hit.square);
        memcpy(t->goal + 3 * v, hit.point, sizeof hit.point);
        memcpy(t->goal_normal + 3 * v, hit.normal, sizeof hit.normal);
    }
}

static void find_reverse(void *context, size_t block)
{
    fit *t = context;
    const vg_mesh *target = t->in->target_mesh;
    size_t end = (block + 1) * BLOCK < target->nv ? (block + 1) * BLOCK : target->nv;
    for (size_t v = block * BLOCK; v < end; v++) {
        reverse *p = &t->reverse[v];
        const double *at = t->in->target_points + 3 * v, *n = vgi_surface_vertex_normals(t->in->target) + 3 * v;
        double sign = t->in->flipped ? -1 : 1, normal[3] = {sign * n[0], sign * n[1], sign * n[2]};
        vgi_hit hit;
        p->weight = 0;
        if (!vgi_surface_alike(t->now, at, normal, COSINE, t->reach, t->limit * t->limit, INFINITY, &hit) ||
            hit.border)
            continue;
        size_t begin = t->m->start[hit.face], r = t->m->start[hit.face + 1] - begin, first = hit.corner - begin;
        if (r < 3 || r > VGI_SMALL_FACE) continue;
        *p = (reverse){.face = hit.face, .weight = 1 - hit.square / (t->limit * t->limit)};
        for (size_t k = 0; r > 3 && k < r; k++) p->share[k] = hit.u[1] / (double)r;
        p->share[first] += 1 - hit.u[0] - hit.u[1];
        p->share[(first + 1) % r] += hit.u[0];
        if (r == 3) p->share[2] += hit.u[1];
    }
}

/* Pulls from target vertices on source points that the source's own search would miss: tips and concavities. */
static int follow_reverse(fit *t, double weight, vg_err *e)
{
    size_t n = t->in->target_mesh->nv;
    vgi_surface_free(&t->now);
    int r = vgi_surface_of(&t->now, t->m, t->x, t->in->take, e);
    if (r < 0) return r;
    vgi_parallel(t->in->threads, (n + BLOCK - 1) / BLOCK, find_reverse, t);
    for (size_t i = 0; i < n; i++) t->reverse[i].weight *= weight * (double)t->m->nv / (double)n;
    return VG_OK;
}

/* first: choose the pulls again. Later in a round the matrix is fixed, and a vertex that has lost its target keeps
 * its position. */
static void follow_target(fit *t, double weight, bool first)
{
    vgi_vertex_normals(t->m, t->x, t->normal, t->tmp);
    for (size_t i = 0; t->in->flipped && i < 3 * t->m->nv; i++) t->normal[i] = -t->normal[i];
    vgi_parallel(t->in->threads, (t->m->nv + BLOCK - 1) / BLOCK, find_near, t);
    for (size_t v = 0; v < t->m->nv; v++) {
        bool found = t->distance[v] < INFINITY;
        double share = found ? t->distance[v] / t->limit : 1;
        if (first) t->pull[v] = found ? weight * (1 - share * share) : 0;
        else if (!found) memcpy(t->goal + 3 * v, t->x + 3 * v, 3 * sizeof *t->x);
    }
}

static void tell(const fit *t, size_t round, double stiffness)
{
    if (!t->in->step) return;
    vg_register_step s = {.round = round, .rounds = ROUNDS, .stiffness = stiffness};
    for (size_t v = 0; v < t->m->nv; v++) {
        if (!(t->pull[v] > 0) || !(t->distance[v] < INFINITY)) continue;
        s.near++;
        s.mean += t->distance[v];
        s.largest = fmax(s.largest, t->distance[v]);
    }
    if (s.near) s.mean /= (double)s.near;
    t->in->step(t->in->context, &s);
}

/* The limit of the first round: where many ties have brought the surfaces together, a far nearest point is a wrong
 * one, as the other lip's. */
static int first_limit(fit *t, double *limit, vg_err *e)
{
    size_t n = 0;
    double *distance = vgi_array(t->m->nv, sizeof *distance, e);
    *limit = t->limit = FIRST_LIMIT;
    if (!distance) return VG_ENOMEM;
    follow_target(t, 0, true);
    for (size_t v = 0; v < t->m->nv; v++)
        if (t->L.sum[v] > 0 && (!t->in->take_vertex || t->in->take_vertex[v])) distance[n++] = fmin(t->distance[v], FIRST_LIMIT);
    if (n) *limit = fmin(FIRST_LIMIT, fmax(TIED_LIMIT, TIMES_MEDIAN * vgi_median(distance, n)));
    free(distance);
    return VG_OK;
}

static int run_rounds(fit *t, vg_err *e)
{
    int r = VG_OK;
    double widest = FIRST_LIMIT;
    if (t->in->nties) {
        r = factorize_matrix(t, e);
        for (int i = 0; i < TIED_SOLVES && r == VG_OK; i++) r = solve_round(t, e);
        if (r == VG_OK) r = first_limit(t, &widest, e);
    }
    for (int round = 0; round < ROUNDS && r == VG_OK; round++) {
        double progress = round / (double)(ROUNDS - 1), first = FIRST_SPAN / t->edge;
        double span = first > LAST_SPAN ? first * pow(LAST_SPAN / first, progress) : LAST_SPAN;
        double weight = pow(span, -4); /* bending scales with the fourth power of length */
        t->limit = widest * pow(LAST_LIMIT / widest, progress);
        for (int i = 0; i < SOLVES && r == VG_OK; i++) {
            follow_target(t, weight, i == 0);
            if (i == 0) r = follow_reverse(t, weight * progress * progress, e);
            if (i == 0 && r == VG_OK) r = factorize_matrix(t, e);
            if (r == VG_OK) r = solve_round(t, e);
        }
        tell(t, (size_t)round + 1, 1 / weight);
    }
    return r;
}

/* Measure the mean edge length, which sets the scale of smoothing. */
static void measure_edges(fit *t)
{
    const vgi_laplacian *L = &t->L;
    double sum = 0, weight = 0;
    for (size_t v = 0; v < L->nv; v++)
        for (uint32_t i = L->first[v]; i < L->first[v + 1]; i++) {
            sum += L->weight[i] * sqrt(vgi_square(t->in->rest + 3 * v, t->in->rest + 3 * (size_t)L->to[i]));
            weight += L->weight[i];
        }
    t->edge = weight > 0 && sum > 0 ? sum / weight : 1;
    t->stretch = fmin(t->edge / STRETCH * t->edge / STRETCH, MOST_STRETCH);
    t->tie = MARKER * (1 + t->stretch);
}

/* Median difference between the normals of adjacent vertices. */
static int adjacent_normals(const vg_mesh *m, const double *normal, double *median, vg_err *e)
{
    size_t n = 0;
    double *turn = vgi_array(vg_mesh_corners(m), sizeof *turn, e);
    if (!turn) return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            uint32_t next = c + 1 < m->start[f + 1] ? c + 1 : m->start[f];
            turn[n++] = vgi_square(normal + 3 * (size_t)m->vert[c], normal + 3 * (size_t)m->vert[next]);
        }
    *median = n ? sqrt(vgi_median(turn, n)) : 0;
    free(turn);
    return VG_OK;
}

static int measure_reach(fit *t, vg_err *e)
{
    double source = 0, target = 0;
    int r = adjacent_normals(t->m, vgi_surface_vertex_normals(t->in->source_surface), &source, e);
    if (r == VG_OK) r = adjacent_normals(t->in->target_mesh, vgi_surface_vertex_normals(t->in->target), &target, e);
    t->reach = REACH * fmin(1, SMOOTH / fmax(source, target));
    return r;
}

static int prepare_fit(fit *t, vg_err *e)
{
    const vg_mesh *m = t->m;
    size_t nv = m->nv, nf = m->nf;
    int r = vgi_incidence_make(&t->around, m, e);
    if (r == VG_OK) r = vgi_springs_make(&t->L, t->in, e);
    if (r == VG_OK) measure_edges(t);
    if (r == VG_OK) r = measure_reach(t, e);
    if (r == VG_OK) r = vgi_smoothness_make(&t->smooth, &t->L, e);
    if (r == VG_OK) r = vgi_cholesky_new(&t->solver, &t->smooth.matrix, NULL, e);
    double **points[] = {&t->laplacian, &t->x, &t->rhs, &t->normal, &t->tmp, &t->goal, &t->goal_normal};
    for (size_t i = 0; i < sizeof points / sizeof *points; i++)
        if (!(*points[i] = vgi_array(nv, 3 * sizeof(double), e))) return VG_ENOMEM;
    t->inverse = vgi_array(nf, 9 * sizeof(double), e);
    t->h_normal = vgi_array(nf, 3 * sizeof(double), e);
    t->area = vgi_array(nf, sizeof(double), e);
    t->trust = vgi_array(nf, sizeof(double), e);
    t->face_map = vgi_array(nf, 9 * sizeof(double), e);
    t->map = vgi_array(nv, 9 * sizeof(double), e);
    t->border = vgi_array(nv, sizeof *t->border, e);
    t->reverse = vgi_array(t->in->target_mesh->nv, sizeof *t->reverse, e);
    t->pull = vgi_array(nv, sizeof(double), e);
    t->distance = vgi_array(nv, sizeof(double), e);
    if (!t->inverse || !t->h_normal || !t->area || !t->trust || !t->face_map || !t->map || !t->border ||
        !t->reverse || !t->pull || !t->distance || r < 0)
        return r < 0 ? r : VG_ENOMEM;
    for (size_t f = 0; f < nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
            if (vgi_surface_border(t->in->source_surface, c))
                t->border[m->vert[c]] = t->border[m->vert[c + 1 < m->start[f + 1] ? c + 1 : m->start[f]]] = true;
    for (size_t v = 0; v < nv; v++) t->distance[v] = INFINITY;
    for (size_t v = 0; v < nv; v++)
        for (size_t k = 0; k < 9; k += 4) t->map[9 * v + k] = 1;
    memcpy(t->x, t->in->rest, 3 * nv * sizeof *t->x);
    vgi_laplacian_apply(&t->L, t->in->rest, t->laplacian);
    prepare_faces(t);
    return make_smoother(t, e);
}

static void clear_fit(fit *t)
{
    double *arrays[] = {t->laplacian, t->inverse, t->h_normal, t->area, t->trust, t->face_map,    t->map,     t->x,
                        t->rhs,       t->normal,  t->tmp,      t->pull, t->goal,  t->goal_normal, t->distance};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    vgi_laplacian_clear(&t->L);
    vgi_smoothness_clear(&t->smooth);
    free(t->border);
    free(t->reverse);
    vgi_surface_free(&t->now);
    vgi_cholesky_free(&t->solver);
    vgi_cholesky_free(&t->smoother);
    vgi_incidence_clear(&t->around);
}

int vgi_fit(const vgi_fitting *in, double *x, vg_err *e)
{
    fit t = {.in = in, .m = in->source};
    int r = prepare_fit(&t, e);
    if (r == VG_OK) r = run_rounds(&t, e);
    if (r == VG_OK) memcpy(x, t.x, 3 * t.m->nv * sizeof *x);
    clear_fit(&t);
    return r;
}
