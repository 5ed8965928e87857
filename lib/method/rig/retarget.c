/* retarget.c: adapts a map to another body with the same faces (T 6.5), or to a body between two (T 6.6). Maps are
 * fitted in map.c (patches) and envelope.c (bones).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/vec3.h"
#include "method/rig/map_parts.h"
#include "method/patches/pieces.h"
#include "numeric/blas.h"
#include "model/rig.h"

#include <math.h>
#include <stdlib.h>

/* The body between two: vectors are rotated and scaled along geodesics, then reconstructed. Its root is on the line
 * between both roots. */
static int morph_body(const vg_head *h, const vg_graph *g, const double *target, double morph, double *body,
                      int threads, vg_err *e)
{
    size_t corners = vg_graph_corners(g), nv = g->faces.nv;
    vg_solver *s = NULL;
    double *a = vgi_array(3 * corners, sizeof *a, e), *b = vgi_array(3 * corners, sizeof *b, e);
    double *rhs = vgi_array(3 * nv, sizeof *rhs, e), roots[2][3], root[3];
    int r = a && b && rhs ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < 3 * nv; i++)
        body[i] = h->body.reference[i] + morph * (target[i] - h->body.reference[i]);
    if (r == VG_OK) r = vg_solver_new(&s, g, NULL, 0, body, VG_WEIGHTS_UNIFORM, threads, e);
    if (r == VG_OK) {
        vg_graph_vectors(g, h->body.reference, a);
        vg_graph_vectors(g, target, b);
        for (size_t c = 0; c < corners; c++) {
            double *x = a + 3 * c, *y = b + 3 * c, q[4], l[4];
            if (!(vgi_dot(x, x) > 0 && vgi_dot(y, y) > 0)) { /* no direction: interpolate linearly */
                vgi_mix(x, y, morph, x);
                continue;
            }
            vg_quat_between(x, y, q);
            vg_quat_log(q, l);
            for (int k = 0; k < 4; k++) l[k] *= morph;
            vg_quat_exp(l, q);
            vg_quat_apply(q, x, x);
        }
        vg_graph_root(g, h->body.reference, roots[0]);
        vg_graph_root(g, target, roots[1]);
        vgi_mix(roots[0], roots[1], morph, root);
        const double *rhs_list[1] = {rhs}, *root_list[1] = {root};
        double *body_list[1] = {body};
        vg_solver_load(s, 1, (const double *const *)&a, NULL, body_list, &rhs);
        vg_solver_solve(s, 1, rhs_list, body_list, NULL, root_list);
    }
    vg_solver_free(&s);
    free(a);
    free(b);
    free(rhs);
    return r;
}

/* Per hinge, on one body: the mean of the vertices that both patches share. */
static int meeting_points(const vg_map *m, const vg_graph *g, const uint32_t *of_face, const double *body,
                          double *mean, vg_err *e)
{
    return vgi_shared_points(&g->faces, of_face, m->hinge, m->nhinges, body, mean, e);
}

/* Move hinges, centres and held points with the body, and scale the corrections of the hinges with it. */
static int move_points(vg_map *m, const vg_body *b, const vg_graph *g, const uint32_t *of_face, const double *body,
                       double ratio, vg_err *e)
{
    size_t n = m->n;
    vgi_shape shape = {0};
    double *before = vgi_array(n, 3 * n * sizeof *before, e), *after = vgi_array(n, 3 * n * sizeof *after, e);
    double *old = vgi_array(3 * m->nhinges, sizeof *old, e), *now = vgi_array(3 * m->nhinges, sizeof *now, e);
    vgi_blas_alone();
    int r = before && after && old && now ? vgi_place_by_hinges(m, m->centre, before, e) : VG_ENOMEM;
    if (r == VG_OK) r = meeting_points(m, g, of_face, b->reference, old, e);
    if (r == VG_OK) r = meeting_points(m, g, of_face, body, now, e);
    if (r == VG_OK) r = vgi_shape_make(&shape, &b->mesh, &b->patches, body, e);
    if (r == VG_OK) {
        for (size_t i = 0; i < 3 * m->nhinges; i++) m->hinge_at[i] = now[i] + ratio * (m->hinge_at[i] - old[i]);
        for (size_t i = 0; i < m->nheld; i++)
            for (size_t k = 0; k < 3; k++) {
                size_t x = 3 * (size_t)m->held[i] + k;
                m->held_at[3 * i + k] = body[x] + ratio * (m->held_at[3 * i + k] - b->reference[x]);
            }
        r = vgi_place_by_hinges(m, shape.centre, after, e);
    }
    vgi_blas_shared();
    if (r == VG_OK) {
        memcpy(m->centre, shape.centre, 3 * n * sizeof *m->centre);
        for (size_t i = 0; i < 3 * n * n; i++) m->place[i] = after[i] + ratio * (m->place[i] - before[i]);
        m->size *= ratio;
    }
    vgi_shape_clear(&shape);
    free(before);
    free(after);
    free(old);
    free(now);
    return r;
}

/* ---- joints of a rig ---- */

/* A joint follows the vertices around it: those shared by its bone and the parent, or else those of its bone. Near
 * vertices have the largest weight, and the joint keeps its position relative to them under scaling. */
