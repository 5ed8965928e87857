#!/usr/bin/env bats
# Between Blender and the suite, both ways: what Blender makes is read as it is there, what we write plays there as it should, and the scripts of
# examples/blender carry sequences over. Runs where Blender is installed. Scripts that judge read Blender's evaluated meshes themselves.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

setup() {
    command -v blender >/dev/null || skip "blender is not installed"
    cd "$BATS_TEST_TMPDIR" || return 1
}

# run_blender SCRIPT [ARGUMENT...]: a script of this file, which must succeed
run_blender() {
    local script=$1
    shift
    capture env PYTHONPATH="$BATS_FILE_TMPDIR" blender --background --factory-startup --python-use-system-env --python-exit-code 1 \
        --python "$script" -- "$@"
    [ "$status" = 0 ] || fail "$output" "$stderr"
}

# from_blender, to_blender: as people call them; without --python-exit-code
from_blender() { blender -b --factory-startup --python "$ROOT/examples/blender/from_blender.py" -- "$@"; }
to_blender() { blender -b --factory-startup --python "$ROOT/examples/blender/to_blender.py" -- "$@"; }

# must_hand SCRIPT ARGUMENT...: one of them, with status 0
must_hand() {
    capture "$@"
    [ "$status" = 0 ] || fail "'$*' ended with status $status" "$stderr" "$output"
}

# must_refuse STATUS TEXT SCRIPT ARGUMENT...: it ends with this status and says so, with the script's name in front
must_refuse() {
    local want=$1 text=$2
    shift 2
    capture "$@"
    [ "$status" = "$want" ] || fail "'$*' ended with status $status, not $want" "$stderr" "$output"
    says "$1: $text"
}

