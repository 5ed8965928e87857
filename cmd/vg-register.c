/* vg-register: pairs the faces of two meshes of different connectivity, from a few pairs of vertices. 'vg-deform
 * --correspondence' uses the result.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <stdlib.h>
#include <string.h>

static struct {
    const char *markers, *dense, *dense_source;
    long base;
    bool uv, aligned, bind, keep_all, all_components;
    uint32_t *components;
    size_t ncomponents;
} opts;

static void take_components(const char *text, void *context)
{
    (void)context;
    free(opts.components);
    opts.components = NULL, opts.ncomponents = 0;
    opts.all_components = !strcmp(text, "all");
    if (!opts.all_components) opts.ncomponents = cli_parse_vertices("components", text, &opts.components);
}

static const cli_option options[] = {
    {.name = "markers",
     .letter = 'm',
     .value = "FILE",
     .help = "pairs of vertices, one per line: [NAME] SOURCE TARGET",
     .text = &opts.markers,
     .reads = true},
    {.name = "index-base",
     .value = "N",
     .help = "the number of the first vertex in these files: 0 or 1 (default: 0)",
     .integer = &opts.base,
     .least = 0,
     .most = 1,
     .needs = "markers|dense|dense-source"},
    {.name = "keep-all", .help = "also use markers that contradict the others", .flag = &opts.keep_all,
     .needs = "markers"},
    {.name = "dense",
     .value = "FILE",
     .help = "vertices of TARGET as points of SOURCE, one per line: VERTEX A B C WA WB WC",
     .text = &opts.dense,
     .reads = true,
     .excludes = "dense-source"},
    {.name = "dense-source",
     .value = "FILE",
     .help = "the reverse: vertices of SOURCE as points of TARGET",
     .text = &opts.dense_source,
     .reads = true},
    {.name = "uv", .help = "pair points with the same texture coordinates", .flag = &opts.uv},
    {.name = "aligned",
     .help = "the meshes are already aligned; markers are not needed",
     .flag = &opts.aligned},
    {.name = "bind",
     .help = "bind TARGET, such as a shirt, hair or a prop, to SOURCE as they are; nothing is fitted",
     .flag = &opts.bind,
     .excludes = "markers|dense|dense-source|uv|aligned|components"},
    {.name = "components",
     .value = "all|K,...",
     .help = "the components of SOURCE that take part, counted from 0 (default: those that explain the target)",
     .take = take_components},
    {0},
};

static const cli_program program = {
    .name = "vg-register",
    .synopsis = "[options] SOURCE TARGET",
    .summary = "pair the faces of two meshes of different connectivity, from a few pairs of vertices",
    .options = options,
    .most_operands = 2,
    .writes_stream = true,
    .threaded = true,
};

static void check_options(size_t operands)
{
    if (operands != 2) cli_usage("two meshes are needed: SOURCE and TARGET");
    if (!opts.markers && !opts.dense && !opts.dense_source && !opts.uv && !opts.aligned && !opts.bind)
        cli_usage("there are no pairs of points: give --markers FILE, --dense FILE, --uv, or --aligned if the meshes "
                  "are aligned; --bind for clothes and props");
}

/* ---- what is said on standard error ---- */

static void note_step(void *context, const vg_register_step *s)
{
    (void)context;
    cli_progress_of("rounds", s->round, s->rounds);
    cli_note(
        "round %zu of %zu: %zu vertices near the target, %.3g D from it on average, at most %.3g D; stiffness %.3g",
        s->round, s->rounds, s->near, s->mean, s->largest, s->stiffness);
}

static void note_alignment(const vg_register_result *r)
{
    cli_note("the source as a whole: scale %.6g, rotation %.4f %.4f %.4f / %.4f %.4f %.4f / %.4f %.4f %.4f, shift "
             "%.6g %.6g %.6g",
             r->scale, r->rotation[0], r->rotation[1], r->rotation[2], r->rotation[3], r->rotation[4], r->rotation[5],
             r->rotation[6], r->rotation[7], r->rotation[8], r->shift[0], r->shift[1], r->shift[2]);
    if (r->uv_pairs)
        cli_note("%zu vertices of the source found their texture coordinates on the target", r->uv_pairs);
}

