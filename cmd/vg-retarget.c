/* vg-retarget: bring a map to another body of the same faces, or to one on the way to it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <stdlib.h>
#include <string.h>

static struct {
    const char *onto;
    double morph;
} opts = {.morph = 1};

static const cli_option options[] = {
    {"onto", 0, "MESH", "the new body, with the faces of the map's body and in its reference pose",
     .text = &opts.onto, .reads = true},
    {"morph", 0, "T", "position between the map's body (0) and the new one (1, the default)", .number = &opts.morph},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-retarget",
    .synopsis = "[options] --onto MESH [MAP]",
    .summary = "transfer a map to another body of the same connectivity",
    .options = options,
    .most_operands = 1,
    .writes_stream = true,
    .writes_map = true,
    .threaded = true};

/* The head of the map becomes that of the other body. */
static void retarget(vg_head *h)
{
    vg_err e;
    vg_head target = {0};
    vg_map map = {0};
    vg_rig rig = {0};
    char name[200];
    snprintf(name, sizeof name, "'%.190s'", opts.onto);
    if (vg_head_need(h, "map", "the input", &e) < 0) cli_die(&e);
    cli_load(&target, opts.onto, "mesh");
    cli_working("retargeting");
    if (vg_mesh_same(&h->body.mesh, "the map", &target.body.mesh, name, &e) < 0 ||
        vg_map_retarget(h, target.body.reference, opts.morph, cli_threads(), &map, &rig, target.body.reference, &e) < 0 ||
        vg_head_merge_trace(h, &target, &e) < 0)
        cli_die(&e);
    vg_head_put(h, &map, "map");
    vg_head_put(h, &rig, "rig");
    vg_head_take(h, &target, "reference"); /* where the body is, under the target's name */
    vg_head_take(h, &target, "attributes");
    vg_head_take(h, &target, "asset");
    vg_head_clear(&target);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    if (!opts.onto) cli_usage("name the new body: --onto MESH");
    vg_source *s = cli_source(operands, n);
    retarget(vg_source_head(s));
    vg_frame frame = {0};
    while (cli_next(s, &frame)) continue; /* a map has no frames; reading to the end finds damage */
    vg_frame_clear(&frame);
    cli_stream_open(vg_source_head(s));
    cli_stream_end(vg_source_tail(s));
    vg_source_close(&s);
    cli_finish(0);
}
