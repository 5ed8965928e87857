/* smooth.c: smooth vertices in time; the rigid motion of the body and the pose are filtered separately.
 * The window of frames is in window.c, the filters are in weights.c and robust_time.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/smooth.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

struct vg_smoother {
    vgi_window window;
    size_t nv;
    int threads;
    const double *reference;
    double centre[3]; /* of the reference */
};

int vg_smoother_new(vg_smoother **out, const vg_smoother_options *o, size_t nv, const double *reference, vg_err *e)
{
    vg_smoother *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    *s = (vg_smoother){.nv = nv, .reference = reference, .threads = o->threads};
    vg_centroid(reference, nv, s->centre);
    int r = vgi_window_make(&s->window, o, 3 * nv, e);
    if (r < 0) vg_smoother_free(out);
    return r;
}

void vg_smoother_free(vg_smoother **out)
{
    vg_smoother *s = *out;
    if (!s) return;
    vgi_window_clear(&s->window);
    free(s);
    *out = NULL;
}

size_t vg_smoother_reach(const vg_smoother *s)
{
    return s->window.reach;
}

/* If the reference does not determine the rotation (points on a line), the previous frame's is kept. */
static void find_turn(const vg_smoother *s, const double *vertices, const double *before, double root[VGI_MOVED])
{
    double b[9] = {0}, size = 0;
    vg_centroid(vertices, s->nv, root + 4);
    for (size_t v = 0; v < s->nv; v++) {
        const double *p = vertices + 3 * v, *q = s->reference + 3 * v, *c = s->centre, *d = root + 4;
        vgi_add_outer(b, 1, (double[]){p[0] - d[0], p[1] - d[1], p[2] - d[2]},
                      (double[]){q[0] - c[0], q[1] - c[1], q[2] - c[2]});
    }
    for (int k = 0; k < 9; k++) size += fabs(b[k]);
    vgi_best_turn_near(b, size > 0 ? 1e-12 * size : 1, before, root);
    vgi_same_side(before, root);
}

void vg_smoother_add(vg_smoother *s, const double *vertices)
{
    double m[9], before[4] = {1, 0, 0, 0}, *root = vgi_window_place(&s->window, s->window.known), *pose = root + VGI_MOVED;
    if (s->window.known) memcpy(before, vgi_window_place(&s->window, s->window.known - 1), sizeof before);
    find_turn(s, vertices, before, root);
    vg_quat_matrix((double[]){root[0], -root[1], -root[2], -root[3]}, m);
    for (size_t v = 0; v < s->nv; v++) {
        const double *p = vertices + 3 * v, *c = root + 4;
        vgi_multiply_vector(m, (double[]){p[0] - c[0], p[1] - c[1], p[2] - c[2]}, pose + 3 * v);
    }
    s->window.known++;
}

void vg_smoother_end(vg_smoother *s)
{
    s->window.ended = true;
}

bool vg_smoother_next(vg_smoother *s, double *vertices)
{
    double root[VGI_MOVED], m[9];
    if (!vgi_window_ready(&s->window)) return false;
    vgi_window_root(&s->window, root);
    vgi_window_filter(&s->window, &s->window.pose, s->threads, VGI_MOVED, 3, 3 * s->nv, vertices);
    vg_quat_matrix(root, m);
    for (size_t v = 0; v < s->nv; v++) {
        vgi_multiply_vector(m, vertices + 3 * v, vertices + 3 * v);
        vgi_add(vertices + 3 * v, root + 4);
    }
    s->window.given++;
    return true;
}
