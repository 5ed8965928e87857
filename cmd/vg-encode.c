/* vg-encode: read poses from mesh files, archives, directories or streams into one stream.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "take.h"

#include <stdlib.h>
#include <string.h>

static struct {
    bool vectors, f32;
    const char *reference, *anchors, *mesh, *most_bytes;
    double fps;
    size_t faces; /* 1: selected */
    take_list take;
} opts;

static const cli_option options[] = {
    {"vectors", 0, NULL, "write the vectors of the vector graph instead of vertices", .flag = &opts.vectors},
    {"faces", 0, "all|selected", "which faces carry vectors: all (default), or about half of them",
     .choice = &opts.faces},
    {"reference", 0, "MESH", "the undeformed pose; default: the first pose", .text = &opts.reference,
     .reads = true},
    {"mesh", 0, "MESH", "the faces and reference pose of point caches and arrays, which hold none",
     .text = &opts.mesh, .reads = true},
    {"max-bytes", 0, "SIZE", "what an archive or compressed file may unpack to (default: 1G in one file, 64G in all)",
     .text = &opts.most_bytes},
    {"anchor", 0, "V,V,...", "vertices that vg-solve must meet exactly", .text = &opts.anchors},
    {"take", 0, "FRAMES", "write these frames alone, counted from 0: 12, or 3,10-20, or 0-/2 for every other",
     .take = take_parse, .context = &opts.take},
    {"fps", 0, "N", "give the poses times, N a second, from 0", .number = &opts.fps, .least = 1e-6, .most = 1e9},
    {"f32", 0, NULL, "write binary32 instead of binary64", .flag = &opts.f32},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-encode",
    .synopsis = "[options] [FILE ...]",
    .summary = "read poses from mesh files, archives, directories or streams into one stream",
    .options = options,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .threaded = true};

/* What was made on another reference pose, or on another choice of faces, is not true of the new one. */
static void set_reference(vg_head *h, const char *operand)
{
    vg_err e;
    vg_head r = {0};
    if (vg_load_mesh(&r, operand, &e) < 0 ||
        vg_mesh_same(&r.body.mesh, "the reference", &h->body.mesh, "the sequence", &e) < 0 ||
        vg_head_merge_trace(h, &r, &e) < 0)
        cli_die(&e);
    free(h->body.reference);
    free(h->body.reference_name);
    h->body.reference = r.body.reference, h->body.reference_name = r.body.reference_name;
    r.body.reference = NULL, r.body.reference_name = NULL;
    if (r.body.attributes.ntex || r.body.attributes.nlabels) {
        vg_attributes_clear(&h->body.attributes);
        h->body.attributes = r.body.attributes;
        r.body.attributes = (vg_attributes){0};
    }
    free(h->links);
    h->links = NULL, h->nlinks = 0, h->has_links = false;
    vg_rig_clear(&h->body.rig);
    vg_map_clear(&h->map);
    vg_head_clear(&r);
}

static void set_anchors(vg_head *h, uint32_t *anchors, size_t n)
{
    if (n && anchors[n - 1] >= h->body.mesh.nv)
        cli_usage("--anchor names vertex %u, but there are %zu, counted from 0", anchors[n - 1], h->body.mesh.nv);
    free(h->anchors);
    h->anchors = anchors, h->nanchors = n;
}

static void select_all_faces(vg_head *h)
{
    free(h->selected);
    free(h->links);
    h->has_selection = h->has_links = false;
    h->selected = NULL, h->nselected = 0, h->links = NULL, h->nlinks = 0;
}

static void select_faces(vg_head *h)
{
    vg_err e;
    if (h->has_selection) return;
    if (vg_select_faces(&h->body.mesh, &h->selected, &h->nselected, &e) < 0) cli_die(&e);
    h->has_selection = true;
    vg_map_clear(&h->map);
    cli_note("%zu of %zu faces carry vectors", h->nselected, h->body.mesh.nf);
}

/* What the options change about a sequence is about vertices: a stream of anything else is passed on as it is. */
static void prepare(vg_head *h, bool selects, uint32_t *anchors, size_t nanchors)
{
    if (h->kind != VG_VERTICES) {
        if (opts.vectors && h->kind == VG_VECTORS) opts.vectors = false;
        if (opts.vectors || selects || opts.reference || opts.anchors)
            cli_stop(VG_EINPUT, "the input holds %s: --vectors, --faces, --reference and --anchor need vertices",
                     vg_kind_name(h->kind));
    } else {
        if (opts.reference) set_reference(h, opts.reference);
        if (selects) select_faces(h);
        else if (cli_given("faces")) select_all_faces(h);
        if (opts.anchors) set_anchors(h, anchors, nanchors);
    }
    if (opts.f32) h->precision = VG_F32;
}

/* The next frame that is wanted: `read` of them are behind it. */
static bool next_taken(vg_source *s, vg_frame *f, uint64_t *read)
{
    while (cli_next(s, f))
        if (take_wants(&opts.take, (*read)++)) return true;
    take_end(&opts.take, *read);
    return false;
}

static void write_as_is(vg_source *s, vg_head *h)
{
    vg_frame f = {0};
    uint64_t read = 0;
    cli_stream_open(h);
    for (uint64_t n = 0; next_taken(s, &f, &read); n++) {
        if (opts.fps > 0) f.has_time = true, f.time = (double)n / opts.fps;
        cli_stream_put(&f);
        cli_progress("poses", n + 1);
    }
    vg_frame_clear(&f);
}

static void write_vectors(vg_source *s, vg_head *h)
{
    vg_err e;
    vg_graph *g;
    vg_frame in = {0}, out = {0};
    uint64_t read = 0;
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_graph_new(&g, h, &e) < 0) cli_die(&e);
    h->kind = VG_VECTORS, h->count = vg_graph_corners(g);
    if (vg_frame_shape(&out, h, &e) < 0) cli_die(&e);
    cli_stream_open(h);
    for (uint64_t n = 0; next_taken(s, &in, &read); n++) {
        if (vg_frame_label(&out, &in, &e) < 0) cli_die(&e);
        if (opts.fps > 0) out.has_time = true, out.time = (double)n / opts.fps;
        vg_graph_vectors(g, in.values, out.values);
        vg_graph_root(g, in.values, out.root);
        vg_graph_anchors(in.values, h->anchors, h->nanchors, out.anchors);
        cli_stream_put(&out);
        cli_progress("poses", n + 1);
    }
    vg_frame_clear(&in);
    vg_frame_clear(&out);
    vg_graph_free(&g);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands), nanchors = 0;
    uint32_t *anchors = NULL;
    bool selects = opts.faces == 1;
    if (opts.anchors) nanchors = cli_parse_vertices("--anchor", opts.anchors, &anchors);

    vg_source_options from = {.mesh = opts.mesh};
    if (opts.most_bytes && !(from.most_bytes = cli_parse_size("max-bytes", opts.most_bytes)))
        cli_usage("option '--max-bytes' needs a size of at least 1");
    vg_source *s = cli_source_with(operands, n, &from);
    vg_head *h = vg_source_head(s);
    prepare(h, selects, anchors, nanchors);
    if (opts.vectors) write_vectors(s, h);
    else write_as_is(s, h);
    cli_stream_end(vg_source_tail(s));
    vg_source_close(&s);
    cli_finish(0);
}