static void move_joint(const vg_rig *r, size_t nv, const double *from, const double *to, uint32_t bone,
                       uint32_t above, double *at)
{
    static const double soft = 1e-4; /* relative to D squared */
    double d = vg_diagonal(from, nv), before[3] = {0, 0, 0}, after[3] = {0, 0, 0}, sum = 0, spread[2] = {0, 0};
    double shared = 0, own = 0;
    for (int round = 0; round < 3; round++) { /* whether there are shared vertices; their mean; their extent */
        for (size_t v = 0; v < nv; v++) {
            double w[2] = {0, 0}, near, pull;
            for (size_t s = VG_SKIN * v; s < VG_SKIN * v + VG_SKIN; s++)
                for (int i = 0; i < 2; i++)
                    if (r->skin_bone[s] == (i ? above : bone)) w[i] += r->skin_weight[s];
            if (round == 0) {
                shared += w[0] * w[1], own += w[0];
                continue;
            }
            const double *x = from + 3 * v, *y = to + 3 * v;
            const double gap[3] = {x[0] - at[0], x[1] - at[1], x[2] - at[2]};
            near = vgi_dot(gap, gap) + soft * d * d;
            pull = (shared > 1e-3 ? w[0] * w[1] : own > 1e-3 ? w[0] : 1) / (near * near);
            if (round == 1) {
                sum += pull;
                vgi_add_scaled(before, pull, x), vgi_add_scaled(after, pull, y);
                continue;
            }
            for (int k = 0; k < 3; k++) {
                spread[0] += pull * (x[k] - before[k]) * (x[k] - before[k]);
                spread[1] += pull * (y[k] - after[k]) * (y[k] - after[k]);
            }
        }
        if (round == 1 && sum > 0) vgi_divide(before, sum), vgi_divide(after, sum);
    }
    if (!(sum > 0)) return;
    double grown = spread[0] > 0 ? sqrt(spread[1] / spread[0]) : 1;
    vgi_deduct(at, before), vgi_scale(at, grown), vgi_add(at, after);
}

/* Move the joints, and set the lengths of the bones between them. */
static int move_joints(vg_rig *r, size_t nv, const double *from, const double *to, vg_err *e)
{
    size_t n = r->skeleton.njoints;
    uint32_t *mover = vgi_array(n, sizeof *mover, e);
    if (!mover) return VG_ENOMEM;
    vgi_rig_movers(r, mover);
    for (size_t j = 0; j < n; j++) {
        uint32_t parent = r->skeleton.joints[j].parent;
        move_joint(r, nv, from, to, mover[j], parent == UINT32_MAX ? VGI_NO_BONE : mover[parent], r->at + 3 * j);
    }
    for (size_t j = 0; j < n; j++) {
        vg_joint *joint = &r->skeleton.joints[j];
        if (joint->parent == UINT32_MAX) continue;
        const double *q = r->turn + 4 * (size_t)joint->parent, back[4] = {q[0], -q[1], -q[2], -q[3]};
        double d[3];
        vgi_subtract(r->at + 3 * j, r->at + 3 * (size_t)joint->parent, d);
        vg_quat_apply(back, d, joint->offset);
    }
    free(mover);
    return VG_OK;
}

static int move_bones(vg_map *m, vg_rig *rig, const double *from, const double *to, vg_err *e)
{
    int r = move_joints(rig, m->nv, from, to, e);
    if (r < 0) return r;
    for (size_t b = 0; b < m->n; b++)
        for (size_t k = 0; k < 3; k++)
            m->centre[3 * b + k] = m->home_centre[3 * b + k] = rig->at[3 * (size_t)rig->bone[b] + k];
    return vgi_place_by_bones(rig, m, m->place, e);
}

/* Scale the regression terms with the body. Those of a bone are relative to its joint, so that their sum stays in the
 * share of the bone. */
static void add_regression(const vg_map *m, const double *skin, const double *joints_before, double ratio)
{
    for (size_t i = 0; i < m->nv * m->n; i++) {
        double *to = m->weights + 4 * i, more = skin[4 * i + 3];
        bool bones = m->kind == VG_MAP_BONES;
        for (size_t k = 0; k < 3; k++) {
            double before = bones ? more * joints_before[3 * (i % m->n) + k] : 0,
                   after = bones ? more * m->centre[3 * (i % m->n) + k] : 0;
            to[k] += ratio * (skin[4 * i + k] - before) + after;
        }
        to[3] += bones ? more : ratio * more;
    }
}

/* ---- a whole map ---- */

typedef struct retargeting {
    const vg_head *h; /* with the original map */
    vg_map *m;        /* the result, first a copy of the original, with its rig */
    vg_rig *rig;
    double *body;     /* nv points: the new body */
    double ratio;     /* size of the new body relative to the old one */
    int threads;
    vg_graph *g;
    uint32_t *of_face;
    double *vectors;  /* 3 per corner: workspace */
    double *skin;     /* what regression added to the reconstruction, for maps with corners */
} retargeting;

