/* vg-diff.c: measures the distance of a sequence from the truth, and answers whether it is within a tolerance; the
 * error of each vertex can be written to a stream. Measures are in lib/model/measures.c; vg-view draws pictures of
 * the error.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "options.h"
#include "error_plot.h"
#include "report.h"
#include "surfaces.h"
#include "units.h"

#include <math.h>

enum which { MEAN, RMS, P95, MAX };

static struct {
    double tolerance; /* in units of D, or `metres`; negative: none was asked for */
    bool metres;
    const char *limit; /* the tolerance as it was said */
    const char *unit;  /* of the meshes */
    const char *of, *heat, *plot;
    size_t which; /* of enum which */
    bool centred, frames, surface;
} opts = {.tolerance = -1, .of = "max", .which = MAX};
static const char *report_file; /* NULL: standard output */

/* "0.001", "1e-3D", "0.1%" of D; "0.1mm" */
static void take_tolerance(const char *text, void *context)
{
    char number[64];
    const char *unit = text + strspn(text, "0123456789.+-eE"), *named = unit;
    (void)context;
    if (!strcmp(text, "inf")) named = unit = text + 3;
    size_t n = (size_t)(unit - text);
    double x = -1, metres = 0;
    if (n && n < sizeof number) {
        memcpy(number, text, n);
        number[n] = 0;
        x = strcmp(number, "inf") ? (cli_parse_numbers(number, &x, 1) == 1 ? x : -1) : INFINITY;
    }
    bool of_D = !*named || !strcmp(named, "D") || !strcmp(named, "%");
    if (!of_D) metres = unit_metres(named, strlen(named));
    if (!(x >= 0) || (!of_D && metres <= 0))
        cli_usage("option '--tolerance' needs a number of at least 0, in D, as 1e-3 or 1e-3D or 0.1%%, or with a unit, as 0.1mm, not '%s'",
                  text);
    opts.tolerance = *named == '%' ? x / 100 : of_D ? x : x * metres;
    opts.metres = !of_D, opts.limit = text;
}

static const cli_option options[] = {
    {.name = "tolerance", .letter = 't', .value = "X[UNIT]",
     .help = "exit 1 when the error exceeds X, in units of D, in per cent of it, or in a unit of length",
     .take = take_tolerance},
    {.name = "unit", .value = "UNIT", .help = "the unit of the meshes, for such a tolerance (default: m)",
     .text = &opts.unit, .needs = "tolerance"},
    {.name = "surface", .help = "measure between the surfaces, in both directions, with any vertices and faces",
     .flag = &opts.surface, .excludes = "centred|plot"},
    {.name = "of", .value = "mean|rms|p95|max", .help = "the error to which it applies (default: max)",
     .text = &opts.of, .choice = &opts.which, .needs = "tolerance"},
    {.name = "centred", .letter = 'c', .help = "move the centroid of every pose to 0 before comparing",
     .flag = &opts.centred},
    {.name = "frames", .help = "list the error of every frame", .flag = &opts.frames},
    {.name = "heat", .value = "FILE", .text = &opts.heat,
     .help = "write RESULT with the error of each vertex as a stream for vg-view; '-': instead of the report"},
    {.name = "plot", .value = "FILE", .text = &opts.plot,
     .help = "draw the errors of the frames, and their distribution, as FILE.svg or FILE.png"},
    {0},
};

static const cli_program program = {
    .name = "vg-diff",
    .synopsis = "[options] TRUTH RESULT",
    .summary = "measure the distance of the poses of RESULT from those of TRUTH",
    .options = options,
    .most_operands = 2,
    .writes_text = true,
    .traces = true,
    .threaded = true,
};

/* Poses that are measured together: some for each thread, but no more than this holds; one for each in any case. */
enum { POSES_PER_THREAD = 4, BATCH_BYTES = 32 << 20 };

/* One of the two sequences. */
typedef struct side {
    const char *name;
    vg_source *source;
    vg_head *head;
    size_t frames; /* read so far */
} side;

/* Pairs of frames that are measured together. */
typedef struct batch {
    size_t n, most;
    vg_frame *truth, *result;
    const double **poses[2]; /* their values */
    double **errors;
    vg_pose_error *found;
} batch;

/* What is known when both sequences have been read. */
typedef struct findings {
    vg_measure_stats measures;
    size_t frames; /* measured so far */
    error_curves curves; /* for --plot */
    double worst;
    char *worst_frame; /* name of the frame with the largest error */
} findings;

