# diff.bats: vg-diff: measures whose value is known by hand, answers, and what cannot be compared.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# near FILE PATH VALUE TOLERANCE: the number at a.b.c of a JSON file
near() {
    python3 - "$@" <<'END'
import json, sys
x = json.load(open(sys.argv[1]), parse_constant=lambda name: sys.exit("not JSON: " + name))
for key in sys.argv[2].split("."):
    x = x[int(key)] if isinstance(x, list) else x[key]
if not abs(x - float(sys.argv[3])) <= float(sys.argv[4]):
    sys.exit("%s is %r, not %s" % (sys.argv[2], x, sys.argv[3]))
END
}

# is FILE PATH JSON: exactly this value
is() {
    python3 - "$@" <<'END'
import json, sys
x = json.load(open(sys.argv[1]), parse_constant=lambda name: sys.exit("not JSON: " + name))
for key in sys.argv[2].split("."):
    x = x[int(key)] if isinstance(x, list) else x[key]
if x != json.loads(sys.argv[3]) or type(x) != type(json.loads(sys.argv[3])):
    sys.exit("%s is %r, not %s" % (sys.argv[2], x, sys.argv[3]))
END
}

@test "a sequence equals itself, with a tolerance of 0" {
    mesh cube >a.obj
    must vg-diff -t 0 a.obj a.obj
    shows 'max error 0 D is within the tolerance of 0 D' 'vertices  8' 'faces     6'
    must vg-diff --tolerance 0 --of rms --centred "$DATA/horse-run.tar.xz" "$DATA/horse-run.tar.xz"
}

@test "one vertex moved by d: mean d/nv, rms d/sqrt(nv), max d, and where" {
    mesh cube >a.obj
    sed 's/^v 1.000000 1.000000 1.000000/v 1 1 1.25/' a.obj >b.obj
    must vg-diff --json a.obj b.obj -o r.json
    near r.json D 1.7320508075688772 1e-15
    near r.json vertex_error.mean.error 0.03125 1e-17
    near r.json vertex_error.mean.D 0.01804219591217581 1e-16
    near r.json vertex_error.rms.error 0.08838834764831845 1e-16
    near r.json vertex_error.max.error 0.25 0
    near r.json vertex_error.p95.error 0.25 0.001
    near r.json vertex_error.sigma.error 0 0
    is r.json vertex_error.max.vertex 6
    is r.json vertex_error.max.frame 0
    is r.json vertex_error.max.frame_name '"a"'
    is r.json vertex_error.mean.vertex null
    must vg-diff a.obj b.obj
    shows "vertex 6 of frame 0 'a'"
}

@test "sigma: the deviation of the errors 0 and d is d/2, at that vertex" {
    mesh cube >p1.obj
    cp p1.obj q1.obj
    cp p1.obj p2.obj
    sed 's/^v 0.000000 1.000000 1.000000/v 0 1.5 1/' p2.obj >q2.obj
    vg-encode p1.obj p2.obj >p.vgs
    vg-encode q1.obj q2.obj >q.vgs
    must vg-diff --json p.vgs q.vgs -o r.json
    near r.json vertex_error.sigma.error 0.25 1e-16
    is r.json vertex_error.sigma.vertex 7
    is r.json vertex_error.max.frame 1
    is r.json vertex_error.max.frame_name '"p2"'
}

@test "a face turned by an angle has orientation error 1 - cos" {
    printf 'v 0 0 0\nv 2 0 0\nv 0 3 0\nf 1 2 3\n' >a.obj
    printf 'v 0 0 0\nv 2 0 0\nv 0 1.5 2.598076211353316\nf 1 2 3\n' >b.obj # 60 degrees about x
    printf 'v 0 0 0\nv 2 0 0\nv 0 -3 0\nf 1 2 3\n' >c.obj                  # turned over
    must vg-diff --json a.obj b.obj -o r.json
    near r.json face_error.orientation.mean 0.5 1e-15
    near r.json face_error.orientation.max 0.5 1e-15
    near r.json face_error.area.max 0 1e-15
    must vg-diff --json a.obj c.obj -o r.json
    near r.json face_error.orientation.max 2 0
}

