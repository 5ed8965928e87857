# planar.bats: vg-solve --planar: faces come nearer to plane, the body stays where it is, and what is refused.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# judge PLAIN PLANAR MOVED FALL: mean and largest planarity error are no larger, the mean at most FALL of what it was, and
# vertices move by at most MOVED of D on average
judge() {
    vg-diff --json "$1" "$2" | must python3 -c '
import json, sys
r, moved, fall = json.load(sys.stdin), float(sys.argv[1]), float(sys.argv[2])
mean, most = ([r["planarity"][i][key] for i in ("truth", "result")] for key in ("mean", "max"))
assert mean[1] <= fall * mean[0] and most[1] <= most[0], (mean, most)
assert 0 < r["vertex_error"]["mean"]["D"] <= moved, r["vertex_error"]["mean"]' "$3" "$4"
}

# roof: a quad that is bent across its diagonal by h = 0.75, its corners at distance 1 from the middle
roof() {
    printf 'v 1 0 0.75\nv 0 1 -0.75\nv -1 0 0.75\nv 0 -1 -0.75\nf 1 2 3 4\n'
}

@test "one quad: its bend shrinks to w1 / (w1 + w2)" {
    roof >roof.obj
    for weights in 0.5,1 0.05,1 1,3 2,0; do
        must bash -c "vg-encode --vectors roof.obj | vg-solve --fit squares --weights uniform --planar --planar-weights $weights -o r.vgs"
        vg-decode --f64 r.vgs -o r.obj
        must python3 - "$weights" <<'END'
import sys
w1, w2 = map(float, sys.argv[1].split(","))
for line, x, y, z in zip(open("r.obj"), (1, 0, -1, 0), (0, 1, 0, -1), (1, -1, 1, -1)):
    p = list(map(float, line.split()[1:]))
    assert max(abs(a - b) for a, b in zip(p, (x, y, 0.75 * z * w1 / (w1 + w2)))) < 1e-10, p
END
    done
    vg-encode --vectors roof.obj -o v.vgs
    must vg-solve --no-provenance --planar v.vgs -o default.vgs
    must vg-solve --no-provenance --planar --planar-weights 0.5,1 v.vgs -o given.vgs
    same_file default.vgs given.vgs
}

@test "a transferred body and a walking animal" {
    vg-encode "$DATA/human-man-poses.tar.xz" | vg-deform --onto "$DATA/human-heavy-poses.tar.xz" -o body.vgs
    vg-encode --reference "$DATA/trex.rest.obj" "$DATA/trex-walk.tar.xz" -o walk.vgs
    LC_ALL=C awk '$1 == "v" {printf "v %.6f %.6f %.6f\n", 0.8 * $2, 1.3 * $3, $4 + 0.2 * $3; next} 1' "$DATA/trex.rest.obj" >other.obj
    must vg-deform --onto other.obj walk.vgs -o animal.vgs
    for name in body animal walk; do
        must vg-solve $name.vgs -o plain.vgs
        must vg-solve --planar $name.vgs -o planar.vgs
        judge plain.vgs planar.vgs 0.002 0.9
        must vg-solve --weights area $name.vgs -o plain.vgs
        must vg-solve --weights area --planar $name.vgs -o planar.vgs
        judge plain.vgs planar.vgs 0.002 0.95
    done
}

@test "triangles and line segments: the plain result to the bit" {
    mesh tetra >tetra.obj
    mesh tetra 1 >turned.obj
    vg-encode tetra.obj turned.obj | vg-deform --onto tetra.obj -o v.vgs
    must vg-solve --no-provenance v.vgs -o plain.vgs
    must vg-solve --no-provenance --planar v.vgs -o planar.vgs
    same_file plain.vgs planar.vgs
    must vg-solve --no-provenance --planar "$CORPUS/accept/line-segments-only.vgs" -o planar.vgs
}

@test "components, links and anchors; the same bytes with any number of threads" {
    local i
    for i in 0 1 2 3 4 5 6 7 8 9; do mesh two "1.$i" "$i" >"p$i.obj"; done
    mesh two >rest.obj
    vg-encode --vectors --anchor 2,9 p?.obj -o anchored.vgs
    vg-encode --vectors p?.obj -o free.vgs
    for name in anchored free; do
        vg-deform --onto rest.obj $name.vgs -o v.vgs
        must vg-solve --no-provenance v.vgs -o plain.vgs
        for j in 1 2 3; do must vg-solve --no-provenance --planar -j $j v.vgs -o planar$j.vgs; done
        same_file planar1.vgs planar2.vgs
        same_file planar1.vgs planar3.vgs
        judge plain.vgs planar1.vgs 0.05 0.9
        py plain.vgs planar1.vgs $name <<'END'
import sys, read_stream
plain, planar = (read_stream.read_stream(name) for name in sys.argv[1:3])
for a, b in zip(plain.frames, planar.frames, strict=True):
    for v in (2, 9) if sys.argv[3] == "anchored" else ():
        assert a.values[3*v:3*v+3] == b.values[3*v:3*v+3]
    for k in range(3):
        if sys.argv[3] == "free": assert abs(sum(a.values[k::3]) - sum(b.values[k::3])) < 1e-12
END
    done
}

@test "--verbose says how it went; a pose that does not converge is named and the stream gets no end" {
    vg-encode --vectors "$DATA/horse-run.tar.xz" -o v.vgs
    vg-solve -v --planar v.vgs -o r.vgs 2>said
    grep -q '^vg-solve: 301 faces of four and more, at most [1-9][0-9]* steps to planarity, residual at most [0-9.]*e-1[1-9]$' said ||
        fail "$(cat said)"
    must_fail 1 bash -c 'vg-solve --planar --planar-weights 1e-13,1 v.vgs >r.vgs'
    one_line
    says "is not planar yet after 1000 steps: choose --planar-weights that are less far apart"
    must_fail 3 vg-info --check r.vgs
}

@test "usage" {
    roof >roof.obj
    vg-encode --vectors roof.obj -o v.vgs
    for weights in '' 1 '1,' ,1 1,2,3 0,1 -1,1 1,-1 a,b inf,1; do
        must_fail 2 vg-solve --planar --planar-weights "$weights" v.vgs -o r.vgs
    done
    must_fail 2 vg-solve --planar-weights 1,1 v.vgs -o r.vgs
    says '--planar-weights needs --planar'
}
