/* vg-view.c: a sequence as a page that plays it or as a contact sheet, with its shape or its errors.
 * Leaves out how a pose becomes pixels, and what is in a page: that is lib/view.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <errno.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

static struct {
    long frames, columns;
    const char *size, *view, *up, *against, *beside, *patches, *title, *format;
    double scale;
    bool edges, ground, follow, centred;
    bool page; /* what is made, else a sheet */
} opts = {.view = "30,15", .up = "y"};

static const cli_option options[] = {
    {.name = "format", .value = "png|html", .text = &opts.format,
     .help = "whatever the name of the output (default: told by it, else png)"},
    {.name = "frames", .value = "N",
     .help = "sheet: N evenly spaced frames, or all when there are fewer (default: 8)",
     .integer = &opts.frames, .least = 1, .most = 10000},
    {.name = "columns", .value = "N", .help = "sheet: frames side by side (default: what makes it about 16 : 9)",
     .integer = &opts.columns, .least = 1, .most = 10000},
    {.name = "size", .value = "WxH", .help = "sheet: of the picture of one frame, in pixels (default: 360x360)",
     .text = &opts.size},
    {.name = "view", .value = "front|back|left|right|top|iso|A,E", .text = &opts.view,
     .help = "from where, or azimuth and elevation in degrees (default: 30,15)"},
    {.name = "up", .value = "y|z", .help = "the axis that points up (default: y)", .text = &opts.up},
    {.name = "follow", .help = "keep the figure in the middle of its picture", .flag = &opts.follow},
    {.name = "ground", .help = "draw a grid where the reference pose stands, and a shadow", .flag = &opts.ground},
    {.name = "edges", .help = "draw the edges of the polygons", .flag = &opts.edges},
    {.name = "beside", .value = "OTHER", .text = &opts.beside,
     .help = "page: show another sequence beside, with the same camera"},
    {.name = "patches", .value = "PATCHES", .help = "colour the faces by the patches of a stream of vg-segment",
     .text = &opts.patches},
    {.name = "title", .value = "TEXT", .help = "page: its title (default: the name of the sequence)",
     .text = &opts.title},
    {.name = "against", .value = "TRUTH", .help = "colour by the distance of each vertex from its place in TRUTH",
     .text = &opts.against},
    {.name = "centred", .letter = 'c', .flag = &opts.centred,
     .help = "with --against: move the centroid of every pose to 0 before comparing"},
    {.name = "scale", .value = "X", .help = "with --against: the error, in units of D, where the colours end",
     .number = &opts.scale, .least = 1e-12, .most = 1e12},
    {0},
};

static const cli_program program = {
    .name = "vg-view",
    .synopsis = "[options] [FILE ...]",
    .summary = "make a page (HTML) that plays a sequence, or a contact sheet (PNG) of it, with its shape or its errors",
    .options = options,
    .most_operands = (size_t)-1,
    .writes_file = true,
    .threaded = true,
};

/* ---- options ---- */

static void parse_size(const char *text, vg_sheet_options *o)
{
    unsigned w, h;
    char rest;
    if (strspn(text, "0123456789x") != strlen(text) || sscanf(text, "%5ux%5u%c", &w, &h, &rest) != 2 || w < 16 ||
        h < 16 || w > 4096 || h > 4096)
        cli_usage("option '--size' needs WIDTHxHEIGHT, each from 16 to 4096, not '%s'", text);
    o->width = w, o->height = h;
}

static void parse_view(const char *text, vg_sheet_options *o)
{
    static const struct {
        const char *name;
        double azimuth, elevation;
    } views[] = {{"front", 0, 0}, {"back", 180, 0}, {"left", -90, 0}, {"right", 90, 0}, {"top", 0, 90},
                 {"iso", 45, 35.264389682754654}};
    for (size_t i = 0; i < sizeof views / sizeof *views; i++)
        if (!strcmp(text, views[i].name)) {
            o->azimuth = views[i].azimuth, o->elevation = views[i].elevation;
            return;
        }
    char azimuth[32];
    size_t n = strcspn(text, ",");
    if (!text[n] || n >= sizeof azimuth)
        cli_usage("option '--view' needs front, back, left, right, top, iso or AZIMUTH,ELEVATION, not '%s'", text);
    memcpy(azimuth, text, n);
    azimuth[n] = 0;
    o->azimuth = cli_parse_number("view", azimuth);
    o->elevation = cli_parse_number("view", text + n + 1);
    if (o->azimuth < -360 || o->azimuth > 360 || o->elevation < -90 || o->elevation > 90)
        cli_usage("option '--view' needs an azimuth from -360 to 360 and an elevation from -90 to 90, not '%s'",
                  text);
}

