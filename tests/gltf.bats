#!/usr/bin/env bats
# GLB and glTF through the programs: ours there and back, and by the Khronos validator where it is installed (blender.bats has Blender's
# word). The validator is the package gltf-validator of npm: found by node, or in the directory that NODE_PATH names.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# make_walk [MESH]: three poses at 25 a second in walk.vgs, and truth.txt with their positions
make_walk() {
    poses "${1:-cube}" 3
    must vg-encode --fps 25 pose1.obj pose2.obj pose3.obj -o walk.vgs
    awk '$1 == "v" {print $2, $3, $4}' pose1.obj pose2.obj pose3.obj >truth.txt
}

@test "GLB: the bytes as Python reads them: chunks, targets, weights, polygon sizes" {
    make_walk
    must vg-decode -o walk.glb walk.vgs
    py <<'END'
import json, struct
b = open('walk.glb', 'rb').read()
magic, version, size, n, kind = struct.unpack('<4sIII4s', b[:20])
assert (magic, version, size, kind) == (b'glTF', 2, len(b), b'JSON')
j = json.loads(b[20:20 + n])
bin = b[28 + n:]
assert struct.unpack('<I4s', b[20 + n:28 + n]) == (len(bin), b'BIN\0') and len(bin) == j['buffers'][0]['byteLength']
def floats(i):
    a = j['accessors'][i]
    width = {'SCALAR': 1, 'VEC3': 3}[a['type']]
    place = lambda x: j['bufferViews'][x['bufferView']]['byteOffset'] + x['byteOffset']
    if 'bufferView' in a: return struct.unpack_from('<%df' % (a['count'] * width), bin, place(a))
    s, values = a['sparse'], [0.0] * (a['count'] * width)
    for k, v in enumerate(struct.unpack_from('<%dH' % s['count'], bin, place(s['indices']))):
        values[3 * v:3 * v + 3] = struct.unpack_from('<3f', bin, place(s['values']) + 12 * k)
    return values
mesh = j['meshes'][0]
copies = mesh['extras'].pop('vg_vertices')
assert mesh['extras'] == {'targetNames': ['pose1', 'pose2', 'pose3'], 'vg_faces': [6, 4]}, mesh['extras']
# the edges of a cube are sharp: a vertex for each corner of each face
assert copies[0] == 8 and sorted(list(range(8)) + copies[1:]) == sorted(3 * list(range(8)))
truth = [float(w) for w in open('truth.txt').read().split()]
primitive = mesh['primitives'][0]
base = floats(primitive['attributes']['POSITION'])
for t, target in enumerate(primitive['targets']):
    moved = floats(target['POSITION'])
    assert max(abs(p + d - q) for p, d, q in zip(base, moved, truth[24 * t:24 * t + 24])) < 1e-6
# the normals of a pose are those of its faces, which are two triangles each
a = j['accessors'][primitive['indices']]
index = struct.unpack_from('<%dI' % a['count'], bin, j['bufferViews'][a['bufferView']]['byteOffset'] + a['byteOffset'])
def cross(a, b): return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
def unit(a):
    l = sum(x * x for x in a) ** 0.5
    return [x / l for x in a]
for t in [None, 0, 1, 2]:
    p, n = list(base), list(floats(primitive['attributes']['NORMAL']))
    if t is not None:
        p = [a + b for a, b in zip(p, floats(primitive['targets'][t]['POSITION']))]
        n = [a + b for a, b in zip(n, floats(primitive['targets'][t]['NORMAL']))]
    seen = set()
    for i in range(0, len(index), 6):
        face = [0, 0, 0]
        for k in (i, i + 3):
            a, b, c = (p[3 * v:3 * v + 3] for v in index[k:k + 3])
            face = [x + y for x, y in zip(face, cross([y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]))]
        for v in index[i:i + 6]:
            assert max(abs(x - y) for x, y in zip(n[3 * v:3 * v + 3], unit(face))) < 1e-5, (t, v)
            seen.add(v)
    assert len(seen) == 24
sampler = j['animations'][0]['samplers'][0]
assert floats(sampler['output']) == (1, 0, 0, 0, 1, 0, 0, 0, 1)
assert max(abs(t - i / 25) for i, t in enumerate(floats(sampler['input']))) < 1e-7
END
}

