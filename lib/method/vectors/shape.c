/* shape.c: transfer by shape deformation (T 4.1): vertices without a linear system. The position of the body is in
 * move.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/vec3.h"

#include <stdlib.h>

struct vg_shaper {
    const vg_graph *g;
    int threads;
    double *quaternion; /* per corner: P_c, source to target in the reference poses */
    double *share;      /* per vertex: 1 / number of its corners */
    double *reference;  /* reference of the target, for vertices without faces */
};

int vg_shaper_new(vg_shaper **out, const vg_graph *g, const double *source, const double *target, int threads,
                  vg_err *e)
{
    size_t corners = vg_graph_corners(g);
    vg_shaper *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->g = g, s->threads = threads;
    double *a = vgi_array(3 * corners, sizeof *a, e), *b = vgi_array(3 * corners, sizeof *b, e);
    s->quaternion = vgi_array(4 * corners, sizeof *s->quaternion, e);
    s->share = vgi_array(g->faces.nv, sizeof *s->share, e);
    s->reference = vgi_copy_array(target, 3 * g->faces.nv, sizeof *s->reference, e);
    bool ok = a && b && s->quaternion && s->share && s->reference;
    if (ok) {
        double least = 1e-9 * vg_diagonal(source, g->faces.nv);
        vg_graph_vectors(g, source, a);
        vg_graph_vectors(g, target, b);
        for (size_t c = 0; c < corners; c++) {
            const double *r = a + 3 * c, *t = b + 3 * c;
            double *q = s->quaternion + 4 * c;
            bool has =
                r[0] * r[0] + r[1] * r[1] + r[2] * r[2] > least * least && (t[0] != 0 || t[1] != 0 || t[2] != 0);
            if (has) vg_quat_between(r, t, q);
            else q[0] = 1;
            s->share[g->faces.vert[c]] += 1;
        }
        for (size_t v = 0; v < g->faces.nv; v++)
            if (s->share[v] > 0) s->share[v] = 1 / s->share[v];
    } else {
        vg_shaper_free(out);
    }
    free(a);
    free(b);
    return ok ? VG_OK : VG_ENOMEM;
}

void vg_shaper_free(vg_shaper **s)
{
    if (!*s) return;
    free((*s)->quaternion);
    free((*s)->share);
    free((*s)->reference);
    free(*s);
    *s = NULL;
}

typedef struct shape_job {
    const vg_shaper *s;
    const double *const *poses;
    double *const *vertices;
} shape_job;

static void shape_pose(void *context, size_t i)
{
    const shape_job *j = context;
    const vg_shaper *s = j->s;
    const vg_graph *g = s->g;
    const double *in = j->poses[i];
    double *out = j->vertices[i];
    memset(out, 0, 3 * g->faces.nv * sizeof *out);
    for (size_t f = 0; f < g->faces.nf; f++) {
        uint32_t begin = g->faces.start[f], end = g->faces.start[f + 1];
        double centre[3] = {0, 0, 0}, part = 1.0 / (double)(end - begin);
        for (uint32_t c = begin; c < end; c++)
            vgi_add(centre, in + 3 * (size_t)g->faces.vert[c]);
        vgi_scale(centre, part);
        for (uint32_t c = begin; c < end; c++) {
            double w[3], *to = out + 3 * (size_t)g->faces.vert[c];
            vgi_subtract(in + 3 * (size_t)g->faces.vert[c], centre, w);
            vg_quat_apply(s->quaternion + 4 * (size_t)c, w, w);
            for (int k = 0; k < 3; k++) to[k] += centre[k] + w[k];
        }
    }
    for (size_t v = 0; v < g->faces.nv; v++)
        for (size_t k = 0; k < 3; k++)
            out[3 * v + k] = g->in_face[v] ? out[3 * v + k] * s->share[v] : s->reference[3 * v + k];
}

void vg_shaper_transfer(vg_shaper *s, size_t n, const double *const *poses, double *const *vertices)
{
    shape_job j = {s, poses, vertices};
    vgi_parallel(s->threads, n, shape_pose, &j);
}