@test "a mesh scaled by s has area error |1 - s^2|" {
    mesh cube >a.obj
    awk '/^v/ { $2 *= 1.5; $3 *= 1.5; $4 *= 1.5 } 1' a.obj >b.obj
    must vg-diff --json a.obj b.obj -o r.json
    near r.json face_error.area.mean 1.25 1e-14
    near r.json face_error.area.sd 0 1e-14
    near r.json face_error.orientation.max 0 1e-15
    is r.json faces_measured 6
}

@test "planarity of a quad bent by h is h / sqrt(1 + h^2)" {
    printf 'v 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3 4\n' >a.obj
    printf 'v 1 0 0.75\nv 0 1 -0.75\nv -1 0 0.75\nv 0 -1 -0.75\nf 1 2 3 4\n' >b.obj
    must vg-diff --json a.obj b.obj -o r.json
    near r.json planarity.truth.max 0 0
    near r.json planarity.result.mean 0.6 1e-15
    is r.json planarity.truth.histogram '[1, 0, 0, 0, 0, 0, 0, 0, 0, 0]'
    near r.json planarity.result.faces 1 0
}

@test "line segments have vertices to measure, but no faces" {
    printf 'v 0 0 0\nv 0 0 1\nv 0 0 2\nl 1 2\nl 2 3\n' >a.obj
    printf 'v 0 0 0\nv 0 0 1\nv 0 1 2\nl 1 2\nl 2 3\n' >b.obj
    must vg-diff a.obj b.obj
    shows 'max                    1       0.5  vertex 2 of frame 0'
    [[ $output != *orientation* && $output != *planarity* ]]
}

@test "--centred takes a shift out, and only that" {
    mesh cube >a.obj
    mesh cube 0 5 >b.obj
    must_fail 1 vg-diff -t 0.1 a.obj b.obj
    must vg-diff -c -t 1e-15 a.obj b.obj
    must vg-diff --centred --json a.obj b.obj -o r.json
    is r.json centred true
}

@test "the tolerance is about the error that --of names" {
    mesh cube >a.obj
    sed 's/^v 1.000000 1.000000 1.000000/v 1 1 1.25/' a.obj >b.obj # in D: mean 0.018, rms 0.051, max 0.144
    must vg-diff --of mean -t 0.0181 a.obj b.obj
    must_fail 1 vg-diff --of mean -t 0.0180 a.obj b.obj
    says 'mean error 0.0180422 D exceeds the tolerance of 0.018 D'
    must vg-diff --of rms -t 0.052 a.obj b.obj
    must_fail 1 vg-diff --of rms -t 0.051 a.obj b.obj
    must vg-diff --of max -t 0.1444 a.obj b.obj
    must_fail 1 vg-diff -t 0.1443 a.obj b.obj
    must_fail 1 vg-diff --of p95 -t 0.143 a.obj b.obj
    must_fail 1 vg-diff --json -t 0.1 a.obj b.obj
    printf '%s' "$output" >r.json
    is r.json tolerance.within false
    is r.json tolerance.of '"max"'
    must_fail 1 vg-diff -t 0 a.obj b.obj
    must vg-diff a.obj b.obj # a report, no question
}

@test "other vertices or faces: the answer is no, in one line" {
    mesh cube >a.obj
    mesh tetra >b.obj
    must_fail 1 vg-diff a.obj b.obj
    one_line
    says "vg-diff: 'b.obj' has 4 vertices where 'a.obj' has 8"
    [ -z "$output" ]
    sed 's/^f 1 4 3 2$/f 4 3 2 1/' a.obj >c.obj
    must_fail 1 vg-diff a.obj c.obj
    one_line
    says 'face 0'
    must_fail 1 vg-diff --json a.obj b.obj
    printf '%s' "$output" >r.json
    is r.json comparable false
    is r.json reason "\"'b.obj' has 4 vertices where 'a.obj' has 8\""
}

