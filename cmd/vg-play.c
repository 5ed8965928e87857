/* vg-play: drive a map of patches or bones: by poses, transforms, a skeleton's motion, or by hand.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "playback.h"

static playback_options opts;

static const cli_option options[] = {
    {"edit", 0, "EDIT",
     "rotate a bone, 'BONE x|y|z|twist DEGREES'; may be repeated; without FILE, in the reference pose",
     .take = bone_edits_take, .context = &opts.edits},
    {"align", 0, "auto|none|all|NAMES",
     "align limbs with different rest directions: arms and legs that differ (default), none, all joints, or these "
     "bones",
     .text = &opts.driving.align},
    {"joints", 0, "FILE", "pairs of a bone of the rig and a joint of the skeleton, one per line (default: by their "
                          "names)",
     .text = &opts.driving.joints},
    {"feet", 0, NULL, "keep standing feet from sliding", .flag = &opts.feet, .excludes = "interpolate|at|live"},
    {"interpolate", 0, "N", "write N poses, evenly from the first pose of the input to the last",
     .integer = &opts.between.count, .least = 1, .most = 1e9, .excludes = "at"},
    {"at", 0, "T,...", "write the poses at these moments: 0 is the first pose, 1 the second; outside is extrapolated",
     .take = pose_times_take, .context = &opts.between},
    {"rotations", 0, NULL, "use only rotations and scales; hinges or joints give the positions",
     .flag = &opts.rotations},
    {"transforms", 0, NULL, "write the motions of the patches or bones, not vertices", .flag = &opts.transforms},
    {"live", 0, NULL, "write each frame at once, before the next is read", .flag = &opts.live,
     .excludes = "interpolate|at"},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-play",
    .synopsis = "[options] MAP [FILE]",
    .summary = "evaluate a map for motions of its patches or bones",
    .options = options,
    .most_operands = 2,
    .writes_stream = true,
    .threaded = true};

/* Edits need no input: they apply to the reference pose. */
static bool needs_input(size_t operands)
{
    if (operands > 1 || !opts.edits.n) return true;
    if (opts.between.count) cli_usage("--interpolate and --at need the poses between which they are");
    if (opts.driving.align || opts.driving.joints)
        cli_usage("--align and --joints need a skeleton as input, and there is no input");
    if (opts.feet) cli_usage("--feet needs poses as input, and there is no input");
    return false;
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    if (n == 0) cli_usage("name the map to play, which vg-fitmap has made: vg-play man.map");
    opts.map = operands[0];
    bool reads = needs_input(n);
    playback_run(&opts, reads ? cli_source(operands + 1, n - 1) : NULL);
    cli_finish(0);
}
