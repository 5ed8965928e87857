# smooth.bats: vg-smooth: what each filter does to a sequence, how spans are said, what passes, and what is refused.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# noisy CLEAN SIZE: noisy.vgs: the sequence with white noise of SIZE D on every vertex; Gaussian, the same each time
noisy() {
    PYTHONPATH=$ROOT/examples python3 - "$1" "$2" <<'END'
import array, random, sys, read_stream
s = read_stream.read_stream(sys.argv[1])
r = s.reference
d = sum((max(r[k::3]) - min(r[k::3])) ** 2 for k in range(3)) ** 0.5
random.seed(7)
out = array.array("d")
for frame in s.frames: out.extend(x + random.gauss(0, float(sys.argv[2]) * d / 3 ** 0.5) for x in frame.values)
header = "{'descr': '<f8', 'fortran_order': False, 'shape': (%d, %d, 3), }" % (len(s.frames), len(r) // 3)
with open("noisy.npy", "wb") as file:
    header += " " * ((53 - len(header)) % 64) + "\n"
    file.write(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + out.tobytes())
END
    must vg-encode -q --mesh "$1" noisy.npy -o noisy.vgs
}

# error_of RESULT: mean vertex error against clean.vgs, in D
error_of() {
    vg-diff --json clean.vgs "$1" | python3 -c 'import json, sys; print(json.load(sys.stdin)["vertex_error"]["mean"]["D"])'
}

less() {
    python3 -c 'import sys; sys.exit(not float(sys.argv[1]) < float(sys.argv[2]) * float(sys.argv[3]))' "$@" ||
        fail "$1 is not below $2 * $3"
}

# A rank of 8 in regions of 100 vertices and 63 rows would leave 0.44 of the noise.
@test "together: of the noise of 21 frames nearly half goes, and hardly anything of the motion" {
    must vg-encode "$DATA/horse-run.tar.xz" -o clean.vgs
    noisy clean.vgs 1e-3
    must vg-smooth --filter together noisy.vgs -o calm.vgs
    less "$(error_of calm.vgs)" 0.6 "$(error_of noisy.vgs)"
    must vg-smooth --filter together clean.vgs -o same.vgs
    less "$(error_of same.vgs)" 0.1 "$(error_of noisy.vgs)"
    # frames in a file instead of memory are the same frames
    must vg-smooth --no-provenance --filter together --memory 1K -j 3 noisy.vgs -o filed.vgs
    must vg-smooth --no-provenance --filter together -j 1 noisy.vgs -o held.vgs
    must cmp filed.vgs held.vgs
}

@test "together: a walk loses two thirds of its noise, and feet that stand stay where they are" {
    [ -n "$VG_DATA" ] || skip "VG_DATA names no folder of animations"
    must vg-encode "$VG_DATA/human/walk-man.tar.gz" -o clean.vgs
    noisy clean.vgs 1e-3
    must vg-smooth --filter together noisy.vgs -o calm.vgs
    less "$(error_of calm.vgs)" 0.3333 "$(error_of noisy.vgs)"
    PYTHONPATH=$ROOT/examples must python3 - <<'END'
import read_stream
clean, noisy, calm = ([f.values for f in read_stream.read_stream(n + ".vgs").frames] for n in ("clean", "noisy", "calm"))
ground = min(min(f[1::3]) for f in clean)
def away(a, b, v): return [a[3 * v + k] - b[3 * v + k] for k in range(3)]
def length(x): return sum(c * c for c in x) ** 0.5
# vertices in the lowest 3 % of the body that move by less than 0.3 % of its height from one frame to the next
size = max(clean[0][1::3]) - ground
stand = [(i, v) for i in range(1, len(clean)) for v in range(len(clean[0]) // 3)
         if clean[i][3 * v + 1] - ground < 0.03 * size and length(away(clean[i], clean[i - 1], v)) < 0.003 * size]
assert len(stand) > 300, len(stand)
error = lambda x: sum(length(away(x[i], clean[i], v)) for i, v in stand) / len(stand)
shift = [sum(away(calm[i], clean[i], v)[k] for i, v in stand) / len(stand) for k in range(3)]
assert error(calm) < 0.5 * error(noisy), (error(calm), error(noisy))
assert length(shift) < 1e-4 * size, shift
END
}

@test "filters in time: a body that stands loses tremor, and names and times stay" {
    mkdir still
    for ((i = 10; i < 50; i++)); do cp "$DATA/horse.rest.obj" still/f$i.obj; done
    must vg-encode still -o clean.vgs
    noisy clean.vgs 1e-3
    for filter in lowpass polynomial robust; do
        must vg-smooth --filter $filter --frames 6 noisy.vgs -o calm.vgs
        less "$(error_of calm.vgs)" 0.75 "$(error_of noisy.vgs)"
    done
    must vg-smooth clean.vgs -o calm.vgs
    less "$(error_of calm.vgs)" 1 1e-12
    vg-info calm.vgs | grep -q "40: 'f10' to 'f49'" || fail "$(vg-info calm.vgs)"
}

# volume_of FILE: the least volume of a frame over that of the same frame of clean.vgs
volume_of() {
    PYTHONPATH=$ROOT/examples/python python3 - "$1" <<'END'
import sys, vgstream
def volumes(name):
    with vgstream.Reader(open(name, "rb")) as s:
        triangles = [(f[0], f[i], f[i + 1]) for f in s.faces for i in range(1, len(f) - 1)]
        return [sum(determinant(*(p[3 * v:3 * v + 3] for v in t)) for t in triangles) for p in (f.values for f in s)]
def determinant(a, b, c):
    return (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]))
print(min(a / b for a, b in zip(volumes(sys.argv[1]), volumes("clean.vgs"))))
END
}

