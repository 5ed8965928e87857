/* vg-fitsignal: fit continuous signals for time, pose and shape to a sequence.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "poses.h"
#include "report.h"
#include "signal_texts.h"
#include "signals.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    double tolerance;
    long m, l, k, pick;
    size_t root, space, sites, basis; /* numbers of choices */
    const char *layout, *place, *examples, *report;
    size_t npins;
    vg_pin *pins;
} opts = {.tolerance = 1e-2};

static void take_pin(const char *text, void *context)
{
    const char *equals = strchr(text, '=');
    double number, at[2];
    (void)context;
    if (!equals || cli_scan_number(text, &number) != equals || !(number >= 1 && number <= VG_SIGNAL_FRAMES) || number != floor(number) ||
        cli_parse_numbers(equals + 1, at, 2) != 2)
        cli_usage("option '--pin' needs a frame and a place, '12=0.5,-1', not '%s'", text);
    opts.pins = cli_resize(opts.pins, opts.npins + 1, sizeof *opts.pins, "pins");
    opts.pins[opts.npins++] = (vg_pin){.frame = (size_t)number - 1, .at = {at[0], at[1]}};
}

static const cli_option options[] = {
    {"tolerance", 't', "X", "largest distance of a vertex, in D (default 0.01)", .number = &opts.tolerance,
     .least = 1e-12, .most = 10},
    {"coordinates", 'm', "M", "how many shape coordinates (default: as few as the tolerance allows)",
     .integer = &opts.m, .least = 1, .most = 1000},
    {"pose-sites", 'l', "L", "how many sites of the pose signal (default: as few as the tolerance allows)",
     .integer = &opts.l, .least = 1, .most = 1000},
    {"controls", 'k', "K", "how many control points of the curve (default: as few as the tolerance allows)",
     .integer = &opts.k, .least = 4, .most = 1002},
    {"root", 0, "rigid|none", "the motion of the whole body is a separate signal (default), or part of the shapes",
     .choice = &opts.root},
    {"space", 0, "vertices|vectors|gradients|rotations|lengths",
     "the numbers of a shape: positions (default), rotations of corners or triangles, rotations or angles between "
     "triangles",
     .choice = &opts.space},
    {"layout", 0, "auto|plain|ring[=C]|time[=C]",
     "how frames are laid out in the plane: by distances alone, with a cycle, with time (default auto)",
     .text = &opts.layout},
    {"pin", 0, "FRAME=X,Y", "put this frame there in the plane; may be repeated", .take = take_pin,
     .excludes = "place"},
    {"place", 0, "FILE", "positions of all frames in the plane: lines of two numbers", .text = &opts.place, .reads = true,
     .excludes = "layout"},
    {"sites", 0, "farthest|gain", "sites are frames of the largest error (default), or those that help most",
     .choice = &opts.sites},
    {"basis", 0, "double|single|int16", "precision of the stored basis (default double)", .choice = &opts.basis},
    {"examples", 0, "POSES", "shapes are sums of the differences of these poses from the first of them",
     .text = &opts.examples, .reads = true, .excludes = "coordinates|space"},
    {"pick", 0, "N", "no fit: name the N frames from which the others are predicted best", .integer = &opts.pick,
     .least = 1, .most = 1000},
    {"report", 0, "FILE", "write what was fitted, and every frame's error, to FILE; '-' is standard output",
     .text = &opts.report},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-fitsignal",
    .synopsis = "[options] [FILE ...]",
    .summary = "fit continuous signals for time, pose and shape to a sequence",
    .options = options,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .reports_json = true,
    .threaded = true};

/* ---- options ---- */

static void parse_layout(vg_signal_options *o)
{
    static const char *const names[] = {"auto", "plain", "ring", "time"};
    const char *text = opts.layout ? opts.layout : "auto", *equals = strchr(text, '=');
    size_t n = equals ? (size_t)(equals - text) : strlen(text), i = 0;
    while (i < 4 && (strlen(names[i]) != n || memcmp(names[i], text, n))) i++;
    if (i == 4 || (equals && i < 2))
        cli_usage("option '--layout' needs auto, plain, ring, ring=C, time or time=C, not '%s'", text);
    o->layout = (vg_layout)i;
    if (equals && (cli_parse_numbers(equals + 1, &o->weight, 1) != 1 || !(o->weight > 0 && o->weight <= 1e6)))
        cli_usage("option '--layout' needs a weight above 0 and up to a million after '=', not '%s'", equals + 1);
}

