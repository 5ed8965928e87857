#!/bin/sh
# unwind.sh OUTDIR: interpolation where rotations are large, and patches: the README's pictures of them.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC1091,SC2016,SC2154
set -eu
. "$(dirname "$0")/run.sh"

# bar DEGREES: a fluted bar, twisted by so much from end to end
bar() {
    awk -v twist="$1" 'BEGIN {
        pi = atan2(0, -1); rings = 81; sides = 24
        for (i = 0; i < rings; i++)
            for (j = 0; j < sides; j++) {
                a = 2 * pi * j / sides + twist * pi / 180 * i / (rings - 1)
                r = int(j / 6) % 2 ? 0.15 : 0.25
                printf "v %.9f %.9f %.9f\n", r * cos(a), 2 * i / (rings - 1), r * sin(a)
            }
        for (i = 0; i + 1 < rings; i++)
            for (j = 0; j < sides; j++) {
                k = (j + 1) % sides
                print "f", i * sides + j + 1, (i + 1) * sides + j + 1, (i + 1) * sides + k + 1, i * sides + k + 1
            }
    }'
}

run 'bar 0 >bar0.obj'
run 'bar 400 >bar400.obj'
run 'vg-encode bar0.obj bar400.obj | vg-interpolate 6 | vg-solve -o bar.vgs'
run 'vg-view bar.vgs --frames 6 --columns 6 --size 160x300 --view 20,15 -o bar.png'

run 'vg-decode --replace $data/human-man-poses.tar.xz -o poses/'
run 'vg-encode poses/*_000_*.obj poses/*_009_*.obj | vg-interpolate 6 | vg-solve -o between.vgs'
run 'vg-view between.vgs --frames 6 --columns 6 --size 220x240 --view 25,10 -o interpolation.png'

run 'vg-encode $data/human-man-poses.tar.xz -o man.vgs'
run 'vg-segment -k 50 --connected man.vgs -o man.patches'
run 'vg-view man.vgs --patches man.patches --frames 5 --columns 5 --size 240x260 --view 25,10 -o patches.png'
