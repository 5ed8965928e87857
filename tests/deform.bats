#!/usr/bin/env bats
# vg-deform: what comes in and goes out, what is refused, what is said. The numbers are in transfer.bats.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

@test "without --onto vertices and vectors become the same deformations" {
    poses two 3
    must vg-encode pose*.obj -o vertices.vgs
    must vg-encode --vectors pose*.obj -o vectors.vgs
    must vg-deform vertices.vgs -o a.vgs
    must vg-deform vectors.vgs -o b.vgs
    py <<'END'
import read_stream
a, b = read_stream.read_stream("a.vgs"), read_stream.read_stream("b.vgs")
assert a.kind == b.kind == "deformations" and a.count == b.count and a.links == b.links
for p, q in zip(a.frames, b.frames):
    assert max(abs(x - y) for x, y in zip(p.values, q.values)) < 1e-14
    assert max(abs(x - y) for x, y in zip(p.root, q.root)) < 1e-14
for p, q in zip(a.frames, read_stream.read_stream("vectors.vgs").frames): # where the body is is no deformation
    assert any(p.root) and max(abs(x - y) for x, y in zip(p.root, q.root)) < 1e-14
first = a.frames[0].values # the reference itself: nothing turns
assert max(abs(abs(x) - (i % 4 == 0)) for i, x in enumerate(first)) < 1e-14
END
}

@test "names, times and anchors pass" {
    poses cube 3
    must vg-encode --fps 10 --anchor 1,2 pose*.obj -o in.vgs
    must vg-deform in.vgs -o measured.vgs
    must vg-deform --onto pose1.obj in.vgs -o onto.vgs
    py <<'END'
import read_stream
for name in ("measured.vgs", "onto.vgs"):
    s = read_stream.read_stream(name)
    assert [f.name for f in s.frames] == ["pose1", "pose2", "pose3"] and [f.time for f in s.frames] == [0, 0.1, 0.2]
    assert list(s.anchors) == [1, 2] and all(len(f.anchors) == 6 for f in s.frames)
END
}

@test "the output is the target's: its reference, name and attributes" {
    poses cube 2
    { echo 'g target' && mesh cube 0 5; } >target.obj
    must vg-encode pose*.obj -o in.vgs
    must vg-deform --onto target.obj in.vgs -o out.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("out.vgs")
assert s.reference_name == "target" and min(s.reference[::3]) == 5
END
    pipe "vg-solve out.vgs | vg-decode -o out/"
    grep -qx 'g target' out/pose1.obj
    grep -qx 'g target' out/pose2.obj
    pipe "vg-encode target.obj | vg-deform --onto pose1.obj | vg-solve | vg-decode -o plain.obj"
    if grep -q 'g target' plain.obj; then fail "the group of the source came along"; fi
}

@test "the provenance has the source's, the target's, and this process" {
    poses cube 2
    must vg-encode pose*.obj -o in.vgs
    must vg-encode pose2.obj -o target.vgs
    must vg-deform --onto target.vgs in.vgs -o out.vgs
    must vg-info --json out.vgs
    shows vg-encode vg-deform in.vgs target.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("out.vgs")
names = [p.program for p in s.provenance]
assert names == ["vg-encode", "vg-encode", "vg-deform"], names
assert list(s.provenance[2].parents) == [0, 1]
END
}

@test "corners without a direction are counted once, on standard error, and stay finite" {
    cat >flat.obj <<'END'
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 3 0 0
f 1 2 3 4
f 2 5 6
END
    sed 's/v 1 1 0/v 1 1 1/' flat.obj >bent.obj
    capture vg-deform flat.obj bent.obj -o out.vgs
    [ "$status" != 0 ] # one operand at most
    must vg-encode flat.obj bent.obj -o in.vgs
    capture vg-deform in.vgs -o out.vgs
    [ "$status" = 0 ]
    one_line
    says "6 corners without a direction" "face 1"
    capture vg-deform --onto flat.obj in.vgs -o out.vgs
    [ "$status" = 0 ]
    one_line
    says "6 corners without a direction"
    must vg-deform -q in.vgs -o out.vgs
    must vg-info --check out.vgs
    pipe "vg-deform -q --onto flat.obj in.vgs | vg-solve >out.vgs"
    must vg-diff -t 1 in.vgs out.vgs
}