static const report_column frame_columns[] = {
    {.key = "frame", .title = "frame"},   {.key = "name", .title = "name"},     {.key = "mean", .title = "mean"},
    {.key = "p95", .title = "p95"},       {.key = "max", .title = "max"},       {.key = "mean_D", .title = "mean/D"},
    {.key = "p95_D", .title = "p95/D"},   {.key = "max_D", .title = "max/D"}};
static const report_column error_columns[] = {
    {.key = "measure", .title = "vertex error"}, {.key = "error", .title = "mesh units"},
    {.key = "D", .title = "in D"},               {.title = ""},
    {.key = "vertex", .json_only = true},        {.key = "frame", .json_only = true},
    {.key = "frame_name", .json_only = true}};
static const report_column face_columns[] = {
    {.key = "measure", .title = "face error"}, {.key = "mean", .title = "mean"},
    {.key = "sd", .title = "deviation"},       {.key = "max", .title = "max"}};
static const report_column planarity_columns[] = {
    {.key = "sequence", .title = "planarity"}, {.key = "faces", .title = "faces"}, {.key = "mean", .title = "mean"},
    {.key = "max", .title = "max"}, {.key = "histogram", .title = "in tenths from 0 to 1"}};

enum { COLUMNS_FRAME = 8, COLUMNS_ERROR = 7, COLUMNS_FACE = 4, COLUMNS_PLANARITY = 5 };

/* The answer is no: in a line, but nothing is said with --quiet, as by 'cmp -s'. */
static void answer_no(const char *line) __attribute__((noreturn));
static void answer_no(const char *line)
{
    if (cli_quiet()) cli_finish(1);
    cli_no("%s", line);
}

/* The answer "these cannot be compared": a line for people, and for programs an object that says so. */
static void cannot_compare(const char *reason) __attribute__((noreturn));
static void cannot_compare(const char *reason)
{
    if (cli_json()) {
        report *r = report_new();
        report_put(r, "comparable", NULL, report_flag(false));
        report_put(r, "reason", NULL, report_text(reason));
        report_print(r, cli_text_open(), true);
        report_free(&r);
        cli_text_end();
    }
    answer_no(reason);
}

static void open_side(side *s, char *operand)
{
    s->name = strcmp(operand, "-") ? operand : "standard input";
    s->source = cli_source(&operand, 1);
    s->head = vg_source_head(s->source);
    char subject[420];
    snprintf(subject, sizeof subject, "'%.400s'", s->name);
    cli_need_vertices(s->head, subject);
}

static bool next_frame(side *s, vg_frame *f)
{
    bool more = cli_next(s->source, f);
    s->frames += more;
    return more;
}

static void check_same_mesh(const side *truth, const side *result)
{
    char names[2][200];
    vg_err e;
    snprintf(names[0], sizeof names[0], "'%.190s'", truth->name);
    snprintf(names[1], sizeof names[1], "'%.190s'", result->name);
    if (vg_mesh_same(&truth->head->body.mesh, names[0], &result->head->body.mesh, names[1], &e) < 0)
        cannot_compare(e.message);
}

static double in_diagonals(double x, double diagonal)
{
    return x == 0 ? 0 : x / diagonal; /* infinite for a mesh without extent */
}

static void report_frame(report *r, size_t i, const char *name, const double x[3], double diagonal)
{
    const report_value row[COLUMNS_FRAME] = {
        report_count(i), report_text(name), report_number(x[0]), report_number(x[1]), report_number(x[2]),
        report_number(in_diagonals(x[0], diagonal)), report_number(in_diagonals(x[1], diagonal)),
        report_number(in_diagonals(x[2], diagonal))};
    report_row(r, row);
}

/* ---- heat: the result, with the error of each vertex ---- */

static void open_heat(side *result, const side *truth)
{
    vg_err e;
    if (!opts.heat) return;
    cli_redirect(opts.heat, true);
    if (vg_head_merge_trace(result->head, truth->head, &e) < 0) cli_die(&e);
    cli_stream_open(result->head);
}

