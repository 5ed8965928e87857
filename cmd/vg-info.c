/* vg-info.c: say what is in a sequence, whether it is whole, and who made it.
 * Leaves out changing anything: it writes text.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "report.h"
#include "networks.h"
#include "signals.h"
#include "skeletons.h"

#include <inttypes.h>
#include <math.h>
#include <sys/stat.h>
#include <unistd.h>

static struct {
    bool check, frames, digest, weights, positions, curve, vertices;
} opts;

static const cli_option options[] = {
    {.name = "check", .help = "read everything and only say whether it is whole", .flag = &opts.check,
     .excludes = "digest|frames|weights|positions|curve|vertices"},
    {.name = "digest", .help = "only print a fingerprint of the content: 16 hexadecimal digits",
     .flag = &opts.digest, .excludes = "frames|weights|positions|curve"},
    {.name = "frames", .help = "list the frames", .flag = &opts.frames, .excludes = "weights|positions|curve"},
    {.name = "weights", .help = "only print the skinning weights of a rig, a vertex per line", .flag = &opts.weights,
     .excludes = "json|positions|curve"},
    {.name = "vertices", .help = "only print which vertex each vertex of a GLB or glTF is, after welding", .flag = &opts.vertices,
     .excludes = "json|digest|frames|weights|positions|curve"},
    {.name = "positions", .help = "only print where control points and frames of a signal are, for vg-sample --edit",
     .flag = &opts.positions, .excludes = "json|curve"},
    {"curve", 0, NULL, "only print the curve of a signal: points for vg-sample --curve, their times, where it crosses itself",
     .flag = &opts.curve, .excludes = "json"},
    {0},
};

static const cli_program program = {
    .name = "vg-info",
    .synopsis = "[options] [FILE]",
    .summary = "say what is in a sequence, whether it is whole, and who made it",
    .options = options,
    .most_operands = 1,
    .writes_text = true,
    .any_form = true,
};

/* A channel that frames bring. */
typedef struct channel_note {
    char *name, *unit, *element; /* of the first frame that has it */
    size_t width;
    uint64_t frames;
    double least, most; /* numbers, or vertices of lists */
} channel_note;

/* Frames that are called "Walk.0001", "Walk.0002" and so on. */
typedef struct animation {
    char *name;
    uint64_t frames;
    double first_time, last_time; /* NaN: it has none */
} animation;

/* What reading all frames tells. */
typedef struct contents {
    uint64_t frames, timed, turned, extra; /* turned: that say how joints have turned; extra: unknown records before
                                              frames */
    channel_note *channels;
    size_t nchannels, nanimations;
    animation *animations;
    char *first, *last;            /* names */
    double first_time, last_time;
    double D; /* of the first frame of vertices */
    uint64_t digest;
} contents;

static const report_column size_columns[] = {{.key = "size"}, {.key = "faces"}};
static const report_column record_columns[] = {{.key = "tag"}, {.key = "bytes"}};
static const report_column provenance_columns[] = {
    {.key = "program"}, {.key = "version"}, {.key = "args"}, {.key = "parents"}};
static const report_column channel_columns[] = {{.key = "name"},   {.key = "unit"},  {.key = "element"}, {.key = "width"},
                                                {.key = "frames"}, {.key = "least"}, {.key = "most"}};
static const report_column animation_columns[] = {
    {.key = "name"}, {.key = "frames"}, {.key = "first_time"}, {.key = "last_time"}};
static const report_column vertex_columns[] = {
    {.key = "frame", .title = "frame"}, {.key = "name", .title = "name"},    {.key = "time", .title = "time"},
    {.key = "x", .title = "centroid x"}, {.key = "y", .title = "centroid y"}, {.key = "z", .title = "centroid z"}};
static const report_column value_columns[] = {
    {.key = "frame", .title = "frame"}, {.key = "name", .title = "name"}, {.key = "time", .title = "time"},
    {.key = "least", .title = "least"}, {.key = "most", .title = "most"}};

static void replace_text(char **to, const char *from)
{
    free(*to);
    *to = cli_copy_text(from, "the name of a frame");
}

/* Close a stream that wrote into *line; false: something of it was lost. glibc may close well and have no line. */
static bool close_line(FILE *f, char *const *line)
{
    bool lost = ferror(f) != 0;
    return fclose(f) == 0 && !lost && *line;
}

