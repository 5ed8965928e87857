/* vg-sample: give the poses of a signal, at any times, edited, along another curve.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "poses.h"
#include "signal_texts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    const char *at, *retime, *edit, *curve, *onto;
    double fps, speed;
    long frames;
} opts;

static const cli_option options[] = {
    {"at", 0, "LIST", "at these times: numbers, and ranges A:B:STEP, separated by commas; frame 1 is at time 1",
     .text = &opts.at, .excludes = "frames|fps|speed|retime|curve"},
    {"frames", 0, "N", "N frames, evenly from the first to the last", .integer = &opts.frames, .least = 1, .most = 1e9,
     .excludes = "fps|speed"},
    {"fps", 0, "RATE", "frames per second; needs a signal whose frames have times", .number = &opts.fps, .least = 1e-6,
     .most = 1e6, .excludes = "speed|curve"},
    {"speed", 0, "X", "X times as fast: below 1 there are frames in between", .number = &opts.speed, .least = 1e-6,
     .most = 1e6, .excludes = "curve"},
    {"retime", 0, "FILE", "lines of an old and a new time, for varying speed", .text = &opts.retime, .reads = true,
     .excludes = "curve"},
    {"edit", 0, "FILE", "change the signal by these lines first: control, insert, remove, frame, site, time",
     .text = &opts.edit, .reads = true},
    {"curve", 0, "FILE", "poses along this curve through the plane: lines 'X Y' it goes through, or 'control X Y'",
     .text = &opts.curve, .reads = true},
    {"onto", 0, "POSES", "another body: its poses replace those of vg-fitsignal --examples",
     .text = &opts.onto, .reads = true},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-sample",
    .synopsis = "[options] [FILE]",
    .summary = "sample the poses of a signal at any times",
    .options = options,
    .most_operands = 1,
    .writes_stream = true};

enum { MOST_FRAMES = 100000000 };

/* What is sampled: at times, or at places of the plane. */
typedef struct plan {
    size_t n;
    double *time, *place; /* one of them */
} plan;

static void add_time(plan *p, size_t *cap, double time)
{
    if (p->n == MOST_FRAMES) cli_stop(VG_EARG, "more than %d frames are requested", MOST_FRAMES);
    if (p->n == *cap) *cap = *cap ? 2 * *cap : 64, p->time = cli_resize(p->time, *cap, sizeof *p->time, "times");
    p->time[p->n++] = time;
}

/* ---- at which times ---- */

/* "A:B:STEP" or one number; false: it is neither. */
static bool parse_range(char *text, double range[3])
{
    int n = 0;
    for (char *part = text; part && n < 3; n++) {
        char *colon = strchr(part, ':');
        if (colon) *colon++ = 0;
        const char *end = cli_scan_number(part, &range[n]);
        if (!end || *end) return false;
        part = colon;
        if (part && n == 2) return false;
    }
    if (n == 1) range[1] = range[0], range[2] = 1;
    if (n == 2) range[2] = range[1] >= range[0] ? 1 : -1;
    return range[2] != 0 && (range[1] - range[0]) * range[2] >= 0;
}

static void plan_list(plan *p, const vg_signal *s)
{
    char *list = cli_copy_text(opts.at, "times"), *next = list;
    size_t cap = 0;
    while (next) {
        double range[3];
        char *part = next;
        if ((next = strchr(part, ','))) *next++ = 0;
        if (!parse_range(part, range))
            cli_usage("option '--at' needs times and ranges A:B:STEP, as in '1,4.5,10:20:0.25', not '%s'", opts.at);
        for (size_t i = 0;; i++) {
            double t = range[0] + (double)i * range[2];
            if ((t - range[1]) * range[2] > 1e-9 * fabs(range[2]) * fabs(range[2])) break;
            if (!(t >= 1 - 1e-9 && t <= (double)s->n + 1e-9))
                cli_stop(VG_EARG, "there is no time %g: the signal goes from 1 to %zu", t, s->n);
            add_time(p, &cap, t);
        }
    }
    free(list);
}

static double seconds_between(const vg_signal *s)
{
    double all = s->timed ? s->times[s->n - 1] - s->times[0] : 0;
    return all > 0 ? all / (double)(s->n - 1) : 0;
}