static vg_sheet_options sheet_options(void)
{
    vg_sheet_options o = {.frames = opts.frames ? (size_t)opts.frames : 8, .columns = (size_t)opts.columns,
                          .edges = opts.edges,
                          .ground = opts.ground, .follow = opts.follow, .compare = opts.against != NULL,
                          .centred = opts.centred, .scale = opts.scale, .threads = cli.threads};
    parse_size(opts.size ? opts.size : "360x360", &o);
    parse_view(opts.view, &o);
    if (strcmp(opts.up, "y") && strcmp(opts.up, "z")) cli_usage("option '--up' needs y or z, not '%s'", opts.up);
    o.z_up = *opts.up == 'z';
    if (!opts.against && opts.centred) cli_usage("option '--centred' is about errors: name the truth with --against");
    if (!opts.against && opts.scale > 0) cli_usage("option '--scale' is about errors: name the truth with --against");
    return o;
}

static bool ends_with(const char *name, const char *suffix)
{
    size_t n = strlen(name), k = strlen(suffix);
    return n > k && !strcasecmp(name + n - k, suffix);
}

/* What is made is told by the name of the output, and options of the other kind are a misunderstanding. */
static void choose_kind(void)
{
    struct stat st;
    if (opts.format && strcmp(opts.format, "png") && strcmp(opts.format, "html"))
        cli_usage("option '--format' needs png or html, not '%s'", opts.format);
    bool named = cli.output && (stat(cli.output, &st) || S_ISREG(st.st_mode)); /* not a pipe or device */
    bool html = named && (ends_with(cli.output, ".html") || ends_with(cli.output, ".htm"));
    if (named && !html && !ends_with(cli.output, ".png") && !opts.format)
        cli_usage("cannot write '%s': the name must end in .html or .png, or be '-' for standard output", cli.output);
    opts.page = opts.format ? !strcmp(opts.format, "html") : html;
    if (opts.page && (opts.frames || opts.columns || opts.size))
        cli_usage("option '--%s' is about a sheet: the output is a page",
                  opts.frames ? "frames" : opts.columns ? "columns" : "size");
    if (!opts.page && (opts.beside || opts.title))
        cli_usage("option '--%s' is about a page: use -o FILE.html", opts.beside ? "beside" : "title");
    if (!cli.output && isatty(STDOUT_FILENO))
        cli_usage("a %s is not written to a terminal: use -o FILE.html or -o FILE.png", opts.page ? "page" : "picture");
}

/* ---- sequences ---- */

typedef struct side {
    char name[420];  /* what messages call it, quotes included */
    char label[256]; /* what a page calls it */
    vg_source *source;
    vg_head *head;
    vg_frame frame;
    size_t frames;
} side;

static bool reads_standard_input(char **operands, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!strcmp(operands[i], "-")) return true;
    return n == 0;
}

/* The last part of a path: labels do not say where files are kept. */
static const char *base_name(const char *path, int *length)
{
    const char *end = path + strlen(path);
    while (end > path + 1 && end[-1] == '/') end--;
    const char *base = end;
    while (base > path && base[-1] != '/') base--;
    *length = end - base < 120 ? (int)(end - base) : 120;
    return base;
}

static void set_label(side *s, char **operands, size_t n)
{
    int first = 0, last = 0;
    if (reads_standard_input(operands, n)) {
        snprintf(s->label, sizeof s->label, "standard input");
        return;
    }
    const char *a = base_name(operands[0], &first), *b = base_name(operands[n - 1], &last);
    if (n == 1) snprintf(s->label, sizeof s->label, "%.*s", first, a);
    else snprintf(s->label, sizeof s->label, "%.*s to %.*s", first, a, last, b);
}

