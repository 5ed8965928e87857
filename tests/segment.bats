#!/usr/bin/env bats
# vg-segment: patches, their seed and connection, and their colours.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash
bats_require_minimum_version 1.5.0

setup_file() {
    cd "$BATS_FILE_TMPDIR" || return 1
    vg-encode --reference "$DATA/trex.rest.obj" "$DATA/trex-walk.tar.xz" -o trex.vgs
}

trex() { echo "$BATS_FILE_TMPDIR/trex.vgs"; }

@test "the same seed gives the same bytes with one thread and with more; another seed other patches" {
    must vg-segment --no-provenance -k 30 -j 1 "$(trex)" -o one.vgs
    must vg-segment --no-provenance -k 30 -j 4 "$(trex)" -o four.vgs
    must cmp one.vgs four.vgs
    must vg-segment --no-provenance -k 30 --seed 2 "$(trex)" -o other.vgs
    if cmp -s one.vgs other.vgs; then fail "another seed chose the same"; fi
}

@test "every face is in a patch, no patch is empty; --connected: each in one piece" {
    must vg-segment -k 20 --connected "$(trex)" -o patches.vgs
    py <<'END'
from read_stream import read_stream
s = read_stream("patches.vgs")
count, of_face = s.patches
assert count == 20 and set(of_face) == set(range(20)) and not s.frames
for p in range(count):
    faces = [set(s.mesh.face(f)) for f in range(s.mesh.nf) if of_face[f] == p]
    reached = faces.pop()
    while any(f & reached for f in faces):
        near = [f for f in faces if f & reached]
        faces = [f for f in faces if not f & reached]
        for f in near:
            reached |= f
    assert not faces, p
END
}

@test "-k auto and wrong numbers; an input without poses" {
    must vg-segment "$(trex)" -o auto.vgs
    must vg-info --check auto.vgs
    for k in 0 -1 1.5 many; do
        run -2 vg-segment -k "$k" "$(trex)" -o out.vgs
    done
    run -3 vg-segment auto.vgs -o out.vgs
    [ ! -e out.vgs ]
}

@test "more components than patches is said" {
    poses two 2
    must_warn vg-segment -k 1 --connected pose1.obj pose2.obj -o out.vgs
    says '2 patches instead of 1: the mesh has more components'
}