/* Evenly: how many old frames a step takes, from time 1 to the last, or through the retiming. */
static void plan_even(plan *p, const vg_signal *s, const vg_retime *r)
{
    double first = r->n ? r->new_time[0] : 1, last = r->n ? r->new_time[r->n - 1] : (double)s->n, step = 1;
    size_t cap = 0;
    if (opts.speed > 0) step = opts.speed;
    if (opts.fps > 0) {
        double between = seconds_between(s);
        if (!(between > 0)) cli_stop(VG_EINPUT, "the signal's frames have no times: --fps needs them (vg-encode --fps)");
        step = 1 / (between * opts.fps);
    }
    if (opts.frames) step = opts.frames > 1 ? (last - first) / (double)(opts.frames - 1) : 1;
    double count = opts.frames ? (double)opts.frames : floor((last - first) / step + 1e-9) + 1;
    if (!(count <= MOST_FRAMES)) cli_stop(VG_EARG, "more than %d frames are requested", MOST_FRAMES);
    for (size_t i = 0; i < (size_t)count; i++) {
        vg_err e;
        double t = fmin(first + (double)i * step, last);
        if (r->n && vg_retime_at(r, t, &t, &e) < 0) cli_die(&e);
        add_time(p, &cap, t);
    }
}

/* ---- files ---- */

static void read_edits(vg_signal *s, vg_retime *r)
{
    vg_err e;
    size_t size;
    char *text = cli_read_file(opts.edit, &size);
    if (vg_signal_edit(s, r, text, size, opts.edit, &e) < 0) cli_die(&e);
    if (r->n == 1) cli_stop(VG_EINPUT, "'%s' has one line 'time': at least two are needed", opts.edit);
    free(text);
}

static void plan_curve(plan *p, const vg_signal *s)
{
    vg_err e;
    size_t n;
    bool controls;
    double *point = read_curve(opts.curve, &n, &controls);
    p->n = opts.frames ? (size_t)opts.frames : s->n;
    if (p->n > MOST_FRAMES) cli_stop(VG_EARG, "more than %d frames are requested", MOST_FRAMES);
    p->place = cli_allocate(p->n, 2 * sizeof *p->place, "the curve");
    if (vg_signal_sketch(point, n, controls, p->n, p->place, &e) < 0) cli_stop(e.code, "'%s': %s", opts.curve, e.message);
    free(point);
}

/* ---- sampling ---- */

/* What makes frames of shapes: nothing when these are vertices. */
typedef struct making {
    vg_unshaper *unshaper;
    vg_graph *graph;
    double *shapes, root[3]; /* of a batch; of the reference */
} making;

/* Shapes that are not vertices are written as vectors. */
static void prepare_vectors(making *m, vg_head *h, const vg_signal *s)
{
    vg_err e;
    if (s->space == VG_SPACE_VERTICES) return;
    if (vg_head_graph(&m->graph, h, &e) < 0 || vg_unshaper_new(&m->unshaper, s, m->graph, h->body.reference, &e) < 0) cli_die(&e);
    vg_graph_root(m->graph, h->body.reference, m->root);
    h->kind = VG_VECTORS, h->count = vg_graph_corners(m->graph), h->nanchors = 0;
    m->shapes = cli_allocate(VG_SAMPLER_BATCH, s->d * sizeof *m->shapes, "shapes");
}

static void finish_vectors(making *m, const vg_sampler *sampler, const double *time, const double *shape, vg_frame *f)
{
    vg_err e;
    double turn[4], shift[3], root[3];
    if (vg_unshaper_vectors(m->unshaper, shape, f->values, &e) < 0) cli_die(&e);
    memcpy(f->root, m->root, sizeof f->root);
    if (!time || !vg_sampler_root(sampler, *time, turn, shift)) return;
    vg_quat_apply(turn, m->root, root);
    for (int k = 0; k < 3; k++) f->root[k] = root[k] + shift[k];
    for (size_t i = 0; i < vg_graph_corners(m->graph); i++) vg_quat_apply(turn, f->values + 3 * i, f->values + 3 * i);
}

/* The name of the frame at or before the time, and the distance from it. */
static void label(vg_frame *f, const vg_signal *s, const plan *p, size_t i)
{
    vg_err e;
    char name[300];
    f->has_time = false;
    if (p->place) snprintf(name, sizeof name, "curve_%zu", i + 1);
    else {
        double t = p->time[i], whole = floor(t + 1e-9), rest = t - whole;
        size_t at = (size_t)fmin(fmax(whole, 1), (double)s->n) - 1;
        if (rest > 1e-9) snprintf(name, sizeof name, "%.250s+%.6g", s->names[at], rest);
        else snprintf(name, sizeof name, "%.290s", s->names[at]);
        double between = seconds_between(s);
        if (opts.at || opts.frames || !s->timed) {
            f->has_time = s->timed;
            if (s->timed) f->time = s->times[at] + (at + 1 < s->n ? rest * (s->times[at + 1] - s->times[at]) : 0);
        } else {
            f->has_time = true;
            f->time = s->times[0] + (double)i * (opts.fps > 0 ? 1 / opts.fps : between);
        }
    }
    size_t cut = strlen(name);
    while (cut && ((unsigned char)name[cut - 1] & 0xc0) == 0x80 && cut >= 290) name[--cut] = 0; /* no half letter */
    if (vg_frame_rename(f, name, &e) < 0) cli_die(&e);
}

