/* vg-generate: continue poses, or fill in between keys, with a network.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <stdlib.h>
#include <string.h>

static struct {
    long frames, between, given, seed;
    double diversity, merge;
    size_t root; /* 1: stays */
    bool optimise, loop;
} opts = {.frames = 30, .seed = 1};

/* "5%" or "0.05" */
static void take_merge(const char *text, void *context)
{
    (void)context;
    const char *end = cli_scan_number(text, &opts.merge);
    if (end && *end == '%') opts.merge /= 100, end++;
    if (!end || *end || !(opts.merge > 0 && opts.merge <= 1))
        cli_usage("option '--merge' needs a share of the training range such as 5%%, not '%s'", text);
}

static const cli_option options[] = {
    {"frames", 0, "N", "how many poses to add (default 30)", .integer = &opts.frames, .least = 1, .most = 1000000000,
     .excludes = "between"},
    {"given", 0, "N", "continue from the first N input poses; ignore the others (default: from all)",
     .integer = &opts.given, .least = 1, .most = 1000000000, .excludes = "between"},
    {"between", 0, "N", "the input poses are keys: put N poses between each and the next", .integer = &opts.between,
     .least = 1, .most = 1000000},
    {"loop", 0, NULL, "make a cycle: return to the first pose at the end", .flag = &opts.loop},
    {"optimise", 0, NULL, "optimise the run to end nearest to the key", .flag = &opts.optimise, .needs = "between|loop",
     .excludes = "merge"},
    {"merge", 0, "SHARE", "try random runs from both keys until they are that near, such as 5% of the range", .take = take_merge,
     .needs = "between|loop"},
    {"diversity", 0, "X", "start from random states of this deviation (with --seed 0.3, else 0: always the same)",
     .number = &opts.diversity, .least = 0, .most = 100},
    {"seed", 0, "N", "seed of the random states (default 1)", .integer = &opts.seed, .least = 0,
     .most = 4294967295.0},
    {"root", 0, "move|stay", "the body moves as in the training (default), or stays", .choice = &opts.root},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-generate",
    .synopsis = "[options] NETWORK [FILE ...]",
    .summary = "continue poses, or fill in between keys, with a network",
    .options = options,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .threaded = true};

static vg_generator *make_generator(const vg_network *n, const vg_head *h)
{
    vg_generator *g;
    vg_err e;
    if (cli_given("seed") && !cli_given("diversity")) opts.diversity = 0.3;
    vg_generate_options o = {.stay = opts.root == 1, .diversity = opts.diversity, .seed = (uint64_t)opts.seed,
                             .optimise = opts.optimise, .merge = opts.merge, .threads = cli_threads()};
    if (vg_generator_new(&g, n, &h->body.mesh, h->body.reference, &o, &e) < 0) cli_die(&e);
    return g;
}

static void put_frame(vg_frame *f, uint64_t number)
{
    char name[40];
    vg_err e;
    snprintf(name, sizeof name, "frame%llu", (unsigned long long)number);
    if (vg_frame_rename(f, name, &e) < 0) cli_die(&e);
    cli_stream_put(f);
}

/* ---- from pose to pose ---- */

/* The poses between two keys. */
typedef struct gap {
    size_t n;
    vg_frame *frame;
    double **poses;
    uint64_t number; /* of poses that are written */
} gap;

static void make_gap(gap *w, size_t n, const vg_head *h)
{
    vg_err e;
    *w = (gap){.n = n, .frame = cli_allocate(n, sizeof *w->frame, "the poses between two keys"),
               .poses = cli_allocate(n, sizeof *w->poses, "the poses between two keys")};
    for (size_t i = 0; i < n; i++) {
        if (vg_frame_shape(&w->frame[i], h, &e) < 0) cli_die(&e);
        w->poses[i] = w->frame[i].values;
    }
}

static void free_gap(gap *w)
{
    for (size_t i = 0; i < w->n; i++) vg_frame_clear(&w->frame[i]);
    free(w->frame);
    free(w->poses);
}

static void say_way(const vg_way *way, const char *to)
{
    double miss = 100 * way->miss;
    if (opts.merge > 0 && !way->merged)
        cli_warn("on the way to %s: none of %zu pairs of runs came within %.3g %% of the range, the nearest within "
                 "%.3g %%: they are joined there", to, way->tries, 100 * opts.merge, miss);
    else if (opts.merge > 0) cli_note("to %s: the runs from both keys came within %.3g %% of the range, pair %zu", to, miss, way->tries);
    else if (opts.optimise)
        cli_note("to %s: after %zu rounds of optimisation the run %s missed it by %.3g %% of the range", to, way->tries,
                 way->backward > 0 ? "from there back" : "there", miss);
    else if (way->backward > 0)
        cli_note("to %s: the better run missed it by %.3g %% of the range; of the run from there back %.0f %% is taken", to, miss,
                 100 * way->backward);
    else cli_note("to %s: the run there missed it by %.3g %% of the range", to, miss);
}