@test "another number of frames: the common ones are reported, and the answer is no" {
    poses cube 3
    vg-encode pose1.obj pose2.obj pose3.obj >long.vgs
    vg-encode pose1.obj pose2.obj >short.vgs
    must_fail 1 vg-diff -t 0 long.vgs short.vgs
    one_line
    says "'long.vgs' has 3 frames and 'short.vgs' has 2: only the first 2 were compared"
    shows 'max error 0 D is within' 'compared  2'
    must_fail 1 vg-diff short.vgs long.vgs
    must_fail 1 vg-diff --json short.vgs long.vgs
    printf '%s' "$output" >r.json
    is r.json frames 2
    is r.json result.frames 3
}

@test "--frames has a line for every frame, with its own error" {
    poses cube 3
    sed '1s/.*/v 1 0 -0.5/' pose2.obj >other.obj
    vg-encode pose1.obj pose2.obj pose3.obj >a.vgs
    vg-encode pose1.obj other.obj pose3.obj >b.vgs
    must vg-diff --frames --json a.vgs b.vgs -o r.json
    is r.json frame_errors.0.max 0.0
    is r.json frame_errors.1.name '"pose2"'
    is r.json frame_errors.1.frame 1
    is r.json frame_errors.2.mean 0.0
    python3 - <<'END'
import json
r = json.load(open("r.json"))
worst = r["frame_errors"][1]
assert len(r["frame_errors"]) == 3
assert worst["max"] == r["vertex_error"]["max"]["error"] > 0
assert abs(worst["mean"] * 8 - worst["max"]) < 1e-15
assert abs(worst["mean_D"] * r["D"] - worst["mean"]) < 1e-15
END
    must vg-diff --frames a.vgs b.vgs
    [ "$(printf '%s\n' "$output" | grep -c ' pose[123] ')" = 3 ]
}

@test "names of frames do not matter, and -v says which differ" {
    mesh cube >a.obj
    cp a.obj b.obj
    must_warn vg-diff -v -t 0 a.obj b.obj
    says "frame 0 is 'a' in 'a.obj' and 'b' in 'b.obj'"
}

@test "one operand may be standard input" {
    poses cube 2
    vg-encode pose1.obj pose2.obj >a.vgs
    pipe 'vg-encode pose1.obj pose2.obj | vg-diff -t 0 a.vgs -'
    shows 'standard input, 2 frames'
    pipe 'vg-encode pose1.obj pose2.obj | vg-diff -t 0 - a.vgs'
    pipe 'cat pose1.obj | vg-diff -t 0 - pose1.obj'
}

@test "vectors and deformations are refused, with advice" {
    poses cube 2
    vg-encode --vectors pose1.obj pose2.obj >w.vgs
    vg-encode pose1.obj pose2.obj >a.vgs
    must_fail 3 vg-diff a.vgs w.vgs
    one_line
    says "'w.vgs' holds vectors" vg-solve
    must_fail 3 vg-diff w.vgs a.vgs
}

@test "wrong usage" {
    mesh cube >a.obj
    must_fail 2 vg-diff
    says 'TRUTH' 'usage: vg-diff [options] TRUTH RESULT'
    must_fail 2 vg-diff a.obj
    must_fail 2 vg-diff a.obj a.obj a.obj
    must_fail 2 vg-diff - -
    says 'standard input can be read only once'
    must_fail 2 vg-diff --of median a.obj a.obj
    says "'median'"
    must_fail 2 vg-diff -t -1 a.obj a.obj
    must_fail 2 vg-diff -t nan a.obj a.obj
    must_fail 2 vg-diff -t 1x a.obj a.obj
    must_fail 2 vg-diff -t 0x1 a.obj a.obj
    must_fail 2 vg-diff -t '' a.obj a.obj
    must_fail 2 vg-diff a.obj a.obj -t
    must_fail 2 vg-diff --no-provenance a.obj a.obj
    must_fail 2 vg-diff -j 0 a.obj a.obj
}

