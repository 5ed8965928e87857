/* map_eval.c: evaluates a map: measures transforms of patches or bones, places them by hinges or joints, interpolates
 * them, and maps them to vertices by one matrix product. Maps are fitted in map.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/vec3.h"
#include "method/rig/map_parts.h"
#include "method/rig/play_kernel.h"
#include "numeric/blas.h"
#include "model/rig.h"

#include <math.h>
#include <stdlib.h>

enum { BLOCK = 32, ROWS = 256, SOME = 8 };
static const double half_turn = 3.14159265358979323846;

struct vg_player {
    const vg_map *m;
    size_t nv;
    int threads;
    bool single;
    vgi_shape shape;    /* patches of the body on which poses are measured */
    vg_inverse_skin *inverse; /* of bones with a skeleton */
    vg_free_bones *free;      /* of bones without a skeleton */
    float *weights_single;
    void *columns;      /* 4n x 3 BLOCK: right factor of the product, float or double */
    void *product;      /* nv x 3 BLOCK */
    double *motion;     /* 12 n: A row by row, then t */
    double *ends;       /* 6 n: error of the hinges at both ends, in the frame of each patch */
    uint32_t *order, *parent; /* the patches in the order of a tree of hinges, parents first; a root is its own
                               * parent */
};

/* Tree of bones: the hierarchy of the skeleton. */
static int plan_bones(vg_player *p, const vg_rig *g, vg_err *e)
{
    int r = vgi_rig_parents(g, p->parent, e);
    for (size_t b = 0; r == VG_OK && b < g->nbones; b++) {
        p->order[b] = (uint32_t)b;
        if (p->parent[b] == VGI_NO_BONE) p->parent[b] = (uint32_t)b;
    }
    return r;
}

/* Tree of patches: breadth first from the largest; patches not reached start a new tree. */
static int plan_patches(vg_player *p, vg_err *e)
{
    const vg_map *m = p->m;
    size_t n = m->n, tail = 0, head = 0;
    bool *seen = vgi_array(n, sizeof *seen, e);
    if (!seen) return VG_ENOMEM;
    while (tail < n) {
        size_t first = n;
        for (size_t i = 0; i < n; i++)
            if (!seen[i] && (first == n || m->share[i] > m->share[first])) first = i;
        seen[first] = true, p->parent[first] = (uint32_t)first, p->order[tail++] = (uint32_t)first;
        for (; head < tail; head++)
            for (size_t j = 0; j < m->nhinges; j++)
                for (int k = 0; k < 2; k++) {
                    uint32_t a = m->hinge[2 * j + (size_t)k], b = m->hinge[2 * j + 1 - (size_t)k];
                    if (a != p->order[head] || seen[b]) continue;
                    seen[b] = true, p->parent[b] = a, p->order[tail++] = b;
                }
    }
    free(seen);
    return VG_OK;
}