/* ---------------------------------------------------------------------------------------------- frames -- */

static void range_of(const double *x, size_t n, double *least, double *most)
{
    *least = *most = n ? x[0] : NAN;
    for (size_t i = 1; i < n; i++) *least = fmin(*least, x[i]), *most = fmax(*most, x[i]);
}

static void list_frame(report *r, const vg_head *h, const vg_frame *f, uint64_t i)
{
    double at[3];
    report_value row[6] = {report_count(i), report_text(f->name),
                           f->has_time ? report_number(f->time) : report_nothing()};
    if (h->kind == VG_VERTICES) {
        vg_centroid(f->values, h->count, at);
        for (int k = 0; k < 3; k++) row[3 + k] = report_number(at[k]);
    } else {
        range_of(f->values, h->count * vg_head_width(h), &at[0], &at[1]);
        for (int k = 0; k < 2; k++) row[3 + k] = report_number(at[k]);
    }
    report_row(r, row);
}

/* The frame goes on with the last animation, or begins one. */
static void note_animation(contents *c, const vg_frame *f)
{
    uint64_t number = 0;
    const size_t n = vg_frame_stem(f->name, &number);
    animation *last = c->nanimations ? &c->animations[c->nanimations - 1] : NULL;
    const double time = f->has_time ? f->time : NAN;
    if (n && last && number == last->frames + 1 && strlen(last->name) == n && !memcmp(last->name, f->name, n)) {
        last->frames++;
        last->last_time = time;
    } else if (n && number == 1) {
        c->animations = cli_resize(c->animations, c->nanimations + 1, sizeof *c->animations, "the names of animations");
        last = &c->animations[c->nanimations++];
        *last = (animation){cli_copy_text(f->name, "the names of animations"), 1, time, time};
        last->name[n] = 0;
    }
}

static void note_frame(contents *c, const vg_frame *f)
{
    size_t turned;
    if (c->frames == 0) replace_text(&c->first, f->name);
    replace_text(&c->last, f->name);
    if (f->has_time) {
        if (c->timed == 0) c->first_time = f->time;
        c->last_time = f->time;
        c->timed++;
    }
    note_animation(c, f);
    vg_frame_turns(f, &turned);
    c->turned += turned > 0;
    c->extra += f->extra.n;
    c->frames++;
}

static channel_note *note_of(contents *c, const vg_channel *channel)
{
    for (size_t i = 0; i < c->nchannels; i++)
        if (!strcmp(c->channels[i].name, channel->name)) return &c->channels[i];
    c->channels = cli_resize(c->channels, c->nchannels + 1, sizeof *c->channels, "the names of channels");
    channel_note *n = &c->channels[c->nchannels++];
    *n = (channel_note){.width = channel->width, .least = INFINITY, .most = -INFINITY};
    n->name = cli_copy_text(channel->name, "the names of channels");
    n->unit = cli_copy_text(channel->unit, "the names of channels");
    n->element = cli_copy_text(channel->element_name, "the names of channels");
    return n;
}

static void note_channels(contents *c, const vg_frame *f)
{
    for (size_t i = 0; i < f->nchannels; i++) {
        const vg_channel *channel = &f->channels[i];
        channel_note *n = note_of(c, channel);
        size_t numbers = channel->width * channel->count;
        for (size_t k = 0; k < numbers; k++) {
            double x = channel->vertices ? channel->vertices[k] : channel->numbers[k];
            n->least = fmin(n->least, x), n->most = fmax(n->most, x);
        }
        n->frames++;
    }
}

/* Read to the end, which is what proves that the input is whole. `list` may be NULL. */
static void read_all(vg_source *s, contents *c, report *list)
{
    const vg_head *h = vg_source_head(s);
    vg_frame f = {0};
    vg_digest *digest = NULL;
    vg_err e;
    bool poses = h->kind == VG_VERTICES;
    if (list) report_table(list, "frame_list", "", false, poses ? vertex_columns : value_columns, poses ? 6 : 5);
    if (vg_digest_new(&digest, h, &e) < 0) cli_die(&e);
    while (cli_next(s, &f)) {
        if (opts.digest) vg_digest_add(digest, &f);
        if (list) list_frame(list, h, &f, c->frames);
        if (c->frames == 0 && poses) c->D = vg_diagonal(f.values, h->count);
        note_frame(c, &f);
        if (!opts.digest && !opts.check) note_channels(c, &f);
        cli_progress("frame", c->frames);
    }
    cli_note("%" PRIu64 " frames read, and the end mark where there has to be one", c->frames);
    c->digest = vg_digest_get(digest);
    c->extra += vg_source_tail(s)->n;
    vg_digest_free(&digest);
    vg_frame_clear(&f);
}

