#!/usr/bin/env bats
# examples/arkit.sh: the 52 shapes of the template onto another head.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

TEMPLATE=$ROOT/examples/arkit/head52.vgs.xz
LANDMARKS=$ROOT/examples/arkit/landmarks.txt

# write_head: head.obj, the face, eyeballs, gums and tongue of the template's person in metres, elsewhere, triangles, its vertices
# in the reverse order; points.txt, by name; kept.txt, the template's vertices in its order
write_head() {
    must vg-decode "$TEMPLATE" -o 'all-%04d.obj'
    mv all-0000.obj neutral.obj
    py "$LANDMARKS" <<'END'
import sys
points, faces = [], []
for line in open("neutral.obj"):
    if line.startswith("v "):
        points.append([float(x) for x in line.split()[1:]])
    elif line.startswith("f "):
        faces.append([int(x.split("/")[0]) - 1 for x in line.split()[1:]])
kept = [*range(6706), *range(14062, 17039), *range(21451, 22221), *range(23021, 23791)][::-1]
new = {v: i for i, v in enumerate(kept)}
with open("head.obj", "w") as out:
    for v in kept:
        x, y, z = points[v]
        out.write(f"v {0.01 * x + 0.3:.8f} {0.01 * y + 1.6:.8f} {0.01 * z - 0.1:.8f}\n")
    for n, face in enumerate(faces):
        if all(v in new for v in face):
            face = [new[v] + 1 for v in face]
            face = face[n % len(face):] + face[:n % len(face)]
            for k in range(1, len(face) - 1):
                out.write(f"f {face[0]} {face[k]} {face[k + 1]}\n")
with open("points.txt", "w") as out:
    for line in open(sys.argv[1]):
        if not line.startswith("#"):
            name, v = line.split()
            out.write(f"{name} {new[int(v)]}\n")
open("kept.txt", "w").write("\n".join(map(str, kept)))
END
}

@test "a head of the same person, other faces, other order: 52 names, the neutral exact, all of the motion on the right side" {
    write_head
    must vg-decode head.obj -o head.glb
    capture "$ROOT/examples/arkit.sh" head.glb points.txt -o head52.glb
    [ "$status" = 0 ] || fail "$stderr"
    must vg-encode head52.glb -o back.vgs
    must vg-decode -q back.vgs -o back.npy
    must vg-decode -q "$TEMPLATE" -o truth.npy
    py <<'END'
import array, ast, json, struct

def npy(path):
    data = open(path, "rb").read()
    head = struct.unpack("<H", data[8:10])[0]
    about = ast.literal_eval(data[10:10 + head].decode())
    values = array.array({"<f8": "d", "<f4": "f"}[about["descr"]])
    values.frombytes(data[10 + head:])
    return about["shape"], values

PAIRED = """eyeBlink eyeLookDown eyeLookIn eyeLookOut eyeLookUp eyeSquint eyeWide mouthSmile mouthFrown mouthDimple mouthStretch
mouthPress mouthLowerDown mouthUpperUp browDown browOuterUp cheekSquint noseSneer""".split()
ARKIT = {n + side for n in PAIRED for side in ("Left", "Right")} | set("""jawForward jawLeft jawRight jawOpen mouthClose mouthFunnel
mouthPucker mouthLeft mouthRight mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper browInnerUp cheekPuff tongueOut""".split())
assert len(ARKIT) == 52
glb = open("head52.glb", "rb").read()
asset = json.loads(glb[20:20 + struct.unpack("<I", glb[12:16])[0]])
mesh = asset["meshes"][0]
names = mesh["extras"]["targetNames"]
assert len(names) == 52 and set(names) == ARKIT, sorted(set(names) ^ ARKIT)
assert "animations" not in asset
kept = [int(x) for x in open("kept.txt")]
(frames, nv, _), got = npy("back.npy")
(count, all_nv, _), truth = npy("truth.npy")
assert (frames, nv, count) == (53, len(kept), 53)
at = lambda f, i, k: got[(f * nv + i) * 3 + k]
was = lambda f, i, k: 0.01 * truth[(f * all_nv + kept[i]) * 3 + k]
rest = [0.3, 1.6, -0.1]
worst = max(abs(at(0, i, k) - was(0, i, k) - rest[k]) for i in range(nv) for k in range(3))
assert worst < 2e-7, worst  # binary32 of 1.6
face = [i for i in range(nv) if kept[i] < 6706]
amplitudes = {}
for f, name in enumerate(names, 1):
    dots = squares = 0
    sides = [0, 0]
    for i in range(nv):
        for k in range(3):
            t = was(f, i, k) - was(0, i, k)
            g = at(f, i, k) - at(0, i, k)
            dots += t * g
            squares += t * t
            if kept[i] < 6706:
                sides[was(0, i, 0) > 0] += g * g
    amplitudes[name] = dots / squares
    if name.endswith("Left") and name not in ("jawLeft", "mouthLeft"):
        assert sides[1] > 3 * sides[0], (name, sides)
    if name.endswith("Right") and name not in ("jawRight", "mouthRight"):
        assert sides[0] > 3 * sides[1], (name, sides)
least = min(amplitudes, key=amplitudes.get)
mean = sum(amplitudes.values()) / 52
assert mean > 0.97 and amplitudes[least] > 0.9, (mean, least, amplitudes[least])
tip = kept.index(16757)
f = 1 + names.index("tongueOut")
assert at(f, tip, 2) - at(0, tip, 2) > 0.02, "the tongue does not come out"
# the left eye turns towards the nose: the front of the ball goes to smaller x
front = max((i for i in range(nv) if 21451 <= kept[i] < 22221), key=lambda i: at(0, i, 2))
f = 1 + names.index("eyeLookInLeft")
assert at(f, front, 0) - at(0, front, 0) < -0.003, at(f, front, 0) - at(0, front, 0)
END
}

@test "points: by name, by both vertices, and what is wrong with them" {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >tri.obj
    printf 'noseTip 0\n' >points.txt
    must_fail 3 "$ROOT/examples/arkit.sh" tri.obj points.txt -o out.glb
    says "'points.txt' line 1: no point of the template is called 'noseTip'"
    must_fail 4 "$ROOT/examples/arkit.sh" tri.obj none.txt -o out.glb
    says "cannot read 'none.txt'"
    printf 'eyeLeft1 7\r\nx 1225 99\n' >points.txt
    must_fail 3 "$ROOT/examples/arkit.sh" tri.obj points.txt -o out.glb
    says 'vg-register'
    [ ! -e out.glb ]
    capture "$ROOT/examples/arkit.sh" tri.obj
    [ "$status" = 2 ] || fail "status $status"
}