@test "damaged, missing and empty input" {
    poses cube 2
    vg-encode pose1.obj pose2.obj >a.vgs
    head -c -40 a.vgs >cut.vgs
    must_fail 3 vg-diff a.vgs cut.vgs
    one_line
    says 'cut.vgs'
    must_fail 3 vg-diff cut.vgs a.vgs
    must_fail 4 vg-diff a.vgs missing.vgs
    says "'missing.vgs'"
    must_fail 3 vg-diff a.vgs - </dev/null
    says 'empty'
}

@test "damage behind the last common frame is found" {
    poses cube 3
    vg-encode pose1.obj >short.vgs
    vg-encode pose1.obj pose2.obj pose3.obj >long.vgs
    head -c -8 long.vgs >cut.vgs
    must_fail 3 vg-diff short.vgs cut.vgs
    must_fail 3 vg-diff cut.vgs short.vgs
}

@test "a report replaces its file only when it is whole" {
    mesh cube >a.obj
    mesh tetra >b.obj
    printf 'old\n' >r.txt
    must_fail 1 vg-diff a.obj b.obj -o r.txt
    [ "$(cat r.txt)" = old ]
    must_fail 4 vg-diff a.obj missing.obj -o r.txt
    [ "$(cat r.txt)" = old ]
    nothing_but a.obj b.obj r.txt
    must vg-diff a.obj a.obj -o r.txt
    [ -z "$output" ]
    grep -q '^vertices  8$' r.txt
    must_fail 4 vg-diff a.obj a.obj -o no/such/dir.txt
    nothing_but a.obj b.obj r.txt
}

@test "a full device and a closed pipe" {
    mesh cube >a.obj
    must_fail 4 bash -c 'vg-diff a.obj a.obj >/dev/full'
    says 'cannot write to standard output: No space left on device'
    must_fail 4 vg-diff a.obj a.obj -o /dev/full
    must_fail 4 bash -c 'vg-diff a.obj a.obj >&-'
    says 'standard output'
}

@test "a mesh without extent has no D: null, never NaN, and only equality is within" {
    printf 'v 1 2 3\n' >a.obj
    printf 'v 1 2 4\n' >b.obj
    must vg-encode a.obj -o a.vgs
    must vg-encode b.obj -o b.vgs
    must vg-diff --json a.vgs b.vgs -o r.json
    is r.json vertex_error.max.error 1.0
    is r.json vertex_error.max.D null
    must vg-diff a.vgs b.vgs
    [[ $output != *nan* && $output != *inf* ]]
    must vg-diff -t 0 a.vgs a.vgs
    must_fail 1 vg-diff -t 1000 a.vgs b.vgs
}

@test "numbers do not follow the locale" {
    mesh cube >a.obj
    mesh cube 0.3 >b.obj
    must vg-diff --json a.obj b.obj -o c.json
    for locale in de_DE.UTF-8 fr_FR.UTF-8 tr_TR.UTF-8; do
        LC_ALL=$locale must vg-diff --json a.obj b.obj -o l.json
        same_file c.json l.json
    done
}

@test "real data: the two bodies of one motion differ, by the same in both orders" {
    must vg-diff -c --json "$DATA/human-man-poses.tar.xz" "$DATA/human-heavy-poses.tar.xz" -o ab.json
    must vg-diff -c --json "$DATA/human-heavy-poses.tar.xz" "$DATA/human-man-poses.tar.xz" -o ba.json
    python3 - <<'END'
import json
a, b = json.load(open("ab.json")), json.load(open("ba.json"))
for k in ("mean", "rms", "max", "p95"):
    x, y = a["vertex_error"][k]["error"], b["vertex_error"][k]["error"]
    assert x > 0 and abs(x - y) <= 1e-12 * x, (k, x, y)
assert a["vertex_error"]["max"]["vertex"] == b["vertex_error"]["max"]["vertex"]
assert abs(a["face_error"]["orientation"]["mean"] - b["face_error"]["orientation"]["mean"]) < 1e-12
assert a["planarity"]["truth"] == b["planarity"]["result"]
END
}

