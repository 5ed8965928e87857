/* vg-smooth: remove noise from a sequence, by filters in time of the vertices or the vector graph, or by the motion that
 * neighbouring vertices share. The filters are in lib/signal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TOGETHER = 3, BATCH = 16 }; /* choice of --filter after those of vg_filter; frames of a batch */
enum { ON_VERTICES, ON_VECTORS };  /* choices of --on */

static struct {
    size_t filter, on;
    double seconds, frames, root;
    uint64_t memory; /* bytes */
} opts = {.memory = 256 << 20};

static void take_memory(const char *text, void *context)
{
    (void)context;
    opts.memory = cli_parse_size("memory", text);
}

static const cli_option options[] = {
    {"filter", 0, "lowpass|polynomial|robust|together",
     "Butterworth forward and back (default), Savitzky-Golay, one without outliers, or what neighbours have in common",
     .choice = &opts.filter},
    {"on", 0, "vertices|vectors", "filter positions (default), or how vectors turn and stretch, which keeps volumes; then vg-solve",
     .choice = &opts.on},
    {"seconds", 0, "X", "span of the filter in time (default: 0.1)", .number = &opts.seconds, .least = 1e-9, .most = 1e9,
     .excludes = "frames"},
    {"frames", 0, "X", "the same in frames, whatever their times", .number = &opts.frames, .least = 1e-9, .most = 1000},
    {"root", 0, "X", "a separate span for the motion of the whole body, in the same unit; 0: keep it",
     .number = &opts.root, .least = 0, .most = 1e9},
    {"memory", 0, "SIZE", "together: keep this much of the frames in memory, the rest in a file (default: 256M)",
     .take = take_memory},
    {0}};

static const cli_program program = {
    .name = "vg-smooth",
    .synopsis = "[options] [FILE]",
    .summary = "remove noise from a sequence",
    .options = options,
    .most_operands = 1,
    .writes_stream = true,
    .vectors_if = &opts.on,
    .threaded = true};

/* ---- filters in time ---- */

typedef struct timing {
    vg_head *h;
    vg_kind kind;          /* what comes in */
    vg_smoother *smoother; /* made once the second frame gives the time step; of vertices, or of vectors: */
    vg_vector_smoother *vectors;
    vg_graph *graph;       /* of vectors */
    vg_frame out;          /* of vectors */
    vg_frame first;        /* held until then */
    bool begun;            /* a frame has come */
    double step, last;     /* seconds between frames (0: frames have no times); time of the last frame */
    vg_frame *label;       /* ring: name and time of the frames of the window, and of vertices their values */
    size_t places, put, given;
} timing;

/* seconds between frames a and b; 0: they have no times */
static double step_between(const vg_frame *a, const vg_frame *b)
{
    return a->has_time && b->has_time ? b->time - a->time : 0;
}

static double span_in_frames(double span, double each)
{
    return cli_given("frames") ? span : span / each;
}

static size_t make_filter(timing *t, const vg_smoother_options *o)
{
    vg_err e;
    const double *reference = t->h->body.reference;
    if (opts.on == ON_VERTICES) {
        if (vg_smoother_new(&t->smoother, o, t->h->body.mesh.nv, reference, &e) < 0) cli_die(&e);
        return vg_smoother_reach(t->smoother);
    }
    if (vg_vector_smoother_new(&t->vectors, o, t->graph, reference, t->h->nanchors, &e) < 0) cli_die(&e);
    return vg_vector_smoother_reach(t->vectors);
}

static void make_smoother(timing *t, double each)
{
    double fallback = 1.0 / VG_FPS, span = cli_given("frames") ? opts.frames : cli_given("seconds") ? opts.seconds : 0.1;
    if (!cli_given("frames") && each < 0) cli_stop(VG_EINPUT, "the times of the frames do not increase: use '--frames'");
    vg_smoother_options o = {.filter = (vg_filter)opts.filter, .threads = cli_threads()};
    o.span = span_in_frames(span, each > 0 ? each : fallback);
    o.root_span = cli_given("root") ? span_in_frames(opts.root, each > 0 ? each : fallback) : o.span;
    size_t reach = make_filter(t, &o);
    t->places = 2 * reach + 2;
    t->label = cli_allocate(t->places, sizeof *t->label, "the frames of the window");
    cli_note("a span of %g frames, of the root %g; %zu frames on either side count", o.span, o.root_span, reach);
}

