/* vg-view.c: draw a sequence as a contact sheet, with its shape or its errors.
 * Leaves out how a pose becomes pixels: that is lib/view.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <errno.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

static struct {
    long frames, columns;
    const char *size, *view, *up, *against;
    double scale;
    bool edges, ground, follow, centred;
} opts = {.frames = 8, .size = "360x360", .view = "30,15", .up = "y"};

static const cli_option options[] = {
    {.name = "frames", .value = "N", .help = "show N evenly spaced frames, or all when there are fewer (default: 8)",
     .integer = &opts.frames, .least = 1, .most = 10000},
    {.name = "columns", .value = "N", .help = "frames side by side (default: what makes the sheet about 16 : 9)",
     .integer = &opts.columns, .least = 1, .most = 10000},
    {.name = "size", .value = "WxH", .help = "of the picture of one frame, in pixels (default: 360x360)",
     .text = &opts.size},
    {.name = "view", .value = "VIEW", .text = &opts.view,
     .help = "front, back, left, right, top, iso, or AZIMUTH,ELEVATION in degrees (default: 30,15)"},
    {.name = "up", .value = "AXIS", .help = "y or z: the axis that points up (default: y)", .text = &opts.up},
    {.name = "follow", .help = "keep the figure in the middle of its picture", .flag = &opts.follow},
    {.name = "ground", .help = "draw a grid where the reference pose stands, and a shadow", .flag = &opts.ground},
    {.name = "edges", .help = "draw the edges of the polygons", .flag = &opts.edges},
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
    .summary = "Draw a sequence as a contact sheet (PNG), with its shape or its errors",
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
    vg_sheet_options o = {.frames = (size_t)opts.frames, .columns = (size_t)opts.columns, .edges = opts.edges,
                          .ground = opts.ground, .follow = opts.follow, .compare = opts.against != NULL,
                          .centred = opts.centred, .scale = opts.scale, .threads = cli.threads};
    parse_size(opts.size, &o);
    parse_view(opts.view, &o);
    if (strcmp(opts.up, "y") && strcmp(opts.up, "z")) cli_usage("option '--up' needs y or z, not '%s'", opts.up);
    o.z_up = *opts.up == 'z';
    if (!opts.against && opts.centred) cli_usage("option '--centred' is about errors: name the truth with --against");
    if (!opts.against && opts.scale > 0) cli_usage("option '--scale' is about errors: name the truth with --against");
    return o;
}

/* A picture is the only thing made here: any other name is a misunderstanding, and told before the work. */
static void check_output(void)
{
    struct stat st;
    if (!cli.output) {
        if (isatty(STDOUT_FILENO)) cli_usage("a picture is not written to a terminal: use -o FILE.png");
        return;
    }
    if (!stat(cli.output, &st) && !S_ISREG(st.st_mode)) return; /* a pipe or device */
    size_t n = strlen(cli.output);
    if (n < 5 || strcasecmp(cli.output + n - 4, ".png"))
        cli_usage("cannot write '%s': the name must end in .png, or be '-' for standard output", cli.output);
}

/* ---- sequences ---- */

typedef struct side {
    char name[420]; /* what messages call it, quotes included */
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

static void open_side(side *s, char **operands, size_t n)
{
    vg_err e;
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

static void open_truth(side *truth, const side *result)
{
    char *operand = (char *)(uintptr_t)opts.against;
    vg_err e;
    open_side(truth, &operand, 1);
    if (vg_mesh_same(&truth->head->mesh, truth->name, &result->head->mesh, result->name, &e) < 0) cli_die(&e);
}

/* All frames of both, to their ends, so that damage is seen. */
static void add_frames(vg_sheet *sheet, side *result, side *truth)
{
    vg_err e;
    for (bool more[2] = {true, opts.against != NULL}; more[0] || more[1];) {
        more[0] = more[0] && next(result);
        more[1] = more[1] && next(truth);
        if (!more[0] || (opts.against && !more[1])) continue;
        if (vg_sheet_add(sheet, result->frame.name, result->frame.values, opts.against ? truth->frame.values : NULL,
                         &e) < 0)
            cli_die(&e);
        cli_progress("frames", result->frames);
    }
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

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_sheet_options o = sheet_options();
    check_output();
    if (opts.against && !strcmp(opts.against, "-") && reads_standard_input(operands, n))
        cli_usage("standard input cannot be both the result and the truth");
    side result = {0}, truth = {0};
    open_side(&result, operands, n);
    if (opts.against) open_truth(&truth, &result);

    vg_sheet *sheet;
    vg_err e;
    const double *reference = opts.against ? truth.head->reference : result.head->reference;
    if (vg_sheet_new(&sheet, &result.head->mesh, reference, &o, &e) < 0) cli_die(&e);
    add_frames(sheet, &result, &truth);
    FILE *out = cli_text_open();
    if (vg_sheet_write(sheet, fileno(out), cli.output ? cli.output : "standard output", &e) < 0) cli_die(&e);
    cli_text_end();
    vg_sheet_free(&sheet);
    if (opts.against) close_side(&truth);
    close_side(&result);
    cli_finish(0);
}
