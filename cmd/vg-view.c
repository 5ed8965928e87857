/* vg-view.c: draws sequences as a page that plays them, a contact sheet or an animation, with their shape, errors or
 * scales. Poses are drawn, and pages written, in lib/view.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "network_plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static struct {
    long frames, columns;
    const char *size, *view, *against, *patches, *title, *format, *look;
    const char *beside[VG_PAGE_SEQUENCES];
    size_t nbeside;
    double scale, zoom, turn, fps;
    bool edges, ground, centred, silhouettes, scales, plain, pick;
    size_t kind, up, fit; /* 1: html, z, figure; kind 2: webp, 3: svg */
    bool page, animated, svg; /* kind of output; otherwise a sheet */
} opts = {.view = "30,15"};

static void take_beside(const char *value, void *context)
{
    (void)context;
    if (opts.nbeside == VG_PAGE_SEQUENCES - 2) /* the result and the truth are sequences, too */
        cli_usage("option '--beside' can be given %d times, not more", VG_PAGE_SEQUENCES - 2);
    cli_claim_input("beside", value);
    opts.beside[opts.nbeside++] = value;
}

static const cli_option options[] = {
    {.name = "format", .value = "png|html|webp|svg", .text = &opts.format, .choice = &opts.kind,
     .help = "format of the output (default: from its name, else png)"},
    {.name = "frames", .value = "N",
     .help = "sheet: N evenly spaced frames, or all if there are fewer (default: 8; animation: 1000)",
     .integer = &opts.frames, .least = 1, .most = 10000},
    {.name = "columns", .value = "N", .help = "sheet: frames side by side (default: for about 16 : 9)",
     .integer = &opts.columns, .least = 1, .most = 10000},
    {.name = "size", .value = "WxH", .help = "sheet: of the picture of one frame, in pixels (default: 360x360)",
     .text = &opts.size},
    {.name = "view", .value = "front|back|left|right|top|iso|A,E", .text = &opts.view,
     .help = "from where, or azimuth and elevation in degrees (default: 30,15)"},
    {.name = "zoom", .value = "X", .help = "magnification: 1 (the default) fits the picture", .number = &opts.zoom,
     .least = 1e-3, .most = 1e3},
    {.name = "turn", .value = "DEGREES", .help = "animation: rotate the view by this angle from start to end",
     .number = &opts.turn, .least = -36000, .most = 36000},
    {.name = "up", .value = "y|z", .help = "the axis that points up (default: y)", .choice = &opts.up},
    {.name = "fit", .value = "path|figure", .choice = &opts.fit,
     .help = "show the whole path with a fixed camera, or keep the figure in the middle (default: path; page: figure "
             "if it goes far)"},
    {.name = "look-at", .value = "VERTEX|NAME", .text = &opts.look, .excludes = "fit",
     .help = "sheet, animation: keep a vertex, a joint, or an object, group or material of the mesh in the middle; with --zoom"},
    {.name = "ground", .help = "draw a grid where the reference pose stands, and a shadow", .flag = &opts.ground},
    {.name = "edges", .help = "draw the edges of the polygons", .flag = &opts.edges},
    {.name = "silhouettes", .help = "sheet: draw the contours of surfaces as lines", .flag = &opts.silhouettes},
    {.name = "beside", .value = "OTHER", .take = take_beside,
     .help = "show another sequence with the same camera: beside, or in a sheet below; repeatable"},
    {.name = "pick", .flag = &opts.pick, .needs = "beside", .excludes = "patches|against|scales|scale|fps",
     .help = "page: click pairs of points on the mesh and the one beside it, and save them as markers for vg-register"},
    {.name = "patches", .value = "PATCHES", .help = "colour the faces by the patches of a stream of vg-segment",
     .text = &opts.patches, .reads = true},
    {.name = "fps", .value = "N", .help = "page, animation: play N frames per second, ignoring their times", .number = &opts.fps,
     .least = 1e-3, .most = 1e6},
    {.name = "title", .value = "TEXT", .help = "page: its title (default: the name of the sequence)",
     .text = &opts.title},
    {.name = "against", .value = "TRUTH", .help = "colour by the distance of each vertex from its position in TRUTH",
     .text = &opts.against, .reads = true, .excludes = "scales|plain"},
    {.name = "centred", .letter = 'c', .flag = &opts.centred, .needs = "against",
     .help = "with --against: move the centroid of every pose to 0 before comparing"},
    {.name = "scales", .flag = &opts.scales,
     .help = "colour by the change of length of each vertex's vectors from the reference pose"},
    {.name = "plain", .help = "no colours, even if the sequence has numbers", .flag = &opts.plain,
     .excludes = "scales|patches|scale"},
    {.name = "scale", .value = "X", .number = &opts.scale, .least = 1e-12, .most = 1e12,
     .help = "end of the colour map: an error in units of D, with --scales a factor (default: from the data)"},
    {0},
};