static void write_vertices(timing *t)
{
    vg_frame *out = &t->label[t->given % t->places];
    while (t->given < t->put && vg_smoother_next(t->smoother, out->values)) {
        cli_stream_put(out);
        out = &t->label[++t->given % t->places];
    }
}

static void write_vectors(timing *t)
{
    vg_err e;
    vg_frame *out = &t->out;
    while (t->given < t->put && vg_vector_smoother_next(t->vectors, out->values, out->root, vg_frame_anchors(out))) {
        if (vg_frame_label(out, &t->label[t->given++ % t->places], &e) < 0) cli_die(&e);
        cli_stream_put(out);
    }
}

/* Swap the frame into the ring, so that its arrays are used again. */
static void add_vertices(timing *t, vg_frame *f)
{
    vg_frame *place = &t->label[t->put % t->places], old = *place;
    vg_frame_drop_all(f); /* the channels belong to the vertices before filtering */
    vg_smoother_add(t->smoother, f->values);
    *place = *f, *f = old;
    t->put++;
    write_vertices(t);
}

static void add_vectors(timing *t, vg_frame *f)
{
    vg_err e;
    double *vectors = t->out.values, *anchors = vg_frame_anchors(&t->out);
    if (t->kind == VG_VERTICES) {
        vg_graph_vectors(t->graph, f->values, vectors);
        vg_graph_root(t->graph, f->values, f->root);
        vg_graph_anchors(f->values, t->h->anchors, t->h->nanchors, anchors);
        vg_vector_smoother_add(t->vectors, vectors, f->root, anchors);
    } else {
        vg_vector_smoother_add(t->vectors, f->values, f->root, vg_frame_anchors(f));
    }
    vg_frame_drop_all(f);
    if (vg_frame_label(&t->label[t->put++ % t->places], f, &e) < 0) cli_die(&e);
    write_vectors(t);
}

static void add_frame(timing *t, vg_frame *f)
{
    if (opts.on == ON_VECTORS) add_vectors(t, f);
    else add_vertices(t, f);
}

static void check_times(timing *t, const vg_frame *f)
{
    if (cli_given("frames")) return;
    double each = t->step != 0 && f->has_time ? f->time - t->last : 0;
    if (fabs(each - t->step) > 0.01 * fabs(t->step))
        cli_stop(VG_EINPUT, "frame '%s' comes %g s after the previous one, not %g s as the first ones: frames that "
                            "are not evenly spaced have no span in seconds: use '--frames'", f->name, each, t->step);
    t->last = f->time;
}

static void filter_in_time(void *context, size_t n, vg_frame *in)
{
    timing *t = context;
    for (size_t i = 0; i < n; i++) {
        if (!t->begun) {
            t->first = in[i], in[i] = (vg_frame){0}, t->begun = true;
            continue;
        }
        if (!t->places) {
            t->step = step_between(&t->first, &in[i]);
            t->last = t->first.time;
            make_smoother(t, t->step);
            add_frame(t, &t->first);
        }
        check_times(t, &in[i]);
        add_frame(t, &in[i]);
    }
}

static void warn_degenerate(const timing *t)
{
    vg_deform_stats c = vg_vector_smoother_get_stats(t->vectors);
    if (c.corners)
        cli_warn("%llu corners without a direction took the rotation of their face (the first in face %llu)",
                 (unsigned long long)c.corners, (unsigned long long)c.first_face);
}

static void finish_in_time(void *context)
{
    timing *t = context;
    if (!t->begun) return;
    if (!t->places) { /* one frame: nothing to filter, but check the options */
        make_smoother(t, 0);
        add_frame(t, &t->first);
    }
    if (opts.on == ON_VERTICES) {
        vg_smoother_end(t->smoother);
        write_vertices(t);
    } else {
        vg_vector_smoother_end(t->vectors);
        write_vectors(t);
        warn_degenerate(t);
    }
}

static void prepare_in_time(void *context, vg_head *h, vg_frame *in)
{
    timing *t = context;
    vg_err e;
    (void)in;
    t->h = h, t->kind = h->kind;
    if (opts.on == ON_VERTICES || h->kind != VG_VECTORS) cli_need_vertices(h, "the input");
    if (opts.on == ON_VERTICES) return;
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_head_graph(&t->graph, h, &e) < 0) cli_die(&e);
    h->kind = VG_VECTORS;
    h->count = vg_graph_corners(t->graph);
    if (vg_frame_shape(&t->out, h, &e) < 0) cli_die(&e);
}

