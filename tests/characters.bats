#!/usr/bin/env bats
# characters.bats: what becomes of characters in glTF: whole numbers, the report of the file, and every sample that is at hand,
# with three.js as the judge.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib

make_in() {
    py <<'END'
import make_character
make_character.main("in.glb")
END
}

@test "whole numbers: Python decodes them as the extension says, and the error is the one that is said" {
    must vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o run.vgs
    must vg-decode run.vgs -o whole.glb
    must_warn vg-decode -v --quantize run.vgs -o small.glb
    says "'small.glb' has $(stat -c %s small.glb) bytes, 21 morph targets for 21 frames; no vertex is off by more than"
    printf '%s\n' "$stderr" >said
    must vg-decode -q --f64 --no-mesh run.vgs -o run.npy
    must vg-decode -q "$DATA/horse.rest.obj" --f64 --no-mesh -o rest.npy
    [ "$(stat -c %s small.glb)" -lt $(($(stat -c %s whole.glb) * 7 / 10)) ]
    py <<'END'
import json, math, re, struct
data = open("small.glb", "rb").read()
n = struct.unpack("<I", data[12:16])[0]
g, binary = json.loads(data[20:20 + n]), data[28 + n:]
assert g["extensionsRequired"] == g["extensionsUsed"] == ["KHR_mesh_quantization"]
types = {5120: ("3b", 127, 4), 5122: ("<3h", 32767, 8)}
def values(number):
    a = g["accessors"][number]
    assert a["normalized"] and "sparse" not in a
    kind, most, stride = types[a["componentType"]]
    view = g["bufferViews"][a["bufferView"]]
    assert view["byteStride"] == stride and a["byteOffset"] % 4 == 0
    off = view["byteOffset"] + a["byteOffset"]
    whole = [struct.unpack_from(kind, binary, off + stride * i) for i in range(a["count"])]
    assert [min(c) for c in zip(*whole)] == a["min"] and [max(c) for c in zip(*whole)] == a["max"]
    return [[x / most for x in p] for p in whole]
def array(name):
    b = open(name, "rb").read()
    start = 10 + struct.unpack_from("<H", b, 8)[0]
    x = struct.unpack("<%dd" % ((len(b) - start) // 8), b[start:])
    return [x[i:i + 3] for i in range(0, len(x), 3)]
node, primitive = g["nodes"][0], g["meshes"][0]["primitives"][0]
nv = g["meshes"][0]["extras"]["vg_vertices"][0]
reference, poses = array("rest.npy"), array("run.npy")
assert len(reference) == nv and len(poses) == 21 * nv
D = math.dist([min(c) for c in zip(*reference)], [max(c) for c in zip(*reference)])
assert g["accessors"][primitive["attributes"]["POSITION"]]["componentType"] == 5122
base = values(primitive["attributes"]["POSITION"])
def off(d, truth):
    return max(math.dist([o + s * (x + y) for o, s, x, y in zip(node["translation"], node["scale"], b, c)], t)
               for b, c, t in zip(base, d, truth))
worst = off([[0, 0, 0]] * nv, reference)
for i, target in enumerate(primitive["targets"]):
    worst = max(worst, off(values(target["POSITION"]), poses[i * nv:][:nv]))
said = float(re.search(r"off by more than ([0-9.e-]+) % of D", open("said").read()).group(1)) / 100
assert 0.9 * said < worst / D < 1.06 * said and said < 1e-4, (worst / D, said)
assert g["accessors"][primitive["attributes"]["NORMAL"]]["componentType"] == 5120
assert all(abs(math.hypot(*x) - 1) < 0.02 for x in values(primitive["attributes"]["NORMAL"]))
END
    pipe 'vg-encode small.glb | vg-diff -t 1e-4 run.vgs -'
    must_warn vg-decode --quantize --shapes run.vgs -o shapes.gltf
    pipe 'vg-encode --shapes shapes.gltf | vg-info -'
}

@test "whole numbers of a character: nodes, skin and normals; the same in three.js to 1e-4 D" {
    make_in
    must vg-decode in.glb -o exact.glb
    must_warn vg-decode --quantize in.glb -o small.glb
    says "no vertex is off by more than"
    must vg-encode in.glb -o in.vgs
    pipe 'vg-encode small.glb | vg-diff -t 1e-4 in.vgs -'
    must_warn vg-decode --quantize small.glb -o again.glb
    pipe 'vg-encode again.glb | vg-diff -t 2e-4 in.vgs -'
    command -v node >/dev/null || return 0
    if node -e 'require("three")' 2>/dev/null; then
        must node "$ROOT/tests/node/characters.mjs" in.glb small.glb '*'
        printf '%s\n' "$output" >small.json
        py <<'END'
import json
r = json.load(open("small.json"))
assert r["vertices"] == 72 and r["frames"] > 1 and r["moved"] > 0.3, r
assert 0 < r["rest"] < 1e-4 and 0 < r["position"] < 1e-4 and r["uv"] == 0 and r["normal"] < 0.7 and r["turned"] < 1, r
assert r["materials"], r
END
    fi
    node -e 'require("gltf-validator")' 2>/dev/null || return 0
    node -e 'require("gltf-validator").validateBytes(new Uint8Array(require("fs").readFileSync("small.glb"))).then(r =>
        console.log(r.issues.numErrors, r.issues.numWarnings))' >counts
    [ "$(cat counts)" = "0 0" ]
}

# Wave turns a joint, Nod moves a node, and Look turns only the camera; Ball has a sparse shape "wide" and a plain one "tall" with
# normals and tangents, and a default weight for each. kept FILE ANIMATION...: FILE has what in.glb has, with these animations.
make_rich() {
    cat >rich.py <<'END'
import json, struct, sys
import make_character
def make():
    m, d = make_character.character()
    turns = m.add([[0, 0, 0, 1], [0, 0.6, 0, 0.8]])
    d["animations"].append({"name": "Look", "channels": [{"sampler": 0, "target": {"node": 5, "path": "rotation"}}],
                            "samplers": [{"input": m.add([0.0, 1.0], bounds=True), "output": turns}]})
    ball = d["meshes"][1]
    ball["weights"], ball["extras"] = [0.25, 0.5], {"targetNames": ["wide", "tall"], "note": "kept"}
    primitive = ball["primitives"][0]
    which = m.view(struct.pack("<2H", 3, 20))
    values = m.view(struct.pack("<6f", 1, 0, 0, 0.5, 0, 0))
    m.accessors.append({"componentType": 5126, "count": 24, "type": "VEC3", "min": [0, 0, 0], "max": [1, 0, 0], "sparse":
        {"count": 2, "indices": {"bufferView": which, "componentType": 5123}, "values": {"bufferView": values}}})
    wide = len(m.accessors) - 1
    tall = m.add([[0, i / 24, 0] for i in range(24)], target=34962, bounds=True)
    turned = m.add([[0, 0, i / 100] for i in range(24)], target=34962)
    primitive["attributes"]["TANGENT"] = m.add([[1, 0, 0, 1]] * 24, target=34962)
    primitive["targets"] = [{"POSITION": wide}, {"POSITION": tall, "NORMAL": turned, "TANGENT": turned}]
    d["buffers"][0]["byteLength"] = len(m.data)
    open("in.glb", "wb").write(make_character.glb(d, m.data))
def load(name):
    b = open(name, "rb").read()
    n, = struct.unpack("<I", b[12:16])
    return json.loads(b[20:20 + n]), b[28 + n:]
def read(g, data, i):
    a = dict(g["accessors"][i])
    size = {5121: 1, 5123: 2, 5126: 4}[a["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[a["type"]]
    def bytes_of(view, offset, n, element):
        v = g["bufferViews"][view]
        at, step = v.get("byteOffset", 0) + offset, v.get("byteStride", element)
        return [data[at + k * step:][:element] for k in range(n)]
    if "bufferView" in a: a["bufferView"] = bytes_of(a["bufferView"], a.pop("byteOffset", 0), a["count"], size * width)
    if "sparse" in a:
        n = a["sparse"]["count"]
        a["sparse"] = [bytes_of(s["bufferView"], s.get("byteOffset", 0), n, e) for s, e in
                       ((a["sparse"]["indices"], 2), (a["sparse"]["values"], size * width))]
    return a
def whole(name, animations=None):
    g, data = load(name)
    for m in g["meshes"]:
        for p in m["primitives"]:
            p["indices"] = read(g, data, p["indices"])
            for some in p["attributes"], *p.get("targets", []):
                for k in some: some[k] = read(g, data, some[k])
    for k in g["skins"]: k["inverseBindMatrices"] = read(g, data, k["inverseBindMatrices"])
    for image in g["images"]:
        v = g["bufferViews"][image["bufferView"]]
        image["bufferView"] = data[v["byteOffset"]:][:v["byteLength"]]
    if animations is not None: g["animations"] = [a for a in g["animations"] if a["name"] in animations]
    if not g.get("animations"): g.pop("animations", None)
    for a in g.get("animations", []):
        for s in a["samplers"]: s["input"], s["output"] = read(g, data, s["input"]), read(g, data, s["output"])
    for key in "accessors", "bufferViews", "buffers": del g[key]
    del g["asset"]["generator"]
    return g
if __name__ == "__main__":
    if len(sys.argv) == 1: make()
    else: assert whole(sys.argv[1]) == whole("in.glb", sys.argv[2:]), whole(sys.argv[1])
END
    PYTHONPATH="$ROOT/tests" python3 rich.py
}
kept() { PYTHONPATH="$ROOT/tests" must python3 rich.py "$@"; }
is_mixed() { PYTHONPATH="$ROOT/tests" must python3 -c 'import rich, sys
assert all(c["target"]["path"] == "weights" for a in rich.load(sys.argv[1])[0]["animations"] if a["name"] != "Look" for c in a["channels"])' "$1"; }

@test "what is not edited comes out as it was: skin, animations, shapes with tangents, default weights, sparse accessors" {
    make_rich
    must vg-encode in.glb -o all.vgs
    must vg-decode all.vgs -o out.glb
    kept out.glb Wave Nod Look
    must vg-decode in.glb -o out.gltf
    must vg-decode out.gltf -o out.glb
    kept out.glb Wave Nod Look
    pipe 'vg-encode --animation Wave in.glb | vg-decode -o out.glb'
    kept out.glb Wave
    pipe 'vg-encode --animation Nod in.glb | vg-decode --name Nod -o out.glb'
    kept out.glb Nod
    pipe 'vg-encode --shapes in.glb | vg-decode -o out.glb'
    kept out.glb
    must_warn vg-decode -v in.glb -o out.glb
    says "what moves is as it was in the GLB that was read"
    # The pose at rest is what a player shows: shapes with their default weights.
    must vg-decode --max-targets 1000 all.vgs -o mixed.glb
    is_mixed mixed.glb
    PYTHONPATH="$ROOT/tests" py <<'END'
import rich
look = [[a for a in rich.whole(name)["animations"] if a["name"] == "Look"] for name in ("in.glb", "mixed.glb")]
assert look[0] == look[1] and len(look[0]) == 1, look
END
    pipe 'vg-encode mixed.glb | vg-diff -t 1e-6 all.vgs -'
    PYTHONPATH="$ROOT/tests" py <<'END'
import rich, struct
g, data = rich.load("in.glb")
h, out = rich.load("mixed.glb")
def points(g, data, i): return [struct.unpack("<3f", p) for p in rich.read(g, data, i)["bufferView"]]
before, after = (points(d, b, d["meshes"][1]["primitives"][0]["attributes"]["POSITION"]) for d, b in ((g, data), (h, out)))
for i, (p, q) in enumerate(zip(before, after)):
    shown = [p[0] + 0.25 * {3: 1, 20: 0.5}.get(i, 0), p[1] + 0.5 * i / 24, p[2]]
    assert max(abs(a - b) for a, b in zip(shown, q)) < 1e-6, (i, shown, q)
assert not any(h["meshes"][1]["weights"])
END
}

@test "whole numbers of a character that is not edited: skin and animations stay, and meshes with shapes are as they were" {
    make_rich
    must vg-encode in.glb -o all.vgs
    must_warn vg-decode --quantize all.vgs -o small.glb
    says "what moves is as it was in the GLB that was read; no vertex is off by more than"
    pipe 'vg-encode small.glb | vg-diff -t 1e-4 all.vgs -'
    PYTHONPATH="$ROOT/tests" py <<'END'
import rich
g, h = rich.load("in.glb")[0], rich.load("small.glb")[0]
def aims(d): return [(a["name"], [(d["nodes"][c["target"]["node"]]["name"], c["target"]["path"]) for c in a["channels"]]) for a in d["animations"]]
assert aims(g) == aims(h), aims(h)
kind = [h["accessors"][m["primitives"][0]["attributes"]["POSITION"]]["componentType"] for m in h["meshes"]]
assert kind == [5122, 5126] and h["extensionsRequired"] == ["KHR_mesh_quantization"], kind
assert h["meshes"][1]["weights"] == [0.25, 0.5] and len(h["meshes"][1]["primitives"][0]["targets"]) == 2
END
    # A node with a rigid mesh is below another one then, which its animation moves.
    make_in
    must_warn vg-decode --quantize in.glb -o small.glb
    pipe 'vg-encode --animation Nod in.glb -o nod.vgs; vg-encode --animation Nod small.glb | vg-diff -t 1e-4 nod.vgs -'
    PYTHONPATH="$ROOT/tests" py <<'END'
import rich
h = rich.load("small.glb")[0]
target = h["animations"][1]["channels"][0]["target"]
assert target["path"] == "translation" and "mesh" not in h["nodes"][target["node"]] and target["node"] != 4, target
END
}

# The upper cube turns a quarter about z: a tangent (x, y, z) becomes (-y, x, z). Of a material without a normal map none is written.
@test "morph targets have tangents where a material has a normal map" {
    make_rich
    py <<'END'
import make_character
m, d = make_character.character()
d["materials"][1]["normalTexture"] = {"index": 0}
along = m.add([[0.6, 0.8, 0, 1]] * 24, target=34962)
for p in d["meshes"][0]["primitives"]: p["attributes"]["TANGENT"] = along
d["buffers"][0]["byteLength"] = len(m.data)
open("mapped.glb", "wb").write(make_character.glb(d, m.data))
END
    must vg-encode --animation Wave mapped.glb -o wave.vgs
    must vg-decode --max-targets 9 wave.vgs -o out.glb
    must vg-encode --fps 60 --animation Wave mapped.glb -o many.vgs
    must vg-decode -q --morph-tolerance 1e-6 many.vgs -o mixed.glb
    PYTHONPATH="$ROOT/tests" py <<'END'
import rich, struct
def points(g, data, i):
    a = rich.read(g, data, i)
    rows = [struct.unpack("<3f", p) for p in a.get("bufferView", [bytes(12)] * a["count"])]
    for at, p in zip(*a.get("sparse", ([], []))): rows[struct.unpack("<H", at)[0]] = struct.unpack("<3f", p)
    return rows
g, data = rich.load("out.glb")
lower, upper = g["meshes"][0]["primitives"]
assert all("TANGENT" not in t for t in lower["targets"]) and "TANGENT" in lower["attributes"]
moved = points(g, data, upper["targets"][1]["TANGENT"])
assert all(max(abs(a - b) for a, b in zip(d, (-0.8 - 0.6, 0.6 - 0.8, 0))) < 1e-6 for d in moved), moved
g, data = rich.load("mixed.glb")
targets = [points(g, data, t["TANGENT"]) for t in g["meshes"][0]["primitives"][1]["targets"]]
values = rich.read(g, data, g["animations"][0]["samplers"][0]["output"])["bufferView"]
weights = [w for w, in struct.iter_unpack("<f", b"".join(values))][15 * len(targets):][:len(targets)]  # the quarter, at 0.25 s
mixed = [[sum(w * t[v][k] for w, t in zip(weights, targets)) for k in range(3)] for v in range(24)]
assert all(max(abs(a - b) for a, b in zip(d, (-1.4, -0.2, 0))) < 1e-3 for d in mixed), mixed
END
}

@test "shapes that are edited keep their default weights; an animation without a name keeps none until it is edited" {
    make_rich
    must vg-encode --shapes --scale 2 in.glb -o shapes.vgs
    must vg-decode shapes.vgs -o out.glb
    py <<'END'
import json, struct
b = open("in.glb", "rb").read()
n, = struct.unpack("<I", b[12:16])
g = json.loads(b[20:20 + n])
g["animations"] = [{k: v for k, v in a.items() if k != "name"} for a in g["animations"][:1]]
text = json.dumps(g).encode()
text += bytes(b" " * (-len(text) % 4))
whole = struct.pack("<I", len(text)) + b"JSON" + text + b[20 + n:]
open("unnamed.glb", "wb").write(b"glTF" + struct.pack("<II", 2, 12 + len(whole)) + whole)
END
    pipe 'vg-encode unnamed.glb | vg-decode -o same.glb'
    pipe 'vg-encode --scale 2 unnamed.glb | vg-decode -o edited.glb'
    PYTHONPATH="$ROOT/tests" py <<'END'
import rich
meshes = rich.load("out.glb")[0]["meshes"]
assert [m["weights"] for m in meshes] == [[0, 0], [0.25, 0.5]], meshes
assert meshes[1]["extras"]["targetNames"] == ["wide", "tall"] and meshes[1]["extras"]["note"] == "kept"
assert [a.get("name") for a in rich.load("same.glb")[0]["animations"]] == [None]
assert [a.get("name") for a in rich.load("edited.glb")[0]["animations"]] == ["unnamed"]
END
}

# Normals that say otherwise than the angle between faces: a cube that is smooth, a strip that is sharp where it bends by 20
# degrees, though its groups say that it is smooth, and a cube with the normals of its faces, which needs no group.
@test "normals of an OBJ say where it is sharp: in GLB and, as smoothing groups, in OBJ" {
    py <<'END'
import math
cube = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
sides = [(0, 0, -1), (0, 0, 1), (0, -1, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0)]
def write(name, points, normals, corners, head=""):
    with open(name, "w") as f:
        for p in points: f.write("v %g %g %g\n" % p)
        for n in normals: f.write("vn %.4f %.4f %.4f\n" % n)
        f.write(head)
        for face, of in corners: f.write("f " + " ".join(f"{v + 1}//{n + 1}" for v, n in zip(face, of)) + "\n")
write("flat.obj", cube, sides, [(f, [i] * 4) for i, f in enumerate(faces)])
write("smooth.obj", cube, [tuple((2 * c - 1) / 3 ** 0.5 for c in p) for p in cube], [(f, f) for f in faces], "o Cube\n")
a = math.radians(20)
xz = [(0, 0), (1, 0), (1 + math.cos(a), math.sin(a)), (2 + math.cos(a), math.sin(a))]
write("strip.obj", [(x, y, z) for y in (0, 1) for x, z in xz], [(0, 0, 1), (-math.sin(a), 0, math.cos(a))],
      [((i, i + 1, i + 5, i + 4), [n] * 4) for i, n in ((0, 0), (1, 1), (2, 0))], "s 1\nusemtl Steel\n")
write("bad.obj", cube, sides[:3], [(f, [i] * 4) for i, f in enumerate(faces)])
END
    local name
    for name in flat smooth strip bad; do
        must vg-decode -q $name.obj -o $name.out.obj
        must vg-decode -q $name.obj -o $name.glb
    done
    [ "$(cat flat.out.obj bad.out.obj | grep -c '^s')" = 0 ]
    [ "$(grep -v '^[vf]' smooth.out.obj)" = "$(printf 'o Cube\ns 1')" ]
    [ "$(grep -v '^[vf]' strip.out.obj)" = "$(printf 'usemtl Steel\ns off')" ]
    must vg-decode -q strip.out.obj -o again.obj
    must cmp strip.out.obj again.obj
    py <<'END'
import json, math, struct
def normals(name):
    b = open(name, "rb").read()
    n, = struct.unpack("<I", b[12:16])
    g, data, found = json.loads(b[20:20 + n]), b[28 + n:], set()
    a = g["accessors"][g["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]]
    v = g["bufferViews"][a["bufferView"]]
    for k in range(a["count"]):
        x = struct.unpack_from("<3f", data, v["byteOffset"] + a.get("byteOffset", 0) + k * v.get("byteStride", 12))
        found.add(tuple(round(c, 3) + 0.0 for c in x))
    return a["count"], found
assert normals("flat.glb")[0] == 24 and normals("bad.glb")[0] == 24
count, found = normals("smooth.glb")
assert count == 8 and all(max(abs(abs(c) - 3 ** -0.5) for c in n) < 1e-3 for n in found), found
assert normals("strip.glb") == (12, {(0, 0, 1), (-0.342, 0, 0.94)}), normals("strip.glb")
END
}

@test "what is edited, cut, renamed or asked for is written as morph targets" {
    make_rich
    must vg-encode --animation Wave in.glb -o wave.vgs
    local cut
    for cut in 0,1 1,2 0-/2; do
        pipe "vg-encode --animation Wave --take $cut in.glb | vg-decode -o out.glb"
        is_mixed out.glb
    done
    for how in '--morph-tolerance 1e-6' '--max-targets 9' '--fps 9'; do
        # shellcheck disable=SC2086 # options
        must vg-decode -q $how wave.vgs -o out.glb
        is_mixed out.glb
    done
    pipe 'vg-encode --fps 60 in.glb | vg-decode -o out.glb'
    is_mixed out.glb
    pipe 'vg-encode out.glb | vg-info -'
    shows "animation  'Wave': 46 frames, 0 s to 0.75 s" "animation  'Nod': 31 frames, 0 s to 0.5 s"
    pipe 'vg-encode in.glb | vg-decode -q --name Both -o out.glb'
    is_mixed out.glb
    pipe 'vg-encode --scale 1.00001 --animation Wave in.glb | vg-decode -o out.glb'
    is_mixed out.glb
}

# A skinned mesh below a moved node, and the other one with joints but without a skin: the validator warns of both.
@test "what others warn of is mended: a skinned mesh below a node, joints without a skin; nothing unused stays" {
    py <<'END'
import make_character
m, d = make_character.character()
d["nodes"][3]["translation"] = [9, 9, 9]
d["nodes"].append({"name": "Frame", "scale": [2, 2, 2], "children": [3]})
d["scenes"][0]["nodes"] = [0, 6, 4]
free = d["meshes"][1]["primitives"][0]["attributes"]
for key in "JOINTS_0", "WEIGHTS_0":
    free[key] = d["meshes"][0]["primitives"][0]["attributes"][key]
open("warned.glb", "wb").write(make_character.glb(d, m.data))
END
    make_in
    must vg-encode in.glb -o in.vgs
    pipe 'vg-encode warned.glb | vg-diff -t 1e-7 in.vgs -'
    must vg-decode --max-targets 1000 warned.glb -o out.glb
    pipe 'vg-encode out.glb | vg-diff -t 1e-6 in.vgs -'
    must vg-decode -q --quantize warned.glb -o small.glb
    py <<'END'
import json, struct
for name in "out.glb", "small.glb":
    b = open(name, "rb").read()
    n, = struct.unpack("<I", b[12:16])
    g = json.loads(b[20:20 + n])
    assert g["nodes"][3]["name"] == "Body" and "translation" not in g["nodes"][3] and "children" not in g["nodes"][6]
    assert g["scenes"][0]["nodes"] == [0, 6, 3, 4 if name == "out.glb" else 7], g["scenes"]
    assert "JOINTS_0" in g["meshes"][0]["primitives"][0]["attributes"]
    assert "JOINTS_0" not in g["meshes"][1]["primitives"][0]["attributes"]
    used = [i for m in g["meshes"] for p in m["primitives"] for i in [*p["attributes"].values(), p["indices"],
            *(x for t in p.get("targets", []) for x in t.values())]]
    used += [s[k] for a in g["animations"] for s in a["samplers"] for k in ("input", "output")]
    used += [s["inverseBindMatrices"] for s in g["skins"]]
    assert set(used) == set(range(len(g["accessors"]))), name
    views = [v[k]["bufferView"] for a in g["accessors"] if "sparse" in a for v in [a["sparse"]] for k in ("indices", "values")]
    views += [a["bufferView"] for a in g["accessors"] if "bufferView" in a] + [i["bufferView"] for i in g["images"]]
    assert set(views) == set(range(len(g["bufferViews"]))), name
END
    command -v node >/dev/null && node -e 'require("gltf-validator")' 2>/dev/null || return 0
    for file in out small; do
        node -e 'require("gltf-validator").validateBytes(new Uint8Array(require("fs").readFileSync(process.argv[1]))).then(r =>
            console.log(r.issues.numErrors, r.issues.numWarnings))' $file.glb >counts
        [ "$(cat counts)" = "0 0" ]
    done
}

@test "the file's size and error are said when frames are mixed, and with -v" {
    must vg-decode "$DATA/horse-run.tar.xz" -o run.glb
    must_warn vg-decode -v "$DATA/horse-run.tar.xz" -o run.glb
    says "'run.glb' has $(stat -c %s run.glb) bytes, 21 morph targets for 21 frames, positions as they are in binary32"
    must_warn vg-decode --morph-tolerance 0.01 "$DATA/horse-run.tar.xz" -o run.glb
    says "'run.glb' has $(stat -c %s run.glb) bytes"
    says "no vertex is off by more than"
    must vg-decode -q --morph-tolerance 0.01 "$DATA/horse-run.tar.xz" -o run.glb
    must_fail 2 vg-decode --quantize "$DATA/horse-run.tar.xz" -o run.pc2
    says "--quantize is for GLB and glTF"
}

# Three models of Blender: a bent column with an armature of three bones, two actions, a texture and a hard edge; a ball with shape
# keys, one of them set, and an action of them; a clock whose hands turn below a mirrored, unevenly scaled node.
make_blender_models() {
    cat >models.py <<'END'
import math
import bpy

def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)

def save(name):
    bpy.ops.export_scene.gltf(filepath=name + ".glb", export_format="GLB", export_tangents=True, export_animations=True)

def material(thing, name, colour, picture=False):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    shader = m.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    if picture:
        image = bpy.data.images.new("chequer", 8, 8)
        image.pixels = [c for i in range(64) for c in ((1, .5, 0, 1) if (i + i // 8) % 2 else (0, .2, .6, 1))]
        image.pack()
        node = m.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        m.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    thing.data.materials.append(m)

def keep(owner, name, path_keys):
    action = bpy.data.actions.new(name)
    for path, index, keys in path_keys:
        curve = action.fcurves.new(path, index=index)
        for frame, value in keys: curve.keyframe_points.insert(frame, value)
    owner.animation_data_create()
    strip = owner.animation_data.nla_tracks.new()
    strip.name = name
    strip.strips.new(name, 1, action)

clear()
bpy.ops.mesh.primitive_cylinder_add(vertices=12, depth=4, location=(0, 0, 2))
column = bpy.context.object
column.name = "Column"
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.subdivide(number_cuts=5)
bpy.ops.object.mode_set(mode="OBJECT")
bpy.ops.object.shade_smooth()
column.data.use_auto_smooth = True
material(column, "Paint", (1, 1, 1), True)
bpy.ops.object.armature_add(location=(0, 0, 0))
rig = bpy.context.object
rig.name = "Rig"
bpy.ops.object.mode_set(mode="EDIT")
bones = rig.data.edit_bones
bones[0].tail = (0, 0, 1.5)
for k in 1, 2:
    b = bones.new(f"Bone{k}")
    b.head, b.tail, b.parent = bones[k - 1].tail, (0, 0, 1.5 + 1.25 * k), bones[k - 1]
bpy.ops.object.mode_set(mode="OBJECT")
column.select_set(True)
bpy.context.view_layer.objects.active = rig
bpy.ops.object.parent_set(type="ARMATURE_AUTO")
for b in rig.pose.bones: b.rotation_mode = "QUATERNION"
def turn(bone, axis, angle):
    path = f'pose.bones["{bone}"].rotation_quaternion'
    half = angle / 2
    return [(path, 0, [(1, 1), (12, math.cos(half)), (24, 1)]), (path, axis, [(1, 0), (12, math.sin(half)), (24, 0)])]
keep(rig, "Bend", turn("Bone1", 1, 0.9) + turn("Bone2", 1, 0.7))
keep(rig, "Twist", turn("Bone2", 2, 1.2))
save("column")

clear()
bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
ball = bpy.context.object
ball.name = "Ball"
bpy.ops.object.shade_smooth()
material(ball, "Skin", (.8, .4, .3))
for name, axis in ("Base", None), ("long", 2), ("wide", 0):
    key = ball.shape_key_add(name=name)
    for i, v in enumerate(ball.data.vertices):
        if axis is not None: key.data[i].co[axis] = 1.5 * v.co[axis] + .1
ball.data.shape_keys.key_blocks["wide"].value = .25
keep(ball.data.shape_keys, "Breathe", [('key_blocks["long"].value', 0, [(1, 0), (10, 1), (20, 0)])])
save("ball")

clear()
bpy.ops.object.empty_add()
stand = bpy.context.object
stand.name, stand.scale = "Stand", (-1, 2, .5)
for k, name in enumerate(("Face", "Hour", "Minute")):
    bpy.ops.mesh.primitive_cube_add(size=1 - .2 * k, location=(0, 0, k))
    part = bpy.context.object
    part.name, part.parent = name, stand
    material(part, name + "Paint", (k / 2, .5, 1 - k / 2))
    if k: keep(part, "Tick", [("rotation_euler", 2, [(1, 0), (24, k * 2.0)]), ("location", 0, [(1, 0), (24, .5)])])
save("clock")
END
    blender --background --factory-startup --python-exit-code 1 --python models.py >blender.log 2>&1 || fail "$(tail -n 20 blender.log)"
}

# same_again FILE: as it is and as vg writes it, it is the same to three.js, and valid.
same_again() {
    must vg-decode -q "$1" -o out.glb
    must node "$ROOT/tests/node/characters.mjs" "$1" out.glb '*'
    printf '%s\n' "$output" | tail -n 1 >>same
    must vg-decode -q --max-targets 100000 "$1" -o mixed.glb
    if [ "$(stat -c %s mixed.glb)" -lt 20000000 ]; then
        must node "$ROOT/tests/node/characters.mjs" "$1" mixed.glb '*'
        printf '%s\n' "$output" | tail -n 1 >>mixed
    fi
    node -e 'require("gltf-validator")' 2>/dev/null || return 0
    node -e 'const fs = require("fs"), v = require("gltf-validator");
        for (const f of process.argv.slice(1)) v.validateBytes(new Uint8Array(fs.readFileSync(f))).then(r =>
            console.log(f, r.issues.numErrors, r.issues.numWarnings))' out.glb mixed.glb >>counts
}

check_same() {
    py <<'END'
import json, os
for line in open("same"):
    r = json.loads(line)
    assert r["uv"] == 0 and r["normal"] < 0.1 and r.get("turned", 0) < 0.1 and r["materials"] and r["nodes"] and r["named"], r
    assert r["rest"] < 1e-6 and r.get("position", 0) < 1e-6, r
for line in open("mixed"):
    r = json.loads(line)
    assert r["uv"] == 0 and r["materials"] and r["rest"] < 1e-6 and r.get("position", 0) < 1e-6, r
if os.path.exists("counts"): assert all(line.split()[1:] == ["0", "0"] for line in open("counts")), open("counts").read()
END
}

# Samples are those of the packages that NODE_PATH names (such as @webxr-input-profiles/assets), and of the folder VG_SAMPLES.
@test "three.js sees in every sample of the installed packages what vg read, to 1e-6 D" {
    command -v node >/dev/null || skip "node is not installed"
    node -e 'require("three")' 2>/dev/null || skip "the node module three is not installed"
    make_rich
    # shellcheck disable=SC2086 # lists of folders
    find ${NODE_PATH//:/ } ${VG_SAMPLES:-} -name '*.gl[bt]*' -size -1500k 2>/dev/null | grep -E '\.(glb|gltf)$' | sort >samples
    printf '%s\n' "$PWD/in.glb" >>samples
    local file
    while read -r file; do
        case $file in *draco.glb) continue ;; esac # three.js has no decoder here
        same_again "$file"
    done <samples
    check_same
}

@test "models of Blender come back the same: skin and actions, shape keys, mirrored nodes; in three.js, and valid" {
    command -v node >/dev/null || skip "node is not installed"
    node -e 'require("three")' 2>/dev/null || skip "the node module three is not installed"
    command -v blender >/dev/null || skip "blender is not installed"
    make_blender_models
    local name
    for name in column ball clock; do same_again $name.glb; done
    check_same
    py <<'END'
import json
assert [json.loads(line)["moved"] > 0.05 for line in open("same")] == [True] * 3
END
    must vg-encode column.glb -o column.vgs
    pipe 'vg-info column.vgs'
    shows "animation  'Bend'" "animation  'Twist'"
}

@test "colours of vertices: PLY of all number types, OBJ, GLB; through filters; what has none names them" {
    cat >c.ply <<'END'
ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
property uchar alpha
element face 1
property list uchar int vertex_indices
end_header
0 0 0 255 0 7 255
1 0 0 0 1 2 128
1 1 0 3 60 200 255
0 1 0 nan 9 9 255
4 0 1 2 3
END
    must_warn vg-encode c.ply -o c.vgs
    says "1 channels of colours are out of their range"
    for format in ply-ascii ply ply-be obj glb gltf; do
        must vg-decode --format $format c.vgs -o out.${format%%-*}
        must vg-encode out.${format%%-*} -o $format.vgs
    done
    printf '%s\n' ply 'format ascii 1.0' 'element vertex 3' 'property float x' 'property float y' 'property float z' \
        'property float red' 'property float green' 'property float blue' 'property ushort alpha' 'element face 1' \
        'property list uchar int vertex_indices' end_header '0 0 0 1 0.5 0 65535' '1 0 0 2 -1 0.2 0' '0 1 0 0 0 1 257' \
        '3 0 1 2' >float.ply
    must_warn vg-encode float.ply -o float.vgs
    says "2 channels of colours are out of their range"
    printf 'v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 0 0 0 0.5\nv 1 1 0\nv 0 0 1 1\nf 1 2 3\n' >part.obj
    must vg-encode part.obj -o part.vgs
    must vg-decode --drop-loose part.obj -o drop.ply
    must vg-encode drop.ply -o drop.vgs
    pipe 'vg-encode --quiet --vectors c.ply | vg-solve -o solved.vgs'
    must_warn vg-decode c.vgs -o out.off
    says "not kept in 'out.off': colours of vertices"
    py <<'END'
import read_stream
def colours(name):
    s = read_stream.read_stream(name + ".vgs").colours
    return [list(s[i:i + 4]) for i in range(0, len(s), 4)]
want = [[255, 0, 7, 255], [0, 1, 2, 128], [3, 60, 200, 255], [0, 9, 9, 255]]
for name in "c", "ply-ascii", "ply", "ply-be", "obj", "glb", "gltf", "solved":
    assert colours(name) == want, (name, colours(name))
assert colours("float") == [[255, 128, 0, 255], [255, 0, 51, 0], [0, 0, 255, 1]], colours("float")
assert colours("part") == [[255] * 4, [255, 128, 0, 255], [0, 0, 0, 128], [255] * 4, [255] * 4], colours("part")
assert colours("drop") == colours("part")[:3]
END
}