@test "--json has a histogram of the vertex errors and, with --frames, p95 of each: those that Python finds" {
    poses cube 4
    vg-encode pose1.obj pose2.obj pose3.obj pose4.obj >a.vgs
    py <<'END'
import random, re
random.seed(7)
for i in range(1, 5):
    lines = open(f"pose{i}.obj").read().splitlines()
    for k, line in enumerate(lines):
        if line.startswith("v ") and k != 3:
            x = [float(t) + random.choice([-1, 1]) * 10 ** random.uniform(-14, 1.5) for t in line.split()[1:]]
            lines[k] = "v " + " ".join(map(repr, x))
    open(f"moved{i}.obj", "w").write("\n".join(lines) + "\n")
END
    vg-encode moved1.obj moved2.obj moved3.obj moved4.obj >b.vgs
    must vg-diff --json --frames a.vgs b.vgs -o r.json
    py <<'END'
import bisect, json, math, read_stream
a, b, r = read_stream.read_stream("a.vgs"), read_stream.read_stream("b.vgs"), json.load(open("r.json"))
box = [[f(a.reference[k::3]) for k in range(3)] for f in (min, max)]
D = math.dist(*box)
edges = [0.0] + [float(f"{m}e{e}") for e in range(-12, 1) for m in (1, 2, 5)]
counts, touched = [0] * len(edges), 0
for p, q, row in zip(a.frames, b.frames, r["frame_errors"]):
    errors = [math.dist(p.values[3 * v:3 * v + 3], q.values[3 * v:3 * v + 3]) for v in range(8)]
    for x in errors:
        counts[bisect.bisect_right(edges, x / D) - 1] += 1
    ranked = sorted(errors)
    assert abs(row["p95"] - ranked[7]) <= 1e-15 * ranked[7] and abs(row["p95_D"] - ranked[7] / D) < 1e-14 * ranked[7]
    assert abs(row["mean"] - sum(errors) / 8) < 1e-14
assert r["histogram"]["edges_D"] == edges
assert r["histogram"]["counts"] == counts and sum(counts) == 32 and sum(c > 0 for c in counts) > 8, counts
END
}

@test "--heat writes the result with the error of each vertex: frames and names are the result's, the numbers those of Python" {
    poses two 3
    vg-encode --fps 10 pose1.obj pose2.obj pose3.obj >result.vgs
    mkdir truth
    for i in 1 2 3; do mesh two 0.05 "0.$i" >"truth/t$i.obj"; done
    must vg-diff truth result.vgs --heat heat.vgs -o report.txt
    grep -q 'vertex error' report.txt
    must vg-diff truth result.vgs --heat centred.vgs -c
    shows 'vertex error'
    must_fail 1 bash -c 'vg-diff truth result.vgs --heat - -t 0.001 >piped.vgs'
    says 'exceeds the tolerance'
    must witness --check heat.vgs
    must vg-diff truth result.vgs --heat untraced.vgs --no-provenance
    must_fail 2 vg-diff truth result.vgs --no-provenance
    says '--heat'
    py <<'END'
import math, read_stream
assert all(p.program != "vg-diff" for p in read_stream.read_stream("untraced.vgs").provenance)
points = lambda i: [[float(x) for x in l.split()[1:]] for l in open(f"truth/t{i}.obj") if l.startswith("v ")]
r, heat, centred, piped = (read_stream.read_stream(n) for n in ("result.vgs", "heat.vgs", "centred.vgs", "piped.vgs"))
D = math.dist(*[[f(p[k] for p in points(1)) for k in range(3)] for f in (min, max)])
assert [f.name for f in heat.frames] == ["pose1", "pose2", "pose3"] and [f.time for f in heat.frames] == [0, 0.1, 0.2]
assert heat.mesh.faces() == r.mesh.faces() and heat.reference == r.reference and len(piped.frames) == 3
assert heat.provenance[-1].program == "vg-diff" and "--heat" in heat.provenance[-1].args
mean = lambda p: [sum(x[k] for x in p) / len(p) for k in range(3)]
for i, (f, g, c, p) in enumerate(zip(r.frames, heat.frames, centred.frames, piped.frames), 1):
    assert f.values == g.values == c.values and p.scalars == g.scalars
    pose = [list(f.values[k:k + 3]) for k in range(0, len(f.values), 3)]
    name, unit, errors = g.scalars
    assert (name, unit) == ("error", "D") and len(errors) == 12
    assert all(abs(x * D - math.dist(a, b)) < 1e-14 for x, a, b in zip(errors, pose, points(i)))
    shift = [a - b for a, b in zip(mean(points(i)), mean(pose))]
    assert c.scalars[0] == "centred error"
    assert all(abs(x * D - math.dist([u + s for u, s in zip(a, shift)], b)) < 1e-14
               for x, a, b in zip(c.scalars[2], pose, points(i)))
END
    must vg-info heat.vgs
    shows "'error' of each vertex in 3 of the frames"
    must vg-info --json heat.vgs -o info.json
    is info.json channels.0.unit '"D"'
    is info.json channels.0.frames 3
}