static void put_heat(vg_frame *f, size_t nv, const double *errors, double diagonal)
{
    const char *name = opts.centred ? "centred error" : "error", *unit = diagonal > 0 ? "D" : "";
    vg_err e;
    if (vg_frame_set_scalars(f, name, unit, errors, nv, &e) < 0) cli_die(&e);
    double *scalars = vg_frame_scalars(f)->numbers;
    for (size_t v = 0; v < nv && diagonal > 0; v++) scalars[v] /= diagonal;
    cli_stream_put(f);
}

/* ---- poses ---- */

/* What --heat writes goes out frame by frame: who looks at it may be waiting. */
static size_t batch_size(size_t nv)
{
    size_t threads = (size_t)cli_threads(), room = BATCH_BYTES / (7 * sizeof(double)) / (nv + 1);
    if (opts.heat) return 1;
    return room < threads ? threads : room < POSES_PER_THREAD * threads ? room : POSES_PER_THREAD * threads;
}

static void make_batch(batch *b, size_t nv)
{
    static const char what[] = "a batch of poses";
    b->most = batch_size(nv);
    b->truth = cli_allocate(b->most, sizeof *b->truth, what);
    b->result = cli_allocate(b->most, sizeof *b->result, what);
    for (int i = 0; i < 2; i++) b->poses[i] = cli_allocate(b->most, sizeof *b->poses[i], what);
    b->found = cli_allocate(b->most, sizeof *b->found, what);
    b->errors = cli_allocate(b->most, sizeof *b->errors, what);
    for (size_t i = 0; i < b->most; i++) b->errors[i] = cli_allocate(nv, sizeof **b->errors, what);
}

static void clear_batch(batch *b)
{
    for (size_t i = 0; i < b->most; i++) {
        vg_frame_clear(&b->truth[i]);
        vg_frame_clear(&b->result[i]);
        free(b->errors[i]);
    }
    free(b->truth);
    free(b->result);
    for (int i = 0; i < 2; i++) free(b->poses[i]);
    free(b->found);
    free(b->errors);
}

/* Read frames that both have until the batch is full; false when one of them has ended. Then the other is read to its
 * end, so that damage is seen. */
static bool next_batch(batch *b, side *truth, side *result)
{
    bool more[2] = {true, true};
    for (b->n = 0; b->n < b->most; b->n++) {
        vg_frame *t = &b->truth[b->n], *r = &b->result[b->n];
        more[0] = next_frame(truth, t);
        more[1] = next_frame(result, r);
        while (more[0] && !more[1]) more[0] = next_frame(truth, t);
        while (more[1] && !more[0]) more[1] = next_frame(result, r);
        if (!more[0]) return false;
        if (strcmp(t->name, r->name))
            cli_note("frame %zu is '%s' in '%s' and '%s' in '%s'", truth->frames - 1, t->name, truth->name, r->name,
                     result->name);
        b->poses[0][b->n] = t->values, b->poses[1][b->n] = r->values;
        cli_progress("frame", truth->frames);
    }
    return true;
}

static void note_worst(findings *found, const vg_pose_error *error, const char *name)
{
    if (found->worst_frame && error->max <= found->worst) return;
    found->worst = error->max;
    free(found->worst_frame);
    found->worst_frame = strdup(name);
}