static void sample_batch(vg_sampler *sampler, const vg_signal *s, const plan *p, size_t first, size_t n, double *x,
                         vg_frame *frames, making *m, size_t nv)
{
    double *shapes[VG_SAMPLER_BATCH], at[2 * VG_SAMPLER_BATCH];
    for (size_t i = 0; i < n; i++) {
        if (p->place) memcpy(at + 2 * i, p->place + 2 * (first + i), 2 * sizeof *at);
        else vg_sampler_position(sampler, p->time[first + i], at + 2 * i);
        shapes[i] = m->unshaper ? m->shapes + i * s->d : frames[i].values;
    }
    vg_sampler_coordinates(sampler, n, at, x);
    vg_sampler_shapes(sampler, n, x, shapes);
    for (size_t i = 0; i < n; i++) {
        if (m->unshaper) finish_vectors(m, sampler, p->time ? p->time + first + i : NULL, shapes[i], &frames[i]);
        else if (p->time) vg_sampler_place(sampler, p->time[first + i], nv, shapes[i]);
        label(&frames[i], s, p, first + i);
        cli_stream_put(&frames[i]);
        cli_progress("poses", first + i + 1);
    }
}

static void sample_signal(vg_head *h, const vg_signal *s, const plan *p)
{
    vg_err e;
    static vg_frame frames[VG_SAMPLER_BATCH];
    vg_sampler *sampler;
    making m = {0};
    double *x = cli_allocate(VG_SAMPLER_BATCH, (s->m + 1) * sizeof *x, "coordinates");
    prepare_vectors(&m, h, s);
    if (vg_sampler_new(&sampler, s, h->precision == VG_F32 && !m.unshaper, &e) < 0) cli_die(&e);
    cli_stream_open(h);
    for (size_t i = 0; i < VG_SAMPLER_BATCH; i++)
        if (vg_frame_shape(&frames[i], h, &e) < 0) cli_die(&e);
    for (size_t first = 0; first < p->n; first += VG_SAMPLER_BATCH) {
        size_t n = p->n - first < VG_SAMPLER_BATCH ? p->n - first : VG_SAMPLER_BATCH;
        sample_batch(sampler, s, p, first, n, x, frames, &m, h->body.mesh.nv);
    }
    for (size_t i = 0; i < VG_SAMPLER_BATCH; i++) vg_frame_clear(&frames[i]);
    vg_sampler_free(&sampler);
    vg_unshaper_free(&m.unshaper);
    vg_graph_free(&m.graph);
    free(m.shapes);
    free(x);
}

/* The signal goes to the body of --onto, whose head is returned; source: to be closed. */
static vg_head *change_body(vg_head *h, vg_signal *s, vg_source **source)
{
    vg_err e;
    *source = cli_source((char *[]){(char *)opts.onto}, 1);
    vg_head *to = vg_source_head(*source);
    char name[200];
    snprintf(name, sizeof name, "'%.190s'", opts.onto);
    cli_need_vertices(to, name);
    poses p = poses_read(*source, VG_SIGNAL_FRAMES);
    if (vg_signal_onto(s, &h->body, &to->body, p.values, p.n, &e) < 0) cli_stop(e.code, "%s: %s", name, e.message);
    p.values = NULL;
    poses_clear(&p);
    if (vg_head_merge_trace(to, h, &e) < 0) cli_die(&e);
    vg_signal_clear(&to->signal);
    return to;
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_source *source = cli_source(operands, n);
    vg_head *h = vg_source_head(source);
    vg_frame frame = {0};
    vg_retime retime = {0};
    plan p = {0};
    if (!h->signal.n) cli_stop(VG_EINPUT, "the input holds no signal: make one with vg-fitsignal");
    while (cli_next(source, &frame)) continue; /* to the end, so that damage is seen; a signal has no frames */
    vg_frame_clear(&frame);
    vg_signal s;
    vg_head_take_out(&s, h, "signal"); /* the poses come without it */
    if (opts.edit) read_edits(&s, &retime);
    if (opts.retime && retime.n) cli_usage("--retime excludes lines 'time' of --edit");
    if (opts.retime) read_retime(opts.retime, s.n, &retime);
    if (opts.at) plan_list(&p, &s);
    else if (opts.curve) plan_curve(&p, &s);
    else plan_even(&p, &s, &retime);
    vg_source *other = NULL;
    if (opts.onto) h = change_body(h, &s, &other);
    sample_signal(h, &s, &p);
    cli_stream_end(vg_source_tail(source));
    vg_retime_clear(&retime);
    vg_signal_clear(&s);
    free(p.time);
    free(p.place);
    vg_source_close(&source);
    vg_source_close(&other);
    cli_finish(0);
}