@test "heat passes where vertices stay, and goes where they move or a format cannot hold it" {
    poses cube 3
    vg-encode pose1.obj pose2.obj pose3.obj >a.vgs
    must vg-diff --heat heat.vgs -q -o report pose1.obj pose1.obj
    capture vg-diff a.vgs pose1.obj --heat short.vgs -o report
    [ "$status" = 1 ]
    must vg-diff a.vgs a.vgs --heat heat.vgs -o report
    must vg-encode --f32 heat.vgs -o f32.vgs
    must vg-encode heat.vgs a.vgs -o joined.vgs
    must vg-encode --vectors heat.vgs -o vectors.vgs
    must vg-poisson --last pose1.obj heat.vgs -o guided.vgs
    py <<'END'
import read_stream
has = lambda name: [bool(f.scalars) for f in read_stream.read_stream(name).frames]
assert has("heat.vgs") == has("f32.vgs") == [True] * 3
assert has("short.vgs") == [True], has("short.vgs")
assert has("joined.vgs") == [True] * 3 + [False] * 3, has("joined.vgs")
assert has("vectors.vgs") == has("guided.vgs") == [False] * 3
END
    must_warn vg-decode heat.vgs -o heat.pc2
    says "not kept in 'heat.pc2'" "the 'error' of the vertices"
    must_warn vg-decode heat.vgs -o 'h-%d.obj'
    says "the 'error' of the vertices"
}

@test "--heat: a stream is no report, and neither is written for what cannot be compared" {
    mesh cube >a.obj
    mesh tetra >b.obj
    must_fail 2 vg-diff a.obj a.obj --heat - --json
    says "option '--json' applies to the report"
    must_fail 2 vg-diff a.obj a.obj --heat x -o x
    must_fail 2 vg-diff a.obj a.obj --heat x.png
    says "the output is a stream"
    must_fail 1 vg-diff a.obj b.obj --heat x --json
    printf '%s' "$output" >r.json
    is r.json comparable false
    must_fail 4 vg-diff a.obj a.obj --heat /dev/full
    must_fail 4 vg-diff a.obj a.obj --heat nowhere/x
    nothing_but a.obj b.obj r.json
    must vg-diff a.obj a.obj --heat - --json -o report.json
    is report.json comparable true
}