int vg_player_new(vg_player **out, const vg_body *body, const vg_map *m, bool single, int threads, vg_err *e)
{
    *out = NULL;
    if (!m->n) return vg_fail(e, VG_EINPUT, "there is no map: make one with vg-fitmap");
    bool bones = m->kind == VG_MAP_BONES;
    if (!bones && body->patches.n != m->n)
        return vg_fail(e, VG_EINPUT, "the map has %zu transforms, the mesh %zu patches", m->n, body->patches.n);
    if (bones && (body->rig.nbones != m->n || !body->rig.skin_bone))
        return vg_fail(e, VG_EINPUT, "the map has %zu transforms, its skeleton %zu bones", m->n, body->rig.nbones);
    if (m->n > INT32_MAX / 4 || body->mesh.nv > INT32_MAX / (3 * BLOCK))
        return vg_fail(e, VG_EINPUT, "a map of %zu transforms and %zu vertices is too large", m->n, body->mesh.nv);
    vg_player *p = *out = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->m = m, p->nv = body->mesh.nv, p->threads = threads, p->single = single;
    size_t size = single ? sizeof(float) : sizeof(double);
    const double *measured = m->home ? m->home : body->reference;
    p->order = vgi_array(m->n, sizeof *p->order, e), p->parent = vgi_array(m->n, sizeof *p->parent, e);
    int r = p->order && p->parent ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) r = bones ? plan_bones(p, &body->rig, e) : plan_patches(p, e);
    if (r == VG_OK && bones && vgi_rig_is_free(&body->rig))
        r = vg_free_bones_new(&p->free, &body->rig, p->nv, measured, threads, e);
    else if (r == VG_OK && bones)
        r = vg_inverse_skin_new(&p->inverse, &body->rig, p->nv, measured, threads, e);
    else if (r == VG_OK)
        r = vgi_shape_make(&p->shape, &body->mesh, &body->patches, measured, e);
    if (r == VG_OK) {
        p->columns = vgi_array(4 * m->n, 3 * BLOCK * size, e);
        p->product = vgi_array(p->nv, 3 * BLOCK * size, e);
        p->motion = vgi_array(12 * m->n, sizeof *p->motion, e);
        p->ends = vgi_array(6 * m->n, sizeof *p->ends, e);
        if (single) p->weights_single = vgi_array(p->nv, 4 * m->n * sizeof(float), e);
        if (!p->columns || !p->product || !p->motion || !p->ends || (single && !p->weights_single)) r = VG_ENOMEM;
    }
    for (size_t i = 0; r == VG_OK && single && i < 4 * m->n * p->nv; i++) p->weights_single[i] = (float)m->weights[i];
    if (r < 0) vg_player_free(out);
    return r;
}

void vg_player_free(vg_player **out)
{
    vg_player *p = *out;
    if (!p) return;
    vgi_shape_clear(&p->shape);
    vg_inverse_skin_free(&p->inverse);
    vg_free_bones_free(&p->free);
    free(p->weights_single);
    free(p->columns);
    free(p->product);
    free(p->motion);
    free(p->ends);
    free(p->order);
    free(p->parent);
    free(p);
    *out = NULL;
}

/* ---- measuring ---- */

typedef struct measuring {
    const vg_player *p;
    const double *const *poses;
    double *const *transforms;
    size_t groups;
} measuring;

static void measure_some(void *context, size_t task)
{
    const measuring *x = context;
    size_t k = task / x->groups, first = task % x->groups * SOME,
           last = first + SOME < x->p->m->n ? first + SOME : x->p->m->n;
    for (size_t i = first; i < last; i++) {
        vgi_motion m;
        double r[9], *to = x->transforms[k] + 7 * i;
        vgi_shape_measure(&x->p->shape, i, x->poses[k], &m);
        double b = sqrt(m.b2), root = sqrt(b);
        for (int q = 0; q < 9; q++) r[q] = m.a[q] / b;
        vg_quat_from_matrix(r, to);
        for (int q = 0; q < 4; q++) to[q] *= root;
        memcpy(to + 4, m.t, sizeof m.t);
    }
}

void vg_player_measure(vg_player *p, size_t n, const double *const *poses, double *const *transforms)
{
    if (p->inverse || p->free) {
        if (p->free) vg_free_bones_fit(p->free, n, poses, transforms);
        else vg_inverse_skin_fit(p->inverse, n, poses, transforms);
        return;
    }
    measuring x = {p, poses, transforms, (p->m->n + SOME - 1) / SOME};
    vgi_parallel(n * x.groups < 4 ? 1 : p->threads, n * x.groups, measure_some, &x);
}

/* ---- placing ---- */

static void matrix_of(const double q[4], double a[9])
{
    double s = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], root = sqrt(s);
    const double unit[4] = {q[0] / root, q[1] / root, q[2] / root, q[3] / root};
    vg_quat_matrix(unit, a);
    for (int i = 0; i < 9; i++) a[i] *= s;
}

