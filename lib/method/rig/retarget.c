/* retarget.c: a map for another body of the same faces (T 6.5), or for a body between two (T 6.6). Fitting is in
 * map.c (patches) and envelope.c (bones).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/vec3.h"
#include "method/rig/map_parts.h"
#include "method/patches/pieces.h"
#include "numeric/blas.h"
#include "model/rig.h"

#include <math.h>
#include <stdlib.h>

/* The body between two: vectors rotated and scaled along geodesics, then reconstructed; its root is on the line
 * between both. */
static int morph_body(const vg_head *h, const vg_graph *g, const double *target, double morph, double *body,
                      int threads, vg_err *e)
{
    size_t corners = vg_graph_corners(g), nv = g->nv;
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
                for (size_t k = 0; k < 3; k++) x[k] += morph * (y[k] - x[k]);
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
        for (int k = 0; k < 3; k++) root[k] = roots[0][k] + morph * (roots[1][k] - roots[0][k]);
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

/* Of each hinge, on one body: the mean of the vertices that both its patches have. */
static int meeting_points(const vg_map *m, const vg_graph *g, const uint32_t *of_face, const double *body,
                          double *mean, vg_err *e)
{
    return vgi_shared_points(&g->faces, of_face, m->hinge, m->nhinges, body, mean, e);
}

/* Hinges, centres and held points go with the body; corrections of what hinges say grow with it. */
static int move_points(vg_head *h, const vg_graph *g, const uint32_t *of_face, const double *body, double ratio,
                       vg_err *e)
{
    vg_map *m = &h->map;
    size_t n = m->n;
    vgi_shape shape = {0};
    double *before = vgi_array(n, 3 * n * sizeof *before, e), *after = vgi_array(n, 3 * n * sizeof *after, e);
    double *old = vgi_array(3 * m->nhinges, sizeof *old, e), *now = vgi_array(3 * m->nhinges, sizeof *now, e);
    vgi_blas_alone();
    int r = before && after && old && now ? vgi_place_by_hinges(m, m->centre, before, e) : VG_ENOMEM;
    if (r == VG_OK) r = meeting_points(m, g, of_face, h->body.reference, old, e);
    if (r == VG_OK) r = meeting_points(m, g, of_face, body, now, e);
    if (r == VG_OK) r = vgi_shape_make(&shape, &h->body.mesh, &h->body.patches, body, e);
    if (r == VG_OK) {
        for (size_t i = 0; i < 3 * m->nhinges; i++) m->hinge_at[i] = now[i] + ratio * (m->hinge_at[i] - old[i]);
        for (size_t i = 0; i < m->nheld; i++)
            for (size_t k = 0; k < 3; k++) {
                size_t x = 3 * (size_t)m->held[i] + k;
                m->held_at[3 * i + k] = body[x] + ratio * (m->held_at[3 * i + k] - h->body.reference[x]);
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

/* A joint follows the vertices around it: those shared by its bone and the parent, or else its own. Near vertices
 * count most, and the joint keeps its position relative to them under scaling. */
static void move_joint(const vg_rig *r, size_t nv, const double *from, const double *to, uint32_t bone,
                       uint32_t above, double *at)
{
    static const double soft = 1e-4; /* of D squared */
    double d = vg_diagonal(from, nv), before[3] = {0, 0, 0}, after[3] = {0, 0, 0}, sum = 0, spread[2] = {0, 0};
    double shared = 0, own = 0;
    for (int round = 0; round < 3; round++) { /* are there shared vertices; their mean; their extent */
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
                for (int k = 0; k < 3; k++) before[k] += pull * x[k], after[k] += pull * y[k];
                continue;
            }
            for (int k = 0; k < 3; k++) {
                spread[0] += pull * (x[k] - before[k]) * (x[k] - before[k]);
                spread[1] += pull * (y[k] - after[k]) * (y[k] - after[k]);
            }
        }
        for (int k = 0; k < 3 && round == 1 && sum > 0; k++) before[k] /= sum, after[k] /= sum;
    }
    if (!(sum > 0)) return;
    double grown = spread[0] > 0 ? sqrt(spread[1] / spread[0]) : 1;
    for (int k = 0; k < 3; k++) at[k] = after[k] + grown * (at[k] - before[k]);
}

/* The joints, and the lengths of the bones between them. */
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
        for (size_t k = 0; k < 3; k++) d[k] = r->at[3 * j + k] - r->at[3 * (size_t)joint->parent + k];
        vg_quat_apply(back, d, joint->offset);
    }
    free(mover);
    return VG_OK;
}