/* ---- the report ---- */

static const char *layout_name(vg_layout layout)
{
    static const char *const names[] = {"auto", "plain", "ring", "time", "placed"};
    return names[layout];
}

static void report_sizes(report *t, const vg_signal *s, const vg_signal_stats *r)
{
    report_put(t, "frames", "frames", report_count(s->n));
    report_put(t, "control_points", "control points (k)", report_count(s->k));
    report_put(t, "sites", "sites (l)", report_count(s->l));
    report_put(t, "coordinates", "shape coordinates (m)", report_count(s->m));
    report_put(t, "rank", "rank", report_count(r->rank));
    report_put(t, "space", "shapes are of", report_text(signal_space(s->space)));
    report_put(t, "dimension", "numbers of a shape (d)", report_count(s->d));
    size_t floats = vg_signal_floats(s);
    report_put(t, "numbers", "numbers of the signal", report_count(floats));
    report_put(t, "compression", "numbers of the poses beside them", report_number((double)(s->n * s->d) / (double)floats));
    report_put(t, "error_shape", "largest error of the shape signal, D", report_number(s->error_shape));
    report_put(t, "error_pose", "with the pose signal, D", report_number(s->error_pose));
    report_put(t, "error", "with the time signal, D", report_number(s->error_time));
    report_put(t, "error_rms", "root mean square of all, D", report_number(s->error_rms));
}

static void report_layout(report *t, const vg_signal *s, const vg_signal_stats *r)
{
    static const report_column trials[] = {{"layout", "layout", false}, {"weight", "weight", false},
                                           {"ratio", "deviation between frames", false}};
    report_put(t, "layout", "layout", report_text(layout_name(s->layout)));
    report_put(t, "layout_weight", NULL, report_number(s->layout_weight));
    report_put(t, "layout_ratio", "deviation between frames beside straight lines", report_number(s->layout_ratio));
    report_put(t, "period", "frames of a cycle", r->period > 0 ? report_number(r->period) : report_nothing());
    report_put(t, "crossings", "crossings of the curve", report_count(r->ncrossings));
    report_put(t, "jumps", "jumps left in the logarithms",
               s->space == VG_SPACE_VERTICES ? report_nothing() : report_count(r->jumps));
    if (r->ntrials) report_table(t, "layouts", "layouts tried", false, trials, 3);
    for (size_t i = 0; i < r->ntrials; i++)
        report_row(t, (report_value[]){report_text(layout_name(r->trials[i].layout)), report_number(r->trials[i].weight),
                                       report_number(r->trials[i].ratio)});
}

static void report_frames(report *t, const vg_signal *s, const vg_signal_stats *r)
{
    static const report_column crossings[] = {{"time", "crossing at time", false}, {"again", "and at", false}};
    static const report_column frames[] = {{"frame", "frame", false}, {"name", "name", false}, {"error", "error, D", false},
                                           {"x", "x", false}, {"y", "y", false}};
    if (r->ncrossings) report_table(t, "crossing", "", false, crossings, 2);
    for (size_t i = 0; i < r->ncrossings; i++)
        report_row(t, (report_value[]){report_number(r->crossing[2 * i]), report_number(r->crossing[2 * i + 1])});
    report_table(t, "frame_errors", "", false, frames, 5);
    for (size_t i = 0; i < s->n; i++)
        report_row(t, (report_value[]){report_count(i + 1), report_text(s->names[i]), report_number(r->frame_error[i]),
                                       report_number(s->position[2 * i]), report_number(s->position[2 * i + 1])});
}

static void write_report(const vg_signal *s, const vg_signal_stats *r)
{
    report *t = report_new();
    report_sizes(t, s, r);
    report_layout(t, s, r);
    report_frames(t, s, r);
    cli_redirect(opts.report, false);
    report_print(t, cli_text_open(), cli_json());
    cli_text_end();
    report_free(&t);
}

static void note_fit(const vg_signal *s, const vg_signal_stats *r)
{
    cli_note("%zu frames: %zu control points, %zu sites, %zu shape coordinates; largest error %.3g D, rms %.3g D", s->n,
            s->k, s->l, s->m, s->error_time, s->error_rms);
    if (s->layout != VG_LAYOUT_PLACED)
        cli_note("layout %s %g, deviation between frames %.3g of that of straight lines, %zu crossings",
                 layout_name(s->layout), s->layout_weight, s->layout_ratio, r->ncrossings);
    if (!(opts.m || opts.l || opts.k || opts.examples) && s->error_time > opts.tolerance)
        cli_warn("the tolerance of %g D is not reached: frames that are nearly at one point in the plane differ by "
                 "up to %.3g D", opts.tolerance, s->error_time);
    if (s->layout_ratio > 2)
        cli_warn("between frames the signal deviates %.1f times as much as straight lines: try another --layout, or "
                 "--pin", s->layout_ratio);
}