static void read_motion(vg_player *p, const double *transforms)
{
    for (size_t i = 0; i < p->m->n; i++) {
        matrix_of(transforms + 7 * i, p->motion + 12 * i);
        memcpy(p->motion + 12 * i + 9, transforms + 7 * i + 4, 3 * sizeof(double));
    }
}

static void root_of(const vg_player *p, const double *centre, double root[3])
{
    root[0] = root[1] = root[2] = 0;
    for (size_t i = 0; i < p->m->n; i++) {
        double at[3];
        vgi_multiply_vector(p->motion + 12 * i, centre + 3 * i, at);
        vgi_add(at, p->motion + 12 * i + 9);
        vgi_add_scaled(root, p->m->share[i], at);
    }
}

/* Position of patch i given by the hinges, relative to the root. */
static void hinge_position(const vg_player *p, size_t i, double t[3])
{
    size_t n = p->m->n;
    const double *g = p->m->place + 3 * n * i;
    t[0] = t[1] = t[2] = 0;
    for (size_t j = 0; j < n; j++) {
        double part[3];
        vgi_multiply_vector(p->motion + 12 * j, g + 3 * j, part);
        vgi_add(t, part);
    }
}

void vg_player_place(vg_player *p, double *transforms)
{
    double root[3], t[3];
    if (p->m->has_home) return; /* vg_player_pose does this in any case */
    read_motion(p, transforms);
    root_of(p, p->m->centre, root);
    for (size_t i = 0; i < p->m->n; i++) {
        hinge_position(p, i, t);
        vgi_sum(t, root, transforms + 7 * i + 4);
    }
}

/* ---- interpolation ---- */

/* Error of the hinges in a pose, in the frame of each patch, and the root. */
static void remember_end(vg_player *p, const double *transforms, double *miss, double root[3])
{
    read_motion(p, transforms);
    root_of(p, p->m->home_centre, root);
    for (size_t i = 0; i < p->m->n; i++) {
        const double *a = p->motion + 12 * i;
        double t[3] = {0, 0, 0}, d[3];
        if (!p->m->has_home) hinge_position(p, i, t);
        vgi_subtract(a + 9, root, d), vgi_deduct(d, t);
        vgi_transposed_vector(a, d, miss + 3 * i);
        vgi_divide(miss + 3 * i, vgi_dot(a, a));
    }
}

/* Logarithm of b a^-1, on the branch nearest to the neighbour's. l[1..3] is half the angle, so branches differ by
 * half turns. */
static void log_difference(const double *a, const double *b, const double *neighbour, double l[4])
{
    double s = a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3], q[4];
    const double back[4] = {a[0] / s, -a[1] / s, -a[2] / s, -a[3] / s};
    vg_quat_multiply(b, back, q);
    if (q[0] < 0)
        for (int k = 0; k < 4; k++) q[k] = -q[k];
    vg_quat_log(q, l);
    if (!neighbour) return;
    double angle = vgi_length(l + 1), far = vgi_length(neighbour + 1), axis[3] = {0, 0, 0};
    if (angle > 1e-9) vgi_divided(l + 1, angle, axis);
    else if (far > 0) vgi_divided(neighbour + 1, far, axis);
    double turns = round((vgi_dot(axis, neighbour + 1) - angle) / half_turn);
    vgi_add_scaled(l + 1, turns * half_turn, axis);
}