/* A single one is said with the frames. */
static void report_animations(report *r, const contents *c)
{
    char line[400];
    for (size_t i = 0; i < c->nanimations && c->nanimations > 1; i++) {
        const animation *a = &c->animations[i];
        int k = snprintf(line, sizeof line, "'%.300s': %" PRIu64 " frames", a->name, a->frames);
        if (!isnan(a->first_time))
            snprintf(line + k, sizeof line - (size_t)k, ", %.6g s to %.6g s", a->first_time, a->last_time);
        report_put(r, NULL, "animation", report_text(line));
    }
    if (!c->nanimations) return;
    report_table(r, "animations", NULL, false, animation_columns, 4);
    for (size_t i = 0; i < c->nanimations; i++) {
        const animation *a = &c->animations[i];
        const report_value row[4] = {report_text(a->name), report_count(a->frames),
                                     isnan(a->first_time) ? report_nothing() : report_number(a->first_time),
                                     isnan(a->last_time) ? report_nothing() : report_number(a->last_time)};
        report_row(r, row);
    }
}

static void report_frames(report *r, const vg_head *h, const contents *c)
{
    char line[700];
    size_t most = SIZE_MAX / 64, bytes = h->count < most ? h->count * vg_head_width(h) * h->precision : 0;
    report_put(r, "kind", NULL, report_text(vg_head_form(h)));
    report_put(r, "precision", NULL, report_count(8 * h->precision));
    report_put(r, "elements", NULL, report_count(h->count));
    snprintf(line, sizeof line, "%zu %s, binary%d", h->count, vg_head_form(h), 8 * (int)h->precision);
    report_put(r, NULL, "a frame", report_text(line));
    report_put(r, "frame_bytes", "its bytes", report_count(bytes));
    report_put(r, "frames", NULL, report_count(c->frames));
    report_put(r, "first", NULL, c->frames ? report_text(c->first) : report_nothing());
    report_put(r, "last", NULL, c->frames ? report_text(c->last) : report_nothing());
    report_put(r, "first_time", NULL, c->timed ? report_number(c->first_time) : report_nothing());
    report_put(r, "last_time", NULL, c->timed ? report_number(c->last_time) : report_nothing());
    if (c->frames == 0) snprintf(line, sizeof line, "0");
    else if (c->frames == 1) snprintf(line, sizeof line, "1: '%.300s'", c->first);
    else snprintf(line, sizeof line, "%" PRIu64 ": '%.300s' to '%.300s'", c->frames, c->first, c->last);
    report_put(r, NULL, "frames", report_text(line));
    if (!c->timed || c->nanimations > 1) return;
    snprintf(line, sizeof line, "%.6g s to %.6g s", c->first_time, c->last_time);
    report_put(r, NULL, "times", report_text(line));
}

static void report_channels(report *r, const contents *c)
{
    char line[400];
    for (size_t i = 0; i < c->nchannels; i++) {
        const channel_note *n = &c->channels[i];
        if (!strcmp(n->name, "anchors") || !strcmp(n->name, "turns")) continue; /* mesh and skeleton say it */
        int k = snprintf(line, sizeof line, "'%.100s' of each %.60s in %" PRIu64 " of the frames", n->name, n->element,
                         n->frames);
        if (n->least <= n->most) /* there is an element */
            snprintf(line + k, sizeof line - (size_t)k, ": %.6g to %.6g %.60s", n->least, n->most, n->unit);
        report_put(r, NULL, "with them", report_text(line));
    }
    if (!c->nchannels) return;
    report_table(r, "channels", NULL, false, channel_columns, 7);
    for (size_t i = 0; i < c->nchannels; i++) {
        const channel_note *n = &c->channels[i];
        bool some = n->least <= n->most;
        report_value row[7] = {report_text(n->name), report_text(n->unit), report_text(n->element),
                               report_count(n->width), report_count(n->frames),
                               some ? report_number(n->least) : report_nothing(),
                               some ? report_number(n->most) : report_nothing()};
        report_row(r, row);
    }
}