static const cli_program program = {
    .name = "vg-view",
    .synopsis = "[options] [FILE ...]",
    .summary =
        "make a page (HTML) that plays a sequence, a contact sheet (PNG) or an animation (WebP), with its shape or errors",
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
    double at[2];
    if (cli_parse_numbers(text, at, 2) != 2)
        cli_usage("option '--view' needs front, back, left, right, top, iso or AZIMUTH,ELEVATION, not '%s'", text);
    if (fabs(at[0]) > 360 || fabs(at[1]) > 90)
        cli_usage("option '--view' needs an azimuth from -360 to 360 and an elevation from -90 to 90, not '%s'",
                  text);
    o->azimuth = at[0], o->elevation = at[1];
}

static vg_tint choose_tint(void)
{
    if (opts.scales && opts.scale > 0 && opts.scale <= 1)
        cli_usage("option '--scale' needs a factor above 1 with --scales, not %g", opts.scale);
    if (opts.against) return VG_TINT_ERRORS;
    return opts.scales ? VG_TINT_SCALES : opts.plain ? VG_TINT_PLAIN : VG_TINT_SCALARS;
}

static vg_fit choose_fit(void)
{
    return !cli_given("fit") ? VG_FIT_AUTO : opts.fit == 1 ? VG_FIT_FIGURE : VG_FIT_PATH;
}

static vg_sheet_options sheet_options(void)
{
    vg_sheet_options o = {.frames = opts.frames ? (size_t)opts.frames : opts.animated ? 1000 : 8,
                          .animated = opts.animated, .turn = opts.turn, .columns = (size_t)opts.columns,
                          .edges = opts.edges,
                          .ground = opts.ground, .fit = choose_fit(), .silhouettes = opts.silhouettes,
                          .zoom = opts.zoom, .tint = choose_tint(), .centred = opts.centred, .scale = opts.scale,
                          .threads = cli_threads()};
    parse_size(opts.size ? opts.size : "360x360", &o);
    parse_view(opts.view, &o);
    o.z_up = opts.up == 1;
    return o;
}

/* The name of the output decides between page and sheet; options of the other kind are refused. */
static void choose_kind(void)
{
    struct stat st;
    bool named = cli_output() && (stat(cli_output(), &st) || S_ISREG(st.st_mode)); /* not a pipe or device */
    bool html = named && (cli_ends_with(cli_output(), ".html") || cli_ends_with(cli_output(), ".htm"));
    bool webp = named && cli_ends_with(cli_output(), ".webp");
    opts.svg = opts.format ? opts.kind == 3 : named && cli_ends_with(cli_output(), ".svg");
    if (named && !html && !webp && !opts.svg && !cli_ends_with(cli_output(), ".png") && !opts.format)
        cli_usage("cannot write '%s': the name must end in .html, .png or .webp, of a network also in .svg, or be '-' for standard output",
                  cli_output());
    opts.page = opts.format ? opts.kind == 1 : html;
    opts.animated = opts.format ? opts.kind == 2 : webp;
    if (!opts.animated && cli_given("turn")) cli_usage("option '--turn' applies to an animation: use -o FILE.webp");
    if (opts.animated && opts.columns) cli_usage("option '--columns' applies to a sheet: the output is an animation");
    if (opts.page && (opts.frames || opts.columns || opts.size || opts.silhouettes))
        cli_usage("option '--%s' applies to a sheet: the output is a page",
                  opts.frames ? "frames" : opts.columns ? "columns" : opts.size ? "size" : "silhouettes");
    if (opts.page && opts.look) cli_usage("option '--look-at' applies to a sheet or an animation: a page can be "
                                          "rotated and zoomed");
    if (!opts.page && opts.patches && (opts.against || opts.scales))
        cli_usage("a sheet has one kind of colours: leave out --patches or --%s",
                  opts.against ? "against" : "scales");
    if (!opts.page && !opts.animated && opts.fps > 0)
        cli_usage("option '--fps' applies to a page or an animation: use -o FILE.html or -o FILE.webp");
    if (opts.pick && !opts.page) cli_usage("option '--pick' applies to a page: use -o FILE.html");
    if (opts.pick && opts.nbeside != 1) cli_usage("option '--pick' applies to two meshes: give --beside once");
    if (opts.pick && !cli_given("view")) opts.view = "front";
    if (!opts.page && opts.title) cli_usage("option '--title' applies to a page: use -o FILE.html");
    if (!cli_output() && isatty(STDOUT_FILENO))
        cli_usage("a %s is not written to a terminal: use -o FILE.html, FILE.png or FILE.webp",
                  opts.page ? "page" : "picture");
}