void vg_player_between(vg_player *p, const double *a, const double *b, double t, double *out)
{
    size_t n = p->m->n;
    double root_a[3], root_b[3], *logs = p->motion; /* free until read_motion below; 4 numbers of 12 */
    remember_end(p, a, p->ends, root_a);
    remember_end(p, b, p->ends + 3 * n, root_b);
    for (size_t k = 0; k < n; k++) {
        size_t i = p->order[k], up = p->parent[i];
        double l[4], q[4];
        log_difference(a + 7 * i, b + 7 * i, up == i ? NULL : logs + 12 * up, logs + 12 * i);
        for (int j = 0; j < 4; j++) l[j] = t * logs[12 * i + (size_t)j];
        vg_quat_exp(l, q);
        vg_quat_multiply(q, a + 7 * i, out + 7 * i);
    }
    read_motion(p, out);
    for (size_t i = 0; i < n; i++) {
        double at[3] = {0, 0, 0}, miss[3], turned[3];
        if (!p->m->has_home) hinge_position(p, i, at);
        vgi_mix(p->ends + 3 * i, p->ends + 3 * (n + i), t, miss);
        vgi_multiply_vector(p->motion + 12 * i, miss, turned);
        for (size_t k = 0; k < 3; k++)
            out[7 * i + 4 + k] = at[k] + root_a[k] + t * (root_b[k] - root_a[k]) + turned[k];
    }
}

/* ---- the matrix product ---- */

typedef struct playing {
    const vg_player *p;
    size_t n;
    double roots[BLOCK][3];
    double *const *vertices;
} playing;

static void fill_columns(vg_player *p, playing *x, size_t k, const double *transforms)
{
    const vg_map *m = p->m;
    size_t n = m->n, stride = 3 * x->n;
    double root[3], *to = x->roots[k];
    read_motion(p, transforms);
    root_of(p, m->home_centre, root);
    for (int c = 0; c < 3; c++) {
        double home = 0, here = 0;
        for (size_t i = 0; i < n; i++) {
            home += m->share[i] * m->home_centre[3 * i + (size_t)c];
            here += m->share[i] * m->centre[3 * i + (size_t)c];
        }
        to[c] = m->has_home ? here + m->size * (root[c] - home) : root[c];
    }
    for (size_t i = 0; i < n; i++) {
        const double *a = p->motion + 12 * i;
        double t[3] = {a[9] - root[0], a[10] - root[1], a[11] - root[2]};
        if (m->has_home) hinge_position(p, i, t);
        for (size_t c = 0; c < 3; c++)
            for (size_t j = 0; j < 4; j++) {
                double value = j < 3 ? a[3 * c + j] : t[c];
                size_t at = (4 * i + j) * stride + 3 * k + c;
                if (p->single) ((float *)p->columns)[at] = (float)value;
                else ((double *)p->columns)[at] = value;
            }
    }
}

static void play_rows(void *context, size_t task)
{
    const playing *x = context;
    const vg_player *p = x->p;
    size_t first = task * ROWS, rows = p->nv - first < ROWS ? p->nv - first : ROWS, width = 4 * p->m->n,
           stride = 3 * x->n;
    if (p->single) {
        float *c = (float *)p->product + first * stride;
        vgi_product_single(rows, stride, width, p->weights_single + first * width, width, p->columns, stride, c,
                           stride);
        vgi_play_kernel_now()->spread_single(c, rows, x->n, x->roots, x->vertices, first);
    } else {
        double *c = (double *)p->product + first * stride;
        vgi_product_double(rows, stride, width, p->m->weights + first * width, width, p->columns, stride, c, stride);
        vgi_play_kernel_now()->spread_double(c, rows, x->n, x->roots, x->vertices, first);
    }
}

void vg_player_pose(vg_player *p, size_t n, const double *const *transforms, double *const *vertices)
{
    vgi_blas_alone();
    for (size_t first = 0; first < n; first += BLOCK) {
        playing x = {.p = p, .n = n - first < BLOCK ? n - first : BLOCK, .vertices = vertices + first};
        for (size_t k = 0; k < x.n; k++) fill_columns(p, &x, k, transforms[first + k]);
        vgi_parallel(p->threads, (p->nv + ROWS - 1) / ROWS, play_rows, &x);
    }
    vgi_blas_shared();
}