static void report_markers(const vg_markers *m, const vg_register_result *r)
{
    for (size_t i = 0; i < m->n; i++) {
        char which[100];
        if (m->at[i].name) snprintf(which, sizeof which, "marker '%.60s' (line %zu)", m->at[i].name, m->at[i].line);
        else snprintf(which, sizeof which, "the marker of line %zu", m->at[i].line);
        if (r->left_out[i])
            cli_warn("%s, vertex %ld on vertex %ld, is %.3g D from where its neighbours expect it, most are within "
                     "%.2g D: %s",
                     which, m->at[i].source + opts.base, m->at[i].target + opts.base, r->residual[i],
                     2 * r->typical_residual, opts.keep_all ? "it is used anyway" : "it is left out");
        else
            cli_note("%s: %.3g D from where its neighbours expect it", which, r->residual[i]);
    }
}

/* One line: the components of the source that explain nothing of the target. */
static void report_components(const vg_register_result *r)
{
    enum { LISTED = 12 };
    char list[16 * LISTED + 8] = "";
    size_t n = 0, at = 0;
    for (size_t k = 0; k < r->components; k++) {
        if (r->taken[k]) continue;
        if (n++ < LISTED) at += (size_t)snprintf(list + at, sizeof list - at, at ? ", %zu" : "%zu", k);
    }
    if (!n || opts.ncomponents) return;
    cli_warn("%zu of the %zu components of the source match no part of the target and are left out: %s%s", n,
             r->components, list, n > LISTED ? ", ..." : "");
}

enum { MOST_WARNINGS = 10 };

typedef struct marked {
    long vertex;
    const vg_marker *by;
} marked;

static int compare_marked(const void *a, const void *b)
{
    const marked *x = a, *y = b;
    if (x->vertex != y->vertex) return x->vertex < y->vertex ? -1 : 1;
    return x->by->line < y->by->line ? -1 : x->by->line > y->by->line;
}

/* Two markers on one vertex of a side say different things of it, or one is there twice. */
static void warn_shared(const vg_markers *m, bool target)
{
    size_t told = 0;
    marked *at = cli_allocate(m->n, sizeof *at, "the markers");
    for (size_t i = 0; i < m->n; i++)
        at[i] = (marked){(long)(target ? m->at[i].target : m->at[i].source), &m->at[i]};
    if (m->n) qsort(at, m->n, sizeof *at, compare_marked);
    for (size_t i = 1; i < m->n; i++)
        if (at[i].vertex == at[i - 1].vertex && told++ < MOST_WARNINGS)
            cli_warn("the markers of lines %zu and %zu are both on vertex %ld of the %s", at[i - 1].by->line,
                     at[i].by->line, at[i].vertex + opts.base, target ? "target" : "source");
    if (told > MOST_WARNINGS) cli_warn("the same applies to %zu more markers", told - MOST_WARNINGS);
    free(at);
}

/* Faces without counterpart, by component of the target. */
static void report_unmatched(const vg_mesh *m, const vg_correspondence *c)
{
    vg_err e;
    size_t n = 0, unmatched = 0;
    static const char what[] = "the components of the target";
    uint32_t *label = cli_allocate(m->nv, sizeof *label, what);
    if (vg_mesh_components(m, label, &n, &e) < 0) cli_die(&e);
    size_t *faces = cli_allocate(n, sizeof *faces, what), *without = cli_allocate(n, sizeof *without, what);
    for (size_t f = 0; f < m->nf; f++) {
        uint32_t k = label[m->vert[m->start[f]]];
        faces[k]++, without[k] += !c->matched[f], unmatched += !c->matched[f];
    }
    size_t told = 0;
    for (size_t k = 0; k < n; k++) {
        if (!without[k]) continue;
        if (told++ < MOST_WARNINGS)
            cli_warn("%zu of the %zu faces of the target's component %zu have no counterpart: they follow %s",
                     without[k], faces[k], k,
                     without[k] < faces[k] ? "those beside them" : "the nearest faces that have one");
    }
    if (told > MOST_WARNINGS)
        cli_warn("so do faces of %zu more components of the target", told - MOST_WARNINGS);
    cli_note("%zu of %zu faces of the target matched, %zu pairs", m->nf - unmatched, m->nf,
             (size_t)c->first[c->target_nf]);
    free(label);
    free(faces);
    free(without);
}

/* ---- the work ---- */

