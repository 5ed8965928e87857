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
