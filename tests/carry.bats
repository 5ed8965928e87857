#!/usr/bin/env bats
# Transfer between meshes of different connectivity, blendshapes, and what is held: against ground truth where there is one.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# markers N: every N-th vertex of the human body with itself
markers() {
    awk -v n="$1" 'BEGIN { for (v = 0; v < 13380; v += n) print v, v }'
}

@test "man onto heavy man through a correspondence from 67 markers: not twice the error of the shared connectivity" {
    markers 200 >markers.txt
    must vg-register -q "$DATA/human-man-poses.tar.xz" "$DATA/human-heavy-poses.tar.xz" --markers markers.txt -o pairs.vgs
    pipe "vg-encode '$DATA/human-man-poses.tar.xz' |
        vg-deform --onto '$DATA/human-heavy-poses.tar.xz' --correspondence pairs.vgs | vg-solve >out.vgs"
    mean=$(vertex_error mean --centred "$DATA/human-heavy-poses.tar.xz" out.vgs)
    at_most "$mean" 0.013
}

@test "an animal onto another, 27 markers, hybrid polygons: every face is driven, the gait stays, nothing explodes" {
    must vg-register -q "$DATA/velociraptor.rest.obj" "$DATA/trex.rest.obj" \
        --markers "$DATA/velociraptor-trex.markers.txt" -o pairs.vgs
    must vg-encode --reference "$DATA/velociraptor.rest.obj" "$DATA/velociraptor-run.tar.xz" -o run.vgs
    pipe "vg-deform --onto '$DATA/trex.rest.obj' --correspondence pairs.vgs run.vgs | vg-solve >out.vgs"
    must vg-info --json out.vgs
    shows '"vertices": 912' '"frames": 14'
    # no face is turned over against the rest pose carried along by its own vertices: the surface keeps its area
    must vg-encode "$DATA/trex.rest.obj" -o rest.vgs
    py <<'END'
from read_stream import read_stream
out, rest = read_stream(open("out.vgs", "rb")), read_stream(open("rest.vgs", "rb"))
def area(mesh, x):
    total, at = 0.0, 0
    for face in mesh.faces():
        n = [0.0, 0.0, 0.0]
        p = [x[3 * v:3 * v + 3] for v in face]
        for a, b in zip(p, p[1:] + p[:1]):
            n[0] += a[1] * b[2] - a[2] * b[1]
            n[1] += a[2] * b[0] - a[0] * b[2]
            n[2] += a[0] * b[1] - a[1] * b[0]
        total += sum(c * c for c in n) ** 0.5 / 2
    return total
whole = area(rest.mesh, rest.frames[0].values)
for f in out.frames:
    ratio = area(out.mesh, f.values) / whole
    assert 0.9 < ratio < 1.15, (f.name, ratio)
END
}

@test "a target that is turned against the source is warned of, one that is inside out is not" {
    awk '$1 == "v" {y = $3; $3 = -$4; $4 = y} {print}' "$DATA/trex.rest.obj" >z-up.obj
    awk '$1 == "f" {for (i = NF; i > 1; i--) printf "%s ", (i == NF ? "f " : "") $i; print ""; next} {print}' \
        "$DATA/trex.rest.obj" >inside-out.obj
    must vg-encode --reference "$DATA/velociraptor.rest.obj" "$DATA/velociraptor-run.tar.xz" -o run.vgs
    for target in z-up inside-out; do
        must vg-register -q --markers "$DATA/velociraptor-trex.markers.txt" "$DATA/velociraptor.rest.obj" $target.obj \
            -o $target.vgs
    done
    must_fail 0 vg-deform --onto z-up.obj --correspondence z-up.vgs run.vgs -o out.vgs
    says "is turned by about 8"
    must vg-deform --onto inside-out.obj --correspondence inside-out.vgs run.vgs -o out.vgs
}

