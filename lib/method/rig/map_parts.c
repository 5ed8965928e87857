/* map_parts.c: geometry of patches, their hinges, and the collapse of a map into one matrix (T 6.3; MATH 7). Maps are
 * fitted in map.c and evaluated in map_eval.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/map_parts.h"
#include "numeric/vec3.h"
#include "numeric/lapack.h"
#include "numeric/polar.h"
#include "model/rig.h"

#include <math.h>
#include <stdlib.h>

/* ---- shapes ---- */

static int by_number(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

int vgi_shape_make(vgi_shape *s, const vg_mesh *m, const vg_patches *patches, const double *points, vg_err *e)
{
    size_t corners = vg_mesh_corners(m), n = 0;
    *s = (vgi_shape){.n = patches->n};
    uint64_t *all = vgi_array_raw(corners, sizeof *all, e);
    s->first = vgi_array(s->n + 1, sizeof *s->first, e);
    s->centre = vgi_array(3 * s->n, sizeof *s->centre, e);
    s->spread = vgi_array(s->n, sizeof *s->spread, e);
    if (!all || !s->first || !s->centre || !s->spread) goto failed;
    for (size_t f = 0; f < m->nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
            all[c] = (uint64_t)patches->of_face[f] << 32 | m->vert[c];
    if (corners) qsort(all, corners, sizeof *all, by_number);
    for (size_t i = 0; i < corners; i++)
        if (i == 0 || all[i] != all[i - 1]) all[n++] = all[i];
    s->member = vgi_array_raw(n, sizeof *s->member, e);
    s->local = vgi_array_raw(3 * n, sizeof *s->local, e);
    if (!s->member || !s->local) goto failed;
    for (size_t i = 0; i < n; i++) {
        size_t p = (size_t)(all[i] >> 32);
        s->member[i] = (uint32_t)all[i];
        s->first[p + 1] = (uint32_t)i + 1;
        vgi_add(s->centre + 3 * p, points + 3 * (size_t)s->member[i]);
    }
    for (size_t p = 0; p < s->n; p++) {
        if (s->first[p + 1] < s->first[p]) s->first[p + 1] = s->first[p];
        for (size_t k = 0; k < 3 && s->first[p + 1] > s->first[p]; k++)
            s->centre[3 * p + k] /= s->first[p + 1] - s->first[p];
        for (size_t i = s->first[p]; i < s->first[p + 1]; i++)
            for (size_t k = 0; k < 3; k++) {
                double x = points[3 * (size_t)s->member[i] + k] - s->centre[3 * p + k];
                s->local[3 * i + k] = x;
                s->spread[p] += x * x;
            }
    }
    free(all);
    return VG_OK;
failed:
    free(all);
    vgi_shape_clear(s);
    return VG_ENOMEM;
}

void vgi_shape_clear(vgi_shape *s)
{
    free(s->first);
    free(s->member);
    free(s->local);
    free(s->centre);
    free(s->spread);
    *s = (vgi_shape){0};
}

void vgi_shape_measure(const vgi_shape *s, size_t p, const double *pose, vgi_motion *to)
{
    static const double least = 1e-6; /* keeps the scale of a patch that collapses to a point above 0 */
    size_t first = s->first[p], last = s->first[p + 1];
    double m[9] = {0}, mean[3] = {0, 0, 0}, r[9], b = 0;
    const double *o = first < last ? pose + 3 * (size_t)s->member[first] : mean;
    for (size_t i = first; i < last; i++) {
        const double *x = pose + 3 * (size_t)s->member[i], *l = s->local + 3 * i;
        for (int k = 0; k < 3; k++) {
            double d = x[k] - o[k]; /* the local vectors sum to 0, so any point serves as the centre */
            mean[k] += d;
            m[3 * k] += d * l[0], m[3 * k + 1] += d * l[1], m[3 * k + 2] += d * l[2];
        }
    }
    vgi_fit_rotation(m, r);
    for (int i = 0; i < 9; i++) b += r[i] * m[i];
    b = s->spread[p] > 0 ? b / s->spread[p] : 1;
    if (!(b > least)) b = least;
    for (int i = 0; i < 9; i++) to->a[i] = b * r[i];
    to->b2 = b * b;
    const double *c = s->centre + 3 * p;
    for (int k = 0; k < 3; k++) {
        double at = first < last ? o[k] + mean[k] / (double)(last - first) : c[k];
        to->t[k] = at - (to->a[3 * k] * c[0] + to->a[3 * k + 1] * c[1] + to->a[3 * k + 2] * c[2]);
    }
}

/* ---- hinges ---- */

/* Least squares over all hinges: t_i - t_j = A_j c - A_i c, with sum of share (A centre + t) = 0. The solution is
 * linear in the A. */
int vgi_place_by_hinges(const vg_map *m, const double *centre, double *place, vg_err *e)
{
    size_t n = m->n;
    double *l = vgi_array(n, n * sizeof *l, e), trace = 1;
    if (!l) return VG_ENOMEM;
    memset(place, 0, 3 * n * n * sizeof *place);
    for (size_t q = 0; q < m->nhinges; q++) {
        size_t i = m->hinge[2 * q], j = m->hinge[2 * q + 1];
        double w = m->hinge_weight[q];
        l[i * n + i] += w, l[j * n + j] += w, l[i * n + j] -= w, l[j * n + i] -= w;
        trace += 2 * w;
        for (size_t k = 0; k < 3; k++) {
            double c = w * m->hinge_at[3 * q + k];
            place[i * 3 * n + 3 * i + k] -= c, place[i * 3 * n + 3 * j + k] += c;
            place[j * 3 * n + 3 * i + k] += c, place[j * 3 * n + 3 * j + k] -= c;
        }
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            l[i * n + j] += trace * m->share[i] * m->share[j];
            for (size_t k = 0; k < 3; k++)
                place[i * 3 * n + 3 * j + k] -= trace * m->share[i] * m->share[j] * centre[3 * j + k];
        }
        l[i * n + i] += 1e-13 * trace;
    }
    bool ok = vgi_spd_factor(n, l);
    if (ok) vgi_spd_solve(n, l, 3 * n, place);
    free(l);
    return ok ? VG_OK : vg_fail(e, VG_EINPUT, "the patches are not connected");
}

uint32_t *vgi_graph_patches(const vg_head *h, const vg_patches *patches, const vg_graph *g, vg_err *e)
{
    size_t faces = g->faces.nf - g->nlinks;
    uint32_t *of_face = vgi_array(g->faces.nf, sizeof *of_face, e), *of_vertex = vgi_array(g->faces.nv, sizeof *of_vertex, e);
    if (of_face && of_vertex) {
        for (size_t f = faces; f-- > 0;) {
            of_face[f] = patches->of_face[h->selection.chosen ? h->selection.faces[f] : f];
            for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) of_vertex[g->faces.vert[c]] = of_face[f];
        }
        for (size_t f = faces; f < g->faces.nf; f++) of_face[f] = of_vertex[g->faces.vert[g->faces.start[f]]];
    } else {
        free(of_face);
        of_face = NULL;
    }
    free(of_vertex);
    return of_face;
}