/* ---- sequences ---- */

typedef struct side {
    char name[420];  /* what messages call it, quotes included */
    char label[256]; /* what a page calls it */
    vg_source *source;
    vg_head *head;
    vg_frame frame;
    size_t frames;
    bool coloured; /* frames bring scalars */
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
    while (*length > 0 && (base[*length] & 0xc0) == 0x80) --*length; /* no part of a character */
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
    set_label(s, operands, n);
    if (n > 1) snprintf(s->name, sizeof s->name, "'%.200s' to '%.200s'", operands[0], operands[n - 1]);
    else if (reads_standard_input(operands, n)) snprintf(s->name, sizeof s->name, "standard input");
    else snprintf(s->name, sizeof s->name, "'%.400s'", operands[0]);
    s->source = cli_source(operands, n);
    s->head = vg_source_head(s->source);
    cli_need_vertices(s->head, s->name);
}

static bool next_frame(side *s)
{
    bool more = cli_next(s->source, &s->frame);
    if (more && opts.fps > 0) s->frame.has_time = true, s->frame.time = (double)s->frames / opts.fps;
    s->frames += more;
    s->coloured |= more && vg_frame_scalars(&s->frame);
    return more;
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
    if (vg_mesh_same(&truth->head->body.mesh, truth->name, &result->head->body.mesh, result->name, &e) < 0)
        cli_die(&e);
}

/* All sequences shown: the result, the truth it is compared with, if any, and those of --beside. */
typedef struct cast {
    side result, truth, beside[VG_PAGE_SEQUENCES];
    bool compared[VG_PAGE_SEQUENCES]; /* of --beside: has the mesh of the truth */
} cast;

static void open_cast(cast *c, char **operands, size_t n)
{
    open_side(&c->result, operands, n);
    if (opts.against) open_truth(&c->truth, &c->result);
    for (size_t i = 0; i < opts.nbeside; i++) {
        side *s = &c->beside[i];
        open_operand(s, opts.beside[i]);
        c->compared[i] =
            opts.against && vg_mesh_same(&c->truth.head->body.mesh, "", &s->head->body.mesh, "", NULL) == VG_OK;
    }
}

static void close_cast(cast *c)
{
    close_side(&c->result);
    close_side(&c->truth);
    for (size_t i = 0; i < opts.nbeside; i++) close_side(&c->beside[i]);
}

/* Called with a frame of sequence i; truth: the frame it is compared with, or NULL. */
typedef void take_frame(void *context, size_t i, const side *s, const double *truth);

/* The next frame of sequence i of --beside. After the end of the truth it is compared with nothing; check_counts reports
 * this. */
static bool put_beside(cast *c, size_t i, const double *truth, bool truth_is_shown, take_frame *put, void *context)
{
    side *s = &c->beside[i];
    if (!next_frame(s)) return false;
    if (truth || !c->compared[i]) put(context, i + 1 + truth_is_shown, s, c->compared[i] ? truth : NULL);
    return true;
}

/* All are read to their ends, so that damage is seen, and side by side, so that each is read once. */
static void read_cast(cast *c, bool shows_truth, take_frame *put, void *context)
{
    for (bool more = true; more;) {
        bool a = next_frame(&c->result), b = opts.against && next_frame(&c->truth);
        const double *truth = b ? c->truth.frame.values : NULL;
        if (a) cli_progress("frames", c->result.frames);
        if (a && (b || !opts.against)) put(context, 0, &c->result, truth);
        if (a && b && shows_truth) put(context, 1, &c->truth, NULL);
        more = a || b;
        for (size_t i = 0; i < opts.nbeside; i++)
            more |= put_beside(c, i, truth, shows_truth && opts.against, put, context);
    }
}

static void refuse_count(const side *s, const side *truth)
{
    cli_stop(VG_EINPUT, "%s has %zu frames where %s has %zu: --against compares frame by frame", s->name, s->frames,
             truth->name, truth->frames);
}

