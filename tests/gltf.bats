#!/usr/bin/env bats
# GLB and glTF through the programs: ours there and back, by the Khronos validator and Blender where they are installed, and what
# Blender exports. The validator is the package gltf-validator of npm: found by node, or in the directory that NODE_PATH names.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# make_walk [MESH]: three poses at 25 a second in walk.vgs, and truth.txt with their positions
make_walk() {
    poses "${1:-cube}" 3
    must vg-encode --fps 25 pose1.obj pose2.obj pose3.obj -o walk.vgs
    awk '$1 == "v" {print $2, $3, $4}' pose1.obj pose2.obj pose3.obj >truth.txt
}

# run_blender SCRIPT
run_blender() {
    capture blender --background --factory-startup --python-exit-code 1 --python "$1"
    [ "$status" = 0 ] || fail "$output" "$stderr"
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
    off = j['bufferViews'][a['bufferView']]['byteOffset'] + a['byteOffset']
    return struct.unpack_from('<%df' % (a['count'] * width), bin, off)
mesh = j['meshes'][0]
assert mesh['extras'] == {'targetNames': ['pose1', 'pose2', 'pose3'], 'vg_faces': [6, 4]}, mesh['extras']
truth = [float(w) for w in open('truth.txt').read().split()]
primitive = mesh['primitives'][0]
base = floats(primitive['attributes']['POSITION'])
for t, target in enumerate(primitive['targets']):
    moved = floats(target['POSITION'])
    assert max(abs(p + d - q) for p, d, q in zip(base, moved, truth[24 * t:24 * t + 24])) < 1e-6
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
    says "cannot write 'wide.glb' in full precision"
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
        says 'only files beside or below are read'
    done
    must_fail 4 vg-encode gone.gltf -o out.vgs
    must_fail 3 vg-encode - -o out.vgs <beside.gltf
    says 'is a file beside, which cannot be found from here'
    head -c 100 'my data.bin' >short && mv short 'my data.bin'
    must_fail 3 vg-encode beside.gltf -o out.vgs
    [ ! -e out.vgs ]
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
    must node validate.js walk.glb walk.gltf horse.glb lines.glb points.glb
    local file
    for file in walk.glb walk.gltf horse.glb lines.glb points.glb; do shows "$file 0 errors 0 warnings"; done
}

@test "Blender plays our GLB to the right places" {
    command -v blender >/dev/null || skip "blender is not installed"
    make_walk
    must vg-decode -o walk.glb walk.vgs
    cat >play.py <<'END'
import bpy, numpy
if 'bool' not in numpy.__dict__: numpy.bool = bool # Blender 3.4 still asks for it, Debian's NumPy has dropped it
truth = [float(w) for w in open('truth.txt').read().split()]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 25
bpy.ops.import_scene.gltf(filepath='walk.glb')
body = next(o for o in bpy.data.objects if o.type == 'MESH')
print('NAMES', [k.name for k in body.data.shape_keys.key_blocks][1:])
action = body.data.shape_keys.animation_data.action or body.data.shape_keys.animation_data.nla_tracks[0].strips[0].action
body.data.shape_keys.animation_data.action = action
first = round(action.frame_range[0])
worst = 0
for frame in range(3):
    bpy.context.scene.frame_set(first + frame)
    mesh = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    x = [c for v in mesh.vertices for c in (v.co[0], v.co[2], -v.co[1])]
    assert len(x) == 24, len(x)
    worst = max(worst, max(abs(p - q) for p, q in zip(x, truth[24 * frame:24 * frame + 24])))
print('WORST', worst)
assert worst < 1e-5
END
    run_blender play.py
    shows "NAMES ['pose1', 'pose2', 'pose3']" WORST
}

@test "what Blender exports of a mesh with seams reads as the motion of its own vertices" {
    command -v blender >/dev/null || skip "blender is not installed"
    cat >export.py <<'END'
import bpy, math
def body():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object # with texture coordinates in six islands
def export(name, o):
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 0, 4
    with open(name + '.txt', 'w') as out:
        for frame in range(5):
            scene.frame_set(frame)
            e = o.evaluated_get(bpy.context.evaluated_depsgraph_get())
            for v in e.to_mesh().vertices: print(*(e.matrix_world @ v.co), file=out)
    bpy.ops.export_scene.gltf(filepath=name + '.glb', export_yup=False)

o = body()
o.shape_key_add(name='Basis')
for i, name in enumerate(('up', 'out')):
    key = o.shape_key_add(name=name)
    for j, p in enumerate(key.data):
        p.co[2 - i] += 0.1 * j + 0.3
    for frame in range(5):
        key.value = (frame * (i + 1) % 5) / 5
        key.keyframe_insert('value', frame=frame)
export('keys', o)

o = body()
bpy.ops.object.armature_add(enter_editmode=True)
rig = bpy.context.object
bone = rig.data.edit_bones.new('tip')
bone.head, bone.tail, bone.parent = (0, 0, 1), (0, 0, 2), rig.data.edit_bones[0]
names = [b.name for b in rig.data.edit_bones]
bpy.ops.object.mode_set(mode='OBJECT')
for k, name in enumerate(names):
    group = o.vertex_groups.new(name=name)
    for v in o.data.vertices: group.add([v.index], (0.25 + 0.5 * k) if v.co.z > 0 else (1 - k) or 1e-3, 'REPLACE')
o.parent = rig
o.modifiers.new('rig', 'ARMATURE').object = rig
tip = rig.pose.bones['tip']
tip.rotation_mode = 'QUATERNION'
for frame in range(5):
    angle = 0.2 * frame
    tip.rotation_quaternion = (math.cos(angle), math.sin(angle), 0, 0)
    tip.keyframe_insert('rotation_quaternion', frame=frame)
export('bones', o)
END
    run_blender export.py
    local name
    for name in keys bones; do
        pipe "vg-encode $name.glb | vg-info"
        shows 'vertices    8' 'faces       12: 12 of 3' 'frames     5'
        must vg-decode -q -o $name-%d.obj $name.glb
        py $name <<'END'
import sys
name = sys.argv[1]
truth = [[float(w) for w in line.split()] for line in open(name + '.txt')]
frames = [[[float(w) for w in line.split()[1:]] for line in open('%s-%d.obj' % (name, i)) if line.startswith('v ')] for i in range(5)]
def distance(p, q): return max(abs(a - b) for a, b in zip(p, q))
own = [min(range(8), key=lambda v: distance(truth[v], p)) for p in frames[0]] # by where they are in the first frame
assert sorted(own) == list(range(8)), own
worst = max(distance(frames[i][k], truth[8 * i + own[k]]) for i in range(5) for k in range(8))
moved = max(distance(truth[v], truth[32 + v]) for v in range(8))
assert worst < 2e-5 and moved > 0.1, (worst, moved)
END
    done
}
