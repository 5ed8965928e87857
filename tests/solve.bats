#!/usr/bin/env bats
# vg-solve: vectors become vertices; what else comes in is refused or derived; labels, times and attributes pass.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

@test "there and back: every data set within 1e-12 D, from all and from selected faces, with both weights and fits" {
    for name in trex.rest.obj horse.rest.obj woman-tanktop.rest.obj trex-walk.tar.xz horse-run.tar.xz faceA.tar.xz; do
        for faces in all selected; do
            pipe "vg-encode --vectors --faces $faces '$DATA/$name' | vg-solve >out.vgs"
            must vg-diff -t 1e-12 "$DATA/$name" out.vgs
        done
        pipe "vg-encode --vectors '$DATA/$name' | vg-solve --weights uniform --fit squares >out.vgs"
        must vg-diff -t 1e-12 "$DATA/$name" out.vgs
    done
}

@test "small meshes: line segments, several components, isolated vertices" {
    for name in cube tetra two strip; do
        mesh $name >a.obj
        mesh $name 0.7 100 >b.obj
        pipe "vg-encode --vectors a.obj b.obj | vg-solve >out.vgs"
        must vg-encode a.obj b.obj -o in.vgs
        must vg-diff -t 1e-12 in.vgs out.vgs
    done
    { mesh cube && echo 'v 7 8 9'; } >a.obj
    { mesh cube 0.5 && echo 'v 1 1 1'; } >b.obj
    pipe "vg-encode --vectors a.obj b.obj | vg-solve | vg-decode --f64 -o out/"
    grep -qx 'v 7 8 9' out/a.obj
    grep -qx 'v 7 8 9' out/b.obj # in no face: where the reference has it
    printf 'v 1 2 3\nv 4 5 6\n' >points.obj
    pipe "vg-encode --vectors points.obj | vg-solve | vg-decode --f64 -o out.obj"
    must diff <(grep ^v points.obj) <(grep ^v out.obj)
}

@test "anchors come through the pipe and are met to the bit, in every pose where it has them" {
    poses two 9
    must vg-encode pose*.obj -o in.vgs
    for anchors in 0 11 0,3,9,11; do
        pipe "vg-encode --vectors --anchor $anchors in.vgs | vg-solve >out.vgs"
        must vg-diff -t 1e-12 in.vgs out.vgs
        py "$anchors" <<'END'
import sys, read_stream
a, b = read_stream.read_stream("in.vgs"), read_stream.read_stream("out.vgs")
assert len(a.frames) == len(b.frames) == 9
for p, q in zip(a.frames, b.frames):
    for v in map(int, sys.argv[1].split(",")):
        assert list(p.values[3 * v:3 * v + 3]) == list(q.values[3 * v:3 * v + 3]), (p.name, v)
END
    done
}

@test "vertices are taken as well: their vectors are derived" {
    poses two 3
    must vg-encode pose*.obj -o in.vgs
    must vg-solve in.vgs -o out.vgs
    must vg-diff -t 1e-12 in.vgs out.vgs
    must vg-solve pose1.obj -o out.vgs
    must vg-diff -t 1e-12 pose1.obj out.vgs
}

@test "names and times pass through, one output frame for each input frame" {
    poses cube 11
    pipe "vg-encode --vectors --fps 25 pose*.obj | vg-solve >out.vgs"
    must vg-encode --fps 25 pose*.obj -o in.vgs
    py <<'END'
import read_stream
a, b = read_stream.read_stream("in.vgs"), read_stream.read_stream("out.vgs")
assert [f.name for f in a.frames] == [f.name for f in b.frames] == ["pose%d" % i for i in (1, 10, 11, 2, 3, 4, 5, 6, 7, 8, 9)]
assert [f.time for f in b.frames] == [i / 25 for i in range(11)] == [f.time for f in a.frames]
assert b.kind == "vertices" and a.reference == b.reference
END
}

@test "texture coordinates, groups and materials pass through encode, deform, solve and decode" {
    {
        echo 'mtllib a.mtl'
        mesh cube | grep ^v
        printf 'vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n'
        echo 'o box'
        echo 'g front'
        echo 'usemtl red'
        echo 'f 1/1 4/2 3/3 2/4'
        echo 's 1'
        echo 'f 5/1 6/2 7/3 8/4'
        echo 'usemtl blue'
        mesh cube | grep ^f | tail -n +3
    } >a.obj
    pipe "vg-encode a.obj | vg-deform --onto a.obj | vg-solve | vg-decode -o out.obj"
    must diff <(grep -v '^#\|^v ' a.obj | sort) <(grep -v '^#\|^v ' out.obj | sort)
}