int vgi_place_by_bones(const vg_rig *rig, const vg_map *m, double *place, vg_err *e)
{
    size_t n = rig->nbones, width = 3 * n;
    uint32_t *parent = vgi_array(n, sizeof *parent, e);
    double *mean = vgi_array(width, sizeof *mean, e);
    int r = parent && mean ? vgi_rig_parents(rig, parent, e) : VG_ENOMEM;
    for (size_t b = 0; r == VG_OK && b < n; b++) { /* position of the hinge relative to the first one */
        double *row = place + b * width;
        if (b) memcpy(row, place + parent[b] * width, width * sizeof *row);
        else memset(row, 0, width * sizeof *row);
        for (size_t k = 0; b && k < 3; k++)
            row[3 * parent[b] + k] += m->centre[3 * b + k] - m->centre[3 * (size_t)parent[b] + k];
        for (size_t i = 0; i < width; i++) mean[i] += m->share[b] * row[i];
    }
    for (size_t b = 0; r == VG_OK && b < n; b++) {
        for (size_t i = 0; i < width; i++) place[b * width + i] -= mean[i];
        vgi_deduct(place + b * width + 3 * b, m->centre + 3 * b);
    }
    free(parent);
    free(mean);
    return r;
}

/* ---- collapse ---- */

/* The skin weight of bone p at vertex v. */
static double skin_share(const vg_rig *rig, size_t v, size_t p)
{
    double w = 0;
    for (size_t s = VG_SKIN * v; s < VG_SKIN * v + VG_SKIN; s++)
        if (rig->skin_bone[s] == p) w += rig->skin_weight[s];
    return w;
}

