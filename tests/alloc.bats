#!/usr/bin/env bats
# Memory that runs out: in every program, allocation after allocation fails, once and from there on. Each time the program ends
# with status 4 and one line, and leaves no file; or it did not need the memory, and gives the same bytes as ever.
# Of the allocations of each command ALLOC_MOST are tried, the first of them and a spread of the others (0: all; minutes).
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

setup_file() {
    [ -f "$BUILD/tools/fail_malloc.so" ] || return 0
    cd "$BATS_FILE_TMPDIR" || return 1
    poses cube 3
    mesh cube 0.05 2 >target.obj
    printf '0 0\n1 1\n3 3\n4 4\n' >markers.txt
    python3 -m zipfile -c poses.zip pose2.obj pose1.obj pose3.obj
    cp "$CORPUS/fuzz_bvh/arm.bvh" .
    vg-encode pose*.obj -o poses.vgs
    vg-encode pose?.obj pose?.obj pose?.obj -o nine.vgs
    vg-encode --vectors pose*.obj -o vectors.vgs
    vg-decode -q poses.vgs -o poses.glb
    vg-segment -k 2 poses.vgs -o patches.vgs
    vg-fitmap -q --patches patches.vgs poses.vgs -o map.vgs
    vg-register -q pose1.obj target.obj --markers markers.txt -o pairs.vgs
}

setup() {
    [ -f "$BUILD/tools/fail_malloc.so" ] || skip "tools/fail_malloc.so was not built"
    cp "$BATS_FILE_TMPDIR"/*.* "$BATS_TEST_TMPDIR"
    cd "$BATS_TEST_TMPDIR" || return 1
}

# each COMMAND...: a command line in one word
each() {
    local command
    for command; do
        # shellcheck disable=SC2086 # words
        must python3 "$ROOT/tests/tools/fail_each.py" "$BUILD/tools/fail_malloc.so" "${ALLOC_MOST:-24}" -- $command
    done
}

@test "memory runs out: vg-encode" {
    each 'vg-encode --vectors --faces selected pose1.obj pose2.obj -o out.vgs' 'vg-encode poses.zip -o out.vgs' \
        'vg-encode poses.glb -o out.vgs' 'vg-encode arm.bvh -o out.vgs'
}

@test "memory runs out: vg-decode" {
    each 'vg-decode poses.vgs -o out-%d.obj' 'vg-decode poses.vgs -o out.zip' 'vg-decode poses.vgs -o out.glb' \
        'vg-decode arm.bvh -o out.bvh' 'vg-decode poses.vgs -o out.npz'
}

@test "memory runs out: vg-deform" {
    each 'vg-deform --onto target.obj poses.vgs -o out.vgs' 'vg-deform --onto target.obj --by shape poses.vgs -o out.vgs' \
        'vg-deform --onto target.obj --correspondence pairs.vgs poses.vgs -o out.vgs' \
        'vg-interpolate 5 poses.vgs -o out.vgs' 'vg-play map.vgs poses.vgs -o out.vgs'
}

@test "memory runs out: vg-solve" {
    each 'vg-solve vectors.vgs -o out.vgs' 'vg-solve --planar --weights area vectors.vgs -o out.vgs'
}

@test "memory runs out: vg-smooth" {
    each 'vg-smooth poses.vgs -o out.vgs' 'vg-smooth --filter together --memory 1K nine.vgs -o out.vgs'
}

@test "memory runs out: vg-poisson" {
    each 'vg-poisson --first target.obj --last pose1.obj --memory 1K poses.vgs -o out.vgs'
    each 'vg-poisson --over pose --first target.obj --last pose1.obj --memory 1K poses.vgs -o out.vgs'
}

@test "memory runs out: vg-segment, vg-fitmap" {
    each 'vg-segment -k 3 --connected poses.vgs -o out.vgs' 'vg-fitmap -q --patches patches.vgs poses.vgs -o out.vgs' \
        'vg-retarget --onto target.obj map.vgs -o out.vgs'
}

@test "memory runs out: vg-register" {
    each 'vg-register pose1.obj target.obj --markers markers.txt -o out.vgs'
}

@test "memory runs out: vg-diff, vg-info" {
    each 'vg-diff poses.vgs poses.zip' 'vg-diff --plot e.svg poses.vgs poses.vgs' 'vg-diff --plot e.png poses.vgs poses.vgs' 'vg-diff --json poses.vgs poses.vgs -o out.json' 'vg-info poses.vgs' \
        'vg-info --json map.vgs -o out.json'
}

@test "memory runs out: vg-view" {
    each 'vg-view poses.vgs --against poses.zip -o out.png' 'vg-view poses.vgs -o out.html'
}

@test "little address space: fewer threads, or status 4, but no waiting" {
    [ "${CONFIG:-release}" = release ] || skip "sanitizers take all address space"
    local kilobytes=40000 tried=0 solved=0
    until bash -c "ulimit -v $kilobytes && exec vg-solve --version" >/dev/null 2>&1; do kilobytes=$((kilobytes + 10000)); done
    for ((; kilobytes < 1000000; kilobytes += kilobytes / 6)); do
        for command in 'vg-solve vectors.vgs -o out.vgs' 'vg-fitmap -q --patches patches.vgs poses.vgs -o out.vgs' \
            'vg-play map.vgs poses.vgs -o out.vgs' 'vg-segment -k 2 -j 8 poses.vgs -o out.vgs'; do
            capture timeout 300 bash -c "ulimit -v $kilobytes && exec $command"
            [ "$status" = 0 ] || { [ "$status" = 4 ] && one_line && [ ! -e out.vgs ]; } || fail "$kilobytes: '$command': status $status"
            [ "$status" = 4 ] || solved=$((solved + 1))
            tried=$((tried + 1))
            rm -f out.vgs
        done
    done
    [ "$solved" -gt 0 ] && [ "$solved" -lt "$tried" ]
}
