/* vg-decode: write the poses of a stream as mesh files, a directory or an archive of them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"
#include "raw.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static vg_sink_options sink_options;
static long first_number, most_targets;
static double fps; /* 0: the times of the frames */
static uint64_t written;
static const char *output; /* not cli_output(), which is NULL for "-" as for none */

static const cli_option options[] = {
    {"output", 'o', "FILE", "a.obj, 'a-%04d.ply', DIR/, a.zip, a.npz, ...; '-' is standard output; '-:f32' numbers alone",
     .text = &output},
    {"format", 0, "obj|ply|ply-ascii|ply-be|off|stl|stl-ascii|pc2|mdd|npy|npz|usda|glb|gltf|bvh",
     "whatever the name says", .text = &sink_options.format},
    {"f64", 0, NULL, "numbers that read back to the same binary64, not binary32",
     .flag = &sink_options.full_precision},
    {"fps", 0, "N", "give the frames times, N a second, from 0", .number = &fps, .least = 1e-6, .most = 1e9},
    {"replace", 0, NULL, "replace the mesh files that are in the directory, or have the pattern's names, as a whole",
     .flag = &sink_options.replace},
    {"first-number", 0, "N", "the first number for %d in the output's name (default 0)", .integer = &first_number,
     .least = 0, .most = 1e9},
    {"mesh", 0, "MESH", "file for the mesh of a point cache or array; default: beside it, as NAME.obj",
     .text = &sink_options.mesh},
    {"no-mesh", 0, NULL, "write no mesh beside a point cache or array", .flag = &sink_options.no_mesh},
    {"drop-loose", 0, NULL, "leave out the vertices that are in no face", .flag = &sink_options.drop_loose},
    {"max-targets", 0, "N", "most morph targets of a GLB or glTF, from which frames are mixed",
     .integer = &most_targets, .least = 1, .most = 1e6},
    {"morph-tolerance", 0, "X", "largest error of a vertex by mixing, in D (default 0.001)",
     .number = &sink_options.morph_tolerance, .least = 1e-7, .most = 1},
    {"no-normals", 0, NULL, "leave out the normals of a GLB or glTF that the input does not have: a smaller file",
     .flag = &sink_options.no_normals},
    {"shapes", 0, NULL, "each frame is a morph target of a GLB or glTF, and there is no animation",
     .flag = &sink_options.shapes},
    {"quantize", 0, NULL, "positions of a GLB or glTF of 16 bits, normals of 8: about half the size",
     .flag = &sink_options.quantize},
    {"name", 0, "NAME", "name of the animation in a GLB or glTF", .text = &sink_options.name},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-decode",
    .synopsis = "[options] -o FILE [FILE]",
    .summary = "write the poses of a stream as mesh files, a directory or an archive of them",
    .options = options,
    .most_operands = 1,
    .threaded = true};

static vg_sink *sink;
static void discard(void)
{
    vg_sink_discard(sink);
}

static void put_frames(void *context, size_t n, vg_frame *in)
{
    vg_err e;
    (void)context;
    for (size_t i = 0; i < n; i++) {
        if (fps > 0) in[i].has_time = true, in[i].time = (double)written / fps;
        if (vg_sink_put(sink, &in[i], &e) < 0) cli_die(&e);
        written++;
    }
}

/* ---- frames as numbers with nothing around them ---- */

typedef struct numbers {
    FILE *to;
    size_t count, width; /* numbers of a frame, bytes of a number */
} numbers;

static void put_numbers(void *context, size_t n, vg_frame *in)
{
    const numbers *x = context;
    for (size_t i = 0; i < n; i++) raw_write(x->to, &in[i], x->count, x->width);
}

static void refuse_raw_options(void)
{
    for (const cli_option *o = options; o->name; o++)
        if (strcmp(o->name, "output") && cli_given(o->name))
            cli_usage("option '--%s' has no meaning for frames that are numbers alone", o->name);
}

static void decode_raw(vg_source *s, size_t width)
{
    static const step writing = {.batch = 1, .unit = "poses", .process = put_numbers};
    const vg_head *h = vg_source_head(s);
    numbers x = {cli_text_open(), h->count * vg_head_width(h), width};
    vg_frame *in = batch_frames(&writing);
    if (!batch_read(&writing, &x, s, in)) cli_warn("the input has no poses: '%s' holds none", output);
    batch_frames_free(&writing, in);
    cli_text_end();
}

/* ---- an artefact, which has no poses: its reference pose ---- */

