/* gltf_normals.c: normals for a mesh without any, because glTF viewers would show it faceted: the mean of the faces
 * around a vertex, weighted by their angles there, within a smooth surface. The normals of a character, made by its
 * artist, are in gltf_character.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_normals.h"
#include "io/smoothing.h"
#include "model/incidence.h"
#include "numeric/face.h"
#include "numeric/sets.h"

#include <math.h>
#include <stdlib.h>

/* The unit normal of a possibly bent face; zero if it has no area. */
static void face_normal(const vg_mesh *m, size_t f, const double *pose, double n[3])
{
    vgi_face_area(pose, m->vert + m->start[f], vgi_face_size(m, f), n);
    vgi_make_unit(n);
}

/* ---- smooth surfaces ---- */

static void unite_corners(uint32_t *parent, const vgi_smoothing *k)
{
    for (size_t i = 1; i < k->nsides; i++) {
        const vgi_side *s = &k->sides[i - 1], *t = &k->sides[i];
        if (!vgi_on_one_edge(s, t) || !vgi_is_smooth(k, s, t)) continue;
        (void)vgi_sets_join(parent, s->at_low, t->at_low);
        (void)vgi_sets_join(parent, s->at_high, t->at_high);
    }
}

/* Groups are numbered by their first corners. */
static void number_groups(vgi_gltf_normals *x, uint32_t *parent)
{
    const vg_mesh *m = x->mesh;
    for (size_t f = 0; f < m->nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            const uint32_t root = vgi_sets_find(parent, c);
            x->corner[c] = vgi_face_size(m, f) < 3 ? UINT32_MAX : root == c ? (uint32_t)x->ngroups++ : x->corner[root];
        }
}

int vgi_gltf_normals_make(vgi_gltf_normals *x, const vg_mesh *m, const vg_attributes *a, const double *reference, vg_err *e)
{
    const size_t corners = vg_mesh_corners(m);
    *x = (vgi_gltf_normals){.mesh = m};
    vgi_smoothing smoothing;
    int r = vgi_smoothing_make(&smoothing, m, a, reference, e);
    uint32_t *parent = vgi_array_raw(corners, sizeof *parent, e);
    x->corner = vgi_array_raw(corners, sizeof *x->corner, e);
    if (!parent || !x->corner) r = VG_ENOMEM;
    if (r == VG_OK) {
        vgi_sets_init(parent, corners);
        unite_corners(parent, &smoothing);
        number_groups(x, parent);
        if (!(x->sum = vgi_array(x->ngroups, 3 * sizeof *x->sum, e))) r = VG_ENOMEM;
    }
    vgi_smoothing_clear(&smoothing);
    free(parent);
    return r;
}

void vgi_gltf_normals_clear(vgi_gltf_normals *x)
{
    free(x->corner);
    free(x->sum);
    free(x->group);
    free(x->base);
    *x = (vgi_gltf_normals){0};
}

/* ---- normals ---- */

/* acos to 3e-8: a polynomial of Hastings (Abramowitz and Stegun 4.4.46). The angles only weigh the normals. */
static inline double angle_of(double cosine)
{
    const double x = cosine < 0 ? -cosine : cosine, rest = x < 1 ? 1 - x : 0, y = x * x, z = y * y;
    const double low = (1.5707963050 - 0.2145988016 * x) + (0.0889789874 - 0.0501743046 * x) * y;
    const double high = (0.0308918810 - 0.0170881256 * x) + (0.0066700901 - 0.0012624911 * x) * y;
    const double angle = sqrt(rest) * (low + high * z);
    return cosine < 0 ? M_PI - angle : angle;
}

/* The angle of a face at corner number i of its size. */
static double angle_at(const vg_mesh *m, size_t f, size_t i, const double *pose)
{
    const size_t size = vgi_face_size(m, f);
    const uint32_t *v = m->vert + m->start[f];
    const double *at = pose + 3 * (size_t)v[i];
    double arm[2][3];
    vgi_subtract(pose + 3 * (size_t)v[(i + 1) % size], at, arm[0]);
    vgi_subtract(pose + 3 * (size_t)v[(i + size - 1) % size], at, arm[1]);
    vgi_make_unit(arm[0]), vgi_make_unit(arm[1]);
    return angle_of(vgi_dot(arm[0], arm[1]));
}