@test "meshes that do not fit are refused, and the message says what differs" {
    mesh cube >cube.obj
    mesh two >two.obj
    sed 's/^f 1 4 3 2$/f 1 2 3 4/' cube.obj >turned.obj
    sed 's/^f 1 4 3 2$/f 1 4 3/' cube.obj >fewer.obj
    must_fail 3 vg-deform --onto two.obj cube.obj -o out.vgs
    one_line
    says "12 vertices" "8"
    must_fail 3 vg-deform --onto turned.obj cube.obj -o out.vgs
    one_line
    says "face 0" "names vertex 1" "names 3"
    must_fail 3 vg-deform --onto fewer.obj cube.obj -o out.vgs
    one_line
    says "face 0" "3 corners" "4"
    must_fail 4 vg-deform --onto none.obj cube.obj -o out.vgs
    says "'none.obj'"
    nothing_but cube.obj two.obj turned.obj fewer.obj
}

@test "kinds that cannot be deformed are refused" {
    mesh cube >cube.obj
    must_fail 3 vg-deform "$GOLDEN/transforms.vgs" -o out.vgs
    says "holds transforms"
    must vg-deform cube.obj -o measured.vgs
    must_fail 3 vg-deform measured.vgs -o out.vgs
    one_line
    says "holds deformations" "--onto"
    nothing_but cube.obj measured.vgs
}

@test "wrong options are refused" {
    mesh cube >cube.obj
    for arguments in --bogus "--root stay" "--by pose" "--onto cube.obj --by force" "--onto cube.obj --root -1" \
        "--onto cube.obj --root 1,2" "--onto cube.obj --root middle" "--onto cube.obj --root 8" "--onto" "a b"; do
        # shellcheck disable=SC2086
        must_fail 2 vg-deform -o out.vgs $arguments <cube.obj
        says vg-deform: usage:
    done
    must_fail 2 vg-deform --root stay cube.obj
    says "--root needs --onto"
    must_fail 2 vg-deform --onto cube.obj --root 8 cube.obj
    says "vertex 8, but there are 8"
    must vg-encode --vectors cube.obj -o vectors.vgs
    must_fail 2 vg-deform --onto cube.obj --root 1 vectors.vgs
    says "needs a sequence of vertices" "vectors"
    nothing_but cube.obj vectors.vgs
}

@test "a method that deformations know nothing of is not ignored" {
    mesh cube >cube.obj
    must vg-deform cube.obj -o measured.vgs
    for by in gradient blend; do
        capture vg-deform --onto cube.obj --by $by measured.vgs -o out.vgs
        [ "$status" = 2 ] || [ "$status" = 3 ] || fail "--by $by was ignored"
    done
    must vg-deform --onto cube.obj --by pose measured.vgs -o out.vgs
}

@test "an input that is cut short fails here, too, and leaves nothing" {
    poses cube 3
    must vg-encode pose*.obj -o in.vgs
    head -c -40 in.vgs >cut.vgs
    must_fail 3 vg-deform --onto pose1.obj cut.vgs -o out.vgs
    one_line
    says "cut short"
    pipe_fail 3 "vg-deform --onto pose1.obj cut.vgs | vg-solve -o out.vgs"
    says "vg-deform: " "vg-solve: " "vg-deform failed with status 3"
    nothing_but pose1.obj pose2.obj pose3.obj in.vgs cut.vgs
}

@test "a quaternion written as its negative, and a scale of 4, are what they say" {
    mesh cube >cube.obj
    must vg-deform cube.obj --no-provenance -o measured.vgs
    py <<'END'
import make_corpus as m, read_stream
END
    mesh cube | awk '$1 == "v" { print "v", 4 * $2, 4 * $3, 4 * $4; next } { print }' >large.obj
    must vg-encode cube.obj large.obj -o in.vgs
    must vg-deform in.vgs -o out.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("out.vgs")
for i, x in enumerate(s.frames[1].values):
    assert abs(abs(x) - (2 if i % 4 == 0 else 0)) < 1e-14, (i, x) # squared length is the scale
END
}

@test "what is left out of the mesh of --onto is said once" {
    mesh cube >cube.obj
    { cat cube.obj; echo 'f 1 1 2'; } >odd.obj
    must vg-encode cube.obj -o in.vgs
    must_warn vg-deform --onto odd.obj in.vgs -o out.vgs
    says "'odd.obj': left out 1 face that names a vertex twice or has fewer than 2 corners"
    one_line
}
