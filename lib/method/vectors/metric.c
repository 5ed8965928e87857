/* metric.c: the area metric of polygons, from the moments of a face's reference vectors in its plane. Used in
 * reconstruct.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/metric.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

/* The smaller moment of a face counts as THIN times the larger one at least: that of a rectangle twice as long as wide.
 * A triangle may have a third of that, as half a rectangle has. The area is at least SMALL times the larger moment. */
static const double thin = 0.25, small = 1e-3;

static void make_face(vgi_face_metric *m, double *plane, const double *w, size_t r)
{
    double n[3];
    *m = (vgi_face_metric){.weight = 1};
    memset(plane, 0, 3 * r * sizeof *plane);
    vgi_area_vector(w, r, n);
    double length = vgi_length(n);
    if (r < 3 || !(length > 0)) return;
    /* axes of the plane: along the first vector that is not parallel to the normal, and perpendicular to it */
    double a[3] = {0, 0, 0}, b[3], most = 0;
    vgi_divide(n, length);
    for (size_t i = 0; i < r; i++) {
        double t[3], along = vgi_dot(n, w + 3 * i);
        memcpy(t, w + 3 * i, sizeof t), vgi_add_scaled(t, -along, n);
        memcpy(plane + 3 * i, t, sizeof t);
        if (vgi_dot(t, t) > most) most = vgi_dot(t, t), memcpy(a, t, sizeof a);
    }
    if (!(most > 0)) return;
    vgi_divide(a, sqrt(most));
    vgi_cross(n, a, b);
    double aa = 0, ab = 0, bb = 0;
    for (size_t i = 0; i < r; i++) {
        double x = vgi_dot(a, plane + 3 * i), y = vgi_dot(b, plane + 3 * i);
        aa += x * x, ab += x * y, bb += y * y;
    }
    /* eigenvalues and the first eigenvector of [aa ab; ab bb] */
    double half = (aa + bb) / 2, spread = hypot((aa - bb) / 2, ab), angle = 0.5 * atan2(2 * ab, aa - bb);
    double l1 = half + spread, l2 = fmax(half - spread, (r == 3 ? thin / 3 : thin) * l1);
    double w_area = fmax(length / 2, small * l1), bending = 2 / l1;
    m->weight = w_area * bending;
    for (int which = 0; which < 2; which++) {
        double c = which ? -sin(angle) : cos(angle), s = which ? cos(angle) : sin(angle), l = which ? l2 : l1, e[3];
        double scale = w_area * (1 / (l * l) - bending / l);
        for (int k = 0; k < 3; k++) e[k] = c * a[k] + s * b[k];
        m->s[0] += scale * e[0] * e[0], m->s[1] += scale * e[0] * e[1], m->s[2] += scale * e[0] * e[2];
        m->s[3] += scale * e[1] * e[1], m->s[4] += scale * e[1] * e[2], m->s[5] += scale * e[2] * e[2];
    }
}

int vgi_metric_make(vgi_metric *m, const vg_graph *g, const double *reference, vg_err *e)
{
    size_t corners = vg_graph_corners(g);
    double *w = vgi_array_raw(3 * corners, sizeof *w, e);
    m->face = vgi_array(g->faces.nf, sizeof *m->face, e);
    m->plane = vgi_array(3 * corners, sizeof *m->plane, e);
    if (!w || !m->face || !m->plane) {
        free(w);
        vgi_metric_clear(m);
        return VG_ENOMEM;
    }
    vg_graph_vectors(g, reference, w);
    /* in units of the mean length, so that moments neither overflow nor vanish */
    double sum = 0;
    for (size_t i = 0; i < 3 * corners; i++) sum += fabs(w[i]);
    for (size_t i = 0; i < 3 * corners && sum > 0; i++) w[i] *= (double)corners / sum;
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t begin = 3 * (size_t)g->faces.start[f];
        make_face(&m->face[f], m->plane + begin, w + begin, g->faces.start[f + 1] - g->faces.start[f]);
    }
    free(w);
    return VG_OK;
}

void vgi_metric_clear(vgi_metric *m)
{
    free(m->face);
    free(m->plane);
    *m = (vgi_metric){0};
}

double vgi_metric_weight(const vgi_metric *m, size_t f)
{
    return m->face ? m->face[f].weight : 1;
}

double vgi_metric_entry(const vgi_metric *m, const vg_graph *g, size_t f, size_t p, size_t q)
{
    size_t begin = g->faces.start[f], r = g->faces.start[f + 1] - begin;
    double weight = vgi_metric_weight(m, f), x = (p == q ? weight : 0) - weight / (double)r;
    if (!m->face) return x;
    const double *s = m->face[f].s, *a = m->plane + 3 * (begin + p), *b = m->plane + 3 * (begin + q);
    return x + a[0] * (s[0] * b[0] + s[1] * b[1] + s[2] * b[2]) + a[1] * (s[1] * b[0] + s[3] * b[1] + s[4] * b[2]) +
           a[2] * (s[2] * b[0] + s[4] * b[1] + s[5] * b[2]);
}