/* A sequence of --beside may end before the truth, and then stays at its last frame. */
static void check_counts(const cast *c)
{
    if (opts.against && c->result.frames != c->truth.frames) refuse_count(&c->result, &c->truth);
    for (size_t i = 0; i < opts.nbeside; i++)
        if (c->compared[i] && c->beside[i].frames > c->truth.frames) refuse_count(&c->beside[i], &c->truth);
    if (c->result.frames == 0) cli_stop(VG_EINPUT, "%s has no frames: there is nothing to draw", c->result.name);
}

static void warn_scale(const cast *c)
{
    bool coloured = opts.against || opts.scales || c->result.coloured;
    for (size_t i = 0; i < opts.nbeside; i++) coloured |= c->beside[i].coloured;
    if (cli_given("scale") && !coloured)
        cli_warn("--scale sets the end of the colours, and there are none: the input has no numbers of its vertices");
}

/* An artefact has no frames: it is shown on the reference pose. */
static bool shows_reference(const cast *c)
{
    static const char *const artefacts[] = {"patches", "map", "network"};
    const vg_head *h = c->result.head;
    if (c->result.frames || opts.against || !h->body.mesh.nv) return false;
    for (size_t i = 0; i < sizeof artefacts / sizeof *artefacts; i++)
        if (vg_head_need(h, artefacts[i], "it", NULL) == VG_OK) return true;
    return false;
}

/* The bone that moves most of a face. share: room for a number of each bone, zero. */
static uint32_t bone_of_face(const vg_body *b, size_t f, double *share)
{
    const vg_mesh *m = &b->mesh;
    uint32_t best = 0;
    for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
        for (size_t k = 0; k < VG_SKIN; k++) {
            size_t at = VG_SKIN * (size_t)m->vert[c] + k;
            share[b->rig.skin_bone[at]] += b->rig.skin_weight[at];
            if (share[b->rig.skin_bone[at]] > share[best]) best = b->rig.skin_bone[at];
        }
    for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
        for (size_t k = 0; k < VG_SKIN; k++) share[b->rig.skin_bone[VG_SKIN * (size_t)m->vert[c] + k]] = 0;
    return best;
}

/* A rig is coloured by its bones, as a map of patches is by these. */
static void colour_bones(vg_head *h)
{
    vg_body *b = &h->body;
    vg_patches bones = {.n = b->rig.nbones};
    if (h->map.kind != VG_MAP_BONES || !h->map.n || b->patches.n || !b->rig.skin_bone || !bones.n || !b->mesh.nf) return;
    double *share = cli_allocate(bones.n, sizeof *share, "the bones");
    bones.of_face = cli_allocate(b->mesh.nf, sizeof *bones.of_face, "the bones");
    for (size_t f = 0; f < b->mesh.nf; f++) bones.of_face[f] = bone_of_face(b, f, share);
    vg_head_put(h, &bones, "patches");
    free(share);
}

static void put_reference(side *s, take_frame *put, void *context)
{
    vg_frame frame = s->frame;
    s->frame = (vg_frame){.name = s->head->body.reference_name, .values = s->head->body.reference};
    put(context, 0, s, NULL);
    s->frame = frame;
    s->frames++;
}

/* ---- sheet ---- */

/* Patches that were kept apart from the sequence. */
static void take_patches(side *s)
{
    vg_head h = {0};
    vg_err e;
    char name[420];
    snprintf(name, sizeof name, "'%.400s'", opts.patches);
    cli_load(&h, opts.patches, "patches");
    if (vg_mesh_same(&h.body.mesh, name, &s->head->body.mesh, s->name, &e) < 0)
        cli_die(&e);
    vg_head_take(s->head, &h, "patches");
    vg_head_clear(&h);
}

/* What --look-at names in each sequence of a sheet. */
static void look_at(vg_sheet *sheet, size_t i, const side *s)
{
    vg_err e;
    uint32_t *vertices;
    size_t n;
    if (vg_look_find(&s->head->body, opts.look, &vertices, &n, &e) < 0) cli_usage("--look-at: in %s %s", s->name, e.message);
    if (vg_sheet_look_at(sheet, i, vertices, n, &e) < 0) cli_die(&e);
    free(vertices);
}

static void add_row(vg_sheet *sheet, size_t i, const side *s, const side *truth)
{
    vg_err e;
    if (vg_sheet_sequence(sheet, s->label, s->head, truth ? truth->head : NULL, &e) < 0) cli_die(&e);
    if (opts.look) look_at(sheet, i, s);
}