/* What the input is instead of poses; NULL: no artefact. advice: which program takes it. */
static const char *artefact_of(const vg_head *h, const char **advice)
{
    static const char *const artefacts[] = {"map", "signal", "network", "patches"},
                      *const takers[] = {"vg-play plays it", "vg-sample evaluates it", "vg-generate uses it", "vg-view colours them"};
    if (h->kind != VG_VERTICES || !h->body.mesh.nv) return NULL;
    for (size_t i = 0; i < sizeof artefacts / sizeof *artefacts; i++)
        if (vg_head_need(h, artefacts[i], "it", NULL) == VG_OK) return *advice = takers[i], artefacts[i];
    return NULL;
}

static bool writes_gltf(void)
{
    const char *end = sink_options.format ? sink_options.format : strrchr(output, '.');
    if (!end) return false;
    end += *end == '.';
    return !strcmp(end, "glb") || !strcmp(end, "gltf");
}

/* A rig with weights is written to glTF with its joints: as transforms, which do nothing in the reference pose. */
static bool write_as_skin(vg_head *h)
{
    const vg_rig *rig = &h->body.rig;
    if (!rig->skin_bone || !writes_gltf()) return false;
    h->kind = VG_TRANSFORMS, h->count = rig->nbones;
    return true;
}

static void put_reference(const vg_head *h)
{
    vg_err e;
    vg_frame f = {0};
    if (vg_frame_shape(&f, h, &e) < 0 || vg_frame_rename(&f, h->body.reference_name, &e) < 0) cli_die(&e);
    if (h->kind == VG_VERTICES) memcpy(f.values, h->body.reference, 3 * h->body.mesh.nv * sizeof *f.values);
    for (size_t i = 0; h->kind == VG_TRANSFORMS && i < 7 * h->count; i++) f.values[i] = i % 7 == 0;
    if (vg_sink_put(sink, &f, &e) < 0) cli_die(&e);
    vg_frame_clear(&f);
}

static void warn_empty(const char *artefact, const char *advice, bool skin)
{
    if (!artefact) cli_warn("the input has no poses: '%s' holds none", output);
    else if (skin) cli_warn("the input holds no poses but a rig: it is written in its reference pose; vg-play moves it");
    else cli_warn("the input holds no poses but a %s: its reference pose is written; %s", artefact, advice);
}

/* Said when the caller chose how exact the file is. */
static void say_report(void)
{
    bool inexact;
    const bool chosen = sink_options.quantize || sink_options.morph_tolerance > 0;
    const char *report = vg_sink_report(sink, &inexact);
    if (report && (cli_verbose() || (inexact && chosen))) cli_say("%s", report);
}

static void decode_frames(vg_source *s)
{
    static const step writing = {.batch = 1, .unit = "poses", .process = put_frames};
    vg_err e;
    vg_head *h = vg_source_head(s);
    vg_frame *in = batch_frames(&writing);
    bool empty = !cli_next(s, in);
    const char *advice = NULL, *artefact = empty ? artefact_of(h, &advice) : NULL;
    bool skin = artefact && write_as_skin(h);
    cli_discard_by(discard);
    if (vg_sink_open(&sink, output, h, &sink_options, &e) < 0) cli_die(&e);
    if (!empty) {
        put_frames(NULL, 1, in);
        batch_read(&writing, NULL, s, in);
    }
    if (artefact) put_reference(h);
    if (vg_sink_end(sink, &e) < 0) cli_die(&e);
    if (empty) warn_empty(artefact, advice, skin);
    for (size_t i = 0; vg_sink_warning(sink, i); i++) cli_warn("%s", vg_sink_warning(sink, i));
    say_report();
    vg_sink_close(&sink);
    batch_frames_free(&writing, in);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_err e;
    sink_options.first_number = first_number, sink_options.most_targets = (size_t)most_targets;
    sink_options.threads = cli_threads();
    if (!output) cli_usage("name the output: -o poses.zip, -o 'pose-%%04d.obj', or -o poses/");
    size_t raw = 0;
    char *file = NULL;
    if (raw_output(output, &raw, &file)) {
        refuse_raw_options();
        cli_redirect(file, false);
        if (!cli_output() && isatty(STDOUT_FILENO)) cli_usage("numbers are not written to a terminal: pipe them into a program");
    } else if (vg_sink_check(output, &sink_options, &e) < 0) {
        cli_die(&e);
    }
    if (cli_given("first-number") && !strchr(output, '%'))
        cli_usage("--first-number is for files with numbers, such as 'pose-%%04d.obj': '%s' has none", output);
    vg_source *s = cli_source(operands, n);
    if (raw) decode_raw(s, raw);
    else decode_frames(s);
    free(file);
    vg_source_close(&s);
    cli_finish(0);
}