@test "--plot: the curves are the errors of the frames, the bars the histogram, as SVG; as PNG a picture of the same size" {
    must vg-encode --take 0-19 "$DATA/trex-attack.tar.xz" -o truth.vgs
    must vg-encode --fps 24 truth.vgs -o timed.vgs
    must vg-smooth -q --seconds 0.2 timed.vgs -o 'a<b&c.vgs'
    must vg-diff --plot e.svg --json --frames truth.vgs 'a<b&c.vgs' -o report.json
    must vg-diff --plot e.png truth.vgs 'a<b&c.vgs' -o report.txt
    must vg-diff --plot again.png truth.vgs 'a<b&c.vgs' --heat heat.vgs -o report.txt
    cmp e.png again.png
    py <<'END'
import json, re, struct
import xml.etree.ElementTree as tree
report, svg = json.load(open("report.json")), tree.parse("e.svg").getroot()
ns = "{http://www.w3.org/2000/svg}"
texts = [(float(t.get("x")), float(t.get("y")), t.text) for t in svg.iter(ns + "text")]
assert any(t[2].startswith("a<b&c.vgs beside truth.vgs") for t in texts), texts
def ticks(low, high): # of the vertical axis: label -> height of its line
    return {float(text): y - 4 for x, y, text in texts if x < 80 and low < y < high}
def reader(marks):
    (a, ya), (b, yb) = min(marks.items()), max(marks.items())
    return lambda y: a + (y - ya) / (yb - ya) * (b - a)
value, most = reader(ticks(0, 320)), max(ticks(0, 320))
for colour, key in ("#1f5fa8", "mean_D"), ("#d86014", "p95_D"), ("#5a5a5a", "max_D"):
    lines = [[float(w) for w in re.findall(r"[-0-9.]+", p.get("d"))] for p in svg.iter(ns + "path")
             if p.get("stroke") == colour and p.get("stroke-width") == "1.8"]
    assert len(lines) == 19, (key, len(lines))
    assert abs(lines[0][0] - 84) < 0.06 and abs(lines[-1][2] - 876) < 0.06
    got = [value(lines[0][1])] + [value(l[3]) for l in lines]
    want = [f[key] for f in report["frame_errors"]]
    assert max(abs(a - b) for a, b in zip(got, want)) < 0.001 * most, (key, got, want)
counts, share = report["histogram"]["counts"], reader(ticks(340, 660))
bars = [(float(r.get("y")) + float(r.get("height")), float(r.get("y"))) for r in svg.iter(ns + "rect") if r.get("fill") == "#1f5fa8"]
want = [100 * c / sum(counts) for c in counts[1:] if c]
assert len(bars) == len(want) > 3
assert max(abs(share(top) - w) for (_, top), w in zip(bars, want)) < 0.001 * max(ticks(340, 660)), (bars, want)
width, height = struct.unpack(">II", open("e.png", "rb").read()[16:24])
assert (width, height) == (int(svg.get("width")), int(svg.get("height")))
END
    must vg-diff --plot same.svg truth.vgs truth.vgs
    must_fail 2 vg-diff --plot e.pdf truth.vgs truth.vgs
    says 'must end in .svg or .png'
    must_fail 2 vg-diff --plot e.svg truth.vgs truth.vgs -o e.svg
    must_fail 2 vg-diff --plot h.svg --heat h.svg truth.vgs truth.vgs
    must_fail 4 vg-diff --plot nowhere/e.svg truth.vgs truth.vgs
}

# plane NAME CELLS SIZE HEIGHT: a square of so many cells a side, from 0 to SIZE
plane() {
    LC_ALL=C awk -v n="$2" -v s="$3" -v z="$4" 'BEGIN {
        for (j = 0; j <= n; j++) for (i = 0; i <= n; i++) printf "v %.17g %.17g %.17g\n", i * s / n, j * s / n, z
        for (j = 0; j < n; j++) for (i = 0; i < n; i++) {
            a = j * (n + 1) + i + 1; print "f", a, a + 1, a + n + 2, a + n + 1
        }
    }' >"$1"
}