/* The vectors produced by transform p alone, when it is the identity. */
static void driven_vectors(const vg_map *m, const vg_graph *g, const uint32_t *of_face, const double *vectors,
                           size_t p, double *wanted)
{
    memset(wanted, 0, 3 * vg_graph_corners(g) * sizeof *wanted);
    if (m->kind == VG_MAP_PATCHES) {
        for (size_t f = 0; f < g->faces.nf; f++)
            for (size_t c = g->faces.start[f]; of_face[f] == p && c < g->faces.start[f + 1]; c++)
                vg_quat_apply(m->corner + 4 * c, vectors + 3 * c, wanted + 3 * c);
        return;
    }
    for (size_t i = 0; i < m->per_corner * (size_t)g->faces.start[g->faces.nf - g->nlinks]; i++) {
        if (m->corner_bone[i] != p) continue;
        double *to = wanted + 3 * (i / m->per_corner), d[3];
        vg_quat_apply(m->corner + 4 * i, vectors + 3 * (i / m->per_corner), d);
        vgi_add(to, d);
    }
}

/* Vectors of the links of a map of bones, between the skinned positions of their ends. at: nv points, or NULL for a
 * unit value of component k. */
static void link_vectors(const vg_rig *rig, const vg_graph *g, size_t p, const double *at, size_t k, double *wanted)
{
    for (size_t f = g->faces.nf - g->nlinks; f < g->faces.nf; f++) {
        const uint32_t *end = g->faces.vert + g->faces.start[f];
        double w[2] = {0.5 * skin_share(rig, end[0], p), 0.5 * skin_share(rig, end[1], p)};
        for (size_t i = at ? 0 : k; i < (at ? 3 : k + 1); i++) {
            double d = at ? w[0] * at[3 * (size_t)end[0] + i] - w[1] * at[3 * (size_t)end[1] + i] : w[0] - w[1];
            wanted[3 * (size_t)g->faces.start[f] + i] = d, wanted[3 * (size_t)g->faces.start[f] + 3 + i] = -d;
        }
    }
}

/* Weight of transform p at held vertex i, and the point that it moves. */
static double hold_of(const vg_map *m, const vgi_map_body *body, size_t i, size_t p, const double **at)
{
    bool bones = m->kind == VG_MAP_BONES;
    *at = bones ? body->reference + 3 * (size_t)m->held[i] : m->held_at + 3 * i;
    return bones ? skin_share(body->rig, m->held[i], p) : m->held_patch[i] == p;
}

/* Vectors and held vertices for a unit value of entry j of A_p, with j = 0 1 2 at once as x y z; or of t of three
 * transforms. */
static void column_input(const vg_map *m, const vgi_map_body *body, const vg_graph *g, const uint32_t *of_face,
                         const double *vectors, size_t column, double *wanted, double *anchors)
{
    const double *at;
    bool bones = m->kind == VG_MAP_BONES;
    if (column < m->n) {
        driven_vectors(m, g, of_face, vectors, column, wanted);
        if (bones) link_vectors(body->rig, g, column, body->reference, 0, wanted);
        for (size_t i = 0; i < m->nheld; i++) {
            double w = hold_of(m, body, i, column, &at);
            vgi_scaled(w, at, anchors + 3 * i);
        }
        return;
    }
    memset(wanted, 0, 3 * vg_graph_corners(g) * sizeof *wanted);
    for (size_t k = 0; k < 3; k++) {
        size_t p = 3 * (column - m->n) + k;
        if (bones && p < m->n) link_vectors(body->rig, g, p, NULL, k, wanted);
        for (size_t i = 0; i < m->nheld; i++) anchors[3 * i + k] = p < m->n ? hold_of(m, body, i, p, &at) : 0;
    }
}