/* ---- which frames to sculpt ---- */

/* The frames as vg-encode --take wants them: "3,17,40". */
static char *list_frames(const uint32_t *frame, size_t n)
{
    size_t size = 12 * n + 1, at = 0;
    char *list = cli_allocate(size, 1, "frames");
    uint32_t *sorted = cli_allocate(n, sizeof *sorted, "frames");
    memcpy(sorted, frame, n * sizeof *sorted);
    qsort(sorted, n, sizeof *sorted, cli_by_number);
    for (size_t i = 0; i < n; i++) at += (size_t)snprintf(list + at, size - at, "%s%u", i ? "," : "", sorted[i]);
    free(sorted);
    return list;
}

/* Frames count from 0 here, as vg-encode --take and vg-diff --frames count them. */
static void pick_frames(const vg_head *h, poses *p)
{
    vg_err e;
    uint32_t *frame;
    double *left;
    size_t n = (size_t)opts.pick;
    static const report_column columns[] = {{"frame", "frame", false}, {"name", "name", false},
                                            {"left", "left in the others", false}};
    if (n > p->n) cli_stop(VG_EARG, "there are %zu frames to pick from, not %zu", p->n, n);
    frame = cli_allocate(n, sizeof *frame, "frames");
    left = cli_allocate(n, sizeof *left, "frames");
    cli_working("choosing poses");
    if (vg_signal_pick(&h->body, p->values, p->n, n, cli_threads(), frame, left, &e) < 0) cli_die(&e);
    report *t = report_new();
    char *list = list_frames(frame, n);
    report_put(t, "take", "take", report_text(list));
    report_table(t, "frames", "", false, columns, 3);
    for (size_t i = 0; i < n; i++)
        report_row(t, (report_value[]){report_count(frame[i]), report_text(p->names[frame[i]]), report_number(left[i])});
    report_print(t, cli_text_open(), cli_json());
    cli_text_end();
    report_free(&t);
    free(list);
    cli_finish(0);
}

/* ---- the work ---- */

int main(int argc, char **argv)
{
    char **operands;
    vg_err e;
    vg_signal_stats r;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_signal_options o = {.tolerance = opts.tolerance, .m = (size_t)opts.m, .l = (size_t)opts.l, .k = (size_t)opts.k,
                           .root = opts.root == 0, .space = (vg_space)(VG_SPACE_VERTICES + opts.space), .gain = opts.sites == 1, .pins = opts.pins, .npins = opts.npins,
                           .bits = (size_t[]){64, 32, 16}[opts.basis], .threads = cli_threads()};
    parse_layout(&o);
    vg_source *source = cli_source(operands, n);
    vg_head *h = vg_source_head(source);
    cli_need_vertices(h, "the input");
    poses p = poses_read(source, VG_SIGNAL_FRAMES);
    if (opts.pick) pick_frames(h, &p);
    if (opts.place) o.place = read_places(opts.place, p.n), o.layout = VG_LAYOUT_PLACED;
    poses x = {0};
    if (opts.examples) x = poses_load(opts.examples, VG_SIGNAL_FRAMES, &h->body.mesh, h);
    o.examples = x.values, o.nexamples = x.n;
    vg_signal_clear(&h->signal);
    vg_graph *graph = NULL;
    if (o.space != VG_SPACE_VERTICES && (vg_head_prepare_vectors(h, &e) < 0 || vg_head_graph(&graph, h, &e) < 0)) cli_die(&e);
    o.graph = graph;
    cli_working("fitting the signal");
    if (vg_signal_fit(&h->signal, &h->body, p.values, p.n, &o, &r, &e) < 0) cli_die(&e);
    poses_name(&p, &h->signal);
    poses_clear(&x);
    vg_graph_free(&graph);
    note_fit(&h->signal, &r);
    cli_stream_open(h);
    cli_stream_end(vg_source_tail(source));
    if (opts.report) write_report(&h->signal, &r);
    vg_signal_stats_clear(&r);
    vg_source_close(&source);
    cli_finish(0);
}