@test "an empty sequence passes, vectors of nothing too" {
    must vg-solve "$CORPUS/accept/vectors-of-nothing.vgs" -o out.vgs
    must vg-info --check out.vgs
}

@test "what holds no vectors is refused, and the message says what to do" {
    mesh cube >a.obj
    must vg-deform a.obj -o deformations.vgs
    must_fail 3 vg-solve deformations.vgs -o out.vgs
    one_line
    says "holds deformations" "vg-deform --onto"
    must_fail 3 vg-solve "$GOLDEN/transforms.vgs" -o out.vgs
    says "holds transforms"
    nothing_but a.obj deformations.vgs
}

@test "an anchor in no face is refused" {
    { mesh cube && echo 'v 7 8 9'; } >a.obj
    must vg-encode --vectors --anchor 8 a.obj -o in.vgs
    must_fail 3 vg-solve in.vgs -o out.vgs
    one_line
    says "anchor 8 is in no face"
    nothing_but a.obj in.vgs
}

@test "wrong options are refused" {
    for arguments in --bogus "--weights heavy" "--weights" "a.vgs b.vgs" "-j 0" "-j x"; do
        # shellcheck disable=SC2086
        must_fail 2 vg-solve $arguments
        says vg-solve: usage:
    done
    must_fail 2 vg-solve --weights heavy
    says "'uniform'" "'area'" "'heavy'"
    nothing_but
}

@test "a missing file, an empty input and a cut one are told apart" {
    must_fail 4 vg-solve none.vgs -o out.vgs
    says "'none.vgs'" "No such file"
    must_fail 3 vg-solve -o out.vgs </dev/null
    says empty
    poses cube 3
    must vg-encode --vectors pose*.obj -o in.vgs
    head -c 2000 in.vgs >cut.vgs
    must_fail 3 vg-solve cut.vgs -o out.vgs
    one_line
    says "cut short"
    nothing_but pose1.obj pose2.obj pose3.obj in.vgs cut.vgs
}

@test "-v says what the factorisation cost, -q nothing" {
    must vg-encode --vectors "$DATA/horse.rest.obj" -o in.vgs
    must_warn vg-solve -v in.vgs -o out.vgs
    says "346 unknowns"
    must vg-solve -q in.vgs -o out.vgs
}

@test "anchors among vertices that are held: each is where it belongs" {
    mesh two >rest.obj
    # the cube stands still, the tetrahedron beside it moves
    LC_ALL=C awk '$1 == "v" && ++n > 8 { $3 += 0.25; $4 -= 0.5 } { print }' rest.obj >moved.obj
    must vg-encode --anchor 2,9,11 rest.obj moved.obj -o in.vgs
    pipe 'vg-deform --onto rest.obj --pin always in.vgs | vg-solve >out.vgs'
    must vg-diff -t 1e-12 in.vgs out.vgs
}

@test "the least absolute misfit is nearer to the truth than least squares, and too few rounds are told" {
    for fit in absolute squares; do
        pipe "vg-encode '$DATA/faceA.tar.xz' | vg-deform --onto '$DATA/faceB.tar.xz' | vg-solve --fit $fit >$fit.vgs"
        vg-diff -c --json "$DATA/faceB.tar.xz" $fit.vgs >$fit.json
    done
    py <<'END'
import json
a, s = (json.load(open(f + ".json"))["vertex_error"]["mean"]["error"] for f in ("absolute", "squares"))
assert 0 < a < 0.97 * s, (a, s)
END
    pipe "vg-encode '$DATA/faceA.tar.xz' | vg-deform --onto '$DATA/faceB.tar.xz' -o vectors.vgs"
    vg-solve --rounds 1 vectors.vgs -o out.vgs 2>err
    grep -q 'poses have not converged: in the last of 1 rounds' err
    vg-solve -q --rounds 1 vectors.vgs -o out.vgs 2>err
    [ ! -s err ]
    must_fail 2 vg-solve --rounds 0 vectors.vgs
    must_fail 2 vg-solve --eps 0 vectors.vgs
    must_fail 2 vg-solve --fit cubes vectors.vgs
}
