/* rod: a closed tube of any size that bends and twists, as a stream: test and benchmark input with an analytic shape.
 * usage: rod A|B tri|quad RINGS SEGMENTS POSES > out.vgs    The truth of a transfer from A to B is B.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { STEPS = 2000 };
static const double length = 2;

typedef struct axis { double at[3], frame[9]; } axis; /* frame: columns across, across, along */

static void turn(double m[9], const double w[3])
{
    double l[4] = {0, w[0] / 2, w[1] / 2, w[2] / 2}, q[4], r[9], out[9];
    vg_quat_exp(l, q);
    vg_quat_matrix(q, r);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = 0;
            for (int k = 0; k < 3; k++) out[3 * i + j] += m[3 * i + k] * r[3 * k + j];
        }
    memcpy(m, out, sizeof out);
}

/* The bent axis at time t in [0, 1]: its curvature, integrated. */
static void make_axis(axis *a, double t)
{
    double bend = 150 * sin(M_PI * t / 2), sway = 60 * sin(2 * M_PI * t), twist = 120 * t, h = length / STEPS;
    double m[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, p[3] = {0, 0, -length / 2};
    for (int i = 0; i <= STEPS; i++) {
        memcpy(a[i].at, p, sizeof p);
        memcpy(a[i].frame, m, sizeof m);
        double u = (i + 0.5) / STEPS, degree = M_PI / 180 / length * h;
        double w[3] = {bend * (1 + 0.6 * cos(4 * M_PI * u)) * degree, sway * cos(2 * M_PI * u) * degree,
                       twist * (1 - 0.5 * cos(2 * M_PI * u)) * degree};
        turn(m, w);
        for (int k = 0; k < 3; k++) p[k] += h * m[3 * k + 2];
    }
}

static double radius(char body, double u, double angle)
{
    double taper = sqrt(fmax(0, 1 - pow(2 * u - 1, 4)));
    if (body == 'A') return 0.16 * taper * (1 + 0.25 * cos(5 * M_PI * u) + 0.10 * cos(2 * angle));
    return 0.20 * taper * (1 + 0.20 * cos(3 * M_PI * u + 0.7) + 0.12 * cos(3 * angle + 2 * u) +
                           0.04 * sin(16 * angle) * sin(30 * M_PI * u));
}

static void place(double *v, const axis *a, double u, double r, double angle)
{
    double s = u * STEPS, f = s - floor(s), across[3] = {r * cos(angle), r * sin(angle), 0};
    const axis *p = &a[(int)s], *q = &a[(int)s < STEPS ? (int)s + 1 : STEPS];
    for (int k = 0; k < 3; k++) {
        v[k] = (1 - f) * p->at[k] + f * q->at[k];
        for (int j = 0; j < 2; j++)
            v[k] += across[j] * ((1 - f) * p->frame[3 * k + j] + f * q->frame[3 * k + j]);
    }
}

static void pose(double *v, char body, size_t rings, size_t segments, double t)
{
    static axis a[STEPS + 1];
    make_axis(a, t);
    place(v, a, 0, 0, 0);
    for (size_t i = 0; i < rings; i++)
        for (size_t j = 0; j < segments; j++) {
            double u = (double)(i + 1) / (double)(rings + 1), angle = 2 * M_PI * (double)j / (double)segments;
            place(v + 3 * (1 + i * segments + j), a, u, radius(body, u, angle), angle);
        }
    place(v + 3 * (1 + rings * segments), a, 1, 0, 0);
}

static void add_face(vg_mesh *m, size_t n, const size_t *v)
{
    for (size_t i = 0; i < n; i++) m->vert[m->start[m->nf] + i] = (uint32_t)v[i];
    m->start[m->nf + 1] = m->start[m->nf] + (uint32_t)n;
    m->nf++;
}

static void make_mesh(vg_mesh *m, bool quads, size_t rings, size_t segments)
{
    size_t most = 2 * rings * segments + 2 * segments;
    m->nv = rings * segments + 2;
    m->start = calloc(most + 1, sizeof *m->start);
    m->vert = calloc(4 * most, sizeof *m->vert);
    if (!m->start || !m->vert) exit(4);
    size_t end = m->nv - 1, last = 1 + (rings - 1) * segments;
    for (size_t j = 0; j < segments; j++) add_face(m, 3, (size_t[]){0, 1 + (j + 1) % segments, 1 + j});
    for (size_t i = 0; i + 1 < rings; i++)
        for (size_t j = 0; j < segments; j++) {
            size_t a = 1 + i * segments + j, b = 1 + i * segments + (j + 1) % segments;
            if (quads) {
                add_face(m, 4, (size_t[]){a, b, b + segments, a + segments});
            } else {
                add_face(m, 3, (size_t[]){a, b, b + segments});
                add_face(m, 3, (size_t[]){a, b + segments, a + segments});
            }
        }
    for (size_t j = 0; j < segments; j++) add_face(m, 3, (size_t[]){end, last + j, last + (j + 1) % segments});
}

static void check(int r, const vg_err *e)
{
    if (r >= 0) return;
    fprintf(stderr, "rod: %s\n", e->message);
    exit(vg_exit_status(r));
}

int main(int argc, char **argv)
{
    if (argc != 6) {
        fprintf(stderr, "usage: rod A|B tri|quad RINGS SEGMENTS POSES > out.vgs\n");
        return 2;
    }
    size_t rings = strtoul(argv[3], NULL, 10), segments = strtoul(argv[4], NULL, 10),
           poses = strtoul(argv[5], NULL, 10);
    char body = argv[1][0];
    vg_err e;
    vg_head h = {.kind = VG_VERTICES, .precision = VG_F64};
    vg_frame f = {0};
    vg_writer *w;
    make_mesh(&h.body.mesh, !strcmp(argv[2], "quad"), rings, segments);
    h.count = h.body.mesh.nv;
    h.body.reference = calloc(3 * h.body.mesh.nv, sizeof *h.body.reference);
    if (!h.body.reference) return 4;
    pose(h.body.reference, body, rings, segments, 0);
    check(vg_frame_shape(&f, &h, &e), &e);
    check(vg_writer_open(&w, STDOUT_FILENO, "standard output", &h, &e), &e);
    for (size_t i = 0; i < poses; i++) {
        char name[32];
        snprintf(name, sizeof name, "pose%zu", i);
        check(vg_frame_rename(&f, name, &e), &e);
        /* times of the first eleven poses are 0 to 1; longer sequences go round */
        pose(f.values, body, rings, segments, (double)(i % 11) / 10);
        check(vg_writer_put(w, &f, &e), &e);
    }
    check(vg_writer_end(w, NULL, &e), &e);
    vg_writer_close(&w);
    vg_frame_clear(&f);
    vg_head_clear(&h);
    return 0;
}