static void open_side(side *s, char **operands, size_t n)
{
    vg_err e;
    set_label(s, operands, n);
    if (n > 1) snprintf(s->name, sizeof s->name, "'%.200s' to '%.200s'", operands[0], operands[n - 1]);
    else if (reads_standard_input(operands, n)) snprintf(s->name, sizeof s->name, "standard input");
    else snprintf(s->name, sizeof s->name, "'%.400s'", operands[0]);
    s->source = cli_source(operands, n);
    s->head = vg_source_head(s->source);
    if (s->head->kind == VG_VERTICES) return;
    if (s->head->kind == VG_VECTORS)
        vg_fail(&e, VG_EINPUT, "%s holds vectors: pipe it through 'vg-solve' first", s->name);
    else
        vg_fail(&e, VG_EINPUT, "%s holds %s, not vertices: make poses of them first", s->name,
                vg_kind_name(s->head->kind));
    cli_die(&e);
}

static bool next(side *s)
{
    vg_err e;
    int r = vg_source_next(s->source, &s->frame, &e);
    if (r < 0) cli_die(&e);
    s->frames += r > 0;
    return r > 0;
}

static void close_side(side *s)
{
    vg_frame_clear(&s->frame);
    vg_source_close(&s->source);
}

static void open_operand(side *s, const char *operand)
{
    char *one = (char *)(uintptr_t)operand;
    open_side(s, &one, 1);
}

static void open_truth(side *truth, const side *result)
{
    vg_err e;
    open_operand(truth, opts.against);
    if (vg_mesh_same(&truth->head->mesh, truth->name, &result->head->mesh, result->name, &e) < 0) cli_die(&e);
}

/* The next frames of both, which are read to their ends, so that damage is seen: 1, 0 behind the last of both, -1 when
 * only one has a frame. */
static int next_pair(side *result, side *truth)
{
    bool a = next(result), b = opts.against && next(truth);
    if (a) cli_progress("frames", result->frames);
    return a && (b || !opts.against) ? 1 : a || b ? -1 : 0;
}

static void check_counts(const side *result, const side *truth)
{
    vg_err e;
    if (opts.against && result->frames != truth->frames) {
        vg_fail(&e, VG_EINPUT, "%s has %zu frames where %s has %zu: frames are compared by their order", result->name,
                result->frames, truth->name, truth->frames);
        cli_die(&e);
    }
    if (result->frames == 0) {
        vg_fail(&e, VG_EINPUT, "%s has no frames: there is nothing to draw", result->name);
        cli_die(&e);
    }
}

/* ---- sheet ---- */

/* Patches that were kept apart from the sequence. */
static void take_patches(side *s)
{
    vg_head h = {0};
    vg_err e;
    char name[420];
    snprintf(name, sizeof name, "'%.400s'", opts.patches);
    if (vg_load_mesh(&h, opts.patches, &e) < 0 ||
        vg_mesh_same(&h.mesh, name, &s->head->mesh, s->name, &e) < 0)
        cli_die(&e);
    if (!h.patches.n) {
        vg_fail(&e, VG_EINPUT, "%s holds no patches: make them with 'vg-segment'", name);
        cli_die(&e);
    }
    vg_patches_clear(&s->head->patches);
    s->head->patches = h.patches;
    h.patches = (vg_patches){0};
    vg_head_clear(&h);
}

static void make_sheet(side *result, side *truth)
{
    vg_sheet_options o = sheet_options();
    vg_sheet *sheet;
    vg_err e;
    if (opts.patches) take_patches(result);
    if (result->head->patches.n) o.patches = &result->head->patches;
    const double *reference = opts.against ? truth->head->reference : result->head->reference;
    if (vg_sheet_new(&sheet, &result->head->mesh, reference, &o, &e) < 0) cli_die(&e);
    for (int more; (more = next_pair(result, truth)) != 0;) {
        if (more > 0 && vg_sheet_add(sheet, result->frame.name, result->frame.values,
                                     opts.against ? truth->frame.values : NULL, &e) < 0)
            cli_die(&e);
    }
    if (!result->frames && o.patches && !opts.against) { /* patches alone are shown on the reference pose */
        if (vg_sheet_add(sheet, result->head->reference_name, result->head->reference, NULL, &e) < 0) cli_die(&e);
        result->frames++;
    }
    check_counts(result, truth);
    FILE *out = cli_text_open();
    if (vg_sheet_write(sheet, fileno(out), cli.output ? cli.output : "standard output", &e) < 0) cli_die(&e);
    cli_text_end();
    vg_sheet_free(&sheet);
}

