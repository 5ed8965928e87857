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
    for by in pose shape blend offset; do
        same $by.vgs vg-deform --no-provenance --onto "$DATA/horse.rest.obj" --by $by --root stay first.poses.vgs
    done
    same between.vgs vg-interpolate --no-provenance 20 --smooth first.poses.vgs
    same solved.vgs vg-solve --no-provenance first.pose.vgs
    same planar.vgs vg-solve --no-provenance --planar --weights area first.vectors.vgs
    same guided.vgs vg-poisson --no-provenance --first "$DATA/horse.rest.obj" first.poses.vgs
    for filter in lowpass polynomial robust together; do same calm.vgs vg-smooth --no-provenance --filter $filter first.poses.vgs; done
    same patches.vgs vg-segment --no-provenance -k 12 first.poses.vgs
    same map.vgs vg-fitmap -q --no-provenance --patches first.patches.vgs first.poses.vgs
    same other.vgs vg-retarget --no-provenance --onto "$DATA/horse.rest.obj" --morph 0.5 first.map.vgs
    same mapped.vgs vg-play --no-provenance first.map.vgs --interpolate 9 first.poses.vgs
    same signal.vgs vg-fitsignal -q --no-provenance first.poses.vgs
    for space in vectors gradients rotations lengths; do
        same $space.vgs vg-fitsignal -q --no-provenance --space $space first.poses.vgs
        same sampled-$space.vgs vg-sample --no-provenance --speed 0.5 first.$space.vgs
    done
    same features.vgs vg-features --no-provenance first.poses.vgs
    same sampled.vgs vg-sample --no-provenance --speed 0.5 first.signal.vgs
    same net.vgs vg-train -q --no-provenance --layers 1 --hidden 16 --iterations 20 first.poses.vgs
    same on.vgs vg-generate -q --no-provenance --frames 40 first.net.vgs first.poses.vgs
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

# a series of files, which has no single output to compare
@test "mesh files are the same with one thread, with three, and of any format" {
    must vg-encode --no-provenance "$DATA/horse-run.tar.xz" -o poses.vgs
    for format in obj ply ply-ascii ply-be off stl stl-ascii; do
        for j in 1 3; do
            mkdir "$j"
            must vg-decode -q -j "$j" --format $format poses.vgs -o "$j/%02d.mesh"
        done
        must diff -r 1 3
        [ "$(find 3 -type f | wc -l)" -gt 5 ]
        rm -r 1 3
    done
}

# alike CODE COMMAND...: fails so with one thread and with three, in the same words; what went to standard output, but for the name
# of the program that failed, is the same
alike() {
    local code=$1
    shift
    must_fail "$code" "$@" -j1
    said=$stderr
    mv .stdout one
    must_fail "$code" "$@" -j3
    [ "$stderr" = "$said" ] || fail "with three threads: $stderr" "with one: $said"
    same_file one .stdout
}

@test "what goes wrong is told when it is its turn, in the same words with any number of threads" {
    cp "$DATA/horse.rest.obj" a.obj
    cp a.obj b.obj
    cp a.obj c.obj
    cp a.obj e.obj
    for wrong in 'v 1 2 x' 'f 1 2 0' 'v 0 0 0' 'f 1 2 999999'; do
        { cat a.obj; echo "$wrong"; } >d.obj
        alike 3 vg-encode --no-provenance [a-e].obj
        says "'d.obj'"
        tar -cf poses.tar [a-e].obj
        alike 3 vg-encode --no-provenance poses.tar
        says "'d.obj'"
    done
    : >d.obj # two are wrong: the first is told
    echo 'v 1' >e.obj
    alike 3 vg-encode --no-provenance [a-e].obj
    says "'d.obj' is empty"
    # frames that single precision cannot hold
    sed 's/^v /v 1e39 /; s/^\(v [^ ]* [^ ]* [^ ]*\).*/\1/' a.obj >d.obj
    must vg-encode --no-provenance [a-d].obj -o large.vgs
    alike 3 vg-decode large.vgs -o 'out-%d.obj'
    says "cannot write frame 'd'" binary32
    [ "$(echo out-*)" = 'out-*' ]
}

@test "a pipe is not waited for before it is its turn" {
    cp "$DATA/horse.rest.obj" a.obj
    mkfifo later.obj
    { head -c 5000 a.obj; for ((n = 0; n < 100; n++)); do [ -e seen ] || sleep 0.1; done; tail -c +5001 a.obj; } >later.obj 3>&- &
    vg-encode --no-provenance -j3 a.obj a.obj later.obj a.obj >all.vgs 3>&- &
    encoder=$!
    must vg-encode --no-provenance a.obj a.obj -o two.vgs
    size=$(($(wc -c <two.vgs) - 4096)) # less its end
    for ((i = 0; i < 50 && $(wc -c <all.vgs) < size; i++)); do sleep 0.1; done
    early=$(wc -c <all.vgs)
    : >seen
    wait $encoder
    [ "$early" -ge "$size" ]
    rm later.obj
    cp a.obj later.obj
    must vg-encode --no-provenance a.obj a.obj later.obj a.obj -o again.vgs
    same_file again.vgs all.vgs
}