@test "GLB and glTF come back: polygons, names, times, positions" {
    local file
    must vg-encode "$DATA/horse-run.tar.xz" -o horse.vgs
    for file in horse.glb horse.gltf; do
        must vg-decode -o $file horse.vgs
        must vg-diff -t 1e-6 horse.vgs $file
        pipe "vg-encode $file | vg-info"
        shows 'faces       375: 74 of 3, 287 of 4, 14 of 5' "'horse-run_001' to 'horse-run_021'" 'reference   horse-run_001'
        pipe "cat $file | vg-encode - | vg-diff -t 1e-6 horse.vgs -"
        vg-decode --format ${file#*.} -o - horse.vgs | cat >piped
        same_file $file piped
    done
    must_fail 2 vg-decode --f64 -o wide.glb horse.vgs
    says "cannot write 'wide.glb' as binary64"
}

@test "a long sequence has fewer morph targets, and the error that is said is the one there is" {
    must vg-encode "$DATA/horse-run.tar.xz" -o horse.vgs
    capture vg-decode --max-targets 12 -o horse.glb horse.vgs
    [ "$status" = 0 ]
    one_line
    says "every frame: 21 are mixed from 12 morph targets, with vertices off by at most "
    local percent=${stderr#*at most }
    percent=${percent%%%*}
    capture vg-diff -t 0 --json horse.vgs horse.glb
    [ "$status" = 1 ]
    printf '%s' "$output" >diff.json
    py "$percent" <<'END'
import json, sys
said, found = float(sys.argv[1]) / 100, json.load(open('diff.json'))['vertex_error']['max']['D']
assert 0 < said < 0.1 and abs(found - said) < 0.01 * said, (said, found)
END
    for x in 0 5 2; do printf 'v 0 0 %s\nv 1 0 %s\nv 0 1 %s\nf 1 2 3\n' $x $x $x >far$x.obj; done
    capture bash -c 'vg-encode far0.obj far5.obj far2.obj | vg-decode -q --max-targets 2 -o far.gltf'
    [ "$status" = 0 ]
    py <<'END'
import base64, json, struct
j = json.load(open('far.gltf')) # all along one direction: one target is enough
assert len(j['meshes'][0]['primitives'][0]['targets']) == 1
a = j['accessors'][j['animations'][0]['samplers'][0]['output']]
data = base64.b64decode(j['buffers'][0]['uri'].partition(',')[2])
w = struct.unpack_from('<3f', data, j['bufferViews'][a['bufferView']]['byteOffset'])
assert max(abs(x - y) for x, y in zip(w, (0, 1, 0.4))) < 1e-6, w
END
    must_fail 2 vg-decode --max-targets 12 -o horse.npz horse.vgs
    says "--max-targets is for GLB and glTF"
    pipe 'vg-encode horse.glb | vg-info --frames'
    shows horse-run_001 horse-run_011 horse-run_021
}

@test "buffers in a file beside are read, and only from there" {
    make_walk
    must vg-decode -o walk.gltf walk.vgs
    py <<'END'
import base64, json
j = json.load(open('walk.gltf'))
data = base64.b64decode(j['buffers'][0]['uri'].split(',')[1])
open('my data.bin', 'wb').write(data)
for name, uri in ('beside', 'my%20data.bin'), ('outside', '../my%20data.bin'), ('root', '/etc/passwd'), ('web', 'http://x/y.bin'), ('gone', 'gone.bin'):
    j['buffers'][0]['uri'] = uri
    json.dump(j, open(name + '.gltf', 'w'))
END
    must vg-diff -t 1e-6 walk.vgs beside.gltf
    local name
    for name in outside root web; do
        must_fail 3 vg-encode $name.gltf -o out.vgs
        says 'only files in the same directory or below it are read'
    done
    must_fail 4 vg-encode gone.gltf -o out.vgs
    must_fail 3 vg-encode - -o out.vgs <beside.gltf
    says 'is a separate file, which cannot be found from here'
    head -c 100 'my data.bin' >short && mv short 'my data.bin'
    must_fail 3 vg-encode beside.gltf -o out.vgs
    [ ! -e out.vgs ]
}

@test "a GLB of other faces does not join, one of the same does" {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n' >a.obj
    printf 'v 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\nf 1 2 4\n' >b.obj
    printf 'v 0 0 2\nv 1 0 2\nv 0 1 2\nv 1 1 2\nf 1 2 3\n' >c.obj
    pipe "vg-encode b.obj | vg-decode -o b.glb"
    pipe "vg-encode c.obj | vg-decode -o c.glb"
    must_fail 3 vg-encode a.obj b.glb -o no.vgs
    says "all poses of a sequence have the same vertices and faces"
    must vg-encode a.obj c.glb -o ac.vgs
    pipe "vg-encode a.obj c.obj | vg-diff -t 0 ac.vgs -"
    [ ! -e no.vgs ]
}

@test "a GLB that was cut, or lies, is refused, and nothing stays" {
    make_walk
    must vg-decode -o walk.glb walk.vgs
    local n size file
    size=$(stat -c %s walk.glb)
    for n in 5 40 $((size / 2)) $((size - 1)); do
        head -c "$n" walk.glb >cut.glb
        must_fail 3 vg-encode cut.glb -o out.vgs
        one_line
    done
    for file in "$CORPUS"/fuzz_gltf/bad-*.glb; do
        must_fail 3 vg-encode "$file" -o out.vgs
        one_line
    done
    [ ! -e out.vgs ] || fail "something was written"
}

@test "transforms of a rig become a skin: joints, weights and turns as Python reads them, and back as its vertices" {
    py <<'END'
import make_skin
make_skin.make()
END
    local file
    must vg-info --check bar.vgs
    must vg-decode -o bar.glb bar.vgs
    must vg-decode -o bar.gltf bar.vgs
    for file in bar.glb bar.gltf; do
        must vg-encode $file -o back.vgs
        py <<'END'
import json
from read_stream import read_stream
s, truth = read_stream('back.vgs'), json.load(open('truth.json'))
assert [list(s.mesh.vert[a:b]) for a, b in zip(s.mesh.start, s.mesh.start[1:])] == truth['faces']
assert [f.name for f in s.frames] == ['bend %d' % i for i in range(5)]
assert max(abs(f.time - i / 25) for i, f in enumerate(s.frames)) < 1e-7
size = max(abs(c) for f in truth['frames'] for c in f)
worst = max(abs(a - b) for f, t in zip(s.frames, truth['frames']) for a, b in zip(f.values, t))
assert worst <= 1e-6 * size, worst
END
    done
    py <<'END'
import base64, json, struct
j = json.load(open('bar.gltf'))
data = base64.b64decode(j['buffers'][0]['uri'].partition(',')[2])
for channel, sampler in zip(j['animations'][0]['channels'], j['animations'][0]['samplers']): # by the short way between two keys
    if channel['target']['path'] != 'rotation': continue
    a = j['accessors'][sampler['output']]
    q = struct.unpack_from('<%df' % (4 * a['count']), data, j['bufferViews'][a['bufferView']]['byteOffset'] + a['byteOffset'])
    assert all(sum(q[i + k] * q[i + 4 + k] for k in range(4)) > 0 for i in range(0, len(q) - 4, 4)), q
assert [n.get('name') for n in j['nodes']] == ['bar', 'low', 'mid', 'top', 'top.end']
assert [n.get('children') for n in j['nodes']] == [None, [2], [3], [4], None]
assert j['skins'][0]['joints'] == [1, 2, 3] and j['scenes'][0]['nodes'] == [0, 1]
paths = [(c['target']['node'], c['target']['path']) for c in j['animations'][0]['channels']]
assert paths == [(1, 'rotation'), (1, 'translation'), (2, 'rotation'), (3, 'rotation')], paths
END
    must_fail 2 vg-decode --max-targets 12 -o bar2.glb bar.vgs
    says 'leave out --max-targets'
    must_fail 3 vg-decode -o bar-%d.obj bar.vgs
    says "convert them to vertices with 'vg-play MAP' first, or write those of a rig as a skin to a .glb"
    must_fail 3 vg-decode -o none.glb "$GOLDEN/transforms.vgs"
    says 'transforms without a skeleton'
}

@test "a character comes back: nodes, materials, picture, skin, texture coordinates, colours, normals" {
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-encode --animation Wave in.glb -o wave.vgs
    pipe 'vg-info wave.vgs'
    shows 'asset                2 materials, 1 texture, normals, further texture coordinates, 1 skin, 1 camera'
    must vg-decode --max-targets 1000 wave.vgs -o out.glb
    must vg-encode out.glb -o back.vgs
    must vg-diff -t 1e-7 wave.vgs back.vgs
    py <<'END'
import json, struct
import make_character
def load(name):
    b = open(name, "rb").read()
    n, = struct.unpack("<I", b[12:16])
    return json.loads(b[20:20 + n]), b[28 + n:]
def read(g, data, i):
    a = g["accessors"][i]
    code, size = {5121: ("B", 1), 5123: ("H", 2), 5125: ("I", 4), 5126: ("f", 4)}[a["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[a["type"]]
    rows = [[0] * width for _ in range(a["count"])]
    def take(view, offset, n, code=code, size=size, width=width):
        v = g["bufferViews"][view]
        at, step = v.get("byteOffset", 0) + offset, v.get("byteStride", width * size)
        return [list(struct.unpack_from(f"<{width}{code}", data, at + k * step)) for k in range(n)]
    if "bufferView" in a:
        rows = take(a["bufferView"], a.get("byteOffset", 0), a["count"])
    if "sparse" in a:
        s = a["sparse"]
        code2, size2 = {5123: ("H", 2), 5125: ("I", 4)}[s["indices"]["componentType"]]
        which = take(s["indices"]["bufferView"], s["indices"]["byteOffset"], s["count"], code2, size2, 1)
        for (k,), row in zip(which, take(s["values"]["bufferView"], s["values"]["byteOffset"], s["count"])):
            rows[k] = row
    return rows
g, data = load("in.glb")
h, out = load("out.glb")
for key in "scenes", "cameras", "materials", "textures", "samplers", "extensionsUsed", "scene":
    assert g[key] == h[key], key
assert g["asset"]["copyright"] == h["asset"]["copyright"]
assert g["nodes"] == h["nodes"], h["nodes"]
assert [m["name"] for m in h["meshes"]] == ["BodyMesh", "BallMesh"]
image = h["bufferViews"][h["images"][0]["bufferView"]]
assert out[image["byteOffset"]:][:image["byteLength"]] == make_character.picture() and h["images"][0]["name"] == "Weave"
old, new = dict(g["skins"][0]), dict(h["skins"][0])
assert read(g, data, old.pop("inverseBindMatrices")) == read(h, out, new.pop("inverseBindMatrices")) and old == new
for m, n in zip(g["meshes"], h["meshes"]):
    for p, q in zip(m["primitives"], n["primitives"]):
        assert p["material"] == q["material"] and read(g, data, p["indices"]) == read(h, out, q["indices"])
        assert p["attributes"].keys() == q["attributes"].keys()
        for key in p["attributes"]:
            assert read(g, data, p["attributes"][key]) == read(h, out, q["attributes"][key]), key
assert [a["name"] for a in h["animations"]] == ["Wave"]
assert [c["target"] for c in h["animations"][0]["channels"]] == [{"node": 3, "path": "weights"}, {"node": 4, "path": "weights"}]
# The upper cube turns a quarter about z at (0, 1, 0) in the second frame: (x, y) -> (1 - y, 1 + x); so do its normals.
upper = h["meshes"][0]["primitives"][1]
def shown(key, target):
    base, moved = read(h, out, upper["attributes"][key]), read(h, out, upper["targets"][target][key])
    return [[a + b for a, b in zip(p, d)] for p, d in zip(base, moved)]
for (x, y, z), p in zip(read(g, data, g["meshes"][0]["primitives"][1]["attributes"]["POSITION"]), shown("POSITION", 1)):
    assert max(abs(a - b) for a, b in zip(p, (1 - y, 1 + x, z))) < 1e-6
for (x, y, z), p in zip(read(g, data, g["meshes"][0]["primitives"][1]["attributes"]["NORMAL"]), shown("NORMAL", 1)):
    assert max(abs(a - b) for a, b in zip(p, (-y, x, z))) < 1e-6
# What stands still has a target that moves nothing: one vertex, by nothing.
still = h["accessors"][h["meshes"][1]["primitives"][0]["targets"][1]["POSITION"]]
assert still["sparse"]["count"] == 1 and still["min"] == still["max"] == [0, 0, 0]
END
}

@test "a character with another reference pose, and mixed from few targets: the frames are the same" {
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-encode --animation Wave in.glb -o wave.vgs
    must_warn vg-decode wave.vgs -o wave-%d.obj
    must vg-encode --reference wave-1.obj wave.vgs -o bent.vgs
    must vg-decode bent.vgs -o bent.glb
    must vg-encode bent.glb -o back.vgs
    must vg-diff -t 1e-6 wave.vgs back.vgs
    must vg-encode --animation Wave --fps 60 in.glb -o long.vgs
    must_warn vg-decode --morph-tolerance 1e-6 long.vgs -o long.glb
    pipe 'vg-encode long.glb | vg-diff -t 2e-6 long.vgs -'
    py <<'END'
import json, struct
def floats(g, data, i):
    a = g["accessors"][i]
    v = g["bufferViews"][a["bufferView"]]
    return struct.unpack_from(f"<{3 * a['count']}f", data, v["byteOffset"] + a.get("byteOffset", 0))
def load(name):
    b = open(name, "rb").read()
    n, = struct.unpack("<I", b[12:16])
    return json.loads(b[20:20 + n]), b[28 + n:]
# In the space of the skin the upper cube lies as it does in the second frame, its normals with it.
(g, data), (h, out) = load("in.glb"), load("bent.glb")
before, after = (m["meshes"][0]["primitives"][1]["attributes"] for m in (g, h))
p, q = floats(g, data, before["POSITION"]), floats(h, out, after["POSITION"])
m, n = floats(g, data, before["NORMAL"]), floats(h, out, after["NORMAL"])
for i in range(0, len(p), 3):
    assert max(abs(a - b) for a, b in zip(q[i:i + 3], (1 - p[i + 1], 1 + p[i], p[i + 2]))) < 1e-6
    assert max(abs(a - b) for a, b in zip(n[i:i + 3], (-m[i + 1], m[i], m[i + 2]))) < 1e-6
# Between two quarter turns there are as many targets as the error asks for, and no more than frames.
h, out = load("long.glb")
targets = h["meshes"][0]["primitives"][1]["targets"]
assert 1 < len(targets) < 46 and all("NORMAL" in t for t in targets), len(targets)
END
}

@test "OBJ: materials of the MTL beside it, with their pictures, come into a GLB; polygons come back" {
    py <<'END'
import make_character
open("weave two.png", "wb").write(make_character.picture())
open("q.mtl", "w").write("newmtl red\nKd 0.8 0.1 0.1\nNs 98\nd 0.5\nnewmtl cloth\nKd 1 0 0\nmap_Kd weave two.png\nnewmtl gone\n")
points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
for name, bend in ("a", 0), ("b", 0.5):
    open(name + ".obj", "w").write("mtllib q.mtl\n" + "".join(f"v {x} {y} {z + bend * x}\n" for x, y, z in points) +
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3 4/4\nusemtl cloth\nf 2/1 5/2 6/3 3/4\nusemtl plain\nf 1 2 5\n")
END
    must vg-encode a.obj b.obj -o poses.vgs
    pipe 'vg-info poses.vgs'
    shows 'asset                3 materials, 1 texture'
    must vg-decode poses.vgs -o poses.glb
    must vg-decode poses.vgs -o again-%d.obj
    grep -qx 'mtllib q.mtl' again-0.obj || fail "the library's name is lost"
    must vg-encode poses.glb -o back.vgs
    must vg-diff -t 1e-7 poses.vgs back.vgs
    pipe 'vg-info back.vgs'
    shows '3: 1 of 3, 2 of 4'
    py <<'END'
import json, struct, make_character
b = open("poses.glb", "rb").read()
n, = struct.unpack("<I", b[12:16])
g, data = json.loads(b[20:20 + n]), b[28 + n:]
red, cloth, plain = g["materials"]
assert red["name"] == "red" and red["pbrMetallicRoughness"]["baseColorFactor"] == [0.8, 0.1, 0.1, 0.5], red
assert red["alphaMode"] == "BLEND" and abs(red["pbrMetallicRoughness"]["roughnessFactor"] - (2 / 100) ** 0.5) < 1e-12
assert cloth["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0} and plain == {"name": "plain"}
primitives = g["meshes"][0]["primitives"]
assert [(p["material"], g["accessors"][p["indices"]]["count"]) for p in primitives] == [(0, 6), (1, 6), (2, 3)]
view = g["bufferViews"][g["images"][g["textures"][0]["source"]]["bufferView"]]
assert data[view["byteOffset"]:][:view["byteLength"]] == make_character.picture()
END
    rm q.mtl "weave two.png"
    must vg-encode a.obj b.obj -o without.vgs
    must vg-decode without.vgs -o without.glb
}

@test "a still GLB has no animation and no morph target; a single pose that moves has both" {
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-decode "$DATA/trex.rest.obj" -o still.glb
    must vg-decode still.glb -o again.glb
    must vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o run.vgs
    must vg-decode run.vgs -o 'run-%d.obj'
    must vg-encode --reference "$DATA/horse.rest.obj" run-3.obj -o pose.vgs
    must vg-decode pose.vgs -o pose.glb
    pipe 'vg-encode pose.glb | vg-diff -t 1e-6 pose.vgs -'
    pipe 'vg-encode again.glb | vg-diff -t 1e-6 "$DATA/trex.rest.obj" -'
    py <<'END'
import json, struct
def document(name):
    data = open(name, "rb").read()
    return json.loads(data[20:20 + struct.unpack("<I", data[12:16])[0]])
for name in "still.glb", "again.glb":
    g = document(name)
    assert "animations" not in g and "weights" not in g["meshes"][0], name
    assert all("targets" not in p for p in g["meshes"][0]["primitives"]), name
g = document("pose.glb")
assert len(g["animations"]) == 1 and len(g["meshes"][0]["primitives"][0]["targets"]) == 1
END
}

@test "several animations: vg-info lists them, vg-decode writes them, each with its own times" {
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-encode in.glb -o all.vgs
    pipe 'vg-info all.vgs'
    shows "animation  'Wave': 3 frames, 0.25 s to 1 s" "animation  'Nod': 2 frames, 0 s to 0.5 s"
    must vg-decode all.vgs -o out.glb
    must vg-encode out.glb -o back.vgs
    must vg-diff -t 1e-7 all.vgs back.vgs
    pipe 'vg-info --frames back.vgs'
    shows '    2  Wave.0003     1  ' '    3  Nod.0001      0  ' '    4  Nod.0002    0.5  '
    must vg-encode --animation Nod out.glb -o nod.vgs
    pipe 'vg-info nod.vgs'
    shows "frames     2: 'Nod.0001' to 'Nod.0002'" 'times      0 s to 0.5 s'
    # Names that are no animations make one.
    cat >names.py <<'END'
import make_corpus as m, sys
def write(name, names):
    open(name, "wb").write(m.whole(m.content(frames=[m.pose(n, m.BENT[:4]) for n in names])))
write("single.vgs", ["A.0001", "B.0001", "C.0001"])
write("gap.vgs", ["A.0001", "A.0002", "B.0001", "B.0003"])
write("two.vgs", ["A.1", "A.2", "B.1", "B.2", "B.3"])
END
    must env PYTHONPATH="$ROOT/tests" python3 names.py
    local name
    for name in single gap two; do
        must vg-decode --replace -o $name.glb $name.vgs
        [ "$(tr '{' '\n' <$name.glb | grep -a -c '"channels"')" = "$([ $name = two ] && echo 2 || echo 1)" ] || fail "$name.glb"
    done
}

@test "what a format cannot keep of a character is named once; it is of its own mesh only" {
    local all='2 materials, 1 texture, normals, further texture coordinates, 1 skin, 1 camera'
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-encode --animation Nod in.glb -o nod.vgs
    must_warn vg-decode nod.vgs -o nod-%d.obj
    one_line
    says "not kept in 'nod-%d.obj': $all"
    must_warn vg-decode nod.vgs -o nod.usda
    says "texture coordinates; groups and materials; colours of vertices; $all"
    must vg-decode --drop-loose nod.vgs -o nod.glb
    py <<'END'
import read_stream, make_corpus
s = read_stream.read_stream("nod.vgs")
digest, vertex, data = s.asset
assert len(vertex) == 72 and len(set(vertex)) == 24 and data[:4] == b"glTF"
assert digest == make_corpus.digest({"vertices": 24, "faces": s.mesh.faces()})
# One vertex more: the digest is wrong, as after a filter that does not know the record.
b = open("nod.vgs", "rb").read()
i = b.index(digest.to_bytes(8, "little"))
def fixed(b, at):
    import struct
    size, = struct.unpack_from("<Q", b, at + 8)
    payload = b[at + 32:at + 32 + size]
    head = b[at:at + 16] + make_corpus.u64(make_corpus.xxh64(payload))
    return head + make_corpus.u64(make_corpus.xxh64(head)) + payload
at = b.index(b"ASST")
other = bytearray(b)
other[i] ^= 1
record = fixed(bytes(other), at)
other[at:at + len(record)] = record
sums, k = b"", 16 if other[8:12] not in (b"PROV", b"MESH") else 8
records = 0
while bytes(other[k:k + 4]) != b"END ":
    size = int.from_bytes(other[k + 8:k + 16], "little")
    sums += other[k + 24:k + 32]
    k += 32 + (size + 7) // 8 * 8
    records += 1
end = make_corpus.u64(records, make_corpus.xxh64(sums))
head = bytes(other[k:k + 16]) + make_corpus.u64(make_corpus.xxh64(end))
other[k:] = head + make_corpus.u64(make_corpus.xxh64(head)) + end
open("other.vgs", "wb").write(other)
END
    must_warn vg-decode other.vgs -o other.glb
    says "not kept in 'other.glb': $all; groups"
    pipe 'vg-encode other.glb | vg-diff -t 1e-6 nod.vgs -'
}

@test "three.js shows a character as it was: positions, normals, texture coordinates, materials, names" {
    command -v node >/dev/null || skip "node is not installed"
    node -e 'require("three")' 2>/dev/null || skip "the node module three is not installed"
    py <<'END'
import make_character
make_character.main("in.glb")
END
    local clip
    for clip in Wave Nod; do
        must vg-encode --animation $clip in.glb -o clip.vgs
        must vg-decode clip.vgs -o clip.glb
        must node "$ROOT/tests/node/characters.mjs" in.glb clip.glb $clip
        printf '%s\n' "$output" >$clip.json
    done
    py <<'END'
import json
for clip in "Wave", "Nod":
    r = json.load(open(clip + ".json"))
    assert r["vertices"] == 72 and r["moved"] > 0.3 and r["frames"] > 1, r
    assert r["rest"] < 1e-7 and r["position"] < 1e-6 and r["uv"] == 0 and r["normal"] == 0 and r["turned"] < 0.1, r
    assert r["materials"] and r["nodes"] and r["animations"] == [clip], r
END
}

@test "the Khronos validator finds neither error nor warning" {
    command -v node >/dev/null || skip "node is not installed"
    node -e 'require("gltf-validator")' 2>/dev/null || skip "the node module gltf-validator is not installed"
    make_walk
    must vg-decode -o walk.glb walk.vgs
    must vg-decode -o walk.gltf walk.vgs
    must vg-encode "$DATA/horse-run.tar.xz" -o horse.vgs
    must vg-decode -q --max-targets 5 -o horse.glb horse.vgs
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\n' >lines.obj
    must vg-decode -o lines.glb lines.obj
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\n' >points.obj
    must vg-decode -o points.glb points.obj
    py <<'END'
import make_skin
make_skin.make()
END
    must vg-decode -o bar.glb bar.vgs
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-encode --animation Wave in.glb -o wave.vgs
    must vg-decode -o character.glb wave.vgs
    must vg-decode -o character.gltf wave.vgs
    must vg-decode --shapes -o shapes.glb wave.vgs
    cat >validate.js <<'END'
const validator = require('gltf-validator'), fs = require('fs');
(async () => {
    for (const file of process.argv.slice(2)) {
        const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
        console.log(file, report.issues.numErrors, 'errors', report.issues.numWarnings, 'warnings');
        for (const m of report.issues.messages) console.log(' ', m.code, m.pointer);
    }
})();
END
    must node validate.js walk.glb walk.gltf horse.glb lines.glb points.glb bar.glb character.glb character.gltf shapes.glb
    local file
    for file in walk.glb walk.gltf horse.glb lines.glb points.glb bar.glb character.glb character.gltf shapes.glb; do shows "$file 0 errors 0 warnings"; done
}

@test "blendshapes: sparse targets, names, no animation; what comes back is what went in" {
    mesh cube >neutral.obj
    awk '/^v /{n++; if (n == 1) {$2 += 0.5}} {print}' neutral.obj >smile.obj
    awk '/^v /{n++; if (n > 2) {$3 -= 0.25}} {print}' neutral.obj >blink_L.obj
    must vg-encode neutral.obj smile.obj blink_L.obj -o face.vgs
    must vg-decode --shapes -o face.glb face.vgs
    py <<'EOF'
import json, struct
b = open('face.glb', 'rb').read()
n, = struct.unpack('<I', b[12:16])
g = json.loads(b[20:20 + n])
assert 'animations' not in g
mesh = g['meshes'][0]
assert mesh['extras']['targetNames'] == ['smile', 'blink_L'] and len(mesh['primitives'][0]['targets']) == 2
EOF
    must vg-encode face.glb -o back.vgs
    pipe 'vg-info --frames back.vgs'
    shows base smile blink_L
    must vg-diff -t 1e-7 face.vgs back.vgs
    must_fail 2 vg-decode --shapes --name x -o face2.glb face.vgs
    must_fail 2 vg-decode --shapes -o face.pc2 face.vgs
    says "--shapes is for GLB and glTF"
    # a large face of which a shape moves little: sparse, and read back
    must vg-encode "$DATA/trex.rest.obj" -o rest.vgs
    must vg-decode -q -o rest.obj rest.vgs
    awk '/^v /{n++; if (n == 7) {$2 += 0.5}} {print}' rest.obj >shape.obj
    must vg-encode rest.obj shape.obj -o few.vgs
    must vg-decode --shapes -o few.glb few.vgs
    py <<'EOF'
import json, struct
b = open('few.glb', 'rb').read()
g = json.loads(b[20:20 + struct.unpack('<I', b[12:16])[0]])
mesh = g['meshes'][0]
copies = mesh['extras']['vg_vertices'][1:].count(6) # of the vertex that moves
target, = mesh['primitives'][0]['targets']
assert g['accessors'][target['POSITION']]['sparse']['count'] == 1 + copies, copies
assert 1 + copies < g['accessors'][target['NORMAL']]['sparse']['count'] < 60
EOF
    must vg-encode few.glb -o few-back.vgs
    must vg-diff -t 1e-7 few.vgs few-back.vgs
    # an animation keeps its name
    must vg-decode --name Jump -o jump.glb face.vgs
    pipe 'vg-encode --animation Jump jump.glb | vg-diff -t 1e-7 face.vgs -'
    pipe 'vg-encode --shapes jump.glb | vg-info --frames'
    shows base smile blink_L
}

@test "a long GLB keeps its tolerance with as few targets as that takes" {
    must vg-encode "$DATA/velociraptor-walk.tar.xz" "$DATA/velociraptor-run.tar.xz" "$DATA/velociraptor-attack.tar.xz" \
        "$DATA/velociraptor-walk.tar.xz" -o long.vgs
    must vg-decode -o long.glb long.vgs
    must vg-diff -t 0.001 long.vgs long.glb
    must_warn vg-decode --morph-tolerance 0.00001 -o fine.glb long.vgs
    must vg-diff -t 0.00001 long.vgs fine.glb
    py <<'EOF'
import json, struct
def targets(name):
    b = open(name, 'rb').read()
    return len(json.loads(b[20:20 + struct.unpack('<I', b[12:16])[0]])['meshes'][0]['primitives'][0]['targets'])
assert targets('long.glb') < targets('fine.glb') < 153, (targets('long.glb'), targets('fine.glb'))
EOF
}

@test "texture coordinates: seams are cut apart for others and put together again" {
    cat >cube.obj <<'EOF'
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
vt 0 0
vt 0.5 0
vt 0.5 1
vt 0 1
vt 0.75 0.25
vt 1 0.25
vt 1 0.5
vt 0.75 0.5
f 1/1 2/2 3/3 4/4
f 2/5 5/6 6/7 3/8
EOF
    awk '/^v /{$4 = NR} {print}' cube.obj >moved.obj
    must vg-encode cube.obj moved.obj -o two.vgs
    must vg-decode -o two.glb two.vgs
    must vg-decode -o two.gltf two.vgs
    py <<'EOF'
import json, struct
b = open('two.glb', 'rb').read()
n, = struct.unpack('<I', b[12:16])
g, data = json.loads(b[20:20 + n]), b[28 + n:]
p = g['meshes'][0]['primitives'][0]
uv, points = (g['accessors'][p['attributes'][k]] for k in ('TEXCOORD_0', 'POSITION'))
assert uv['count'] == points['count'] == 8 and uv['type'] == 'VEC2', (uv, points)
assert g['meshes'][0]['extras']['vg_vertices'] == [6, 1, 2]
at = lambda a: g['bufferViews'][a['bufferView']].get('byteOffset', 0) + a.get('byteOffset', 0)
uv = struct.unpack_from('<16f', data, at(uv))
assert uv[:4] == (0, 1, 0.5, 1) and uv[12:] == (0.75, 0.75, 0.75, 0.5), uv # v downwards
x = struct.unpack_from('<24f', data, at(points))
assert x[18:21] == x[3:6] and x[21:24] == x[6:9] # the copies
for t in p['targets']: # which move along
    a = g['accessors'][t['POSITION']]
    d = struct.unpack_from('<24f', data, at(a))
    assert a['count'] == 8 and d[18:21] == d[3:6] and d[21:24] == d[6:9]
EOF
    local kind
    for kind in glb gltf; do
        must vg-encode two.$kind -o back.vgs
        must vg-diff -t 0 two.vgs back.vgs
        rm -f back-*.obj
        must vg-decode -o back-%d.obj back.vgs
        py <<'EOF'
def read(name):
    v, vt, f = [], [], []
    for l in open(name):
        w = l.split()
        if w[0] == 'v': v.append(tuple(map(float, w[1:])))
        if w[0] == 'vt': vt.append(tuple(map(float, w[1:])))
        if w[0] == 'f': f.append([(v[int(c.split('/')[0]) - 1], vt[int(c.split('/')[1]) - 1]) for c in w[1:]])
    return v, f
assert read('cube.obj') == read('back-0.obj') and read('moved.obj') == read('back-1.obj')
EOF
    done
}

@test "normals of plain meshes: by smoothing groups, or by the angle; --no-normals; a file that was read has them made again" {
    # a roof: two quads that meet at 90 degrees, and at 30
    roof() {
        printf 'v -1 0 0\nv -1 0 1\nv 0 %s 0\nv 0 %s 1\nv 1 0 0\nv 1 0 1\n%s\nf 1 2 4 3\n%s\nf 3 4 6 5\n' "$1" "$1" "$2" "$3" >roof.obj
        must vg-encode roof.obj -o roof.vgs
        must vg-decode -o roof.glb "${@:4}" roof.vgs
    }
    # normals ANSWER: how many vertices the file has, and the normal at the first corner of the ridge
    normals() {
        cat >normals.py <<'EOF'
import json, struct, sys
b = open('roof.glb', 'rb').read()
n, = struct.unpack('<I', b[12:16])
g, data = json.loads(b[20:20 + n]), b[28 + n:]
at = g['meshes'][0]['primitives'][0]['attributes']
count = g['accessors'][at['POSITION']]['count']
if 'NORMAL' not in at: sys.exit(print(count, 'none'))
a = g['accessors'][at['NORMAL']]
x = struct.unpack_from('<3f', data, g['bufferViews'][a['bufferView']]['byteOffset'] + a['byteOffset'] + 12 * 2)
print(count, *['%.4f' % (c + 0.0) for c in x])
EOF
        must python3 normals.py
        [ "$output" = "$1" ] || fail "$output, not $1"
    }
    roof 1 '' ''
    normals '8 -0.7071 0.7071 0.0000'
    roof 0.26794919 '' ''
    normals '6 0.0000 1.0000 0.0000'
    roof 1 's 1' ''
    normals '6 0.0000 1.0000 0.0000'
    roof 1 's 1' 's 2'
    normals '8 -0.7071 0.7071 0.0000'
    roof 0.26794919 's off' ''
    normals '8 -0.2588 0.9659 0.0000'
    roof 1 '' '' --no-normals
    normals '6 none'
    roof 1 '' ''
    must vg-encode roof.glb -o back.vgs
    pipe 'vg-info back.vgs'
    shows 'vertices    6' 'faces       2: 2 of 4'
    must vg-decode -o again.glb back.vgs
    must vg-diff -t 0 roof.vgs again.glb
    must vg-decode -o plain.obj back.vgs
    must_fail 2 vg-decode --no-normals -o roof.ply roof.vgs
    says "--no-normals is for GLB and glTF"
}

@test "vg-info --vertices: which vertex of a file is which of the mesh" {
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-encode --animation Wave in.glb -o wave.vgs
    must vg-info --vertices wave.vgs
    cp .stdout vertices.txt
    py <<'END'
import json, struct
b = open("in.glb", "rb").read()
n, = struct.unpack("<I", b[12:16])
g, data = json.loads(b[20:20 + n]), b[28 + n:]
rows = [l.split() for l in open("vertices.txt")]
assert len(rows) == 72 and {int(r[0]) for r in rows} == set(range(24))
assert [int(r[0]) for r in rows] == sorted(int(r[0]) for r in rows)
def position(node, primitive, index):
    mesh = next(g["meshes"][n["mesh"]] for n in g["nodes"] if n.get("name", "-").replace(" ", "_") == node and "mesh" in n)
    a = g["accessors"][mesh["primitives"][primitive]["attributes"]["POSITION"]]
    v = g["bufferViews"][a["bufferView"]]
    return struct.unpack_from("<3f", data, v.get("byteOffset", 0) + a.get("byteOffset", 0) + index * v.get("byteStride", 12))
# those of one vertex lie at one place, and each vertex of a primitive is there once
for v in range(24):
    assert len({(r[1], position(r[1], int(r[2]), int(r[3]))) for r in rows if int(r[0]) == v}) == 1, v
assert len({tuple(r[1:]) for r in rows}) == 72
END
    mesh cube >cube.obj
    must vg-info --vertices cube.obj
    [ "$(tail -1 <<<"$output")" = '7 - 0 7' ] || fail "$output"
}

@test "normals that lean against their surface turn with it, about its normal too" {
    py <<'END'
import json, struct
import make_character
make_character.main("in.glb")
b = bytearray(open("in.glb", "rb").read())
n, = struct.unpack("<I", b[12:16])
g = json.loads(b[20:20 + n])
for mesh in g["meshes"]:
    for p in mesh["primitives"]:
        a = g["accessors"][p["attributes"]["NORMAL"]]
        v = g["bufferViews"][a["bufferView"]]
        for k in range(a["count"]):
            at = 28 + n + v.get("byteOffset", 0) + a.get("byteOffset", 0) + k * v.get("byteStride", 12)
            x = [c + d for c, d in zip(struct.unpack_from("<3f", b, at), (0.3, 0.2, 0.4))]
            l = sum(c * c for c in x) ** 0.5
            struct.pack_into("<3f", b, at, *[c / l for c in x])
open("lean.glb", "wb").write(b)
END
    must vg-encode --animation Wave lean.glb -o wave.vgs
    must vg-decode --max-targets 1000 wave.vgs -o out.glb
    py <<'END'
import json, struct
def load(name):
    b = open(name, "rb").read()
    n, = struct.unpack("<I", b[12:16])
    return json.loads(b[20:20 + n]), b[28 + n:]
def read(g, data, i):
    a = g["accessors"][i]
    def at(x): return g["bufferViews"][x["bufferView"]].get("byteOffset", 0) + x.get("byteOffset", 0)
    step = g["bufferViews"][a["bufferView"]].get("byteStride", 12) if "bufferView" in a else 12
    rows = [list(struct.unpack_from("<3f", data, at(a) + k * step)) if "bufferView" in a else [0, 0, 0] for k in range(a["count"])]
    s = a.get("sparse")
    for k in range(s["count"] if s else 0):
        v, = struct.unpack_from("<H", data, at(s["indices"]) + 2 * k)
        rows[v] = list(struct.unpack_from("<3f", data, at(s["values"]) + 12 * k))
    return rows
g, data = load("lean.glb")
h, out = load("out.glb")
# The upper cube turns a quarter about z in the second frame: any normal (x, y, z) becomes (-y, x, z); on the lids that is a turn about them.
before = read(g, data, g["meshes"][0]["primitives"][1]["attributes"]["NORMAL"])
p = h["meshes"][0]["primitives"][1]
base, moved = read(h, out, p["attributes"]["NORMAL"]), read(h, out, p["targets"][1]["NORMAL"])
assert max(abs(a - b) for p, q in zip(before, base) for a, b in zip(p, q)) < 1e-6
for (x, y, z), n, d in zip(before, base, moved):
    assert max(abs(a + b - c) for a, b, c in zip(n, d, (-y, x, z))) < 1e-6, (x, y, z, n, d)
END
}