static void sheet_frame(void *sheet, size_t i, const side *s, const double *truth)
{
    vg_err e;
    if (vg_sheet_add(sheet, i, &s->frame, truth, &e) < 0) cli_die(&e);
}

/* Options that are about frames or several sequences do not go with an artefact of which something else is drawn. */
static void refuse_options(const char *const *strange, size_t n, const char *what)
{
    for (size_t i = 0; i < n; i++)
        if (cli_given(strange[i])) cli_usage("option '--%s' applies to a sequence: of a %s", strange[i], what);
}

static void refuse_sequence_options(const char *what)
{
    static const char *const strange[] = {"frames", "columns", "size", "silhouettes", "look-at", "beside", "against", "scales", "scale", "turn", "fps"};
    refuse_options(strange, sizeof strange / sizeof *strange, what);
}

static void refuse_camera_options(const char *what)
{
    static const char *const strange[] = {"zoom", "fit", "ground", "edges"};
    refuse_options(strange, sizeof strange / sizeof *strange, what);
}

/* A signal is drawn as its curve through the pose plane. */
static void make_plane(cast *c)
{
    vg_err e;
    vg_sheet_options o = sheet_options();
    vg_plane_options plane = {.azimuth = o.azimuth, .elevation = o.elevation, .z_up = o.z_up};
    refuse_camera_options("signal the pose plane is drawn");
    refuse_sequence_options("signal the pose plane is drawn");
    if (opts.animated) cli_usage("a signal is drawn as PNG: an animation is made of the poses of vg-sample");
    if (opts.patches) take_patches(&c->result);
    while (next_frame(&c->result)) continue; /* to the end, so that damage is seen */
    FILE *out = cli_text_open();
    if (vg_plane_write(c->result.head, &plane, fileno(out), cli_output() ? cli_output() : "standard output", &e) < 0) cli_die(&e);
    cli_text_end();
}

/* A network is drawn as the curves of its training. */
static bool has_curves(const cast *c)
{
    const vg_network *n = &c->result.head->network;
    return n->model && n->ncurve && !opts.page && !opts.animated;
}

static void make_curves(cast *c)
{
    static const char *const strange[] = {"view", "up", "patches"};
    const char *what = "network its curves are drawn";
    refuse_options(strange, sizeof strange / sizeof *strange, what);
    refuse_camera_options(what);
    refuse_sequence_options(what);
    while (next_frame(&c->result)) continue; /* to the end, so that damage is seen */
    network_plot_write(&c->result.head->network, c->result.label, opts.svg);
}

static void make_sheet(cast *c)
{
    vg_sheet_options o = sheet_options();
    vg_sheet *sheet;
    vg_err e;
    if (opts.patches) take_patches(&c->result);
    if (vg_sheet_new(&sheet, &o, &e) < 0) cli_die(&e);
    add_row(sheet, 0, &c->result, opts.against ? &c->truth : NULL);
    for (size_t i = 0; i < opts.nbeside; i++) add_row(sheet, i + 1, &c->beside[i], c->compared[i] ? &c->truth : NULL);
    read_cast(c, false, sheet_frame, sheet);
    if (shows_reference(c)) put_reference(&c->result, sheet_frame, sheet);
    check_counts(c);
    FILE *out = cli_text_open();
    if (vg_sheet_write(sheet, fileno(out), cli_output() ? cli_output() : "standard output", &e) < 0) cli_die(&e);
    cli_text_end();
    vg_sheet_free(&sheet);
}

/* ---- page ---- */

static vg_page_options page_options(const side *result)
{
    vg_sheet_options view = sheet_options();
    return (vg_page_options){.title = opts.title ? opts.title : result->label,
                             .azimuth = view.azimuth,
                             .elevation = view.elevation,
                             .z_up = view.z_up,
                             .fit = view.fit,
                             .edges = opts.edges,
                             .ground = opts.ground,
                             .zoom = view.zoom,
                             .tint = view.tint,
                             .centred = opts.centred,
                             .scale = opts.scale,
                             .pick = opts.pick};
}

static void add_sequence(vg_page *page, const side *s)
{
    vg_err e;
    if (vg_page_sequence(page, s->label, s->head, &e) < 0) cli_die(&e);
}

static void page_frame(void *page, size_t i, const side *s, const double *truth)
{
    vg_err e;
    if (vg_page_add(page, i, &s->frame, truth, &e) < 0) cli_die(&e);
}

