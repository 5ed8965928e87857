/* places.c: finds where the vertices of a target lie on a source that was fitted to it, and follows them in poses.
 * Faces are paired in pair.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/places.h"
#include "method/pairs/surface.h"
#include "numeric/face.h"
#include "numeric/vec3.h"

#include <stdlib.h>

enum { BLOCK = 256 };
static const double FAR = 0.03;   /* in D: the largest distance of a vertex from its place, as of paired faces */
static const double COSINE = 0.5; /* least cosine of the angle between normals that match */

typedef struct search {
    const vgi_surface *source, *target;
    const double *points;
    size_t n;
    double sign, limit; /* sign -1: the two meshes have opposite orientations */
    vgi_place *places;
} search;

static void find_block(void *context, size_t block)
{
    const search *s = context;
    size_t end = (block + 1) * BLOCK < s->n ? (block + 1) * BLOCK : s->n;
    for (size_t v = block * BLOCK; v < end; v++) {
        const double *n = vgi_surface_vertex_normals(s->target) + 3 * v;
        double normal[3] = {s->sign * n[0], s->sign * n[1], s->sign * n[2]};
        vgi_hit hit;
        s->places[v].face = UINT32_MAX;
        if (vgi_surface_nearest(s->source, s->points + 3 * v, normal, COSINE, s->limit, &hit))
            s->places[v] = (vgi_place){hit.face, hit.corner, {hit.u[0], hit.u[1]}};
    }
}

/* Whether paired faces look the same way: all are asked. */
static double orientation(const vg_correspondence *pairs, const vgi_surface *source, const vgi_surface *target)
{
    double sum = 0;
    for (size_t f = 0; f < pairs->target_nf; f++)
        if (pairs->matched[f])
            sum += vgi_dot(vgi_surface_normals(target) + 3 * f, vgi_surface_normals(source) + 3 * (size_t)pairs->source[pairs->first[f]]);
    return sum < 0 ? -1 : 1;
}

int vgi_places_find(vgi_place *places, const vg_mesh *source, const double *fitted, const vg_correspondence *pairs,
                    const vg_mesh *target, const double *points, int threads, vg_err *e)
{
    vgi_surface *from = NULL, *to = NULL;
    bool *take = vgi_array(source->nf, sizeof *take, e);
    int r = take ? VG_OK : VG_ENOMEM;
    for (uint32_t i = 0; r == VG_OK && i < pairs->first[pairs->target_nf]; i++) take[pairs->source[i]] = true;
    if (r == VG_OK) r = vgi_surface_of(&from, source, fitted, take, e);
    if (r == VG_OK) r = vgi_surface_new(&to, target, points, e);
    if (r == VG_OK) {
        double far = FAR * vg_diagonal(points, target->nv);
        search s = {from, to, points, target->nv, orientation(pairs, from, to), far * far, places};
        vgi_parallel(threads, (target->nv + BLOCK - 1) / BLOCK, find_block, &s);
    }
    vgi_surface_free(&from);
    vgi_surface_free(&to);
    free(take);
    return r;
}

void vgi_place_point(const vg_mesh *source, const vgi_place *p, const double *pose, double at[3])
{
    size_t begin = source->start[p->face], r = source->start[p->face + 1] - begin, i = p->corner - begin;
    const uint32_t *vert = source->vert + begin;
    const double *a = pose + 3 * (size_t)vert[i], *b = pose + 3 * (size_t)vert[(i + 1) % r];
    double centre[3];
    const double *c = pose + 3 * (size_t)vert[(i + 2) % r];
    if (r > 3) vgi_face_centre(pose, vert, r, centre), c = centre;
    for (int k = 0; k < 3; k++) at[k] = a[k] + p->u[0] * (b[k] - a[k]) + p->u[1] * (c[k] - a[k]);
}

/* Add a point of the source, as vgi_place_point finds it, to the shares. */
static void share_place(const vg_mesh *source, const vgi_place *p, double *share)
{
    size_t begin = source->start[p->face], r = source->start[p->face + 1] - begin, i = p->corner - begin;
    const uint32_t *vert = source->vert + begin;
    share[vert[i]] += 1 - p->u[0] - p->u[1];
    share[vert[(i + 1) % r]] += p->u[0];
    if (r <= 3) share[vert[(i + 2) % r]] += p->u[1];
    for (size_t k = 0; r > 3 && k < r; k++) share[vert[k]] += p->u[1] / (double)r;
}

static void share_face(const vg_mesh *source, size_t f, double *share)
{
    double part = 1 / (double)(source->start[f + 1] - source->start[f]);
    for (uint32_t c = source->start[f]; c < source->start[f + 1]; c++) share[source->vert[c]] += part;
}

int vgi_places_share(const vgi_place *places, const vg_mesh *source, const vg_correspondence *pairs,
                     const vg_mesh *target, double *share, vg_err *e)
{
    bool *done = vgi_array(target->nv, sizeof *done, e);
    if (!done) return VG_ENOMEM;
    size_t n = 0;
    memset(share, 0, source->nv * sizeof *share);
    for (size_t f = 0; f < target->nf; f++)
        for (uint32_t c = target->start[f]; c < target->start[f + 1]; c++) {
            uint32_t v = target->vert[c];
            if (done[v]) continue;
            if (places && places[v].face != UINT32_MAX) share_place(source, &places[v], share);
            else share_face(source, pairs->source[pairs->first[f]], share);
            done[v] = true;
            n++;
        }
    for (size_t v = 0; v < source->nv && n; v++) share[v] /= (double)n;
    free(done);
    return VG_OK;
}

double vgi_places_size(const vg_mesh *source, const double *reference, const vg_correspondence *pairs,
                       const vg_mesh *target, const double *points)
{
    double sum[2][3] = {{0}}, square[2] = {0}, at[2][3];
    for (size_t f = 0; f < target->nf; f++) {
        size_t g = pairs->source[pairs->first[f]];
        vgi_face_centre(points, target->vert + target->start[f], target->start[f + 1] - target->start[f], at[0]);
        vgi_face_centre(reference, source->vert + source->start[g], source->start[g + 1] - source->start[g], at[1]);
        for (size_t k = 0; k < 2; k++) vgi_add(sum[k], at[k]), square[k] += vgi_dot(at[k], at[k]);
    }
    for (size_t k = 0; k < 2 && target->nf; k++) square[k] -= vgi_dot(sum[k], sum[k]) / (double)target->nf;
    return square[0] > 0 && square[1] > 0 ? sqrt(square[0] / square[1]) : 1;
}