static void store_column(vg_map *m, const vg_graph *g, size_t column, const double *x)
{
    size_t n = m->n;
    for (size_t v = 0; v < g->faces.nv; v++) {
        double *row = m->weights + v * 4 * n;
        if (!g->in_face[v]) continue;
        for (size_t k = 0; k < 3; k++) {
            size_t p = 3 * (column - n) + k;
            if (column < n) row[4 * column + k] = x[3 * v + k];
            else if (p < n) row[4 * p + 3] = x[3 * v + k];
        }
    }
}

void vgi_map_skin_row(vg_map *m, const vgi_map_body *body, size_t v)
{
    const vg_rig *rig = body->rig;
    double *row = m->weights + v * 4 * m->n;
    memset(row, 0, 4 * m->n * sizeof *row);
    for (size_t s = VG_SKIN * v; s < VG_SKIN * v + VG_SKIN; s++) {
        double w = rig->skin_weight[s], *to = row + 4 * (size_t)rig->skin_bone[s];
        vgi_add_scaled(to, w, body->reference + 3 * v);
        to[3] += w;
    }
}

/* A vertex without a face follows the patch with the nearest centre, or its skin. */
static void attach_loose(vg_map *m, const vgi_map_body *body, const vg_graph *g)
{
    for (size_t v = 0; v < g->faces.nv; v++) {
        if (g->in_face[v]) continue;
        if (m->kind == VG_MAP_BONES) {
            vgi_map_skin_row(m, body, v);
            continue;
        }
        const double *x = body->reference + 3 * v;
        size_t best = 0;
        double least = INFINITY;
        for (size_t p = 0; p < m->n; p++) {
            const double *c = m->centre + 3 * p;
            double d = (x[0] - c[0]) * (x[0] - c[0]) + (x[1] - c[1]) * (x[1] - c[1]) + (x[2] - c[2]) * (x[2] - c[2]);
            if (d < least) least = d, best = p;
        }
        double *row = m->weights + v * 4 * m->n + 4 * best;
        row[0] = x[0], row[1] = x[1], row[2] = x[2], row[3] = 1;
    }
}

int vgi_map_collapse(vg_map *m, const vgi_map_body *body, const vg_graph *g, const uint32_t *of_face,
                     const double *vectors, int threads, vg_err *e)
{
    vg_solver *s;
    int r = vg_solver_new(&s, g, m->held, m->nheld, body->reference, VG_WEIGHTS_UNIFORM, threads, e);
    if (r < 0) return r;
    size_t batch = vg_solver_batch(s), columns = m->n + (m->n + 2) / 3, nv = g->faces.nv;
    double *wanted = vgi_array(3 * vg_graph_corners(g), sizeof *wanted, e);
    double *space = vgi_array(batch, (6 * nv + 3 * m->nheld) * sizeof *space, e);
    double **x = vgi_array(4 * batch, sizeof *x, e), **rhs = x ? x + batch : NULL,
           **anchors = x ? x + 2 * batch : NULL;
    free(m->weights);
    m->weights = vgi_array(nv, 4 * m->n * sizeof *m->weights, e);
    if (wanted && space && x && m->weights) {
        static const double nowhere[3] = {0, 0, 0};
        for (size_t i = 0; i < batch; i++) {
            x[i] = space + i * (6 * nv + 3 * m->nheld), rhs[i] = x[i] + 3 * nv, anchors[i] = rhs[i] + 3 * nv;
            x[3 * batch + i] = (double *)(uintptr_t)nowhere;
        }
        for (size_t first = 0; first < columns; first += batch) {
            size_t n = columns - first < batch ? columns - first : batch;
            for (size_t i = 0; i < n; i++) {
                column_input(m, body, g, of_face, vectors, first + i, wanted, anchors[i]);
                vg_solver_load(s, 1, (const double *const *)&wanted, (const double *const *)anchors + i, x + i,
                               rhs + i);
            }
            vg_solver_solve(s, n, (const double *const *)rhs, x, (const double *const *)anchors,
                            (const double *const *)(x + 3 * batch));
            for (size_t i = 0; i < n; i++) store_column(m, g, first + i, x[i]);
        }
        attach_loose(m, body, g);
    } else {
        r = VG_ENOMEM;
    }
    vg_solver_free(&s);
    free(wanted);
    free(space);
    free(x);
    return r;
}