static void note_stats(const vg_page_stats *stats)
{
    cli_note("%zu frames in %.2f MB; positions are within %.2g D of the input", stats->frames,
             (double)stats->bytes / 1e6, stats->loss);
    if (opts.against)
        cli_note("errors: mean %.3g D, max %.3g D; the colours end at %.3g D", stats->mean, stats->max, stats->scale);
    else if (stats->tinted)
        cli_note("colours: from %.3g to %.3g, mean %.3g; they end at %.3g", stats->least, stats->max, stats->mean,
                 stats->scale);
}

/* The frames of a signal, sampled, say what the camera has to show. */
static void add_sampled(vg_page *page, side *s)
{
    vg_err e;
    const vg_signal *signal = &s->head->signal;
    vg_sampler *sampler;
    double at[2], *x = cli_allocate(signal->m + 1, sizeof *x, "coordinates");
    if (vg_sampler_new(&sampler, signal, false, &e) < 0 || vg_frame_shape(&s->frame, s->head, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < signal->n; i++) {
        vg_sampler_position(sampler, (double)i + 1, at);
        vg_sampler_coordinates(sampler, 1, at, x);
        vg_sampler_shapes(sampler, 1, x, &s->frame.values);
        vg_sampler_place(sampler, (double)i + 1, s->head->body.mesh.nv, s->frame.values);
        s->frame.has_time = signal->timed;
        s->frame.time = signal->timed ? signal->times[i] : 0;
        if (vg_frame_rename(&s->frame, signal->names[i], &e) < 0) cli_die(&e);
        page_frame(page, 0, s, NULL);
    }
    vg_sampler_free(&sampler);
    free(x);
}

/* A page on which the signal is edited. */
static void make_signal_page(cast *c)
{
    vg_page_options o = page_options(&c->result);
    vg_page *page;
    vg_page_stats stats;
    vg_err e;
    refuse_sequence_options("signal the pose plane is shown");
    if (c->result.head->signal.space != VG_SPACE_VERTICES)
        cli_stop(VG_EINPUT, "a page shows signals whose shapes are vertices: pipe 'vg-sample | vg-solve | vg-view', or fit it "
                 "with 'vg-fitsignal --space vertices'");
    o.signal = true;
    if (opts.patches) take_patches(&c->result);
    while (next_frame(&c->result)) continue; /* to the end, so that damage is seen */
    FILE *out = cli_text_open();
    if (vg_page_new(&page, fileno(out), cli_output() ? cli_output() : "standard output", &o, &e) < 0) cli_die(&e);
    add_sequence(page, &c->result);
    add_sampled(page, &c->result);
    if (vg_page_end(page, &stats, &e) < 0) cli_die(&e);
    cli_text_end();
    vg_page_free(&page);
    cli_note("a signal of %zu frames in %.2f MB", stats.frames, (double)stats.bytes / 1e6);
}

static void make_page(cast *c)
{
    vg_page_options o = page_options(&c->result);
    vg_page *page;
    vg_page_stats stats;
    vg_err e;
    if (opts.patches) take_patches(&c->result);
    FILE *out = cli_text_open();
    if (vg_page_new(&page, fileno(out), cli_output() ? cli_output() : "standard output", &o, &e) < 0) cli_die(&e);
    add_sequence(page, &c->result);
    if (opts.against) add_sequence(page, &c->truth);
    for (size_t i = 0; i < opts.nbeside; i++) add_sequence(page, &c->beside[i]);
    read_cast(c, true, page_frame, page);
    if (shows_reference(c)) put_reference(&c->result, page_frame, page);
    if (!opts.pick) check_counts(c);
    if (vg_page_end(page, &stats, &e) < 0) cli_die(&e);
    cli_text_end();
    vg_page_free(&page);
    note_stats(&stats);
}

int main(int argc, char **argv)
{
    static cast c;
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    sheet_options(); /* report errors in them before the input is opened */
    choose_kind();
    open_cast(&c, operands, n);
    colour_bones(c.result.head);
    if (opts.svg && !has_curves(&c)) cli_usage("an SVG is made of the curves of a network, which %s does not hold: use .html, .png or .webp", c.result.name);
    if (has_curves(&c)) make_curves(&c);
    else if (opts.page && c.result.head->signal.n) make_signal_page(&c);
    else if (opts.page) make_page(&c);
    else if (c.result.head->signal.n) make_plane(&c);
    else make_sheet(&c);
    warn_scale(&c);
    close_cast(&c);
    cli_finish(0);
}
