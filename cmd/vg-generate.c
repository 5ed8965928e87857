/* vg-generate: go on from a few poses, or lead from key to key, by what a network has learned.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <stdlib.h>
#include <string.h>

static struct {
    long frames, between, seed;
    double diversity;
    size_t root; /* 1: stays */
} opts = {.frames = 30, .seed = 1};

static const cli_option options[] = {
    {"frames", 0, "N", "go on for so many poses (default 30)", .integer = &opts.frames, .least = 1, .most = 1000000000,
     .excludes = "between"},
    {"between", 0, "N", "the poses that come in are keys: so many between each and the next", .integer = &opts.between,
     .least = 1, .most = 1000000},
    {"diversity", 0, "X", "begin from random states of this deviation: 0.3 is lively (default 0: always the same)",
     .number = &opts.diversity, .least = 0, .most = 100},
    {"seed", 0, "N", "another choice of them (default 1)", .integer = &opts.seed, .least = 0, .most = 4294967295.0,
     .needs = "diversity"},
    {"root", 0, "move|stay", "the body as a whole moves on as it learned to (default), or stays", .choice = &opts.root},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-generate",
    .synopsis = "[options] NETWORK [FILE ...]",
    .summary = "go on from a few poses, or from key to key, by a network",
    .options = options,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .threaded = true};

static vg_generator *make_generator(const vg_network *n, const vg_head *h)
{
    vg_generator *g;
    vg_err e;
    vg_generate_options o = {.stay = opts.root == 1, .diversity = opts.diversity, .seed = (uint64_t)opts.seed,
                             .threads = cli.threads};
    if (vg_generator_new(&g, n, &h->body.mesh, h->body.reference, &o, &e) < 0) cli_die(&e);
    return g;
}

static void put(vg_frame *f, uint64_t number)
{
    char name[40];
    vg_err e;
    snprintf(name, sizeof name, "frame%llu", (unsigned long long)number);
    if (vg_frame_rename(f, name, &e) < 0) cli_die(&e);
    cli_stream_put(f);
}

/* The poses that come in go out, and as many more as are asked for. */
static void go_on(vg_generator *g, vg_source *s)
{
    vg_frame f = {0};
    vg_err e;
    uint64_t given = 0;
    while (cli_next(s, &f)) {
        if (vg_generator_give(g, f.values, &e) < 0) cli_die(&e);
        given++;
    }
    if (!given) cli_stop(VG_EINPUT, "the input has no pose to go on from");
    vg_frame_clear(&f);
    if (vg_frame_shape(&f, vg_source_head(s), &e) < 0) cli_die(&e);
    for (uint64_t i = 0; i < (uint64_t)opts.frames; i++) {
        if (vg_generator_next(g, f.values, &e) < 0) cli_die(&e);
        put(&f, i + 1);
    }
    double change = vg_generator_change(g);
    if (change < 0.5) cli_warn("the motion freezes: at the end it is %.2f times as lively as what was learned", change);
    if (change > 2) cli_warn("the motion runs away: at the end it is %.2f times as lively as what was learned", change);
    vg_frame_clear(&f);
}

static void lead(vg_generator *g, vg_source *s)
{
    vg_frame key = {0}, *between = cli_allocate((size_t)opts.between, sizeof *between, "the poses between two keys");
    double **poses = cli_allocate((size_t)opts.between, sizeof *poses, "the poses between two keys"), miss;
    vg_err e;
    uint64_t keys = 0, number = 0;
    for (size_t i = 0; i < (size_t)opts.between; i++) {
        if (vg_frame_shape(&between[i], vg_source_head(s), &e) < 0) cli_die(&e);
        poses[i] = between[i].values;
    }
    while (cli_next(s, &key)) {
        if (keys++ == 0) {
            if (vg_generator_give(g, key.values, &e) < 0) cli_die(&e);
        } else {
            if (vg_generator_between(g, key.values, (size_t)opts.between, poses, &miss, &e) < 0) cli_die(&e);
            cli_note("key %llu: the network's own way ended %.1f %% of its range away", (unsigned long long)keys, 100 * miss);
            for (size_t i = 0; i < (size_t)opts.between; i++) put(&between[i], ++number);
        }
        number++;
        cli_stream_put(&key);
    }
    if (keys < 2) cli_stop(VG_EINPUT, "--between needs at least two keys, the input has %llu", (unsigned long long)keys);
    for (size_t i = 0; i < (size_t)opts.between; i++) vg_frame_clear(&between[i]);
    vg_frame_clear(&key);
    free(between);
    free(poses);
}

int main(int argc, char **argv)
{
    char **operands;
    vg_err e;
    vg_head from = {0};
    size_t n = cli_start(&program, argc, argv, &operands);
    if (!n) cli_usage("a network is needed: what vg-train wrote");
    if (vg_load(&from, operands[0], "mesh", &e) < 0) cli_die(&e);
    if (!from.network.model) cli_stop(VG_EINPUT, "'%.190s' holds no network: make one with vg-train", operands[0]);
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