# Made once: bend.blend and bend.fbx, a cylinder of quads and twelve-sided caps with seams and a vertex in no face, bent by three bones;
# *.truth: as JSON, what Blender makes of both, with y up; keys.glb and bones.glb: a cube with seams, and *.txt with its motion.
setup_file() {
    command -v blender >/dev/null || return 0
    local BATS_TEST_TMPDIR=$BATS_FILE_TMPDIR # where capture keeps what was said
    cd "$BATS_FILE_TMPDIR" || return 1
    cat >look.py <<'END'
import bpy
def body():
    return max((o for o in bpy.context.scene.objects if o.type == 'MESH'), key=lambda o: len(o.data.vertices))
def places(o, turned=True):
    """Of all vertices in the world, in a row; turned: with y up"""
    e = o.evaluated_get(bpy.context.evaluated_depsgraph_get())
    world = [e.matrix_world @ v.co for v in e.to_mesh().vertices]
    return [c for p in world for c in ((p.x, p.z, -p.y) if turned else tuple(p))]
def show(frame):
    whole = int(frame // 1)
    bpy.context.scene.frame_set(whole, subframe=frame - whole)
END
    cat >make.py <<'END'
import bpy, json, math, os
from look import body, places, show

def truth(name, first, last):
    o, frames, heads = body(), [], []
    rig = next(r for r in bpy.context.scene.objects if r.type == 'ARMATURE')
    for frame in range(first, last + 1):
        show(frame)
        frames.append(places(o))
        shown = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
        world = [shown.matrix_world @ p for b in shown.pose.bones for p in ((b.head, b.tail) if not b.children else (b.head,))]
        heads.append([c for p in world for c in (p.x, p.z, -p.y)])
    json.dump({'frames': frames, 'heads': heads, 'faces': [list(p.vertices) for p in o.data.polygons]}, open(name, 'w'))

def bent():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = 25, 1, 6
    around, rings = 12, 7
    at = lambda i, r: (0.5 * math.cos(2 * math.pi * i / around), 0.5 * math.sin(2 * math.pi * i / around), r / 2)
    points = [at(i, r) for r in range(rings) for i in range(around)] + [(1, 1, 1)] # the last is in no face
    faces = [list(range(around))[::-1], [(rings - 1) * around + i for i in range(around)]]
    faces += [[r * around + i, r * around + (i + 1) % around, (r + 1) * around + (i + 1) % around, (r + 1) * around + i]
              for r in range(rings - 1) for i in range(around)]
    mesh = bpy.data.meshes.new('tube')
    mesh.from_pydata(points, [], faces)
    uv = mesh.uv_layers.new()
    for p in mesh.polygons:
        for k, loop in enumerate(p.loop_indices): uv.data[loop].uv = ((k + p.index) % 4 / 4, p.index / len(faces))
    o = bpy.data.objects.new('tube', mesh)
    scene.collection.objects.link(o)
    bpy.ops.object.armature_add(enter_editmode=True)
    rig = bpy.context.object
    bones = rig.data.edit_bones
    bones[0].name, bones[0].head, bones[0].tail = 'low', (0, 0, 0), (0, 0, 1)
    for name, above in ('mid', 'low'), ('top', 'mid'):
        b = bones.new(name)
        b.parent, b.head = bones[above], bones[above].tail
        b.tail, b.use_connect = b.head + bones['low'].vector, True
    bpy.ops.object.mode_set(mode='OBJECT')
    for k, name in enumerate(('low', 'mid', 'top')):
        group = o.vertex_groups.new(name=name)
        for v in mesh.vertices: group.add([v.index], max(0, 1 - abs(v.co.z - k - 0.5)) + 0.01, 'REPLACE')
    rig.location, rig.rotation_euler = (0.3, -0.2, 0.1), (0.1, 0.2, 0.3)
    o.parent = rig
    o.modifiers.new('rig', 'ARMATURE').object = rig
    for k, name in enumerate(('low', 'mid', 'top')):
        b = rig.pose.bones[name]
        b.rotation_mode = 'XYZ'
        for frame in range(1, 7):
            b.rotation_euler = (0.15 * (frame - 1) * (k + 1), 0.1 * (frame - 1), -0.2 * k * (frame - 1))
            b.keyframe_insert('rotation_euler', frame=frame)
            if k == 0:
                b.location = (0.1 * frame, 0, 0.05 * frame)
                b.keyframe_insert('location', frame=frame)

def cube():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object # with texture coordinates in six islands
def export(name, o):
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 0, 4
    with open(name + '.txt', 'w') as out:
        for frame in range(5):
            show(frame)
            x = places(o, False)
            for i in range(0, len(x), 3): print(*x[i:i + 3], file=out)
    bpy.ops.export_scene.gltf(filepath=name + '.glb', export_yup=False)

bent()
bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath('bend.blend'))
truth('blend.truth', 1, 6)
bpy.ops.export_scene.fbx(filepath='bend.fbx', bake_anim_step=1, bake_anim_simplify_factor=0)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.fbx(filepath='bend.fbx')
truth('fbx.truth', 1, 6)

o = cube()
o.shape_key_add(name='Basis')
for i, name in enumerate(('up', 'out')):
    key = o.shape_key_add(name=name)
    for j, p in enumerate(key.data): p.co[2 - i] += 0.1 * j + 0.3
    for frame in range(5):
        key.value = (frame * (i + 1) % 5) / 5
        key.keyframe_insert('value', frame=frame)
export('keys', o)

o = cube()
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
    run_blender make.py
}

# like_truth STREAM TRUTH: the same positions, to the precision of binary32, and the same polygons
like_truth() {
    py "$@" <<'END'
import json, sys
from read_stream import read_stream
s, truth = read_stream(sys.argv[1]), json.load(open(sys.argv[2]))
faces = [list(s.mesh.vert[s.mesh.start[f]:s.mesh.start[f + 1]]) for f in range(len(s.mesh.start) - 1)]
assert faces == truth['faces'], 'other faces'
assert sorted(len(f) for f in faces)[-2:] == [12, 12]
assert len(s.frames) == len(truth['frames']) == 6
size = max(abs(c) for frame in truth['frames'] for c in frame)
for frame, want in zip(s.frames, truth['frames']):
    assert len(frame.values) == len(want) == 3 * 85
    worst = max(abs(a - b) for a, b in zip(frame.values, want))
    assert worst <= 1e-6 * size, worst
still, last = truth['frames'][0], truth['frames'][5]
assert max(abs(a - b) for a, b in zip(still, last)) > 0.5, 'nothing moves'
END
}