/* ---- page ---- */

static vg_page_options page_options(const side *result)
{
    vg_sheet_options view = sheet_options();
    return (vg_page_options){.title = opts.title ? opts.title : result->label, .azimuth = view.azimuth,
                             .elevation = view.elevation, .z_up = view.z_up, .follow = opts.follow, .edges = opts.edges,
                             .ground = opts.ground, .compare = opts.against != NULL, .centred = opts.centred,
                             .scale = opts.scale};
}

static void add_sequence(vg_page *page, const side *s)
{
    vg_err e;
    if (vg_page_sequence(page, s->label, s->head, &e) < 0) cli_die(&e);
}

static void add_frame(vg_page *page, size_t i, const side *s, const double *truth)
{
    vg_err e;
    if (vg_page_add(page, i, &s->frame, truth, &e) < 0) cli_die(&e);
}

static void note_facts(const vg_page_facts *facts)
{
    cli_note("%zu frames in %.2f MB; positions are within %.2g D of the input", facts->frames,
             (double)facts->bytes / 1e6, facts->loss);
    if (opts.against)
        cli_note("errors: mean %.3g D, max %.3g D; the colours end at %.3g D", facts->mean, facts->max, facts->scale);
}

/* A stream of patches has no frames: they are shown on the reference pose. */
static void add_reference(vg_page *page, side *s)
{
    vg_frame f = {.name = s->head->reference_name, .values = s->head->reference};
    vg_err e;
    if (vg_page_add(page, 0, &f, NULL, &e) < 0) cli_die(&e);
    s->frames++;
}

static void make_page(side *result, side *truth, side *other)
{
    vg_page_options o = page_options(result);
    vg_page *page;
    vg_page_facts facts;
    vg_err e;
    if (opts.patches) take_patches(result);
    FILE *out = cli_text_open();
    if (vg_page_new(&page, fileno(out), cli.output ? cli.output : "standard output", &o, &e) < 0) cli_die(&e);
    add_sequence(page, result);
    if (opts.against) add_sequence(page, truth);
    if (opts.beside) add_sequence(page, other);
    for (int more; (more = next_pair(result, truth)) != 0;) {
        if (more < 0) continue;
        add_frame(page, 0, result, opts.against ? truth->frame.values : NULL);
        if (opts.against) add_frame(page, 1, truth, NULL);
    }
    if (!result->frames && !opts.against && result->head->patches.n) add_reference(page, result);
    check_counts(result, truth);
    while (opts.beside && next(other)) add_frame(page, opts.against ? 2 : 1, other, NULL);
    if (vg_page_end(page, &facts, &e) < 0) cli_die(&e);
    cli_text_end();
    vg_page_free(&page);
    note_facts(&facts);
}

/* Standard input can be read once. */
static void check_inputs(char **operands, size_t n)
{
    bool input = reads_standard_input(operands, n), truth = opts.against && !strcmp(opts.against, "-");
    bool other = opts.beside && !strcmp(opts.beside, "-"), patches = opts.patches && !strcmp(opts.patches, "-");
    if (truth && input) cli_usage("standard input cannot be both the result and the truth");
    if (other && (input || truth)) cli_usage("standard input cannot be two sequences");
    if (patches && (input || truth || other)) cli_usage("standard input cannot be both a sequence and its patches");
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    sheet_options(); /* what is wrong with them is told before the input is opened */
    choose_kind();
    check_inputs(operands, n);
    side result = {0}, truth = {0}, other = {0};
    open_side(&result, operands, n);
    if (opts.against) open_truth(&truth, &result);
    if (opts.beside) open_operand(&other, opts.beside);
    if (opts.page) make_page(&result, &truth, &other);
    else make_sheet(&result, &truth);
    close_side(&result);
    close_side(&truth);
    close_side(&other);
    cli_finish(0);
}
