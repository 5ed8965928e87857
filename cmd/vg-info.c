/* vg-info.c: describes a sequence, checks that it is complete, and shows how it was made. Frames are read in
 * contents.c; reports on some parts of the head are in separate files.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "contents.h"
#include "correspondences.h"
#include "meshes.h"
#include "networks.h"
#include "signals.h"
#include "skeletons.h"

#include <inttypes.h>
#include <sys/stat.h>
#include <unistd.h>

static struct {
    bool check, frames, digest, weights, positions, curve, vertices;
} opts;

static const cli_option options[] = {
    {.name = "check", .help = "read everything and only check that it is complete", .flag = &opts.check,
     .excludes = "digest|frames|weights|positions|curve|vertices"},
    {.name = "digest", .help = "only print a fingerprint of the content: 16 hexadecimal digits",
     .flag = &opts.digest, .excludes = "frames|weights|positions|curve"},
    {.name = "frames", .help = "list the frames", .flag = &opts.frames, .excludes = "weights|positions|curve"},
    {.name = "weights", .help = "only print the skinning weights of a rig, a vertex per line", .flag = &opts.weights,
     .excludes = "json|positions|curve"},
    {.name = "vertices", .help = "only print the vertex that each vertex of a GLB or glTF becomes by welding", .flag = &opts.vertices,
     .excludes = "json|digest|frames|weights|positions|curve"},
    {.name = "positions", .help = "only print the positions of control points and frames of a signal, for vg-sample "
                                  "--edit",
     .flag = &opts.positions, .excludes = "json|curve"},
    {"curve", 0, NULL, "only print the curve of a signal: points for vg-sample --curve, their times, crossings",
     .flag = &opts.curve, .excludes = "json"},
    {0},
};

static const cli_program program = {
    .name = "vg-info",
    .synopsis = "[options] [FILE]",
    .summary = "describe a sequence, check that it is complete, and show how it was made",
    .options = options,
    .most_operands = 1,
    .writes_text = true,
    .any_form = true,
};

static const report_column record_columns[] = {{.key = "tag"}, {.key = "bytes"}};
static const report_column provenance_columns[] = {
    {.key = "program"}, {.key = "version"}, {.key = "args"}, {.key = "parents"}};

/* ------------------------------------------------------------------------------------------- artefacts -- */

static void report_map(report *r, const vg_map *m)
{
    char line[160];
    bool bones = m->kind == VG_MAP_BONES;
    const char *plural = m->n == 1 ? "" : "s";
    if (!m->n) return;
    report_gap(r);
    report_group(r, "map");
    report_put(r, "kind", NULL, report_text(bones ? "bones" : "patches"));
    report_put(r, "transforms", NULL, report_count(m->n));
    report_put(r, "per_corner", NULL, report_count(m->ncorners ? m->per_corner : 0));
    if (!bones) snprintf(line, sizeof line, "%zu patch%s", m->n, m->n == 1 ? "" : "es");
    else if (!m->ncorners) snprintf(line, sizeof line, "%zu bone%s, by linear blend skinning alone", m->n, plural);
    else snprintf(line, sizeof line, "%zu bone%s, %zu for each corner", m->n, plural, m->per_corner);
    report_put(r, NULL, "map of", report_text(line));
    report_put(r, "hinges", bones ? NULL : "hinges", report_count(m->nhinges));
    report_put(r, "held_vertices", "held", report_count(m->nheld));
    report_put(r, "retargeted", NULL, report_flag(m->has_home));
    if (m->has_home) report_put(r, NULL, "body", report_text("not the one on which poses are measured"));
    report_end(r);
}

static void report_patches(report *r, const vg_head *h)
{
    if (!h->body.patches.n) return;
    report_gap(r);
    report_group(r, "patches");
    report_put(r, "count", "patches", report_count(h->body.patches.n));
    report_end(r);
}

/* ------------------------------------------------------------------------------------------ provenance -- */

