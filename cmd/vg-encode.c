/* vg-encode: read poses from mesh files, archives, directories or streams into one stream.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"
#include "placing.h"
#include "raw.h"
#include "take.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    bool vectors, f32;
    const char *reference, *anchors, *mesh, *most_bytes;
    vg_reading reading;
    size_t weld; /* 1: off */
    size_t objects; /* 1: frames */
    double fps;
    size_t faces; /* 1: selected */
    size_t raw;   /* of enum raw */
    take_list take;
    placing placing;
} opts;

static const cli_option options[] = {
    {"vectors", 0, NULL, "write the vectors of the vector graph instead of vertices", .flag = &opts.vectors},
    {"faces", 0, "all|selected", "which faces have vectors: all (default), or about half of them",
     .choice = &opts.faces},
    {"reference", 0, "MESH", "the undeformed pose; default: the first pose", .text = &opts.reference,
     .reads = true},
    {"mesh", 0, "MESH", "the faces and reference pose of point caches and arrays, which hold none",
     .text = &opts.mesh, .reads = true},
    {"array-axes", 0, "ORDER", "the order of the axes of positions in an NPZ: fvx, vxf, ... (frames, vertices, x y z)",
     .text = &opts.reading.array_axes},
    {"objects", 0, "parts|frames", "objects of an OBJ are parts of one mesh (default), or each a frame",
     .choice = &opts.objects},
    {"animation", 0, "NAME", "the animation of a GLB or glTF with this name",
     .text = &opts.reading.animation},
    {"shapes", 0, NULL, "read the morph targets of a GLB or glTF, not its animations", .flag = &opts.reading.shapes},
    {"weld", 0, "exact|off", "merge vertices of a GLB or glTF that always coincide (default), or keep them apart",
     .choice = &opts.weld},
    {"max-bytes", 0, "SIZE", "limit for unpacking archives and compressed files (default: 1G per file, 64G in all)",
     .text = &opts.most_bytes},
    {"anchor", 0, "V,V,...", "vertices that vg-solve must meet exactly", .text = &opts.anchors},
    {"take", 0, "FRAMES", "write these frames alone, counted from 0: 12, or 3,10-20, or 0-/2 for every other",
     .take = take_parse, .context = &opts.take},
    {"fps", 0, "N", "give the poses times, N a second, from 0; sample animations of a GLB or glTF at them",
     .number = &opts.fps, .least = 1e-6, .most = 1e9},
    {"axes", 0, "y-up|z-up|FROM:TO", "rotate the body: make y (or z) point up where z (or y) did; or 'xz-y:xyz'",
     .take = placing_take_axes, .context = &opts.placing},
    {"scale", 0, "X", "multiply all positions by X", .number = &opts.placing.scale, .least = 1e-12, .most = 1e12},
    {"unit", 0, "FROM:TO", "scale from one unit to another, such as cm:m", .take = placing_take_unit,
     .context = &opts.placing},
    {"mirror", 0, "x|y|z", "mirror the body in its middle: vertices are exchanged with those on the other side",
     .take = placing_take_mirror, .context = &opts.placing},
    {"pairs", 0, "auto|FILE", "the pairs of vertices: found in the reference pose (default), or a file, one pair per "
                              "line",
     .text = &opts.placing.pairs, .reads = true, .needs = "mirror"},
    {"origin", 0, "centre|floor|X,Y,Z", "move this point of the reference pose to 0,0,0: its centroid, the floor "
                                        "below it",
     .text = &opts.placing.origin},
    {"raw", 0, "f32|f64", "read frames that are numbers alone, x y z of each vertex of --mesh, little-endian",
     .choice = &opts.raw, .needs = "mesh", .excludes = "array-axes|animation|shapes|weld|max-bytes"},
    {"f32", 0, NULL, "write binary32 instead of binary64", .flag = &opts.f32},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-encode",
    .synopsis = "[options] [FILE ...]",
    .summary = "read poses from mesh files, archives, directories or streams into one stream",
    .options = options,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .any_form = true,
    .threaded = true};