static void cross_gap(gap *w, vg_generator *g, const double *key, bool loop, const char *to)
{
    vg_err e;
    vg_way way;
    cli_working("looking for a way");
    if (vg_generator_between(g, key, loop, w->n, w->poses, &way, &e) < 0) cli_die(&e);
    say_way(&way, to);
    for (size_t i = 0; i < w->n; i++) put_frame(&w->frame[i], ++w->number);
}

static double *copy_pose(const double *pose, const vg_head *h)
{
    size_t n = 3 * h->body.mesh.nv;
    double *copy = cli_allocate(n, sizeof *copy, "the first pose");
    memcpy(copy, pose, n * sizeof *copy);
    return copy;
}

static void lead(vg_generator *g, vg_source *s)
{
    vg_frame key = {0};
    gap w;
    vg_err e;
    double *first = NULL;
    uint64_t keys = 0;
    make_gap(&w, (size_t)opts.between, vg_source_head(s));
    while (cli_next(s, &key)) {
        char name[40];
        snprintf(name, sizeof name, "key %llu", (unsigned long long)++keys);
        if (keys > 1) cross_gap(&w, g, key.values, false, name);
        else if (vg_generator_give(g, key.values, &e) < 0) cli_die(&e);
        if (opts.loop && !first) first = copy_pose(key.values, vg_source_head(s));
        w.number++;
        cli_stream_put(&key);
    }
    if (keys < 2 && !opts.loop)
        cli_stop(VG_EINPUT, "--between needs at least two keys, the input has %llu", (unsigned long long)keys);
    if (!keys) cli_stop(VG_EINPUT, "the input has no pose to start from");
    if (opts.loop) cross_gap(&w, g, first, true, "the first pose");
    free(first);
    free_gap(&w);
    vg_frame_clear(&key);
}

/* ---- on and on ---- */

static void warn_of_motion(const vg_generator *g)
{
    double change = vg_generator_change(g), drift = vg_generator_drift(g);
    if (change < 0.5) cli_warn("the motion freezes: at the end it changes %.2f times as much as the training data", change);
    if (change > 2) cli_warn("the motion diverges: at the end it changes %.2f times as much as the training data", change);
    if (drift > 0.1)
        cli_warn("the poses drift: at the end they are outside the training range by %.0f %% of it", 100 * drift);
}

/* Write the given poses, each before the next is read, then the generated ones, each before the next is computed. */
static void go_on(vg_generator *g, vg_source *s)
{
    vg_frame f = {0};
    vg_err e;
    uint64_t given = 0, most = opts.given ? (uint64_t)opts.given : UINT64_MAX;
    double *first = NULL;
    while (given < most && cli_next(s, &f)) {
        if (vg_generator_give(g, f.values, &e) < 0) cli_die(&e);
        if (opts.loop && !first) first = copy_pose(f.values, vg_source_head(s));
        given++;
        cli_stream_put(&f);
    }
    if (!given) cli_stop(VG_EINPUT, "the input has no pose to continue from");
    if (opts.given && given < most)
        cli_stop(VG_EINPUT, "--given %ld needs as many poses, the input has %llu", opts.given, (unsigned long long)given);
    vg_frame_clear(&f);
    if (opts.loop) {
        gap w;
        make_gap(&w, (size_t)opts.frames, vg_source_head(s));
        w.number = given;
        cross_gap(&w, g, first, true, "the first pose");
        free_gap(&w);
    } else {
        if (vg_frame_shape(&f, vg_source_head(s), &e) < 0) cli_die(&e);
        for (uint64_t i = 0; i < (uint64_t)opts.frames; i++) {
            if (vg_generator_next(g, f.values, &e) < 0) cli_die(&e);
            put_frame(&f, given + i + 1);
        }
        warn_of_motion(g);
        vg_frame_clear(&f);
    }
    free(first);
    while (cli_next(s, &f)) /* so that a program before this one is heard when it fails */
        ;
    vg_frame_clear(&f);
}

int main(int argc, char **argv)
{
    char **operands;
    vg_err e;
    vg_head from = {0};
    size_t n = cli_start(&program, argc, argv, &operands);
    if (!n) cli_usage("a network from vg-train is needed");
    cli_load(&from, operands[0], "network");
    vg_source *s = cli_source(operands + 1, n - 1);
    vg_head *h = vg_source_head(s);
    cli_need_vertices(h, "the input");
    if (vg_mesh_same(&from.body.mesh, "the network", &h->body.mesh, "the input", &e) < 0 ||
        vg_head_merge_trace(h, &from, &e) < 0)
        cli_die(&e);
    /* features are measured against the reference that the network learned with, which the output has, too */
    memcpy(h->body.reference, from.body.reference, 3 * h->body.mesh.nv * sizeof *h->body.reference);
    vg_generator *g = make_generator(&from.network, h);
    cli_stream_open(h);
    if (opts.between) lead(g, s);
    else go_on(g, s);
    vg_generator_free(&g);
    vg_head_clear(&from);
    cli_stream_end(vg_source_tail(s));
    vg_source_close(&s);
    cli_finish(0);
}