/* ------------------------------------------------------------------------------------------------ mesh -- */

static uint32_t face_size(const vg_mesh *m, size_t f)
{
    return m->start[f + 1] - m->start[f];
}

enum { SIZES_SHOWN = 3 };

/* "838: 134 of 3, 626 of 4, 78 of 5 to 21": more than a few sizes are put together. */
static char *size_line(const vg_mesh *m, const uint64_t *count, size_t largest)
{
    char *line = NULL;
    size_t bytes, kinds = 0, at = 0, first = 0;
    uint64_t rest = 0;
    FILE *f = open_memstream(&line, &bytes);
    if (!f) cli_stop(VG_ENOMEM, "not enough memory for the sizes of faces");
    for (size_t k = 2; k <= largest; k++) kinds += count[k] > 0;
    fprintf(f, "%zu", m->nf);
    for (size_t k = 2; k <= largest; k++) {
        if (!count[k]) continue;
        if (kinds <= SIZES_SHOWN || at < SIZES_SHOWN - 1)
            fprintf(f, "%s%" PRIu64 " of %zu", at ? ", " : ": ", count[k], k);
        else rest += count[k], first = first ? first : k;
        at++;
    }
    if (rest) fprintf(f, ", %" PRIu64 " of %zu to %zu", rest, first, largest);
    if (!close_line(f, &line)) cli_stop(VG_ENOMEM, "not enough memory for the sizes of faces");
    return line;
}

/* How many faces there are of each size, as rows in JSON and as one line in the text. */
static void report_faces(report *r, const vg_mesh *m)
{
    size_t largest = 0;
    for (size_t f = 0; f < m->nf; f++) largest = face_size(m, f) > largest ? face_size(m, f) : largest;
    uint64_t *count = cli_allocate(largest, sizeof *count, "the sizes of faces");
    for (size_t f = 0; f < m->nf; f++) count[face_size(m, f)]++;
    char *line = size_line(m, count, largest);
    report_put(r, "faces", NULL, report_count(m->nf));
    report_put(r, NULL, "faces", report_text(line));
    report_table(r, "face_sizes", NULL, false, size_columns, 2);
    for (size_t k = 2; k <= largest; k++) {
        const report_value row[2] = {report_count(k), report_count(count[k])};
        if (count[k]) report_row(r, row);
    }
    free(line);
    free(count);
}

static void report_components(report *r, const vg_mesh *m)
{
    size_t components = 0, isolated = 0;
    vg_err e;
    uint32_t *label = cli_allocate(m->nv, sizeof *label, "the components of the mesh");
    if (vg_mesh_components(m, label, &components, &e) < 0) cli_die(&e);
    for (size_t v = 0; v < m->nv; v++) isolated += label[v] == UINT32_MAX;
    free(label);
    report_put(r, "components", "components", report_count(components));
    report_put(r, "isolated_vertices", isolated ? "isolated" : NULL, report_count(isolated));
}

static void report_mesh(report *r, const vg_head *h)
{
    const vg_attributes *a = &h->body.attributes;
    if (!h->body.reference) return;
    report_gap(r);
    report_group(r, "mesh");
    report_put(r, "vertices", "vertices", report_count(h->body.mesh.nv));
    report_faces(r, &h->body.mesh);
    report_components(r, &h->body.mesh);
    report_put(r, "D", "D", report_number(vg_diagonal(h->body.reference, h->body.mesh.nv)));
    report_put(r, "reference", "reference", report_text(h->body.reference_name ? h->body.reference_name : ""));
    report_put(r, "texture_coordinates", a->ntex ? "texture coordinates" : NULL, report_count(a->ntex));
    char asset[200];
    vg_asset_text(&h->body.asset, asset, sizeof asset);
    report_put(r, "asset", *asset ? "asset" : NULL, h->body.asset.n ? report_text(asset) : report_nothing());
    report_put(r, "labels", a->nlabels ? "labels" : NULL, report_count(a->nlabels));
    report_put(r, "selected_faces", h->has_selection ? "selected faces" : NULL,
               h->has_selection ? report_count(h->nselected) : report_nothing());
    report_put(r, "links", h->has_links ? "links" : NULL, h->has_links ? report_count(h->nlinks) : report_nothing());
    report_put(r, "anchors", h->nanchors ? "anchors" : NULL, report_count(h->nanchors));
    report_end(r);
}

