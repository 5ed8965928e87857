/* vg-features: measure poses as features, which learners take and vg-solve takes back.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"
#include "solve_features.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    bool nine, plain;
} opts;

static const cli_option options[] = {
    {"nine", 0, NULL, "nine numbers per vertex, as published, not twelve: the reconstruction is not exact", .flag = &opts.nine},
    {"plain", 0, NULL, "leave the rotation of the root in the features, and write none", .flag = &opts.plain},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-features",
    .synopsis = "[options] [FILE]",
    .summary = "compute features of poses: rotation and stretch around each vertex",
    .options = options,
    .most_operands = 1,
    .writes_stream = true,
    .threaded = true};

typedef struct work {
    const vg_head *h;
    size_t most;            /* frames of a batch */
    double diagonal;        /* D of the reference pose */
    vg_feature_stats stats;
    vg_featurer *featurer;
    vg_frame *out;
    double **values, **roots, **centroids, **back; /* back: with --verbose, the poses that come back */
    double worst;           /* largest distance of a vertex from where it was */
} work;

/* ---- setting up ---- */

static double **lists(size_t n, size_t length)
{
    double **list = cli_allocate(n, sizeof *list, "a batch of poses");
    for (size_t i = 0; i < n; i++) list[i] = cli_allocate(length, sizeof **list, "a batch of poses");
    return list;
}

static void free_lists(double **list, size_t n)
{
    for (size_t i = 0; list && i < n; i++) free(list[i]);
    free(list);
}

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    work *w = context;
    vg_err e;
    (void)in;
    cli_need_vertices(h, "the input");
    vg_feature_options o = {.nine = opts.nine, .plain = opts.plain, .threads = cli_threads()};
    if (vg_featurer_new(&w->featurer, &h->body.mesh, h->body.reference, &o, &e) < 0) cli_die(&e);
    w->h = h, w->stats = vg_featurer_get_stats(w->featurer);
    w->diagonal = vg_diagonal(h->body.reference, h->body.mesh.nv);
    h->kind = VG_FEATURES, h->width = w->stats.width, h->count = h->body.mesh.nv, h->precision = VG_F64;
    w->out = cli_allocate(w->most, sizeof *w->out, "a batch of poses");
    w->values = cli_allocate(w->most, sizeof *w->values, "a batch of poses");
    for (size_t i = 0; i < w->most; i++) {
        if (vg_frame_shape(&w->out[i], h, &e) < 0) cli_die(&e);
        w->values[i] = w->out[i].values;
    }
    w->roots = lists(w->most, 4);
    w->centroids = lists(w->most, 3 * w->stats.parts);
    if (cli_verbose()) w->back = lists(w->most, 3 * h->body.mesh.nv);
}

/* ---- frames ---- */

static void put_channel(vg_frame *f, const char *name, vg_element element, size_t width, size_t count,
                        const double *numbers)
{
    vg_channel *c;
    vg_err e;
    if (vg_frame_add(f, name, "", element, width, count, &c, &e) < 0) cli_die(&e);
    memcpy(c->numbers, numbers, width * count * sizeof *numbers);
    c->precision = VG_F64;
}

static void check_way_back(work *w, size_t n, const double *const *poses)
{
    size_t nv = w->h->body.mesh.nv;
    vg_featurer_solve(w->featurer, n, (const double *const *)w->values, (const double *const *)w->roots,
                      (const double *const *)w->centroids, w->back);
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < nv; v++) {
            const double *a = poses[i] + 3 * v, *b = w->back[i] + 3 * v;
            w->worst = fmax(w->worst, hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]));
        }
}

static void measure_batch(void *context, size_t n, vg_frame *in)
{
    work *w = context;
    vg_err e;
    const double **poses = cli_allocate(n, sizeof *poses, "a batch of poses");
    for (size_t i = 0; i < n; i++) poses[i] = in[i].values;
    if (vg_featurer_measure(w->featurer, n, poses, w->values, w->roots, w->centroids, &e) < 0) cli_die(&e);
    if (cli_verbose()) check_way_back(w, n, poses);
    for (size_t i = 0; i < n; i++) {
        vg_frame *f = &w->out[i];
        if (vg_frame_label(f, &in[i], &e) < 0) cli_die(&e);
        if (!opts.plain) put_channel(f, FEATURES_ROOT, VG_OF_FRAME, 4, 1, w->roots[i]);
        put_channel(f, FEATURES_CENTROIDS, VG_OF_COMPONENT, 3, w->stats.parts, w->centroids[i]);
        cli_stream_put(f);
    }
    free(poses);
}

static void report_features(void *context)
{
    work *w = context;
    w->stats = vg_featurer_get_stats(w->featurer);
    cli_note("%llu poses with %zu numbers per vertex, %zu components", (unsigned long long)w->stats.poses, w->stats.width,
             w->stats.parts);
    cli_note("%llu times an edge over which the rotation jumps by more than half a turn",
             (unsigned long long)w->stats.jumps);
    cli_note("%zu vertices whose neighbourhood is degenerate: with its normal it does not span space",
             w->stats.open_rings);
    cli_note("largest error of the reconstruction: %.1e D", w->diagonal > 0 ? w->worst / w->diagonal : w->worst);
}

static void clear_work(work *w)
{
    for (size_t i = 0; i < w->most; i++) vg_frame_clear(&w->out[i]);
    free(w->out);
    free(w->values);
    free_lists(w->roots, w->most);
    free_lists(w->centroids, w->most);
    free_lists(w->back, w->most);
    vg_featurer_free(&w->featurer);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_source *s = cli_source(operands, n);
    work w = {.most = 8 * (size_t)cli_threads()};
    const step measure = {.batch = w.most, .unit = "poses", .init = prepare, .process = measure_batch, .finish = report_features};
    step_run(&measure, &w, s);
    clear_work(&w);
    vg_source_close(&s);
    cli_finish(0);
}