static void measure_batch(vg_measures *x, batch *b, const side *result, double diagonal, findings *found, report *r)
{
    vg_err e;
    size_t nv = result->head->body.mesh.nv;
    if (vg_measures_add(x, b->n, b->poses[0], b->poses[1], b->errors, b->found, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < b->n; i++, found->frames++) {
        const char *name = b->truth[i].name;
        note_worst(found, &b->found[i], name);
        if (opts.heat) put_heat(&b->result[i], nv, b->errors[i], diagonal);
        if (!opts.frames && !opts.plot) continue;
        const double errors[3] = {b->found[i].mean, vg_error_p95(b->errors[i], nv), b->found[i].max};
        if (opts.plot) error_curves_add(&found->curves, errors, diagonal);
        if (opts.frames) report_frame(r, found->frames, name, errors, diagonal);
    }
}

/* Measure the frames that both have in common. */
static void compare(side *truth, side *result, findings *found, report *r)
{
    vg_measures *x = NULL;
    vg_err e;
    batch b = {0};
    size_t nv = truth->head->body.mesh.nv;
    const double *reference = truth->head->body.reference;
    double diagonal = vg_diagonal(reference, nv);
    make_batch(&b, nv);
    if (vg_measures_new(&x, &truth->head->body.mesh, reference, opts.centred, cli_threads(), &e) < 0) cli_die(&e);
    if (opts.frames) report_table(r, "frame_errors", "", false, frame_columns, COLUMNS_FRAME);
    open_heat(result, truth);
    for (bool more = true; more;) {
        more = next_batch(&b, truth, result);
        measure_batch(x, &b, result, diagonal, found, r);
    }
    vg_measures_get_stats(x, &found->measures);
    vg_measures_free(&x);
    clear_batch(&b);
    if (!opts.heat) return;
    cli_stream_end(vg_source_tail(result->source));
    cli_redirect(report_file, false);
}

/* --surface: frame by frame, because each frame has its own search tree. */
static void compare_surfaces(surfaces *s, side *truth, side *result, report *r)
{
    batch b = {0};
    size_t n = 0, nv = result->head->body.mesh.nv;
    surfaces_begin(s, &truth->head->body, &result->head->body, opts.frames ? r : NULL);
    open_heat(result, truth);
    b.most = 1;
    b.truth = cli_allocate(1, sizeof *b.truth, "a pose"), b.result = cli_allocate(1, sizeof *b.result, "a pose");
    for (int i = 0; i < 2; i++) b.poses[i] = cli_allocate(1, sizeof *b.poses[i], "a pose");
    while (next_batch(&b, truth, result)) {
        const double *distance = surfaces_add(s, n++, b.truth->name, b.poses[0][0], b.poses[1][0]);
        if (opts.heat) put_heat(b.result, nv, distance, s->diagonal);
    }
    vg_frame_clear(b.truth);
    vg_frame_clear(b.result);
    free(b.truth);
    free(b.result);
    for (int i = 0; i < 2; i++) free(b.poses[i]);
    if (!opts.heat) return;
    cli_stream_end(vg_source_tail(result->source));
    cli_redirect(report_file, false);
}

static void report_sides(report *r, const side *truth, const side *result, const vg_measure_stats *m)
{
    const side *const sides[2] = {truth, result};
    static const char *const keys[2] = {"truth", "result"};
    report_put(r, "comparable", NULL, report_flag(true));
    for (int i = 0; i < 2; i++) {
        char line[600];
        snprintf(line, sizeof line, "%.500s, %zu frame%s", sides[i]->name, sides[i]->frames,
                 sides[i]->frames == 1 ? "" : "s");
        report_put(r, NULL, keys[i], report_text(line));
        report_group(r, keys[i]);
        report_put(r, "name", NULL, report_text(sides[i]->name));
        report_put(r, "frames", NULL, report_count(sides[i]->frames));
        report_end(r);
    }
    report_put(r, "frames", "compared", report_count(m->frames));
    report_put(r, "vertices", "vertices", report_count(m->vertices));
    report_put(r, "faces", "faces", report_count(m->faces));
    report_put(r, "D", "D", report_number(m->diagonal));
    report_put(r, "centred", "centred", report_flag(opts.centred));
}

static void report_error(report *r, const char *name, double error, double diagonal, const char *where,
                         const report_value place[3])
{
    const report_value row[COLUMNS_ERROR] = {
        report_text(name), report_number(error), report_number(in_diagonals(error, diagonal)), report_text(where),
        place[0], place[1], place[2]};
    report_row(r, row);
}

static void report_vertices(report *r, const findings *found)
{
    const vg_measure_stats *m = &found->measures;
    const report_value nowhere[3] = {report_nothing(), report_nothing(), report_nothing()};
    const char *name = found->worst_frame ? found->worst_frame : "";
    const report_value worst[3] = {report_count(m->max_vertex), report_count(m->max_frame), report_text(name)};
    const report_value unsteady[3] = {report_count(m->sigma_vertex), report_nothing(), report_nothing()};
    char at_max[600] = "", at_sigma[60] = "";
    if (m->max > 0)
        snprintf(at_max, sizeof at_max, "vertex %zu of frame %zu '%.500s'", m->max_vertex, m->max_frame, name);
    if (m->sigma > 0) snprintf(at_sigma, sizeof at_sigma, "vertex %zu", m->sigma_vertex);
    report_gap(r);
    report_table(r, "vertex_error", "", true, error_columns, COLUMNS_ERROR);
    report_error(r, "mean", m->mean, m->diagonal, "", nowhere);
    report_error(r, "rms", m->rms, m->diagonal, "", nowhere);
    report_error(r, "p95", m->p95, m->diagonal, "", nowhere);
    report_error(r, "max", m->max, m->diagonal, at_max, m->max > 0 ? worst : nowhere);
    report_error(r, "sigma", m->sigma, m->diagonal, at_sigma, m->sigma > 0 ? unsteady : nowhere);
    report_note(r, "Distance of each vertex from its true position, over all vertices and frames. p95: 95 %% of them "
                   "are smaller.");
    report_note(r, "sigma: the largest standard deviation over the frames of the error of one vertex.");
    report_note(r, "D: the diagonal of the box around the reference pose of the truth.");
}

static void report_histogram(report *r, const vg_measure_stats *m)
{
    report_group(r, "histogram");
    report_put(r, "edges_D", NULL, report_numbers(vg_error_edges, VG_ERROR_BINS));
    report_put(r, "counts", NULL, report_counts(m->histogram, VG_ERROR_BINS));
    report_end(r);
}

static void report_faces(report *r, const vg_measure_stats *m)
{
    const report_value rows[2][COLUMNS_FACE] = {
        {report_text("orientation"), report_number(m->orientation_mean), report_number(m->orientation_sd),
         report_number(m->orientation_max)},
        {report_text("area"), report_number(m->area_mean), report_number(m->area_sd), report_number(m->area_max)}};
    bool any = m->faces_measured > 0;
    if (any) report_gap(r);
    report_put(r, "faces_measured", NULL, report_count(m->faces_measured));
    report_table(r, "face_error", any ? "" : NULL, true, face_columns, COLUMNS_FACE);
    report_row(r, rows[0]);
    report_row(r, rows[1]);
    if (any) report_note(r, "orientation: 1 - cosine between the normals. area: the difference of the ratio of the "
                            "areas from 1.");
    any = m->planarity_faces[0] || m->planarity_faces[1];
    if (any) report_gap(r);
    report_table(r, "planarity", any ? "" : NULL, true, planarity_columns, COLUMNS_PLANARITY);
    for (int i = 0; i < 2; i++) {
        const report_value row[COLUMNS_PLANARITY] = {
            report_text(i ? "result" : "truth"), report_count(m->planarity_faces[i]),
            report_number(m->planarity_mean[i]), report_number(m->planarity_max[i]),
            report_counts(m->planarity_histogram[i], 10)};
        report_row(r, row);
    }
}

/* Does the result satisfy? When a tolerance was given the report says so, and `line` is the answer in words. */
static bool judge_error(report *r, const double found[4], double diagonal, char *line, size_t size)
{
    if (opts.tolerance < 0) return true;
    const char *of_unit = opts.unit ? opts.unit : "m";
    double error = in_diagonals(found[opts.which], diagonal), limit = opts.tolerance;
    if (opts.metres) limit = in_diagonals(opts.tolerance / unit_metres(of_unit, strlen(of_unit)), diagonal);
    bool within = error <= limit;
    if (opts.metres)
        snprintf(line, size, "%s error %.6g %s (%.4g D) %s the tolerance of %s", opts.of, found[opts.which], of_unit, error,
                 within ? "is within" : "exceeds", opts.limit);
    else
        snprintf(line, size, "%s error %.6g D %s the tolerance of %.6g D", opts.of, error, within ? "is within" : "exceeds",
                 limit);
    report_gap(r);
    report_note(r, "%s", line);
    report_group(r, "tolerance");
    report_put(r, "of", NULL, report_text(opts.of));
    report_put(r, "limit", NULL, report_number(limit));
    report_put(r, "error", NULL, report_number(error));
    report_put(r, "within", NULL, report_flag(within));
    report_end(r);
    return within;
}

/* The stream goes where the report would. */
static bool replaces_report(void)
{
    return opts.heat && !strcmp(opts.heat, "-") && !report_file;
}

static void parse_options(int argc, char **argv, char ***operands)
{
    size_t n = cli_start(&program, argc, argv, operands);
    if (n < 2) cli_usage("two sequences are needed: TRUTH and RESULT");
    report_file = cli_output();
    if (opts.plot) error_plot_check(opts.plot, report_file, opts.heat);
    if (opts.unit && !unit_metres(opts.unit, strlen(opts.unit)))
        cli_usage("option '--unit' needs one of " UNITS_LIST ", not '%s'", opts.unit);
    if (opts.unit && !opts.metres) cli_usage("--unit is for a tolerance with a unit, such as 0.1mm");
    if (!opts.heat && options_of_process()->no_provenance) cli_usage("--no-provenance applies to the stream that --heat writes");
    if (!opts.heat) return;
    if (replaces_report() && (cli_json() || opts.frames))
        cli_usage("option '--%s' applies to the report, which needs a file: -o FILE", cli_json() ? "json" : "frames");
    if (report_file && cli_same_output(opts.heat, report_file))
        cli_usage("'%s' cannot be both the stream and the report", report_file);
    cli_redirect(opts.heat, true); /* report errors in the name now */
    cli_redirect(report_file, false);
}

/* With --quiet there is no report unless it was requested by name. */
static bool wants_report(void)
{
    return !replaces_report() && (!cli_quiet() || report_file || cli_json());
}

static void report_all(report *r, const side *truth, const side *result, const findings *found, double errors[4])
{
    const vg_measure_stats *m = &found->measures;
    const double all[] = {[MEAN] = m->mean, [RMS] = m->rms, [P95] = m->p95, [MAX] = m->max};
    memcpy(errors, all, sizeof all);
    report_sides(r, truth, result, m);
    report_vertices(r, found);
    report_histogram(r, m);
    report_faces(r, m);
}

static void report_surfaces(report *r, const side *truth, const side *result, surfaces *s, double errors[4])
{
    const side *const sides[2] = {truth, result};
    static const char *const keys[2] = {"truth", "result"};
    report_put(r, "comparable", NULL, report_flag(true));
    for (int i = 0; i < 2; i++) {
        const vg_mesh *m = &sides[i]->head->body.mesh;
        char line[600];
        snprintf(line, sizeof line, "%.500s, %zu frame%s of %zu vertices and %zu faces", sides[i]->name, sides[i]->frames,
                 sides[i]->frames == 1 ? "" : "s", m->nv, m->nf);
        report_put(r, NULL, keys[i], report_text(line));
        report_group(r, keys[i]);
        report_put(r, "name", NULL, report_text(sides[i]->name));
        report_put(r, "frames", NULL, report_count(sides[i]->frames));
        report_put(r, "vertices", NULL, report_count(m->nv));
        report_put(r, "faces", NULL, report_count(m->nf));
        report_end(r);
    }
    report_put(r, "D", "D", report_number(s->diagonal));
    surfaces_report(s, r, errors);
}

static void answer(const side *truth, const side *result, bool within, const char *line) __attribute__((noreturn));
static void answer(const side *truth, const side *result, bool within, const char *line)
{
    char counts[1100];
    size_t least = truth->frames < result->frames ? truth->frames : result->frames;
    snprintf(counts, sizeof counts, "'%.400s' has %zu frames and '%.400s' has %zu: only the first %zu were compared",
             truth->name, truth->frames, result->name, result->frames, least);
    if (truth->frames != result->frames) answer_no(counts);
    if (!within) answer_no(line);
    cli_finish(0);
}

int main(int argc, char **argv)
{
    char **operands, line[300];
    side truth = {0}, result = {0};
    findings found = {0};
    surfaces s = {0};
    double errors[4];
    parse_options(argc, argv, &operands);
    open_side(&truth, operands[0]);
    open_side(&result, operands[1]);
    if (!opts.surface) check_same_mesh(&truth, &result);

    report *frames = report_new(), *r = report_new();
    if (opts.surface) {
        compare_surfaces(&s, &truth, &result, frames);
        report_surfaces(r, &truth, &result, &s, errors);
    } else {
        compare(&truth, &result, &found, frames);
        report_all(r, &truth, &result, &found, errors);
    }
    bool within = judge_error(r, errors, opts.surface ? s.diagonal : found.measures.diagonal, line, sizeof line);
    if (opts.frames) report_gap(r);
    report_join(r, frames);
    if (wants_report()) {
        report_print(r, cli_text_open(), cli_json());
        cli_text_end();
    }
    report_free(&r);
    if (opts.plot) error_plot_write(&found.curves, &found.measures, truth.name, result.name, opts.plot);
    error_curves_clear(&found.curves);
    surfaces_end(&s);
    free(found.worst_frame);
    vg_source_close(&truth.source);
    vg_source_close(&result.source);
    answer(&truth, &result, within, line);
}