static void read_pairs(vg_register_input *in, vg_markers *markers, vg_seed **seeds)
{
    vg_err e;
    size_t n;
    const char *dense = opts.dense ? opts.dense : opts.dense_source;
    if (opts.markers) {
        char *data = cli_read_file(opts.markers, &n);
        if (vg_markers_read(markers, data, n, (int)opts.base, opts.markers, &e) < 0) cli_die(&e);
        free(data);
        in->markers = markers;
    }
    if (dense) {
        char *data = cli_read_file(dense, &n);
        if (vg_seeds_read(seeds, &in->nseeds, data, n, (int)opts.base, dense, &e) < 0) cli_die(&e);
        free(data);
        in->seeds = *seeds, in->seeds_of_source = opts.dense_source != NULL;
    }
}

static void load_mesh(vg_head *h, const char *operand)
{
    cli_load(h, operand, "mesh");
    if (opts.uv && h->body.attributes.ntex == 0)
        cli_stop(VG_EINPUT, "'%s' has no texture coordinates: --uv needs them in both meshes", operand);
}

/* The stream: the source's mesh and reference, one frame, and the pairs. */
static void write_stream(vg_head *h, const vg_head *target, vg_correspondence *pairs, const double *vertices)
{
    vg_err e;
    vg_frame f = {0};
    vg_head_put(h, pairs, "correspondence");
    h->kind = VG_VERTICES, h->count = h->body.mesh.nv;
    if (vg_head_merge_trace(h, target, &e) < 0) cli_die(&e);
    cli_stream_open(h);
    if (vg_frame_shape(&f, h, &e) < 0 ||
        vg_frame_rename(&f, target->body.reference_name ? target->body.reference_name : "", &e) < 0)
        cli_die(&e);
    if (h->body.mesh.nv) memcpy(f.values, vertices, 3 * h->body.mesh.nv * sizeof *f.values);
    cli_stream_put(&f);
    cli_stream_end(NULL);
    vg_frame_clear(&f);
}

/* --bind */
static void bind_target(vg_head *source, vg_head *target)
{
    vg_err e;
    vg_correspondence c;
    const vg_body *s = &source->body, *t = &target->body;
    cli_working("binding");
    if (vg_bind(&c, &s->mesh, s->reference, &t->mesh, t->reference, cli_threads(), &e) < 0) cli_die(&e);
    double farthest = 0, D = vg_diagonal(s->reference, s->mesh.nv);
    for (size_t f = 0; f < c.target_nf; f++) farthest = c.distance[f] > farthest ? c.distance[f] : farthest;
    cli_note("%zu faces are bound to the source, the farthest at %.3g %% of D from it", c.target_nf, 100 * farthest / D);
    write_stream(source, target, &c, s->reference);
}

static void pair_meshes(vg_head *source, vg_head *target)
{
    vg_err e;
    vg_markers markers = {0};
    vg_seed *seeds = NULL;
    vg_register_result r;
    vg_register_input in = {.source = &source->body.mesh,
                            .target = &target->body.mesh,
                            .source_points = source->body.reference,
                            .target_points = target->body.reference,
                            .aligned = opts.aligned,
                            .keep_all = opts.keep_all,
                            .components = opts.components,
                            .ncomponents = opts.ncomponents,
                            .all_components = opts.all_components,
                            .source_uv = opts.uv ? &source->body.attributes : NULL,
                            .target_uv = opts.uv ? &target->body.attributes : NULL,
                            .threads = cli_threads()};
    read_pairs(&in, &markers, &seeds);
    warn_shared(&markers, false);
    warn_shared(&markers, true);
    cli_working("aligning");
    if (vg_register(&r, &in, note_step, NULL, &e) < 0) cli_die(&e);
    note_alignment(&r);
    report_markers(&markers, &r);
    report_components(&r);
    report_unmatched(&target->body.mesh, &r.pairs);
    write_stream(source, target, &r.pairs, r.fitted);
    vg_register_result_clear(&r);
    vg_markers_clear(&markers);
    free(seeds);
}

int main(int argc, char **argv)
{
    char **operands;
    vg_head source = {0}, target = {0};
    check_options(cli_start(&program, argc, argv, &operands));
    load_mesh(&source, operands[0]);
    load_mesh(&target, operands[1]);
    if (opts.bind) bind_target(&source, &target);
    else pair_meshes(&source, &target);
    free(opts.components);
    vg_head_clear(&source);
    vg_head_clear(&target);
    cli_finish(0);
}
