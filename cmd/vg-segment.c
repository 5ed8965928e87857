/* vg-segment: divide the faces of a sequence into patches that turn alike.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "fitting.h"

#include <stdlib.h>
#include <string.h>

static struct {
    const char *patches;
    long seed;
    bool connected;
} opts = {.patches = "auto", .seed = 1};

static const cli_option options[] = {
    {"patches", 'k', "K|auto", "number of patches (default auto: the fewest within 10 degrees of their faces)",
     .text = &opts.patches},
    {"connected", 0, NULL, "every patch in one piece", .flag = &opts.connected},
    {"seed", 0, "N", "seed of the initial centres (default 1)", .integer = &opts.seed, .least = 0,
     .most = 4294967295.0},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-segment",
    .synopsis = "[options] [FILE ...]",
    .summary = "divide the faces of a sequence into patches that rotate alike",
    .options = options,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .threaded = true};

static size_t parse_patches(void)
{
    if (!strcmp(opts.patches, "auto")) return 0;
    char *end;
    double k = strtod(opts.patches, &end);
    if (*end || opts.patches[strspn(opts.patches, "0123456789")] || !(k >= 1 && k <= 4294967294.0))
        cli_usage("option '--patches' needs a whole number from 1 on or 'auto', not '%s'", opts.patches);
    return (size_t)k;
}

static void add_batch(void *context, const fitting_batch *b)
{
    vg_err e;
    if (vg_segmenter_add(context, b->n, b->values, &e) < 0) cli_die(&e);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands), k = parse_patches();
    vg_source *source = cli_source(operands, n);
    vg_head *h = vg_source_head(source);
    cli_need_vertices(h, "the input");
    vg_err e;
    vg_segmenter *s;
    vg_segment_stats report;
    if (vg_segmenter_new(&s, &h->body.mesh, h->body.reference, cli_threads(), &e) < 0) cli_die(&e);
    if (!fitting_stream(source, add_batch, s))
        cli_stop(VG_EINPUT, "the input has no poses: rotations cannot be compared");
    vg_head_drop(h, "patches");
    vg_head_drop(h, "map");
    cli_working("finding patches");
    if (vg_segmenter_cut(s, k, (uint64_t)opts.seed, opts.connected, &h->body.patches, &report, &e) < 0) cli_die(&e);
    vg_segmenter_free(&s);
    if (k && report.patches < k)
        cli_warn("%zu patches instead of %zu: no more faces rotate differently", report.patches, k);
    if (k && report.patches > k)
        cli_warn("%zu patches instead of %zu: the mesh has more components", report.patches, k);
    cli_note("%zu patches of %zu faces, %.2f degrees from their faces (rms), %zu rounds", report.patches,
             h->body.mesh.nf, report.angle, report.rounds);
    cli_stream_open(h);
    cli_stream_end(vg_source_tail(source));
    vg_source_close(&source);
    cli_finish(0);
}