/* Artefacts made with another reference pose, or another choice of faces, are invalid for the new one. */
static void set_reference(vg_head *h, const char *operand)
{
    vg_err e;
    vg_head r = {0};
    cli_load(&r, operand, "mesh");
    if (vg_mesh_same(&r.body.mesh, "the reference", &h->body.mesh, "the sequence", &e) < 0 ||
        vg_head_merge_trace(h, &r, &e) < 0)
        cli_die(&e);
    vg_head_take(h, &r, "reference");
    if (r.body.attributes.ntex || r.body.attributes.nlabels || r.body.attributes.ncolours || r.body.asset.n) vg_head_take(h, &r, "attributes");
    if (r.body.asset.n) vg_head_take(h, &r, "asset");
    vg_head_drop(h, "links");
    vg_head_drop(h, "rig");
    vg_head_drop(h, "map");
    vg_head_clear(&r);
}

static void set_anchors(vg_head *h, uint32_t *anchors, size_t n)
{
    if (n && anchors[n - 1] >= h->body.mesh.nv)
        cli_usage("--anchor names vertex %u, but there are %zu, counted from 0", anchors[n - 1], h->body.mesh.nv);
    vg_head_drop(h, "anchors");
    h->anchors = anchors, h->nanchors = n;
}

static void select_all_faces(vg_head *h)
{
    vg_head_drop(h, "selection");
    vg_head_drop(h, "links");
}

static void select_faces(vg_head *h)
{
    vg_err e;
    if (h->selection.chosen) return;
    if (vg_select_faces(&h->body.mesh, &h->selection.faces, &h->selection.n, &e) < 0) cli_die(&e);
    h->selection.chosen = true;
    vg_map_clear(&h->map);
    cli_note("%zu of %zu faces have vectors", h->selection.n, h->body.mesh.nf);
}

/* The options that change a sequence need vertices; a stream of anything else is passed on unchanged. */
static void apply_options(vg_head *h, bool selects, uint32_t *anchors, size_t nanchors)
{
    if (h->kind != VG_VERTICES) {
        if (opts.vectors && h->kind == VG_VECTORS) opts.vectors = false;
        if (opts.f32 && h->kind == VG_OTHER)
            cli_stop(VG_EINPUT, "the input holds '%s': --f32 needs a form that this program knows", vg_head_form(h));
        if (opts.vectors || selects || opts.reference || opts.anchors || placing_wanted(&opts.placing))
            cli_stop(VG_EINPUT,
                     "the input holds %s: --vectors, --faces, --reference, --anchor, --axes, --scale, --unit, "
                     "--mirror and --origin need vertices",
                     vg_head_form(h));
    } else {
        if (opts.reference) set_reference(h, opts.reference);
        if (placing_wanted(&opts.placing)) placing_head(&opts.placing, h);
        if (selects) select_faces(h);
        else if (cli_given("faces")) select_all_faces(h);
        if (opts.anchors) set_anchors(h, anchors, nanchors);
    }
    if (opts.f32) h->precision = VG_F32;
}

typedef struct work {
    uint32_t *anchors; /* of --anchor */
    size_t nanchors;
    uint64_t read, written;
    uint64_t since;   /* frames written of this animation, */
    double last_time; /* and the time that the last one read had */
    vg_head *h;
    vg_graph *g; /* NULL: frames are written as they come */
    vg_frame vectors;
} work;

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    work *w = context;
    vg_err e;
    (void)in;
    w->h = h;
    apply_options(h, opts.faces == 1, w->anchors, w->nanchors);
    if (!opts.vectors) return;
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_head_graph(&w->g, h, &e) < 0) cli_die(&e);
    h->kind = VG_VECTORS, h->count = vg_graph_corners(w->g);
    if (vg_frame_shape(&w->vectors, h, &e) < 0) cli_die(&e);
}

/* The vectors of a pose as a frame. */
static vg_frame *to_vectors(work *w, vg_frame *in)
{
    vg_err e;
    vg_frame *out = &w->vectors;
    if (vg_frame_label(out, in, &e) < 0) cli_die(&e);
    vg_graph_vectors(w->g, in->values, out->values);
    vg_graph_root(w->g, in->values, out->root);
    vg_graph_anchors(in->values, w->h->anchors, w->h->nanchors, vg_frame_anchors(out));
    return out;
}

/* A file of several animations counts each from 0: "Run.0001" is earlier than the frame before it. */
static bool begins_animation(const work *w, const vg_frame *f)
{
    return f->has_time && f->time <= w->last_time && vg_frame_begins(f->name);
}