static void smooth_in_time(vg_source *s)
{
    static const step filtering = {
        .batch = 1, .unit = "frames", .init = prepare_in_time, .process = filter_in_time, .finish = finish_in_time};
    timing t = {0};
    step_run(&filtering, &t, s);
    for (size_t i = 0; i < t.places; i++) vg_frame_clear(&t.label[i]);
    free(t.label);
    vg_frame_clear(&t.first);
    vg_frame_clear(&t.out);
    vg_smoother_free(&t.smoother);
    vg_vector_smoother_free(&t.vectors);
    vg_graph_free(&t.graph);
}

/* ---- what moves together ---- */

typedef struct together {
    vg_head *h;
    vg_region_filter *filter;
    vg_poses *poses;
} together;

static void prepare_together(void *context, vg_head *h, vg_frame *in)
{
    together *t = context;
    vg_err e;
    size_t limit = opts.memory < SIZE_MAX ? (size_t)opts.memory : SIZE_MAX;
    (void)in;
    t->h = h;
    cli_need_vertices(h, "the input");
    if (vg_region_filter_new(&t->filter, &h->body.mesh, h->body.reference, cli_threads(), &e) < 0 ||
        vg_poses_new(&t->poses, h, limit, &e) < 0)
        cli_die(&e);
}

static void collect_batch(void *context, size_t n, vg_frame *in)
{
    together *t = context;
    const double *vertices[BATCH];
    vg_err e;
    for (size_t i = 0; i < n; i++) {
        vg_frame_drop_all(&in[i]); /* channels of the vertices are not valid for the new positions */
        vertices[i] = in[i].values;
        if (vg_poses_add(t->poses, &in[i], &e) < 0) cli_die(&e);
    }
    vg_region_filter_look(t->filter, n, vertices);
}

static void apply_batch(together *t, size_t first, size_t n, vg_frame *in, double *room)
{
    const double *from[BATCH];
    double *to[BATCH];
    size_t numbers = 3 * t->h->body.mesh.nv;
    vg_err e;
    for (size_t i = 0; i < n; i++) {
        if (vg_poses_frame(t->poses, first + i, &in[i], &e) < 0) cli_die(&e);
        from[i] = in[i].values, to[i] = room + i * numbers;
    }
    vg_region_filter_apply(t->filter, n, from, to);
    for (size_t i = 0; i < n; i++) {
        if (numbers) memcpy(in[i].values, to[i], numbers * sizeof **to);
        cli_stream_put(&in[i]);
        cli_progress_of("frames written", first + i + 1, vg_poses_count(t->poses));
    }
}

static void write_together(void *context)
{
    together *t = context;
    size_t n = vg_poses_count(t->poses), nv = t->h->body.mesh.nv;
    double d = vg_diagonal(t->h->body.reference, nv), *room;
    vg_frame in[BATCH] = {{0}};
    vg_err e;
    if (n == 0) return;
    cli_working("finding the common motion");
    if (vg_region_filter_learn(t->filter, &e) < 0) cli_die(&e);
    cli_note("noise of %.3g D (root mean square of a vertex)", d > 0 ? vg_region_filter_noise(t->filter) / d : 0);
    room = cli_allocate(BATCH * 3 * nv, sizeof *room, "a batch of frames");
    for (size_t i = 0; i < n; i += BATCH) apply_batch(t, i, n - i < BATCH ? n - i : BATCH, in, room);
    for (size_t i = 0; i < BATCH; i++) vg_frame_clear(&in[i]);
    free(room);
}

static void smooth_together(vg_source *s)
{
    static const step regions = {
        .batch = BATCH, .unit = "frames", .init = prepare_together, .process = collect_batch, .finish = write_together};
    together t = {0};
    step_run(&regions, &t, s);
    vg_region_filter_free(&t.filter);
    vg_poses_free(&t.poses);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    if (opts.filter == TOGETHER && (cli_given("seconds") || cli_given("frames") || cli_given("root")))
        cli_usage("'--filter together' does not use times: it takes no '--seconds', '--frames' or '--root'");
    if (opts.filter == TOGETHER && opts.on == ON_VECTORS)
        cli_usage("'--filter together' works on vertices: it takes no '--on vectors'");
    if (opts.filter != TOGETHER && cli_given("memory")) cli_usage("option '--memory' needs '--filter together'");
    vg_source *s = cli_source(operands, n);
    if (opts.filter == TOGETHER) smooth_together(s);
    else smooth_in_time(s);
    vg_source_close(&s);
    cli_finish(0);
}
