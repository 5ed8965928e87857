/* root.c: the rigid motion of a body: the rotation and shift that map its reference nearest to each pose.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/root.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

static void find_root(size_t nv, const double *reference, const double from[3], const double *pose, double turn[4],
                 double shift[3])
{
    double to[3], b[9] = {0}, moved[3];
    vg_centroid(pose, nv, to);
    for (size_t v = 0; v < nv; v++) {
        const double *p = pose + 3 * v, *r = reference + 3 * v;
        vgi_add_outer(b, 1, (double[]){p[0] - to[0], p[1] - to[1], p[2] - to[2]},
                      (double[]){r[0] - from[0], r[1] - from[1], r[2] - from[2]});
    }
    vgi_best_turn(b, turn);
    vg_quat_apply(turn, from, moved);
    vgi_subtract(to, moved, shift);
}

void vgi_root_remove(size_t n, size_t nv, const double *reference, double *poses, double *turn, double *shift)
{
    double from[3];
    vg_centroid(reference, nv, from);
    for (size_t i = 0; i < n; i++) {
        double *q = turn + 4 * i, *t = shift + 3 * i, *pose = poses + i * 3 * nv, m[9], same = 0;
        find_root(nv, reference, from, pose, q, t);
        for (int k = 0; k < 4 && i; k++) same += q[k] * (q - 4)[k];
        for (int k = 0; k < 4 && same < 0; k++) q[k] = -q[k];
        vg_quat_matrix((double[]){q[0], -q[1], -q[2], -q[3]}, m);
        for (size_t v = 0; v < nv; v++) {
            double *p = pose + 3 * v;
            vgi_multiply_vector(m, (double[]){p[0] - t[0], p[1] - t[1], p[2] - t[2]}, p);
        }
    }
}

void vgi_root_centre(size_t n, const vg_graph *g, const double centre[3], double *poses, const double *turn, double *shift)
{
    for (size_t i = 0; i < n; i++) {
        double *pose = poses + i * 3 * g->faces.nv, at[3], turned[3];
        vg_graph_root(g, pose, at);
        vgi_deduct(at, centre);
        vg_quat_apply(turn + 4 * i, at, turned);
        vgi_add(shift + 3 * i, turned);
        for (size_t c = 0; c < 3 * g->faces.nv; c++) pose[c] -= at[c % 3];
    }
}

void vgi_root_apply(const double turn[4], const double shift[3], size_t nv, double *vertices)
{
    double m[9];
    vg_quat_matrix(turn, m);
    for (size_t v = 0; v < nv; v++) {
        double *p = vertices + 3 * v, moved[3];
        vgi_multiply_vector(m, p, moved);
        vgi_sum(moved, shift, p);
    }
}