static int collapse(const retargeting *x, const vgi_map_body *body, vg_err *e)
{
    vg_graph_vectors(x->g, body->reference, x->vectors);
    return vgi_map_collapse(x->m, body, x->g, x->of_face, x->vectors, x->threads, e);
}

static int check_map(const vg_head *h, vg_err *e)
{
    bool bones = h->map.kind == VG_MAP_BONES;
    return h->map.n && (bones ? h->body.rig.nbones : h->body.patches.n) == h->map.n
               ? VG_OK
               : vg_fail(e, VG_EINPUT, "there is no map to retarget");
}

static int prepare_retargeting(retargeting *x, vg_err *e)
{
    const vg_head *h = x->h;
    int r = vg_head_graph(&x->g, h, e);
    if (r == VG_OK && h->map.ncorners && h->map.ncorners != vg_graph_corners(x->g))
        r = vg_fail(e, VG_EINPUT, "the map has no rotations of its corners");
    if (r == VG_OK) r = vg_map_copy(x->m, &h->map, e);
    if (r == VG_OK) r = vg_rig_copy(x->rig, &h->body.rig, h->body.mesh.nv, e);
    if (r == VG_OK && h->map.kind == VG_MAP_PATCHES && !(x->of_face = vgi_graph_patches(h, &h->body.patches, x->g, e)))
        r = VG_ENOMEM;
    if (r == VG_OK && !(x->vectors = vgi_array(3 * vg_graph_corners(x->g), sizeof *x->vectors, e))) r = VG_ENOMEM;
    return r;
}

/* What regression added to the reconstruction. */
static int keep_regression(retargeting *x, vg_err *e)
{
    const vg_head *h = x->h;
    const vgi_map_body before = {h->body.reference, &h->body.rig};
    size_t size = h->body.mesh.nv * 4 * h->map.n;
    if (!h->map.ncorners) return VG_OK;
    if (!(x->skin = vgi_copy_array(h->map.weights, size, sizeof *x->skin, e))) return VG_ENOMEM;
    int r = collapse(x, &before, e);
    for (size_t i = 0; r == VG_OK && i < size; i++) x->skin[i] -= x->m->weights[i];
    return r;
}

/* Patches are measured on the body to which the map was fitted. */
static int keep_home(retargeting *x, vg_err *e)
{
    const vg_body *b = &x->h->body;
    if (x->m->kind == VG_MAP_BONES || x->m->has_home) return VG_OK;
    if (!(x->m->home = vgi_copy_array(b->reference, 3 * b->mesh.nv, sizeof *x->m->home, e))) return VG_ENOMEM;
    x->m->has_home = true;
    return VG_OK;
}

static int move_map(retargeting *x, vg_err *e)
{
    const vg_body *from = &x->h->body;
    double before = vg_diagonal(from->reference, from->mesh.nv), after = vg_diagonal(x->body, from->mesh.nv);
    x->ratio = after / before;
    if (!(before > 0 && after > 0)) return vg_fail(e, VG_EINPUT, "a body without extent cannot be retargeted");
    if (!(isfinite(x->ratio * x->m->size) && x->ratio * x->m->size > 0))
        return vg_fail(e, VG_EINPUT, "the new body is too large or too small relative to that of the map");
    return x->m->kind == VG_MAP_BONES ? move_bones(x->m, x->rig, from->reference, x->body, e)
                                      : move_points(x->m, from, x->g, x->of_face, x->body, x->ratio, e);
}

static int find_weights(retargeting *x, vg_err *e)
{
    const vgi_map_body body = {x->body, x->rig};
    for (size_t v = 0; !x->m->ncorners && v < x->m->nv; v++) vgi_map_skin_row(x->m, &body, v);
    if (!x->m->ncorners) return VG_OK;
    int r = collapse(x, &body, e);
    if (r == VG_OK) add_regression(x->m, x->skin, x->h->map.centre, x->ratio);
    return r;
}

int vg_map_retarget(const vg_head *h, const double *target, double morph, int threads, vg_map *map, vg_rig *rig,
                    double *reference, vg_err *e)
{
    size_t nv = h->body.mesh.nv;
    retargeting x = {.h = h, .m = map, .rig = rig, .threads = threads};
    *map = (vg_map){0}, *rig = (vg_rig){0};
    int r = check_map(h, e);
    if (r == VG_OK && !(x.body = vgi_copy_array(target, 3 * nv, sizeof *x.body, e))) r = VG_ENOMEM;
    if (r == VG_OK) r = prepare_retargeting(&x, e);
    if (r == VG_OK) r = keep_regression(&x, e);
    if (r == VG_OK && morph != 1) r = morph_body(h, x.g, target, morph, x.body, threads, e);
    if (r == VG_OK) r = move_map(&x, e);
    if (r == VG_OK) r = keep_home(&x, e);
    if (r == VG_OK) r = find_weights(&x, e);
    if (r == VG_OK && nv) memcpy(reference, x.body, 3 * nv * sizeof *reference);
    if (r < 0) vg_map_clear(map), vg_rig_clear(rig);
    vg_graph_free(&x.g);
    free(x.of_face);
    free(x.vectors);
    free(x.skin);
    free(x.body);
    return r;
}
