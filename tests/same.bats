#!/usr/bin/env bats
# The same bytes from the same input, options and version: run again, and with one thread or several.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# same OUTPUT COMMAND...: run three times; -j1 and -j3 where the program has threads
same() {
    local out=$1 program=$2 threads=
    shift
    "$program" -h | grep -q -e --threads && threads=yes
    must "$@" ${threads:+-j1} -o "first.$out"
    must "$@" ${threads:+-j3} -o "second.$out"
    must "$@" ${threads:+-j3} -o "third.$out"
    same_file "first.$out" "second.$out"
    same_file "first.$out" "third.$out"
    rm "second.$out" "third.$out"
}

@test "every program gives the same bytes with one thread, with three, and again" {
    A=$DATA/horse-run.tar.xz
    for program in $(each_program); do grep -q "vg-${program#vg-} " "$ROOT/tests/same.bats" || fail "$program is not tried here"; done
    same poses.vgs vg-encode --no-provenance "$A"
    same vectors.vgs vg-encode --no-provenance --vectors --faces selected "$A"
    for by in pose shape blend; do
        same $by.vgs vg-deform --no-provenance --onto "$DATA/horse.rest.obj" --by $by --root stay first.poses.vgs
    done
    same between.vgs vg-deform --no-provenance --interpolate 20 --smooth first.poses.vgs
    same solved.vgs vg-solve --no-provenance first.pose.vgs
    same planar.vgs vg-solve --no-provenance --planar --weights area first.vectors.vgs
    same guided.vgs vg-poisson --no-provenance --first "$DATA/horse.rest.obj" first.poses.vgs
    same patches.vgs vg-segment --no-provenance -k 12 first.poses.vgs
    same map.vgs vg-fitmap -q --no-provenance --patches first.patches.vgs first.poses.vgs
    same mapped.vgs vg-deform --no-provenance --map first.map.vgs --interpolate 9 first.poses.vgs
    must vg-decode -q first.poses.vgs -o poses.zip
    printf '0 0\n100 100\n200 200\n300 300\n' >markers.txt
    same pairs.vgs vg-register -q --no-provenance "$DATA/horse.rest.obj" "$DATA/horse.rest.obj" --markers markers.txt
    same carried.vgs vg-deform --no-provenance --onto "$DATA/horse.rest.obj" --correspondence first.pairs.vgs first.poses.vgs
    same diff.txt vg-diff --json first.poses.vgs first.guided.vgs
    same info.txt vg-info --json first.poses.vgs
    same sheet.png vg-view first.poses.vgs --against first.guided.vgs
    same page.html vg-view first.poses.vgs
    for kind in zip tar.gz glb usda npz npy; do same $kind vg-decode -q first.poses.vgs; done
}