static void encode_batch(void *context, size_t n, vg_frame *in)
{
    work *w = context;
    for (size_t i = 0; i < n; i++) {
        if (w->read > 0 && begins_animation(w, &in[i])) w->since = 0;
        w->last_time = in[i].has_time ? in[i].time : HUGE_VAL;
        if (!take_wants(&opts.take, w->read++)) continue;
        if (placing_wanted(&opts.placing)) placing_frame(&opts.placing, &in[i]);
        vg_frame *f = w->g ? to_vectors(w, &in[i]) : &in[i];
        if (opts.fps > 0) f->has_time = true, f->time = (double)w->since++ / opts.fps;
        cli_stream_put(f);
        w->written++;
    }
}

static void check_taken(void *context)
{
    const work *w = context;
    take_end(&opts.take, w->read);
}

/* Frames that are numbers alone: what step_run does, without a source. */
static void encode_raw(work *w, char **operands, size_t n)
{
    vg_err e;
    vg_head h = {0};
    vg_frame f = {0};
    if (n > 1) cli_usage("--raw reads one file or pipe, not %zu", n);
    if (vg_load(&h, opts.mesh, "mesh", &e) < 0) cli_die(&e);
    cli_expect_input(n);
    h.kind = VG_VERTICES, h.count = h.body.mesh.nv, h.precision = VG_F64;
    raw_input in = raw_open(n ? operands[0] : "-", 3 * h.count, opts.raw == 1 ? 8 : 4);
    if (vg_frame_shape(&f, &h, &e) < 0) cli_die(&e);
    prepare(w, &h, &f);
    cli_stream_open(&h);
    while (raw_next(&in, &f)) {
        encode_batch(w, 1, &f);
        cli_progress("poses", w->read);
    }
    check_taken(w);
    cli_stream_end(NULL);
    raw_close(&in);
    vg_frame_clear(&f);
    vg_head_clear(&h);
}

static void check_axes(const char *axes)
{
    if (axes && (strlen(axes) != 3 || !strchr(axes, 'f') || !strchr(axes, 'v') || !strchr(axes, 'x')))
        cli_usage("option '--array-axes' needs f, v and x in the order of the axes, such as vxf, not '%s'", axes);
}

/* An option for files that none of the inputs is. */
static void warn_of_ignored(const vg_source *s)
{
    static const struct {
        const char *member, *option, *formats;
    } all[] = {{"array_axes", "--array-axes", "NPZ"},
               {"objects", "--objects frames", "OBJ"},
               {"animation", "--animation", "GLB and glTF"},
               {"shapes", "--shapes", "GLB and glTF"},
               {"unwelded", "--weld off", "GLB and glTF"}};
    const char *member = vg_source_ignored(s);
    for (size_t i = 0; member && i < sizeof all / sizeof *all; i++)
        if (!strcmp(all[i].member, member)) cli_warn("%s is for %s, and no input is one", all[i].option, all[i].formats);
}

int main(int argc, char **argv)
{
    static const step encoding = {
        .batch = 1, .unit = "poses", .init = prepare, .process = encode_batch, .finish = check_taken};
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    work w = {0};
    if (opts.anchors) w.nanchors = cli_parse_vertices("--anchor", opts.anchors, &w.anchors);
    opts.reading.fps = opts.fps, opts.reading.unwelded = opts.weld == 1, opts.reading.objects = opts.objects == 1;
    if (opts.reading.shapes && opts.reading.animation) cli_usage("--shapes and --animation exclude one another");
    check_axes(opts.reading.array_axes);
    vg_source_options from = {.mesh = opts.mesh, .reading = opts.reading};
    if (opts.most_bytes && !(from.most_bytes = cli_parse_size("max-bytes", opts.most_bytes)))
        cli_usage("option '--max-bytes' needs a size of at least 1");
    if (cli_given("raw")) {
        encode_raw(&w, operands, n);
    } else {
        vg_source *s = cli_source_with(operands, n, &from);
        step_run(&encoding, &w, s);
        warn_of_ignored(s);
        vg_source_close(&s);
    }
    vg_frame_clear(&w.vectors);
    vg_graph_free(&w.g);
    cli_finish(0);
}