@test "on vectors: limbs that swing keep their volume, and the error is smaller" {
    [ -n "$VG_DATA" ] || skip "VG_DATA names no folder of animations"
    must vg-encode --take 0-39 "$VG_DATA/human/walk-man.tar.gz" -o clean.vgs
    must vg-smooth --seconds 0.3 clean.vgs -o points.vgs
    must vg-smooth --on vectors --seconds 0.3 clean.vgs -o v.vgs
    must vg-solve -q v.vgs -o vectors.vgs
    less "$(volume_of points.vgs)" 0.9 1
    less 0.99 1 "$(volume_of vectors.vgs)"
    less "$(error_of vectors.vgs)" 0.7 "$(error_of points.vgs)"
    # noise goes from vectors too, those of a stream and those derived here; nothing depends on the number of threads
    noisy clean.vgs 1e-3
    must vg-smooth --no-provenance -j1 --on vectors noisy.vgs -o a.vgs
    must vg-encode --vectors noisy.vgs -o n.vgs
    vg-smooth --on vectors -j3 n.vgs | vg-solve -q -o b.vgs
    must vg-solve -q a.vgs -o calm.vgs
    less "$(error_of calm.vgs)" 0.9 "$(error_of noisy.vgs)"
    must vg-diff --tolerance 1e-12D calm.vgs b.vgs
    must vg-smooth --no-provenance -j3 --on vectors noisy.vgs -o c.vgs
    must cmp a.vgs c.vgs
}

@test "on vectors: names, times and anchors stay; one frame, no frame, and what is refused" {
    mkdir still
    for ((i = 10; i < 30; i++)); do cp "$DATA/horse.rest.obj" still/f$i.obj; done
    must vg-encode --anchor 5,17 --fps 30 still -o clean.vgs
    local filter
    for filter in lowpass polynomial robust; do
        must vg-smooth --on vectors --filter $filter --frames 3 clean.vgs -o v.vgs
        must vg-solve -q v.vgs -o calm.vgs
        less "$(error_of calm.vgs)" 1 1e-12
        vg-info v.vgs | grep -q "20: 'f10' to 'f29'" || fail "$(vg-info v.vgs)"
        vg-info v.vgs | grep -q "anchors *2" || fail "$(vg-info v.vgs)"
    done
    must vg-smooth --on vectors "$DATA/horse.rest.obj" -o one.vgs
    must vg-info --check one.vgs
    must vg-smooth --on vectors "$GOLDEN/empty-sequence.vgs" -o none.vgs
    must vg-info --check none.vgs
    must_fail 2 vg-smooth --on vectors --filter together clean.vgs -o out.vgs
    says "--filter together"
    must_fail 2 vg-smooth --on vectors clean.vgs -o out.glb
    says "vg-solve | vg-decode -o out.glb"
    must_fail 2 vg-smooth clean.vgs -o out.glb
    says "pipe it into 'vg-decode -o out.glb'"
}

@test "robust: one frame that is somewhere else has no influence" {
    mkdir walk
    for ((i = 10; i < 40; i++)); do mesh two 0 0.$i >walk/w$i.obj; done
    must vg-encode walk -o clean.vgs
    mesh two 0 9 >walk/w25.obj
    must vg-encode walk -o noisy.vgs
    must vg-smooth --filter robust --frames 4 noisy.vgs -o calm.vgs
    less "$(error_of calm.vgs)" 1 1e-6
    must vg-smooth --filter polynomial --frames 4 noisy.vgs -o calm.vgs
    less 1e-3 1 "$(error_of calm.vgs)"
}

@test "one frame, no frame, no vertices in faces" {
    mesh two 0 0 >one.obj
    must vg-encode one.obj -o clean.vgs
    must vg-smooth clean.vgs -o calm.vgs
    less "$(error_of calm.vgs)" 1 1e-12
    must vg-smooth "$GOLDEN/empty-sequence.vgs" -o calm.vgs
    must vg-smooth --filter together "$GOLDEN/empty-sequence.vgs" -o calm.vgs
    must vg-info --check calm.vgs
}

@test "what is refused" {
    poses cube 3
    must vg-encode pose*.obj -o p.vgs
    must vg-encode --vectors pose*.obj -o v.vgs
    must_fail 2 vg-smooth --seconds 0.1 --frames 3 p.vgs -o out.vgs
    must_fail 2 vg-smooth --filter together --frames 3 p.vgs -o out.vgs
    must_fail 2 vg-smooth --memory 1M p.vgs -o out.vgs
    must_fail 2 vg-smooth --frames 0.5 p.vgs -o out.vgs
    [[ $stderr = *'above 1 frame'* ]] || fail "$stderr"
    must_fail 2 vg-smooth --filter robust --frames 200 p.vgs -o out.vgs
    must_fail 3 vg-smooth v.vgs -o out.vgs
    must_fail 3 vg-smooth --filter together p.vgs -o out.vgs
    [[ $stderr = *'3 frames'* ]] || fail "$stderr"
    [ ! -e out.vgs ]
}