static int move_bones(vg_head *h, const double *body, vg_err *e)
{
    vg_map *m = &h->map;
    int r = move_joints(&h->body.rig, m->nv, h->body.reference, body, e);
    if (r < 0) return r;
    for (size_t b = 0; b < m->n; b++)
        for (size_t k = 0; k < 3; k++)
            m->centre[3 * b + k] = m->home_centre[3 * b + k] = h->body.rig.at[3 * (size_t)h->body.rig.bone[b] + k];
    return vgi_place_by_bones(&h->body.rig, m, m->place, e);
}

/* Regression terms scale with the body. Those of a bone are relative to its joint, so that their addition to the
 * share of a bone is kept. */
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

/* ---- the whole ---- */

/* The rows of skinning alone, for a map without corners. */
static void skin_rows(vg_head *h)
{
    for (size_t v = 0; v < h->map.nv; v++) vgi_map_skin_row(h, v);
}

int vg_map_retarget(vg_head *h, const double *target, double morph, int threads, vg_err *e)
{
    vg_map *m = &h->map;
    vg_graph *g = NULL;
    uint32_t *of_face = NULL;
    size_t nv = h->body.mesh.nv, size = nv * 4 * m->n;
    bool bones = m->kind == VG_MAP_BONES, corners = m->ncorners > 0;
    if (!m->n || (bones ? h->body.rig.nbones : h->body.patches.n) != m->n)
        return vg_fail(e, VG_EINPUT, "there is no map to retarget");
    double *body = vgi_copy_array(target, 3 * nv, sizeof *body, e), *vectors = NULL, *home = NULL, *skin = NULL,
           ratio = 1;
    double *joints = vgi_copy_array(m->centre, 3 * m->n, sizeof *joints, e);
    int r = body && joints ? vg_head_graph(&g, h, e) : VG_ENOMEM;
    if (r == VG_OK && corners && m->ncorners != vg_graph_corners(g))
        r = vg_fail(e, VG_EINPUT, "the map does not say how its corners turn");
    if (r == VG_OK && !bones && !(of_face = vgi_graph_patches(h, g, e))) r = VG_ENOMEM;
    if (r == VG_OK && !(vectors = vgi_array(3 * vg_graph_corners(g), sizeof *vectors, e))) r = VG_ENOMEM;
    if (r == VG_OK && corners && !(skin = vgi_copy_array(m->weights, size, sizeof *skin, e))) r = VG_ENOMEM;
    if (r == VG_OK && corners) { /* what regression added to the reconstruction */
        vg_graph_vectors(g, h->body.reference, vectors);
        r = vgi_map_collapse(h, g, of_face, vectors, threads, e);
        for (size_t i = 0; r == VG_OK && i < size; i++) skin[i] -= m->weights[i];
    }
    if (r == VG_OK && !bones && !m->has_home && !(home = vgi_copy_array(h->body.reference, 3 * nv, sizeof *home, e)))
        r = VG_ENOMEM;
    if (r == VG_OK && morph != 1) r = morph_body(h, g, target, morph, body, threads, e);
    if (r == VG_OK) {
        double before = vg_diagonal(h->body.reference, nv), after = vg_diagonal(body, nv);
        ratio = after / before;
        if (!(before > 0 && after > 0)) r = vg_fail(e, VG_EINPUT, "a body without extent cannot be retargeted");
        else if (!(isfinite(ratio * m->size) && ratio * m->size > 0))
            r = vg_fail(e, VG_EINPUT, "the new body is too large or too small beside that of the map");
        else r = bones ? move_bones(h, body, e) : move_points(h, g, of_face, body, ratio, e);
    }
    if (r == VG_OK) {
        if (home) m->home = home, m->has_home = true, home = NULL;
        memcpy(h->body.reference, body, 3 * nv * sizeof *body);
        vg_graph_vectors(g, body, vectors);
        if (corners) r = vgi_map_collapse(h, g, of_face, vectors, threads, e);
        else skin_rows(h);
        if (r == VG_OK && corners) add_regression(m, skin, joints, ratio);
    }
    vg_graph_free(&g);
    free(of_face);
    free(skin);
    free(vectors);
    free(body);
    free(joints);
    free(home);
    return r;
}