@test "from_blender: a .blend as a cache: positions, polygons, times, and the bones as BVH" {
    must_hand blender -b --factory-startup "$BATS_FILE_TMPDIR/bend.blend" --python "$ROOT/examples/blender/from_blender.py" -- \
        --bvh bend.bvh -o bend.pc2
    nothing_but bend.pc2 bend.obj bend.bvh
    must vg-encode bend.pc2 -o bend.vgs
    like_truth bend.vgs "$BATS_FILE_TMPDIR/blend.truth"
    must vg-info --frames bend.vgs
    shows 0.04 0.2
    [ "$(grep -c '^vt ' bend.obj)" -gt 70 ] || fail "texture coordinates are lost"
    must vg-encode bend.bvh -o bones.vgs
    py "$BATS_FILE_TMPDIR/blend.truth" <<'END'
import json, sys
from read_stream import read_stream
s, truth = read_stream('bones.vgs'), json.load(open(sys.argv[1]))
assert len(s.frames) == 6 and s.mesh.nv == 4
for frame, want in zip(s.frames, truth['heads']):
    worst = max(abs(a - b) for a, b in zip(frame.values, want)) # low mid top and the end of top
    assert worst < 1e-5, worst
END
}

@test "from_blender: an FBX as a directory of OBJ files" {
    must_hand from_blender "$BATS_FILE_TMPDIR/bend.fbx" --frames 1:6 -o bend/
    nothing_but bend
    must vg-encode bend -o bend.vgs
    like_truth bend.vgs "$BATS_FILE_TMPDIR/fbx.truth"
    must_refuse 2 "'bend' is there already and not empty" from_blender "$BATS_FILE_TMPDIR/bend.fbx" -o bend
}

@test "there and back: from_blender, a transfer, to_blender: shape keys, and a cache, play what was solved" {
    must_hand from_blender "$BATS_FILE_TMPDIR/bend.blend" -o bend.pc2
    awk '$1 == "v" {print "v", 2 * $2, $3, 1.5 * $4} $1 == "f"' bend.obj | sed 's|/[0-9]*||g' >big.obj
    must bash -o pipefail -c 'vg-encode bend.pc2 | vg-deform --onto big.obj | vg-solve -o big.vgs'
    must vg-decode -q -o big.pc2 --mesh rest.obj big.vgs
    must vg-decode -q -o big.mdd --no-mesh big.vgs
    must vg-decode -q -o big-%d.obj big.vgs
    must vg-decode -q --no-normals -o big.glb big.vgs # which would cut vertices apart at sharp edges
    must_hand to_blender big.pc2 --mesh rest.obj -o keys.blend
    must_hand to_blender --cache --mesh rest.obj big.mdd -o cache.blend
    must_hand to_blender big.glb -o glb.blend
    cat >reopen.py <<'END'
import bpy, os
from look import body, places, show
def numbers(i): return [float(w) for line in open(f'big-{i}.obj') if line.startswith('v ') for w in line.split()[1:4]]
sizes = lambda mesh: sorted(len(p.vertices) for p in mesh.polygons)
for name in 'keys', 'cache', 'glb':
    bpy.ops.wm.open_mainfile(filepath=os.path.abspath(name + '.blend'))
    o, scene, worst = body(), bpy.context.scene, 0
    assert len(o.data.vertices) == (84 if name == 'glb' else 85), (name, len(o.data.vertices)) # its own importer drops the one in no face
    if name != 'glb': assert sizes(o.data) == [4] * 72 + [12] * 2, name
    rate, first, last = scene.render.fps / scene.render.fps_base, scene.frame_start, scene.frame_end
    assert name == 'glb' or (first, last, round(rate, 4)) == (1, 6, 25), (name, first, last, rate)
    step = rate / 25 if name == 'glb' else 1
    if name == 'keys':
        keys = o.data.shape_keys.key_blocks
        assert len(keys) == 7
        for i in range(6): # each by itself, whatever plays them
            x = [c for p in keys[i + 1].data for c in (p.co.x, p.co.z, -p.co.y)]
            worst = max(worst, max(abs(a - b) for a, b in zip(x, numbers(i))))
    for i in range(6):
        show(first + i * step)
        x, want = places(o), numbers(i)
        assert len(x) == len(want) - 3 * (name == 'glb') # the last
        worst = max(worst, max(abs(a - b) for a, b in zip(x, want)))
    size = max(abs(c) for c in want)
    print('WORST', name, worst / size)
    assert worst <= (5e-6 if name == 'glb' else 1e-6) * size, (name, worst)
END
    run_blender reopen.py
    shows 'WORST keys' 'WORST cache' 'WORST glb'
}