@test "through a correspondence with itself every pose comes back within 1e-10 D, by every method" {
    for set in trex-walk:trex horse-run:horse woman-tanktop-jump:woman-tanktop; do
        poses=$DATA/${set%:*}.tar.xz rest=$DATA/${set#*:}.rest.obj
        must vg-register -q --aligned "$rest" "$rest" -o pairs.vgs
        must vg-encode --reference "$rest" "$poses" -o walk.vgs
        for by in auto pose gradient blend offset; do
            pipe "vg-deform --by $by --onto '$rest' --correspondence pairs.vgs walk.vgs | vg-solve >out.vgs"
            must vg-diff -c -t 1e-10 walk.vgs out.vgs
        done
    done
}

@test "a correspondence of other meshes, a stream without one, and options that do not go with it are refused" {
    must vg-register -q --aligned "$DATA/horse.rest.obj" "$DATA/horse.rest.obj" -o pairs.vgs
    must_fail 3 vg-deform --onto "$DATA/horse.rest.obj" --correspondence pairs.vgs "$DATA/trex.rest.obj"
    says 'another source'
    must_fail 3 vg-deform --onto "$DATA/trex.rest.obj" --correspondence pairs.vgs "$DATA/horse-run.tar.xz"
    says 'another target'
    must_fail 3 vg-deform --onto "$DATA/horse.rest.obj" --correspondence "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz"
    says 'holds no correspondence' vg-register
    must_fail 2 vg-deform --by shape --onto "$DATA/horse.rest.obj" --correspondence pairs.vgs "$DATA/horse-run.tar.xz"
    must_fail 2 vg-deform --root 3 --onto "$DATA/horse.rest.obj" --correspondence pairs.vgs "$DATA/horse-run.tar.xz"
    must_fail 2 vg-deform --correspondence pairs.vgs "$DATA/horse-run.tar.xz"
    must_fail 3 vg-deform --onto "$DATA/trex.rest.obj" "$DATA/horse-run.tar.xz"
    says vg-register
}

@test "blendshapes: names are kept, the neutral is the target's own, what does not move does not move" {
    must vg-encode "$DATA/faceA.tar.xz" -o a.vgs
    must vg-encode "$DATA/faceB.tar.xz" -o b.vgs
    pipe "vg-deform --onto b.vgs a.vgs | vg-solve >out.vgs"
    py <<'END'
from read_stream import read_stream
a, b, out = (read_stream(open(n, "rb")) for n in ("a.vgs", "b.vgs", "out.vgs"))
assert [f.name for f in out.frames] == [f.name for f in a.frames]
assert list(out.frames[0].values) == list(b.frames[0].values)
faces = [[] for _ in range(out.mesh.nv)]
face = [list(f) for f in out.mesh.faces()]
for i, f in enumerate(face):
    for v in f:
        faces[v].append(i)
ref, held = a.frames[0].values, 0
for fa, fo in zip(a.frames, out.frames):
    still = [fa.values[3 * v:3 * v + 3] == ref[3 * v:3 * v + 3] for v in range(out.mesh.nv)]
    if sum(still) < out.mesh.nv / 10:
        continue
    for v in range(out.mesh.nv):
        if faces[v] and all(still[u] for f in faces[v] for u in face[f]):
            held += 1
            assert fo.values[3 * v:3 * v + 3] == b.frames[0].values[3 * v:3 * v + 3], (fo.name, v)
assert held > 5000, held
END
    # with --pin none they drift, so that the test above tests something
    pipe "vg-deform --pin none --onto b.vgs a.vgs | vg-solve >free.vgs"
    must_fail 1 vg-diff -t 1e-6 out.vgs free.vgs
    at_most "$(vertex_error mean --centred b.vgs out.vgs)" 0.0022
}

@test "pins come through the stream, and sequences without still parts have none" {
    must vg-encode "$DATA/faceA.tar.xz" -o a.vgs
    pipe "vg-deform --onto '$DATA/faceB.tar.xz' a.vgs >vectors.vgs"
    py <<'END'
from read_stream import read_stream
s = read_stream(open("vectors.vgs", "rb"))
assert len(s.frames[0].pins) == s.mesh.nv, len(s.frames[0].pins)
assert 0 < min(len(f.pins) for f in s.frames[1:] if f.pins) < s.mesh.nv
END
    pipe "vg-encode --reference '$DATA/trex.rest.obj' '$DATA/trex-walk.tar.xz' | vg-deform --onto '$DATA/trex.rest.obj' >vectors.vgs"
    py <<'END'
from read_stream import read_stream
assert not any(f.pins for f in read_stream(open("vectors.vgs", "rb")).frames)
END
}

@test "pieces that touch and come apart are carried exactly onto themselves" {
    printf 'v %s\n' '0 0 0' '1 0 0' '0 1 0' '0 0 1' '1 0 0' '2 0 0' '1 1 0' '1 0 1' >touch.obj
    printf 'f %s\n' '1 3 2' '1 2 4' '2 3 4' '3 1 4' '5 7 6' '5 6 8' '6 7 8' '7 5 8' >>touch.obj
    awk '$1 == "v" && ++n > 4 { $2 += 0.25; $4 += 0.125 } { print }' touch.obj >apart.obj
    pipe "vg-encode touch.obj apart.obj | vg-deform --pin none --onto touch.obj | vg-solve >out.vgs"
    must vg-encode touch.obj apart.obj -o truth.vgs
    must vg-diff -t 1e-12 truth.vgs out.vgs
}

@test "by shape: vertices at once, a mesh onto itself exact, worse than by pose on another body" {
    pipe "vg-encode '$DATA/trex-walk.tar.xz' | vg-deform --by shape --onto '$DATA/trex-walk.tar.xz' >out.vgs"
    must vg-diff -t 1e-12 "$DATA/trex-walk.tar.xz" out.vgs
    must_fail 3 bash -o pipefail -c "vg-encode --vectors '$DATA/horse-run.tar.xz' | vg-deform --by shape --onto '$DATA/horse.rest.obj' -o x.vgs"
    says vertices
}

@test "the asset build makes all actions, again only what is out of date, and stops on a bad source" {
    command -v make >/dev/null || skip "no make"
    cp -r "$ROOT/examples/asset-build" build
    mkdir data
    cp "$DATA"/velociraptor* "$DATA/trex.rest.obj" data/
    capture make -s -j2 -C build DATA=../data
    [ "$status" = 0 ] || fail "$stderr"
    for action in walk run attack; do [ -s "build/out/trex-$action.zip" ] || fail "no $action"; done
    capture make -C build DATA=../data
    shows 'Nothing to be done'
    touch data/velociraptor-run.tar.xz
    capture make -n -C build DATA=../data
    shows velociraptor-run
    [[ $output != *register* && $output != *walk* ]] || fail "more than the run is made again: $output"
    head -c 20000 data/velociraptor-walk.tar.xz >data/cut && mv data/cut data/velociraptor-walk.tar.xz
    capture make -C build DATA=../data
    [ "$status" != 0 ] || fail "a cut archive was taken"
    says velociraptor-walk
}

@test "walk-man onto walk-woman, other connectivity, 86 frames of truth (needs VG_DATA, the data kit)" {
    [ -d "${VG_DATA:-}/human" ] || skip "VG_DATA does not name the data kit"
    man=$VG_DATA/human/walk-man woman=$VG_DATA/human/walk-woman
    must vg-register -q "$man.rest.obj" "$woman.rest.obj" \
        --markers "$VG_DATA/correspondences/male1591-female1605.markers.txt" -o pairs.vgs
    pipe "vg-encode --reference '$man.rest.obj' '$man.tar.gz' |
        vg-deform --onto '$woman.rest.obj' --correspondence pairs.vgs | vg-solve >out.vgs"
    at_most "$(vertex_error mean --centred "$woman.tar.gz" out.vgs)" 0.012
    at_most "$(vertex_error max --centred "$woman.tar.gz" out.vgs)" 0.03
}

# ---- against ground truth: a head of another person and topology --------------------------------------------------------

# The truth adds the offsets of the source's shapes to the target, point by point, so that the share of the motion that
# arrives is the projection of what moved on what should have.
@test "shapes of a whole head onto another's face: the motion arrives, eyelids included, and what stays does" {
    [ -n "${VG_DATA:-}" ] || skip "needs the data kit: VG_DATA names its directory"
    other=$VG_DATA/face/head-other.rest.obj
    must vg-register -q "$VG_DATA/face/head-shapes.tar.xz" "$other" --markers "$VG_DATA/correspondences/head-other.markers.txt" -o pairs.vgs
    pipe "vg-encode '$VG_DATA/face/head-shapes.tar.xz' | vg-deform --onto '$other' --correspondence pairs.vgs | vg-solve -o shapes.vgs"
    must vg-encode "$VG_DATA/face/head-other.truth.tar.xz" -o truth.vgs
    py <<'END'
import read_stream
got, want = read_stream.read_stream("shapes.vgs"), read_stream.read_stream("truth.vgs")
rest = want.reference
D = sum((max(rest[k::3]) - min(rest[k::3])) ** 2 for k in range(3)) ** 0.5
shares, misses = [], []
for f, t in list(zip(got.frames, want.frames))[1:]:
    moved = [a - b for a, b in zip(f.values, rest)]
    true = [a - b for a, b in zip(t.values, rest)]
    square = sum(x * x for x in true)
    shares.append(sum(x * y for x, y in zip(moved, true)) / square)
    misses.append((sum((x - y) ** 2 for x, y in zip(moved, true)) / square) ** 0.5)
    for v in range(0, len(true), 3):
        if max(map(abs, true[v:v + 3])) < 1e-6 * D:
            assert sum(x * x for x in moved[v:v + 3]) ** 0.5 < 5e-4 * D, (f.name, v // 3)
assert len(shares) == 10
assert sum(shares) / 10 > 0.98 and min(shares) > 0.93 and sum(misses) / 10 < 0.035, (shares, misses)
END
}

# ---- a head that moves as a whole ---------------------------------------------------------------------------------------

# write_talk: talk-*.obj, an expression of face A, the one that moves the fewest vertices, so that part of the face rests; nod-*.obj, the same while the head turns by up to 60 degrees
# and leaves its place; b-tri.obj, face B as triangles in another order; markers.txt
write_talk() {
    must vg-decode "$DATA/faceA.tar.xz" -o 'a-%02d.obj'
    must vg-decode "$DATA/faceB.tar.xz" -o 'b-%02d.obj'
    py <<'END'
import math
def read(path):
    rows = [l.split() for l in open(path)]
    return ([[float(x) for x in r[1:]] for r in rows if r[0] == "v"],
            [[int(x.split("/")[0]) - 1 for x in r[1:]] for r in rows if r[0] == "f"])
A, faces = [read(f"a-{i:02}.obj")[0] for i in range(15)], read("a-00.obj")[1]
shape = min(A[1:], key=lambda x: sum(p != q for p, q in zip(x, A[0])))
n, B = len(A[0]), read("b-00.obj")[0]
order = sorted(range(n), key=lambda v: v * 7919 % n)
new = {v: i for i, v in enumerate(order)}
with open("b-tri.obj", "w") as out:
    for v in order:
        out.write("v %.6f %.6f %.6f\n" % tuple(B[v]))
    for k, face in enumerate(faces):
        face = [new[v] + 1 for v in face]
        face = face[k % 4:] + face[:k % 4]
        for i in range(1, len(face) - 1):
            out.write("f %d %d %d\n" % (face[0], face[i], face[i + 1]))
with open("markers.txt", "w") as out:
    for v in range(7, n, n // 60):
        out.write(f"{v} {new[v]}\n")
lines = ["f " + " ".join(str(v + 1) for v in face) + "\n" for face in faces]
for i in range(10):
    t = i / 9
    w = math.sin(2.5 * math.pi * t) ** 2
    c, s = math.cos(math.pi / 3 * t * t), math.sin(math.pi / 3 * t * t)
    with open(f"talk-{i:02}.obj", "w") as talk, open(f"nod-{i:02}.obj", "w") as nod:
        for v, x in enumerate(A[0]):
            y = [x[k] + w * (shape[v][k] - x[k]) for k in range(3)]
            talk.write("v %.6f %.6f %.6f\n" % tuple(y))
            nod.write("v %.6f %.6f %.6f\n" % (y[0] + 3 * t, c * (y[1] + 10) - s * y[2] - 10, s * (y[1] + 10) + c * y[2]))
        talk.writelines(lines)
        nod.writelines(lines)
END
}

# The rigid motion is taken from the result again: what is left must be what the head does that does not move, in every frame, so
# that no frame goes another way than its neighbour.
@test "a face that talks while the head turns by 60 degrees goes onto another as the same face at rest does" {
    write_talk
    must vg-register -q a-00.obj b-tri.obj --markers markers.txt -o pairs.vgs
    for name in talk nod; do
        pipe "vg-encode a-00.obj $name-*.obj | vg-deform --onto b-tri.obj --correspondence pairs.vgs | vg-solve >$name.vgs"
    done
    py <<'END'
import math, read_stream
talk, nod = [[f.values for f in read_stream.read_stream(name).frames][1:] for name in ("talk.vgs", "nod.vgs")]
n = len(talk[0])
D = sum((max(talk[0][k::3]) - min(talk[0][k::3])) ** 2 for k in range(3)) ** 0.5
for i, (a, b) in enumerate(zip(talk, nod)):
    t = i / 9
    c, s = math.cos(math.pi / 3 * t * t), math.sin(math.pi / 3 * t * t)
    back = []
    for v in range(0, n, 3):
        back += [b[v] - 3 * t, c * (b[v + 1] + 10) + s * b[v + 2] - 10, c * b[v + 2] - s * (b[v + 1] + 10)]
    off = [x - y for x, y in zip(back, a)]
    place = [sum(off[k::3]) / (n / 3) for k in range(3)]
    shape = sum(sum((off[v + k] - place[k]) ** 2 for k in range(3)) ** 0.5 for v in range(0, n, 3)) / (n / 3)
    print(i, shape / D, sum(x * x for x in place) ** 0.5 / D)
    assert shape < 1e-4 * D and sum(x * x for x in place) < (0.02 * D) ** 2, i
END
}