/* -------------------------------------------------------------------------------------- correspondence -- */

/* What a correspondence covers: how many faces, how near, by how many. */
typedef struct coverage {
    uint64_t matched, most_pairs, used;
    double sum, largest; /* distances of matched faces */
} coverage;

static int ascending(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* How many faces of the source drive anything: counted among the pairs, for how many it has is the stream's word only. */
static uint64_t count_sources(const vg_correspondence *c)
{
    size_t n = c->first[c->target_nf];
    uint32_t *faces = cli_allocate(n, sizeof *faces, "the pairs of a correspondence");
    uint64_t used = n > 0;
    if (n) memcpy(faces, c->source, n * sizeof *faces);
    qsort(faces, n, sizeof *faces, ascending);
    for (size_t i = 1; i < n; i++) used += faces[i] != faces[i - 1];
    free(faces);
    return used;
}

static coverage cover(const vg_correspondence *c)
{
    coverage x = {.used = count_sources(c)};
    for (size_t f = 0; f < c->target_nf; f++) {
        uint64_t pairs = c->first[f + 1] - c->first[f];
        if (pairs > x.most_pairs) x.most_pairs = pairs;
        if (!c->matched[f]) continue;
        x.matched++;
        x.sum += c->distance[f];
        x.largest = fmax(x.largest, c->distance[f]);
    }
    return x;
}

static double percent(uint64_t part, uint64_t all)
{
    return all ? 100.0 * (double)part / (double)all : 0;
}

static void report_skeletons(report *r, const vg_head *h, const contents *c)
{
    const vg_rig *g = &h->body.rig;
    char line[80];
    if (h->body.skeleton.njoints) {
        report_gap(r);
        report_group(r, "skeleton");
        report_skeleton(r, "skeleton", &h->body.skeleton);
        report_put(r, "turned_frames", NULL, report_count(c->turned));
        snprintf(line, sizeof line, "known in %" PRIu64 " of %" PRIu64 " frames", c->turned, c->frames);
        report_put(r, NULL, "turns", report_text(line));
        report_end(r);
    }
    if (!g->skeleton.njoints) return;
    report_gap(r);
    report_group(r, "rig");
    report_skeleton(r, "rig", &g->skeleton);
    report_put(r, "skinned", NULL, report_flag(g->skin_weight != NULL));
    report_put(r, NULL, "skin",
               report_text(g->skin_weight ? "weights of linear blend skinning: --weights" : "no weights"));
    report_end(r);
}

static void report_map(report *r, const vg_map *m)
{
    char line[160];
    bool bones = m->kind == VG_MAP_BONES;
    if (!m->n) return;
    report_gap(r);
    report_group(r, "map");
    report_put(r, "kind", NULL, report_text(bones ? "bones" : "patches"));
    report_put(r, "transforms", NULL, report_count(m->n));
    report_put(r, "per_corner", NULL, report_count(m->ncorners ? m->per_corner : 0));
    if (!bones) snprintf(line, sizeof line, "%zu patches", m->n);
    else if (!m->ncorners) snprintf(line, sizeof line, "%zu bones, by linear blend skinning alone", m->n);
    else snprintf(line, sizeof line, "%zu bones, %zu for each corner", m->n, m->per_corner);
    report_put(r, NULL, "map of", report_text(line));
    report_put(r, "hinges", bones ? NULL : "hinges", report_count(m->nhinges));
    report_put(r, "held_vertices", "held", report_count(m->nheld));
    report_put(r, "retargeted", NULL, report_flag(m->has_home));
    if (m->has_home) report_put(r, NULL, "body", report_text("another one than its poses are measured on"));
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

/* D is that of the source as it lies on the target, which is what the stream holds of the target. */
static void report_correspondence(report *r, const vg_head *h, double D)
{
    const vg_correspondence *c = &h->correspondence;
    char line[160];
    if (!c->first) return;
    coverage x = cover(c);
    uint64_t pairs = c->first[c->target_nf];
    double mean = x.matched ? x.sum / (double)x.matched : NAN, largest = x.matched ? x.largest : NAN;
    report_gap(r);
    report_group(r, "correspondence");
    report_put(r, "source_vertices", NULL, report_count(c->source_nv));
    report_put(r, "source_faces", NULL, report_count(c->source_nf));
    report_put(r, "target_vertices", NULL, report_count(c->target_nv));
    report_put(r, "target_faces", NULL, report_count(c->target_nf));
    snprintf(line, sizeof line, "%zu faces, %zu vertices", c->target_nf, c->target_nv);
    report_put(r, NULL, "target", report_text(line));
    report_put(r, "matched_faces", NULL, report_count(x.matched));
    report_put(r, "unmatched_faces", NULL, report_count(c->target_nf - x.matched));
    snprintf(line, sizeof line, "%" PRIu64 " of %zu faces (%.4g %%), %" PRIu64 " ride with others", x.matched,
             c->target_nf, percent(x.matched, c->target_nf), (uint64_t)c->target_nf - x.matched);
    report_put(r, NULL, "matched", report_text(line));
    report_put(r, "source_faces_used", NULL, report_count(x.used));
    snprintf(line, sizeof line, "%" PRIu64 " of %zu faces (%.4g %%)", x.used, c->source_nf,
             percent(x.used, c->source_nf));
    report_put(r, NULL, "source used", report_text(line));
    report_put(r, "pairs", NULL, report_count(pairs));
    report_put(r, "most_pairs", NULL, report_count(x.most_pairs));
    snprintf(line, sizeof line, "%" PRIu64 ", %.3g a face on average, at most %" PRIu64, pairs,
             c->target_nf ? (double)pairs / (double)c->target_nf : 0, x.most_pairs);
    report_put(r, NULL, "pairs", report_text(line));
    report_put(r, "mean_distance", NULL, report_number(mean));
    report_put(r, "largest_distance", NULL, report_number(largest));
    report_put(r, "mean_distance_D", NULL, report_number(D > 0 ? mean / D : NAN));
    report_put(r, "largest_distance_D", NULL, report_number(D > 0 ? largest / D : NAN));
    if (x.matched && D > 0) {
        snprintf(line, sizeof line, "mean %.3g, at most %.3g (%.3g D and %.3g D)", mean, largest, mean / D,
                 largest / D);
        report_put(r, NULL, "distances", report_text(line));
    }
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
    char *line = NULL;
    size_t size;
    FILE *f = open_memstream(&line, &size);
    if (!f) cli_stop(VG_ENOMEM, "not enough memory for the command lines");
    if (p->nargs == 0) print_quoted(f, p->program);
    for (size_t i = 0; i < p->nargs; i++) {
        if (i) fputc(' ', f);
        print_quoted(f, p->args[i]);
    }
    if (!close_line(f, &line)) cli_stop(VG_ENOMEM, "not enough memory for the command lines");
    report_note(r, "  %*s%s", (int)(2 * (depth < 20 ? depth : 20)), "", line);
    free(line);
}

typedef struct step {
    size_t process, depth;
} step;

/* The last process first, and below each what it read from. Every process is shown once, so that the tree is never
 * longer than the list. */
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
    report_note(r, "records this version does not know: %zu before the frames, %" PRIu64 " between and behind them",
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
    report_skeletons(r, h, c);
    report_map(r, &h->map);
    report_signal(r, &h->signal);
    report_network(r, &h->network);
    report_provenance(r, h);
    report_unknown(r, h, c);
}

static void report_check(report *r)
{
    report_put(r, "whole", NULL, report_flag(true));
    if (!cli.quiet) report_note(r, "whole");
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
    read_all(s, &c, list);
    const char *operand = n && strcmp(operands[0], "-") ? operands[0] : NULL;
    if (opts.check) report_check(r);
    else if (opts.digest) report_digest(r, &c);
    else if ((!list || cli.json) && !prints_alone()) report_all(r, operand, vg_source_head(s), &c);
    if (list) report_join(r, list);
    if (opts.weights) print_weights(vg_source_head(s), operand);
    else if (opts.vertices) print_vertices(vg_source_head(s));
    else if (opts.positions || opts.curve) print_signal(vg_source_head(s), operand);
    else report_print(r, cli_text_open(), cli.json);
    cli_text_end();
    report_free(&r);
    vg_source_close(&s);
    cli_finish(0);
}