@test "what Blender exports of a mesh with seams reads as the motion of its own vertices" {
    local name
    for name in keys bones; do
        pipe "vg-encode $BATS_FILE_TMPDIR/$name.glb | vg-info | tr -s ' '"
        shows 'vertices 8' 'faces 12: 12 of 3' 'frames 5'
        must vg-decode -q -o $name-%d.obj "$BATS_FILE_TMPDIR/$name.glb"
        py $name "$BATS_FILE_TMPDIR/$name.txt" <<'END'
import sys
name = sys.argv[1]
truth = [[float(w) for w in line.split()] for line in open(sys.argv[2])]
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

@test "what vg-decode writes Blender plays and reads: PC2, MDD, GLB; OBJ, PLY, STL" {
    poses two 3
    must vg-encode --fps 25 pose1.obj pose2.obj pose3.obj -o walk.vgs
    awk '$1 == "v" {print $2, $3, $4}' pose1.obj pose2.obj pose3.obj >truth.txt
    local suffix
    for suffix in pc2 mdd; do must vg-decode -q -o walk.$suffix walk.vgs; done
    must vg-decode -q --no-normals -o walk.glb walk.vgs
    for suffix in obj ply stl; do must vg-decode -q -o pose.$suffix pose2.obj; done
    cat >play.py <<'END'
import bpy, numpy, os
from look import body, places, show
if 'bool' not in numpy.__dict__: numpy.bool = bool # Blender 3.4 still asks for it, Debian's NumPy has dropped it
truth = [float(w) for w in open('truth.txt').read().split()]
size = max(abs(c) for c in truth)
def judge(what, o, first, turned, bound=1e-6):
    worst = 0
    for frame in range(3):
        show(first + frame)
        x, part = places(o, turned), truth[36 * frame:36 * frame + 36]
        assert len(x) == 36, (what, len(x))
        worst = max(worst, max(abs(p - q) for p, q in zip(x, part)))
    print('WORST', what, worst / size)
    assert worst <= bound * size, (what, worst)
for path, kind in ('walk.pc2', 'PC2'), ('walk.mdd', 'MDD'):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath='walk.obj', forward_axis='Y', up_axis='Z')
    cache = body().modifiers.new('cache', 'MESH_CACHE')
    cache.cache_format, cache.filepath = kind, os.path.abspath(path)
    cache.frame_start, cache.interpolation = 0, 'NONE'
    judge(path, body(), 0, False)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 25
bpy.ops.import_scene.gltf(filepath='walk.glb')
keys = body().data.shape_keys
print('NAMES', [k.name for k in keys.key_blocks][1:])
strip = keys.animation_data
strip.action = strip.action or strip.nla_tracks[0].strips[0].action
judge('walk.glb', body(), round(strip.action.frame_range[0]), True, bound=3e-6) # base and displacement are rounded apart
def read(what, importer, count, **axes):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    importer(filepath='pose.' + what, **axes)
    x, want = places(body(), False), truth[36:72]
    found, sought = (sorted(tuple(round(c, 4) for c in p[i:i + 3]) for i in range(0, len(p), 3)) for p in (x, want))
    sizes = [len(p.vertices) for p in body().data.polygons]
    print('READ', what, len(found), sizes)
    if what == 'stl': assert found == sought and sizes == [3] * count
    else: assert max(abs(p - q) for p, q in zip(x, want)) <= 1e-6 * size and sizes == [4] * 6 + [3] * 4
    assert len(sizes) == count
read('obj', bpy.ops.wm.obj_import, 10, forward_axis='Y', up_axis='Z')
read('ply', bpy.ops.import_mesh.ply, 10)
read('stl', bpy.ops.import_mesh.stl, 16)
END
    run_blender play.py
    shows "NAMES ['pose1', 'pose2', 'pose3']" 'WORST walk.pc2' 'WORST walk.mdd' 'WORST walk.glb' 'READ obj' 'READ ply' 'READ stl'
}