static void add_polygon(vgi_gltf_normals *x, size_t f, const double *pose)
{
    const vg_mesh *m = x->mesh;
    double n[3];
    face_normal(m, f, pose, n);
    for (size_t i = 0; i < vgi_face_size(m, f); i++)
        vgi_add_scaled(x->sum + 3 * (size_t)x->corner[m->start[f] + i], angle_at(m, f, i, pose), n);
}

/* The same for a triangle, of which most meshes consist. */
static inline void add_triangle(vgi_gltf_normals *x, uint32_t first, const double *pose)
{
    const uint32_t *v = x->mesh->vert + first;
    const double *p = pose + 3 * (size_t)v[0], *q = pose + 3 * (size_t)v[1], *s = pose + 3 * (size_t)v[2];
    double pq[3], qs[3], sp[3], n[3];
    vgi_subtract(q, p, pq), vgi_subtract(s, q, qs), vgi_subtract(p, s, sp);
    vgi_cross(pq, qs, n);
    const double size = sqrt(vgi_dot(n, n));
    if (!(size > 0)) return;
    const double a = vgi_dot(pq, pq), b = vgi_dot(qs, qs), c = vgi_dot(sp, sp);
    const double at_p = angle_of(-vgi_dot(pq, sp) / sqrt(a * c)), at_q = angle_of(-vgi_dot(pq, qs) / sqrt(a * b));
    const double weight[3] = {at_p / size, at_q / size, (M_PI - at_p - at_q) / size};
    for (uint32_t i = 0; i < 3; i++) {
        double *to = x->sum + 3 * (size_t)x->corner[first + i];
        to[0] += weight[i] * n[0], to[1] += weight[i] * n[1], to[2] += weight[i] * n[2];
    }
}

static void sum_normals(vgi_gltf_normals *x, const double *pose)
{
    const vg_mesh *m = x->mesh;
    memset(x->sum, 0, 3 * x->ngroups * sizeof *x->sum);
    for (size_t f = 0; f < m->nf; f++) {
        const size_t size = vgi_face_size(m, f);
        if (size == 3) add_triangle(x, m->start[f], pose);
        else if (size > 3) add_polygon(x, f, pose);
    }
    for (size_t g = 0; g < x->ngroups; g++) vgi_make_unit(x->sum + 3 * g);
}

/* Vertices without area or faces: any unit vector, because glTF requires one. */
static void base_of(const vgi_gltf_normals *x, size_t v, float to[3])
{
    static const double up[3] = {0, 0, 1};
    const double *n = x->group[v] == UINT32_MAX ? up : x->sum + 3 * (size_t)x->group[v];
    if (vgi_length(n) == 0) n = up;
    for (int k = 0; k < 3; k++) to[k] = (float)n[k];
}

int vgi_gltf_normals_place(vgi_gltf_normals *x, size_t n, const uint32_t *corner, const double *reference, vg_err *e)
{
    const size_t corners = vg_mesh_corners(x->mesh);
    x->n = n;
    x->group = vgi_array_raw(n, sizeof *x->group, e), x->base = vgi_array_raw(n, 3 * sizeof *x->base, e);
    if (!x->group || !x->base) return VG_ENOMEM;
    for (size_t v = 0; v < n; v++) x->group[v] = UINT32_MAX;
    for (size_t c = 0; c < corners; c++)
        if (x->corner[c] != UINT32_MAX) x->group[corner ? corner[c] : x->mesh->vert[c]] = x->corner[c];
    sum_normals(x, reference);
    for (size_t v = 0; v < n; v++) base_of(x, v, x->base + 3 * v);
    return VG_OK;
}

void vgi_gltf_normals_turn(vgi_gltf_normals *x, const double *pose, float *to)
{
    sum_normals(x, pose);
    for (size_t v = 0; v < x->n; v++) {
        const double *n = x->group[v] == UINT32_MAX ? NULL : x->sum + 3 * (size_t)x->group[v];
        const bool has = n && (n[0] != 0 || n[1] != 0 || n[2] != 0);
        for (size_t k = 0; k < 3; k++) to[3 * v + k] = has ? (float)n[k] - x->base[3 * v + k] : 0;
    }
}