/* An argument as a person would have to type it. */
static void print_quoted(FILE *f, const char *s)
{
    static const char plain[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_@%+=:,./-";
    if (*s && !s[strspn(s, plain)]) {
        fputs(s, f);
        return;
    }
    fputc('\'', f);
    for (; *s; s++) *s == '\'' ? fputs("'\\''", f) : fputc(*s, f);
    fputc('\'', f);
}

static void note_process(report *r, const vg_provenance *p, size_t depth)
{
    cli_line line;
    FILE *f = cli_line_open(&line, "the command lines");
    if (p->nargs == 0) print_quoted(f, p->program);
    for (size_t i = 0; i < p->nargs; i++) {
        if (i) fputc(' ', f);
        print_quoted(f, p->args[i]);
    }
    char *text = cli_line_close(&line);
    report_note(r, "  %*s%s", (int)(2 * (depth < 20 ? depth : 20)), "", text);
    free(text);
}

typedef struct step {
    size_t process, depth;
} step;

/* The last process first, and below each the processes whose output it read. Every process is shown once, so that the
 * tree is never longer than the list. */
static void note_tree(report *r, const vg_head *h)
{
    size_t n = h->nprovenance, nedges = n;
    for (size_t i = 0; i < n; i++) nedges += h->provenance[i].nparents;
    step *pending = cli_allocate(nedges, sizeof *pending, "the command lines");
    bool *shown = cli_allocate(n, sizeof *shown, "the command lines");
    for (size_t root = n; root-- > 0;) {
        size_t open = 0;
        if (!shown[root]) pending[open++] = (step){root, 0};
        while (open) {
            step s = pending[--open];
            const vg_provenance *p = &h->provenance[s.process];
            if (shown[s.process]) continue;
            shown[s.process] = true;
            note_process(r, p, s.depth);
            for (size_t i = 0; i < p->nparents; i++) pending[open++] = (step){p->parents[i], s.depth + 1};
        }
    }
    free(pending);
    free(shown);
}

static void report_provenance(report *r, const vg_head *h)
{
    if (h->nprovenance) {
        report_gap(r);
        report_note(r, "made by");
        note_tree(r, h);
    }
    report_table(r, "provenance", NULL, false, provenance_columns, 4);
    for (size_t i = 0; i < h->nprovenance; i++) {
        const vg_provenance *p = &h->provenance[i];
        uint64_t *parents = cli_allocate(p->nparents, sizeof *parents, "the command lines");
        for (size_t k = 0; k < p->nparents; k++) parents[k] = p->parents[k];
        const report_value row[4] = {report_text(p->program), report_text(p->version),
                                     report_texts((const char *const *)p->args, p->nargs),
                                     report_counts(parents, p->nparents)};
        report_row(r, row);
        free(parents);
    }
}

static void report_unknown(report *r, const vg_head *h, const contents *c)
{
    report_put(r, "unknown_records", NULL, report_count(h->extra.n + c->extra));
    report_table(r, "unknown_head_records", NULL, false, record_columns, 2);
    for (size_t i = 0; i < h->extra.n; i++) {
        const report_value row[2] = {report_text(h->extra.at[i].tag), report_count(h->extra.at[i].payload.size)};
        report_row(r, row);
    }
    if (h->extra.n + c->extra == 0) return;
    report_gap(r);
    report_note(r, "records unknown to this version: %zu before the frames, %" PRIu64 " between and after them",
                h->extra.n, c->extra);
}

/* ------------------------------------------------------------------------------------------------ main -- */

/* operand NULL: standard input. Archives and streams have a size worth telling; a pipe has none. */
static void report_name(report *r, const char *operand)
{
    struct stat st;
    bool file = !(operand ? stat(operand, &st) : fstat(STDIN_FILENO, &st)) && S_ISREG(st.st_mode);
    report_put(r, "name", "name", report_text(operand ? operand : "standard input"));
    report_put(r, "bytes", file ? "bytes" : NULL, file ? report_count((uint64_t)st.st_size) : report_nothing());
}

static void report_all(report *r, const char *operand, const vg_head *h, const contents *c)
{
    report_name(r, operand);
    report_frames(r, h, c);
    report_animations(r, c);
    report_channels(r, c);
    report_mesh(r, h);
    report_correspondence(r, h, c->D);
    report_patches(r, h);
    report_skeletons(r, h, c->turned, c->frames);
    report_map(r, &h->map);
    report_signal(r, &h->signal);
    report_network(r, &h->network);
    report_provenance(r, h);
    report_unknown(r, h, c);
}

static void report_check(report *r)
{
    report_put(r, "whole", NULL, report_flag(true));
    if (!cli_quiet()) report_note(r, "whole");
}

static void report_digest(report *r, const contents *c)
{
    char text[20];
    snprintf(text, sizeof text, "%016" PRIx64, c->digest);
    report_put(r, "digest", NULL, report_text(text));
    report_note(r, "%s", text);
}

static void print_weights(const vg_head *h, const char *operand)
{
    if (!h->body.rig.skin_weight)
        cli_stop(VG_EINPUT, "'%s' holds no skinning weights: vg-fitmap --skeleton makes them",
                 operand ? operand : "standard input");
    write_weights(cli_text_open(), &h->body.rig, h->body.mesh.nv);
}

/* A vertex of the file. */
typedef struct placed_vertex {
    char *node;
    size_t primitive, index;
    uint32_t vertex;
} placed_vertex;

typedef struct placed_list {
    placed_vertex *at;
    size_t n, cap;
} placed_list;

static void take_vertex(void *context, const char *node, size_t primitive, size_t index, uint32_t vertex)
{
    placed_list *list = context;
    if (list->n == list->cap) {
        list->cap = list->cap ? 2 * list->cap : 1024;
        list->at = cli_resize(list->at, list->cap, sizeof *list->at, "the vertices of the file");
    }
    list->at[list->n++] = (placed_vertex){cli_copy_text(node, "the vertices of the file"), primitive, index, vertex};
}

static int by_vertex(const void *a, const void *b)
{
    const placed_vertex *p = a, *q = b;
    if (p->vertex != q->vertex) return p->vertex < q->vertex ? -1 : 1;
    int order = strcmp(p->node, q->node);
    if (order) return order;
    if (p->primitive != q->primitive) return p->primitive < q->primitive ? -1 : 1;
    return (p->index > q->index) - (p->index < q->index);
}

/* A line for each vertex of the file, those of one vertex together. Without an asset nothing was welded. */
static void print_vertices(const vg_head *h)
{
    FILE *f = cli_text_open();
    const vg_asset *a = &h->body.asset;
    placed_list list = {0};
    vg_err e;
    if (a->n && vg_asset_vertices(a, take_vertex, &list, &e) < 0) cli_die(&e);
    for (size_t v = 0; !list.n && v < h->body.mesh.nv; v++) fprintf(f, "%zu - 0 %zu\n", v, v);
    if (list.n) qsort(list.at, list.n, sizeof *list.at, by_vertex);
    for (size_t i = 0; i < list.n; i++) {
        placed_vertex *p = &list.at[i];
        for (char *c = p->node; *c; c++)
            if ((unsigned char)*c <= ' ') *c = '_';
        fprintf(f, "%u %s %zu %zu\n", p->vertex, *p->node ? p->node : "-", p->primitive, p->index);
        free(p->node);
    }
    free(list.at);
}

static void print_signal(const vg_head *h, const char *operand)
{
    if (!h->signal.n)
        cli_stop(VG_EINPUT, "'%s' holds no signal: make one with vg-fitsignal", operand ? operand : "standard input");
    if (opts.positions) write_positions(cli_text_open(), &h->signal);
    else write_curve(cli_text_open(), &h->signal, vg_diagonal(h->body.reference, h->body.mesh.nv));
}

static bool prints_alone(void)
{
    return opts.weights || opts.vertices || opts.positions || opts.curve;
}

int main(int argc, char **argv)
{
    char **operands;
    contents c = {0};
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_source *s = cli_source(operands, n);
    report *r = report_new(), *list = opts.frames ? report_new() : NULL;
    contents_read(&c, s, opts.digest, !opts.digest && !opts.check, list);
    const char *operand = n && strcmp(operands[0], "-") ? operands[0] : NULL;
    if (opts.check) report_check(r);
    else if (opts.digest) report_digest(r, &c);
    else if ((!list || cli_json()) && !prints_alone()) report_all(r, operand, vg_source_head(s), &c);
    if (list) report_join(r, list);
    if (opts.weights) print_weights(vg_source_head(s), operand);
    else if (opts.vertices) print_vertices(vg_source_head(s));
    else if (opts.positions || opts.curve) print_signal(vg_source_head(s), operand);
    else report_print(r, cli_text_open(), cli_json());
    cli_text_end();
    report_free(&r);
    vg_source_close(&s);
    cli_finish(0);
}
