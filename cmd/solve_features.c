/* solve_features.c: converts frames of features to vertices (MATH 12). Features are measured in vg-features.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "solve_features.h"
#include "batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct work {
    const vg_head *h;
    size_t parts, most;    /* components; frames of a batch */
    vg_featurer *featurer;
    vg_frame *out;
    const double **values, **roots, **centroids;
    double (*root)[4];     /* unit quaternions of a batch */
    double **vertices, *rest; /* rest: centroids of the reference pose */
    uint64_t unplaced;     /* frames without centroids */
} work;

/* ---- setting up ---- */

static void check_form(const vg_head *h)
{
    if (h->width != 9 && h->width != 12)
        cli_stop(VG_EINPUT, "the input has %zu numbers a vertex: features of vg-features are 9 or 12", h->width);
    if (!h->body.reference)
        cli_stop(VG_EINPUT, "the input has no reference pose, which features are measured against");
}

/* The centroids of the reference pose, for frames without centroids. */
static void measure_rest(work *w, const vg_head *h)
{
    vg_err e;
    double *values = cli_allocate(h->width * h->body.mesh.nv, sizeof *values, "features"), root[4], *to = root;
    const double *pose = h->body.reference;
    w->rest = cli_allocate(3 * w->parts, sizeof *w->rest, "features");
    if (vg_featurer_measure(w->featurer, 1, &pose, &values, &to, &w->rest, &e) < 0) cli_die(&e);
    free(values);
}

static void make_batch(work *w)
{
    vg_err e;
    w->out = cli_allocate(w->most, sizeof *w->out, "a batch of poses");
    w->values = cli_allocate(w->most, sizeof *w->values, "a batch of poses");
    w->roots = cli_allocate(w->most, sizeof *w->roots, "a batch of poses");
    w->centroids = cli_allocate(w->most, sizeof *w->centroids, "a batch of poses");
    w->root = cli_allocate(w->most, sizeof *w->root, "a batch of poses");
    w->vertices = cli_allocate(w->most, sizeof *w->vertices, "a batch of poses");
    for (size_t i = 0; i < w->most; i++) {
        if (vg_frame_shape(&w->out[i], w->h, &e) < 0) cli_die(&e);
        w->vertices[i] = w->out[i].values;
    }
}

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    work *w = context;
    vg_err e;
    (void)in;
    check_form(h);
    vg_feature_options o = {.nine = h->width == 9, .threads = cli_threads()};
    if (vg_featurer_new(&w->featurer, &h->body.mesh, h->body.reference, &o, &e) < 0) cli_die(&e);
    w->h = h, w->parts = vg_featurer_get_stats(w->featurer).parts;
    measure_rest(w, h);
    h->kind = VG_VERTICES, h->count = h->body.mesh.nv;
    make_batch(w);
}

/* ---- frames ---- */

/* NULL: the frame has no such channel; one of another shape stops the program. */
static const double *find_channel(const vg_frame *f, const char *name, size_t width, size_t count)
{
    const vg_channel *c = vg_frame_channel(f, name);
    if (!c) return NULL;
    if (!c->numbers || c->width != width || c->count != count)
        cli_stop(VG_EINPUT, "frame '%s' has '%s' of %zu times %zu numbers, where %zu times %zu are needed", f->name, name,
                 c->count, c->width, count, width);
    return c->numbers;
}

/* Normalise: learners do not keep quaternions at length 1. NULL: no rotation. */
static const double *find_root(const vg_frame *f, double unit[4])
{
    const double *q = find_channel(f, FEATURES_ROOT, 4, 1);
    if (!q) return NULL;
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 1e-6) || !isfinite(length))
        cli_stop(VG_EINPUT, "frame '%s' has a '%s' that is not a rotation: its length is %g", f->name, FEATURES_ROOT, length);
    for (int k = 0; k < 4; k++) unit[k] = fabs(length - 1) < 1e-15 ? q[k] : q[k] / length;
    return unit;
}

static void solve_batch(void *context, size_t n, vg_frame *in)
{
    work *w = context;
    vg_err e;
    for (size_t i = 0; i < n; i++) {
        w->values[i] = in[i].values;
        w->roots[i] = find_root(&in[i], w->root[i]);
        w->centroids[i] = find_channel(&in[i], FEATURES_CENTROIDS, 3, w->parts);
        if (w->centroids[i]) continue;
        w->centroids[i] = w->rest;
        w->unplaced++;
    }
    vg_featurer_solve(w->featurer, n, w->values, w->roots, w->centroids, w->vertices);
    for (size_t i = 0; i < n; i++) {
        if (vg_frame_label(&w->out[i], &in[i], &e) < 0) cli_die(&e);
        cli_stream_put(&w->out[i]);
    }
}

static void clear_work(work *w)
{
    for (size_t i = 0; i < w->most; i++) vg_frame_clear(&w->out[i]);
    free(w->out);
    free(w->values);
    free(w->roots);
    free(w->centroids);
    free(w->root);
    free(w->vertices);
    free(w->rest);
    vg_featurer_free(&w->featurer);
}

void features_solve(vg_source *s)
{
    work w = {.most = 8 * (size_t)cli_threads()};
    const step back = {.batch = w.most, .unit = "poses", .init = prepare, .process = solve_batch};
    step_run(&back, &w, s);
    if (w.unplaced)
        cli_warn("%llu frames have no '%s': their components are where the reference pose has them",
                 (unsigned long long)w.unplaced, FEATURES_CENTROIDS);
    clear_work(&w);
}