@test "a skin of ours bends in Blender as linear blend skinning does, from bones with their names" {
    py <<'END'
import make_skin
make_skin.make()
END
    must vg-decode --no-normals -o bar.glb bar.vgs
    cat >play.py <<'END'
import bpy, json, numpy
from look import body, places, show
if 'bool' not in numpy.__dict__: numpy.bool = bool # Blender 3.4 still asks for it, Debian's NumPy has dropped it
truth = json.load(open('truth.json'))['frames']
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 25
bpy.ops.import_scene.gltf(filepath='bar.glb')
rig = next(o for o in bpy.data.objects if o.type == 'ARMATURE')
print('BONES', [b.name for b in rig.data.bones])
first, worst = round(bpy.data.actions[0].frame_range[0]), 0
for i, want in enumerate(truth):
    show(first + i)
    x = places(max((o for o in bpy.data.objects if o.type == 'MESH' and o.vertex_groups), key=lambda o: len(o.data.vertices)))
    assert len(x) == len(want)
    worst = max(worst, max(abs(a - b) for a, b in zip(x, want)))
size = max(abs(c) for frame in truth for c in frame)
print('WORST', worst / size)
assert worst <= 3e-6 * size, worst # Blender keeps the bones' matrices in binary32 and multiplies them
END
    run_blender play.py
    shows "BONES ['low', 'mid', 'top'" WORST
}

@test "the scripts refuse, and end with a status that says so" {
    must_refuse 4 "cannot use 'none.fbx': No such file" from_blender none.fbx -o out.pc2
    must_refuse 2 "cannot read 'a.txt': known are .blend" from_blender a.txt -o out.pc2
    must_refuse 3 "there is no mesh object 'arm': the scene has 'tube'" from_blender "$BATS_FILE_TMPDIR/bend.blend" --object arm -o out.pc2
    must_refuse 3 "no armature bends" from_blender "$BATS_FILE_TMPDIR/keys.glb" --bvh out.bvh -o out.pc2
    echo junk >junk.fbx
    must_refuse 3 "cannot read 'junk.fbx'" from_blender junk.fbx -o out.pc2
    poses cube 2
    must vg-encode pose1.obj pose2.obj -o walk.vgs
    must vg-decode -q -o walk.pc2 walk.vgs
    head -c 100 walk.pc2 >cut.pc2
    must_refuse 3 "'cut.pc2' is not whole" to_blender cut.pc2 --mesh walk.obj -o out.blend
    mesh tetra >tetra.obj
    must_refuse 3 "'tetra.obj' has 4 vertices where 'walk.pc2' has 8" to_blender walk.pc2 --mesh tetra.obj -o out.blend
    must_refuse 2 "'out.obj' does not end in .blend" to_blender walk.pc2 -o out.obj
    nothing_but cut.pc2 junk.fbx pose1.obj pose2.obj tetra.obj walk.obj walk.pc2 walk.vgs
}