@test "--surface: planes apart, whatever their vertices, and a part that is missing in one way only" {
    plane fine.obj 8 2 0
    plane coarse.obj 3 2 0.25
    plane half.obj 4 1 0
    must vg-diff --surface --json fine.obj coarse.obj
    python3 - "$output" <<'END'
import json, sys
r = json.loads(sys.argv[1])
for way in "truth_to_result", "result_to_truth":
    for key in "mean", "rms", "max":
        assert abs(r["surface_distance"][way][key] - 0.25) < 1e-12, (way, key)
    assert abs(r["surface_distance"][way]["p95"] - 0.25) < 0.25 * 0.006
assert abs(r["hausdorff"] - 0.25) < 1e-12 and abs(r["D"] - 8 ** 0.5) < 1e-12
END
    # from the square of side 2 to that of side 1 in its corner: (x - 1)+ and (y - 1)+ are the distances along the axes
    plane dense.obj 64 2 0
    must vg-diff --surface --json dense.obj half.obj
    python3 - "$output" <<'END'
import json, math, sys
d = json.loads(sys.argv[1])["surface_distance"]
back, there = d["result_to_truth"], d["truth_to_result"]
assert back["max"] < 1e-12
assert abs(there["max"] - 2 ** 0.5) < 1e-12 and there["at"] == [2, 2, 0]
# mean: two unit squares of mean 1/2, one of mean (sqrt 2 + asinh 1) / 3, one of 0; mean square: 1/3, 1/3, 2/3, 0
assert abs(there["mean"] - (1 + (2 ** 0.5 + math.asinh(1)) / 3) / 4) < 2e-5
assert abs(there["rms"] - (4 / 3 / 4) ** 0.5) < 2e-5
END
    # vertices in no face are not on the surface
    { cat coarse.obj && echo 'v 0 0 9'; } >stray.obj
    must vg-diff --surface --json fine.obj stray.obj
    python3 -c 'import json, sys; assert abs(json.loads(sys.argv[1])["hausdorff"] - 0.25) < 1e-12' "$output"
    # frame by frame; the vertices of the result as colours
    must vg-encode fine.obj fine.obj -o two.vgs
    must vg-encode --reference coarse.obj coarse.obj coarse.obj -o raised.vgs
    must vg-diff --surface --frames --heat heat.vgs two.vgs raised.vgs
    shows "Hausdorff" "p95: 95 %" "D: the diagonal"
    [ "$(grep -c 'coarse\|fine' <<<"$output")" = 2 ]
    py <<'END'
import read_stream
for f in read_stream.read_stream("heat.vgs").frames:
    assert all(abs(x - 0.25 / 8 ** 0.5) < 1e-12 for x in f.scalars[2]), f.scalars
END
    must_fail 1 vg-diff --surface -t 0.24m fine.obj coarse.obj
    says "max error 0.25 m" "0.24m"
    must vg-diff --surface -t 0.26m fine.obj coarse.obj
    must_fail 2 vg-diff --surface -c fine.obj coarse.obj
    grep '^v' fine.obj >points.obj
    must_fail 3 vg-diff --surface fine.obj points.obj
    says "no faces"
}

@test "a tolerance in D, in per cent of it, and as a length in the unit of the meshes" {
    mesh cube >a.obj
    mesh cube 0 0.0173 >b.obj # D is sqrt 3: 0.00999 D, 17.3 mm in metres
    for tolerance in 0.01 1e-2D 1% 17.4mm 1.74cm 0.0174m 0.69in; do must vg-diff -t "$tolerance" a.obj b.obj; done
    for tolerance in 0.0099 9.9e-3D 0.99% 17.2mm 1.72cm 0.0172m 0.67in; do
        must_fail 1 vg-diff -t "$tolerance" a.obj b.obj
        says "max error" "exceeds the tolerance"
    done
    must vg-diff -t 0.18mm --unit cm a.obj b.obj
    must_fail 1 vg-diff -t 0.17mm --unit cm a.obj b.obj
    says "0.0173 cm" "0.17mm"
    for wrong in '-t 1furlong' '-t mm' '-t -1mm' '-t 1e-3 --unit cm' '-t 1mm --unit D' '--unit m'; do
        # shellcheck disable=SC2086 # words
        must_fail 2 vg-diff $wrong a.obj b.obj
    done
}

@test "--quiet says nothing, whatever the answer; a report that is asked for is written" {
    mesh cube >a.obj
    mesh cube 0 0.1 >b.obj
    must vg-diff -q a.obj b.obj
    [ -z "$output" ]
    capture vg-diff -q -t 0 a.obj b.obj
    [ "$status" = 1 ] && [ -z "$output$stderr" ]
    mesh tetra >c.obj
    capture vg-diff -q a.obj c.obj
    [ "$status" = 1 ] && [ -z "$output$stderr" ]
    must vg-diff -q a.obj b.obj -o report
    grep -q rms report
    must vg-diff -q --json a.obj b.obj
    shows rms
    must_fail 4 vg-diff -q a.obj missing.obj
}
