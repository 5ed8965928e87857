#!/usr/bin/env bats
# The add-on for Blender, as its zip installs it: every operator on real data gives what the same pipe gives in a shell, to the precision of
# Blender's binary32. Runs where Blender is installed.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

setup_file() {
    command -v blender >/dev/null || return 0
    local BATS_TEST_TMPDIR=$BATS_FILE_TMPDIR # where capture keeps what was said
    cd "$BATS_FILE_TMPDIR" || return 1
    python3 "$ROOT/examples/blender/pack.py" vg_tools.zip
    # what the tests share: worlds made of streams, and how far a result is from a stream
    cat >world.py <<'END'
import bpy, numpy, os, sys, traceback
HERE = os.path.dirname(os.path.abspath(__file__))
if 'bool' not in numpy.__dict__: numpy.bool = bool
if bpy.app.background: bpy.ops.wm.read_factory_settings(use_empty=True)
else: bpy.data.batch_remove(list(bpy.data.objects)) # the window's context stays
bpy.ops.preferences.addon_install(filepath=os.path.join(HERE, 'vg_tools.zip'))
bpy.ops.preferences.addon_enable(module='vg_tools')
import vg_tools
from vg_tools import vgstream, bodies
scene = bpy.context.scene
vg = scene.vg

def stream(path):
    reader = vgstream.Reader(path)
    return reader, [f for f in reader]
def mesh_of(name, points, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(bodies.from_file(points).tolist(), [f for f in faces if len(f) == 2], [f for f in faces if len(f) > 2])
    thing = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(thing)
    return thing
def rest_of(reader):
    return numpy.array(reader.reference).reshape(-1, 3)
def body(name, path, played=True):
    """A stream as an object: the reference pose as its mesh, frames as shape keys, played from frame 1 on."""
    reader, frames = stream(path)
    thing = mesh_of(name, rest_of(reader), reader.faces)
    bodies.give_keys(thing, [f.name for f in frames], [f.values for f in frames], list(range(1, len(frames) + 1)) if played else None, scene)
    if played: scene.frame_start, scene.frame_end = 1, len(frames)
    return thing
def shown(thing, frame):
    scene.frame_set(frame)
    return bodies.shown_points(thing, scene)
def far(a, b):
    """The largest distance of a vertex, in the diagonal of b."""
    a, b = numpy.asarray(a, float), numpy.asarray(b, float)
    assert a.shape == b.shape, (a.shape, b.shape)
    return numpy.sqrt(((a - b) ** 2).sum(1)).max() / numpy.sqrt(((b.max(0) - b.min(0)) ** 2).sum())
def check(what, worst, bound):
    print('WORST %s %.2e' % (what, worst))
    assert worst <= bound, (what, worst, bound)
def plays(thing, path, bound=5e-6, first=1):
    """The object plays the frames of a stream on the time line."""
    _, frames = stream(path)
    check(thing.name, max(far(shown(thing, first + i), f.values) for i, f in enumerate(frames)), bound)
def refused(op, words):
    before = set(bpy.data.objects.keys())
    try: op()
    except RuntimeError as error:
        assert words in str(error), (words, str(error))
        assert set(bpy.data.objects.keys()) == before, 'something was made'
    else: raise AssertionError('not refused: ' + words)
def newest(before):
    new = [o for o in bpy.data.objects if o.name not in before]
    assert len(new) == 1, new
    return new[0]
def made_by(op):
    before = set(bpy.data.objects.keys())
    assert op() == {'FINISHED'}
    return newest(before)
END
}

setup() {
    command -v blender >/dev/null || skip "blender is not installed"
    cd "$BATS_TEST_TMPDIR" || return 1
    export BLENDER_USER_SCRIPTS=$BATS_TEST_TMPDIR/scripts BLENDER_USER_CONFIG=$BATS_TEST_TMPDIR/config
}

# in_blender: the script from standard input, which must succeed
in_blender() {
    cat >script.py
    capture env DATA="$DATA" PYTHONPATH="$BATS_FILE_TMPDIR" blender --background --factory-startup --python-use-system-env --python-exit-code 1 --python script.py
    [ "$status" = 0 ] || fail "$output" "$stderr"
}

@test "transfer: the same faces, as shape keys and as a cache; n-gons, modifiers, a scene of centimetres" {
    must vg-encode --reference "$DATA/trex.rest.obj" --take 0-5 "$DATA/trex-attack.tar.xz" -o trex.vgs
    awk '$1 == "v" {print "v", 1.4 * $2, $3, 0.8 * $4} $1 != "v"' "$DATA/trex.rest.obj" >stout.obj
    must vg-encode stout.obj -o stout.vgs
    pipe 'vg-deform --onto stout.obj trex.vgs | vg-solve -o want.vgs'
    pipe 'vg-deform --onto stout.obj --by pose --root stay trex.vgs | vg-solve --fit squares -o fast.vgs'
    in_blender <<'END'
from world import *
source, target = body('trex', 'trex.vgs'), body('stout', 'stout.vgs', False)
target.shape_key_clear()
target.modifiers.new('round', 'SUBSURF').levels = 1
source.modifiers.new('round', 'SUBSURF').levels = 1
vg.source.object, vg.target = source, target
scene.frame_set(3)
made = made_by(bpy.ops.vg.transfer)
assert scene.frame_current == 3 and made.data is not target.data and not target.data.shape_keys
assert source.modifiers['round'].show_viewport and made.modifiers['round'].show_viewport
sizes = [len(p.vertices) for p in made.data.polygons]
assert sizes == [len(p.vertices) for p in target.data.polygons] and max(sizes) > 10
made.modifiers['round'].show_viewport = False
plays(made, 'want.vgs')
assert [k.name for k in made.data.shape_keys.key_blocks][1] == 'trex.0001'

vg.by, vg.root, vg.fast, vg.result, vg.folder = 'POSE', 'STAY', True, 'CACHE', os.getcwd()
cached = made_by(bpy.ops.vg.transfer)
cached.modifiers['round'].show_viewport = False
plays(cached, 'fast.vgs')
vg.source.whole, vg.source.start, vg.source.end, vg.source.step = False, 2, 6, 2
sparse = made_by(bpy.ops.vg.transfer)
sparse.modifiers['round'].show_viewport = False
_, fast = stream('fast.vgs')

check('sparse', max(far(shown(sparse, f), fast[f - 1].values) for f in (2, 4, 6)), 5e-6)
vg.folder = '//'
refused(bpy.ops.vg.transfer, 'save the .blend file first')
vg.result, vg.source.whole = 'KEYS', True

# the same in a scene whose unit is a centimetre: objects are larger by 100
from mathutils import Matrix
scene.unit_settings.system, scene.unit_settings.scale_length = 'METRIC', 0.01
for thing in source, target: thing.matrix_world = Matrix.Scale(100, 4)
vg.by, vg.root, vg.fast = 'DEFAULT', 'CENTROID', False
again = made_by(bpy.ops.vg.transfer)
again.modifiers['round'].show_viewport = False
plays(again, 'want.vgs')

vg.source.whole, vg.source.start, vg.source.end, vg.source.step = False, 1, 5, 2
few = made_by(bpy.ops.vg.transfer)
assert len(few.data.shape_keys.key_blocks) == 4 and few.data.shape_keys.key_blocks[2].name == 'trex.0003'
END
    shows 'WORST stout as trex ' 'WORST stout as trex.001' 'WORST sparse' 'WORST stout as trex.003'
}

@test "transfer: a target of several components with normals of its own, in a scene of metres: both survive" {
    must vg-encode --reference "$DATA/woman-tanktop.rest.obj" --take 20-23 "$DATA/woman-tanktop-jump.tar.xz" -o woman.vgs
    awk '$1 == "v" {print "v", 1.2 * $2, $3, $4} $1 != "v"' "$DATA/woman-tanktop.rest.obj" >wide.obj
    must vg-encode wide.obj -o wide.vgs
    pipe 'vg-deform --onto wide.obj woman.vgs | vg-solve -o want.vgs'
    in_blender <<'END'
from world import *
def normals_of(mesh):
    if hasattr(mesh, 'calc_normals_split'): mesh.calc_normals_split()
    found = numpy.empty(3 * len(mesh.loops), numpy.float32)
    (mesh.loops if hasattr(mesh, 'calc_normals_split') else mesh.corner_normals).foreach_get(
        'normal' if hasattr(mesh, 'calc_normals_split') else 'vector', found)
    return found.reshape(-1, 3)
def parts_of(mesh):
    above = list(range(len(mesh.vertices)))
    def top(i):
        while above[i] != i: above[i] = i = above[above[i]]
        return i
    for e in mesh.edges: above[top(e.vertices[0])] = top(e.vertices[1])
    return len({top(i) for i in above})

source, target = body('woman', 'woman.vgs'), body('wide', 'wide.vgs', False)
target.shape_key_clear()
if hasattr(target.data, 'use_auto_smooth'): target.data.use_auto_smooth = True
target.data.normals_split_custom_set([(0.0, 0.6, 0.8)] * len(target.data.loops))
assert parts_of(target.data) > 1
scene.unit_settings.system, scene.unit_settings.scale_length = 'METRIC', 1.0
vg.source.object, vg.target = source, target
made = made_by(bpy.ops.vg.transfer)
assert made.data.has_custom_normals and target.data.has_custom_normals
given, kept = normals_of(target.data), normals_of(made.data)
assert numpy.abs(given - numpy.array([0.0, 0.6, 0.8])).max() < 0.02 # Blender keeps two numbers of 16 bits
check('normals', numpy.abs(kept - given).max(), 1e-6)
assert parts_of(made.data) == parts_of(target.data)
plays(made, 'want.vgs')
END
    shows 'WORST normals' 'WORST wide as woman '
}

@test "transfer: other faces by pairs of vertex groups and empties, refused without; what a program says is kept" {
    must vg-encode --reference "$DATA/velociraptor.rest.obj" --take 0-3 "$DATA/velociraptor-run.tar.xz" -o run.vgs
    must vg-encode "$DATA/trex.rest.obj" -o trex.vgs
    sed 's|#.*||; /^ *$/d' "$DATA/velociraptor-trex.markers.txt" | awk '{row[NR] = $0} END {for (k = 0; k < 2; k++) for (i = 2 - k; i <= NR; i += 2) print row[i]}' >markers.txt
    in_blender <<'END'
from world import *
source, target = body('raptor', 'run.vgs'), body('trex', 'trex.vgs', False)
vg.source.object, vg.target = source, target
refused(bpy.ops.vg.transfer, 'at least 3 are needed')
rows = [line.split() for line in open('markers.txt')]
for i, words in enumerate(rows):
    for thing, v in zip((source, target), map(int, words[-2:])):
        if i < len(rows) // 2:
            thing.vertex_groups.new(name='m%02d' % i).add([v], 1, 'REPLACE')
        else:
            spot = bpy.data.objects.new('e%02d' % i, None)
            scene.collection.objects.link(spot)
            spot.parent, spot.location = thing, bodies.rest_points(thing)[v]
bpy.context.view_layer.update()
found = vg_tools.transfer.pairs(source, target)
assert sorted(p[1:] for p in found) == sorted(tuple(map(int, w[-2:])) for w in rows), found
made = made_by(bpy.ops.vg.transfer)
# pairing amplifies the rounding to binary32 (nearest points), so the shell gets the rounded positions
vg_tools.programs.Body(bodies.rest_body(source, scene).reference, bodies.faces_of(source.data)).write('source.vgs')
bodies.rest_body(target, scene).write('target.vgs')
bodies.all_of(bodies.poses(vg.source, scene)).write('run32.vgs')
for name, thing in ('run.vgs', source),: check('source', max(far(shown(thing, 1 + i), f.values) for i, f in enumerate(stream(name)[1])), 1e-6)
import subprocess
subprocess.run('vg-register -q source.vgs target.vgs --markers markers.txt -o pairs.vgs && '
               'vg-deform --onto target.vgs --correspondence pairs.vgs run32.vgs | vg-solve -o want.vgs', shell=True, check=True)
plays(made, 'want.vgs')

bpy.ops.object.select_all(action='DESELECT')
for thing, v in (source, 7), (target, 9):
    thing.select_set(True)
    thing.data.vertices.foreach_set('select', [i == v for i in range(len(thing.data.vertices))])
bpy.context.view_layer.objects.active = target
assert bpy.ops.vg.pair() == {'FINISHED'}
assert ('pair_01', 7, 9) in vg_tools.transfer.pairs(source, target)
vg_tools.programs.Programs.folder = '/nowhere'
refused(bpy.ops.vg.transfer, "'/nowhere' has no vg-register")
assert vg_tools.work.State.failed and not vg_tools.work.State.title
END
    shows 'WORST source' 'WORST trex as raptor'
}

@test "shapes: names, ranges and drivers; onto a head that has some already; follow sculpted poses" {
    must vg-encode --take 1-5 --reference "$DATA/faceA.tar.xz" "$DATA/faceA.tar.xz" -o a.vgs
    must vg-encode --take 0-5 "$DATA/faceB.tar.xz" -o b.vgs
    pipe 'vg-encode --take 0 b.vgs -o neutral.vgs && vg-deform --onto neutral.vgs a.vgs | vg-solve -o want.vgs'
    must vg-encode --take 2,4 b.vgs -o sculpted.vgs
    must vg-encode --take 1,3 a.vgs -o known.vgs
    pipe 'vg-deform --onto neutral.vgs --examples known.vgs sculpted.vgs a.vgs | vg-solve -o better.vgs'
    pipe 'vg-encode --take 2 b.vgs -o key.vgs && vg-deform --onto neutral.vgs a.vgs | vg-solve | vg-poisson --key 1=key.vgs -o guided.vgs'
    in_blender <<'END'
from world import *
source, target = body('a', 'a.vgs', False), body('b', 'neutral.vgs', False)
target.shape_key_clear()
names = [k.name for k in source.data.shape_keys.key_blocks][1:]
target.shape_key_add(name='Basis')
target.shape_key_add(name='own').data[0].co.x += 1
target.shape_key_add(name=names[1])
source.data.shape_keys.key_blocks[names[2]].slider_max = 2
source['smile'] = 0.25
driver = source.data.shape_keys.driver_add('key_blocks["%s"].value' % names[0]).driver
variable = driver.variables.new()
variable.targets[0].id, variable.targets[0].data_path, driver.expression = source, '["smile"]', 'var * 2'
vg.source.kind, vg.source.object, vg.target = 'KEYS', source, target
assert bpy.ops.vg.shapes() == {'FINISHED'}
keys = target.data.shape_keys
assert [k.name for k in keys.key_blocks] == ['Basis', 'own', names[1], names[0]] + names[2:]
_, want = stream('want.vgs')
check('shapes', max(far(bodies.to_file(bodies.positions(keys.key_blocks[n].data)), f.values) for n, f in zip(names, want)), 1e-5)
assert keys.key_blocks[names[2]].slider_max == 2
bpy.context.view_layer.update()
assert abs(keys.evaluated_get(bpy.context.evaluated_depsgraph_get()).key_blocks[names[0]].value - 0.5) < 1e-6

# what is sculpted by the names of poses is followed, in all poses or in time
sculpted, frames = body('sculpted', 'neutral.vgs', False), stream('sculpted.vgs')[1]
sculpted.shape_key_clear()
for n, f in zip((names[1], names[3]), frames): bodies.add_key(sculpted, n, bodies.from_file(f.values))
vg.guide = sculpted
made = made_by(bpy.ops.vg.transfer)
of = lambda thing, n: bodies.to_file(bodies.positions(thing.data.shape_keys.key_blocks[n].data))
_, better = stream('better.vgs')
check('examples', max(far(of(made, n), f.values) for n, f in zip(names, better)), 1e-5)
sculpted.shape_key_remove(sculpted.data.shape_keys.key_blocks[names[3]])
vg.guide_by = 'POISSON'
made = made_by(bpy.ops.vg.transfer)
_, guided = stream('guided.vgs')
check('poisson', max(far(of(made, n), f.values) for n, f in zip(names, guided)), 1e-5)
check('key', far(of(made, names[1]), frames[0].values), 1e-6)
sculpted.data.shape_keys.key_blocks[1].name = 'other'
refused(bpy.ops.vg.transfer, 'has the name of a pose')
END
    shows 'WORST shapes' 'WORST examples' 'WORST poisson'
}

@test "envelope: a rig learnt and fitted, the mesh follows the bones as vg-play has them, turned bones, a baked motion; a skeleton's motion for another" {
    must vg-encode --reference "$DATA/trex.rest.obj" --take 0-28/2 "$DATA/trex-attack.tar.xz" -o poses.vgs
    pipe 'vg-encode '"$DATA"'/trex.rest.obj poses.vgs | vg-fitmap -q --skeleton '"$DATA"'/trex.skeleton.txt -o learnt.rig'
    must vg-play --transforms learnt.rig poses.vgs -o motions.vgs
    in_blender <<'END'
from world import *
from vg_tools import envelope, skeleton
import subprocess
data = os.environ['DATA']
shell = lambda line: subprocess.run(['bash', '-o', 'pipefail', '-c', line], check=True)
trex = body('trex', 'poses.vgs')
rows = [line.split() for line in open(data + '/trex.skeleton.txt') if line.strip() and not line.startswith('#')]
def armature(name, scale):
    arm = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    scene.collection.objects.link(arm)
    bpy.context.view_layer.objects.active = arm
    bpy.ops.object.mode_set(mode='EDIT')
    for w in rows:
        bone = arm.data.edit_bones.new(w[0])
        bone.head, bone.tail = bodies.from_file(numpy.array([w[2:5], w[5:8]], float) * scale)
        bone.parent = arm.data.edit_bones.get(w[1])
    bpy.ops.object.mode_set(mode='OBJECT')
    return arm
arm = armature('rig', 1)
vg.source.object, vg.armature, vg.learn, vg.body = trex, arm, True, trex
refused(bpy.ops.vg.envelope, 'choose where the rig is written')
vg.rig_file = os.path.abspath('blender.rig')
assert bpy.ops.vg.envelope() == {'FINISHED'}
assert any('bones' in line for line in vg_tools.work.State.lines), vg_tools.work.State.lines
shell('vg-play blender.rig poses.vgs -o b.vgs && vg-play learnt.rig poses.vgs -o s.vgs')
pairs = list(zip(stream('b.vgs')[1], stream('s.vgs')[1]))
check('learnt', max(far(a.values, b.values) for a, b in pairs), 1e-4)

# the motion of the bones, baked on the armature from what vg-play says of them
moved, frames = stream('motions.vgs')
rig = envelope.Rig('learnt.rig')
joints = skeleton.Joints(arm, scene)
number = [rig.bones.index(b.replace(' ', '_')) for b in joints.bones]
motion = []
for f in frames:
    q = numpy.array([skeleton.rotation(f.values[k, :4]) for k in number])
    motion.append((numpy.einsum('jab,jb->ja', q, joints.rest) + f.values[number, 4:], q))
skeleton.bake(arm, joints, motion, list(range(1, len(frames) + 1)), 'walk')
driver = envelope.Driver(envelope.Rig('blender.rig'), arm, scene)
worst = 0
for i, f in enumerate(frames):
    scene.frame_set(i + 1)
    got = driver.motions(arm)
    want = f.values[[rig.bones.index(b) for b in driver.rig.bones]]
    sign = numpy.sign((got[:, :4] * want[:, :4]).sum(1))[:, None]
    worst = max(worst, numpy.abs(got[:, :4] * sign - want[:, :4]).max())
check('turns', worst, 2e-6)

# live: the mesh follows; what it shows is what vg-play gives for the same motion
vg.rig_file = os.path.abspath('learnt.rig')
shell('vg-play learnt.rig motions.vgs -o want.vgs')
_, want = stream('want.vgs')
before = trex.data.copy()
assert bpy.ops.vg.follow() == {'FINISHED'} and envelope.Follow.active()
for key in trex.data.shape_keys.key_blocks[1:-1]: key.mute = True
worst = 0
for i, f in enumerate(want):
    scene.frame_set(i + 1)
    envelope.follow_now(bpy.context)
    bpy.context.view_layer.update()
    worst = max(worst, far(bodies.shown_points(trex, scene), f.values))
check('follow', worst, 5e-6)
scene.frame_set(1)
bpy.context.view_layer.objects.active = arm
arm.animation_data.action = None
for b in arm.pose.bones: b.matrix_basis.identity()
bpy.ops.object.mode_set(mode='POSE')
arm.data.bones.active = arm.data.bones['Head']
bpy.ops.vg.turn(axis='TWIST', angle=0.5)
arm.data.bones.active = arm.data.bones['Tail1']
bpy.ops.vg.turn(axis='Y', angle=-0.4)
shell("vg-play learnt.rig --edit 'Tail1 y %.12g' -o edit.vgs" % numpy.degrees(-0.4))
arm.pose.bones['Head'].matrix_basis.identity()
envelope.follow_now(bpy.context)
bpy.context.view_layer.update()
_, edited = stream('edit.vgs')
check('edit', far(bodies.shown_points(trex, scene), edited[0].values), 5e-6)
bpy.ops.object.mode_set(mode='OBJECT')
assert bpy.ops.vg.follow() == {'FINISHED'} and not envelope.Follow.active()
assert 'vg live' not in trex.data.shape_keys.key_blocks

# baked, and fitted with the motion known
arm.animation_data.action = bpy.data.actions['walk']
made = made_by(bpy.ops.vg.bake)
plays(made, 'want.vgs')
vg.learn, vg.rig_file = False, os.path.abspath('known.rig')
for key in trex.data.shape_keys.key_blocks: key.mute = False
assert bpy.ops.vg.envelope() == {'FINISHED'}
made = made_by(bpy.ops.vg.bake)
_, truth = stream('poses.vgs')
mean = lambda path_or_obj: numpy.mean([numpy.sqrt(((shown(path_or_obj, i + 1) - f.values) ** 2).sum(1)).mean() for i, f in enumerate(truth)])
learnt = numpy.mean([numpy.sqrt(((w.values - f.values) ** 2).sum(1)).mean() for w, f in zip(want, truth)])
print('FITTED', mean(made), learnt)
assert mean(made) < 1.1 * learnt

# the motion for an armature of other proportions
other = armature('other', numpy.array([1.2, 0.9, 1.1]))
vg.source.object, vg.target = arm, other
baked = made_by(bpy.ops.vg.transfer)
source, onto = bodies.all_of(skeleton.walk(arm, vg.source, scene)), skeleton.Skeleton(skeleton.Joints(other, scene))
source.write('arm.vgs'); onto.write('other.vgs')
shell('vg-deform --onto other.vgs arm.vgs | vg-solve | vg-decode -q -o out.bvh && vg-encode out.bvh -o out.vgs')
_, want = stream('out.vgs')
joints, worst = skeleton.Joints(baked, scene), 0
for i, f in enumerate(want):
    scene.frame_set(i + 1)
    worst = max(worst, far(joints.pose(baked)[0], f.values))
check('skeleton', worst, 1e-5)
END
    shows 'WORST learnt' 'WORST follow' 'WORST edit' FITTED 'WORST skeleton'
}

@test "between: interpolation and extrapolation, by geodesics and by a map; morphing; patches as colours; a slider; the map of another body" {
    must vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o run.vgs
    must vg-encode --take 0,5 run.vgs -o keys.vgs
    must vg-decode -q -o key-%d.obj keys.vgs
    pipe 'vg-encode key-0.obj key-1.obj | vg-interpolate --at -0.5,0,0.5,1,1.5 | vg-solve -o first.vgs' # the first pose is the rest pose
    awk '$1 == "v" {print "v", 1.3 * $2, $3, 0.8 * $4} $1 != "v"' "$DATA/horse.rest.obj" >stout.obj
    must vg-encode stout.obj -o stout.vgs
    must vg-encode "$DATA/horse.rest.obj" -o rest.vgs
    pipe 'vg-interpolate --at -0.5,0,0.5,1,1.5 keys.vgs | vg-solve -o between.vgs'
    pipe 'vg-encode '"$DATA"'/horse.rest.obj stout.obj | vg-interpolate --at 0,0.5,1 | vg-solve -o morphed.vgs'
    must vg-segment -q -k 12 --connected run.vgs -o horse.patches
    in_blender <<'END'
from world import *
from vg_tools import between
keys = body('keys', 'keys.vgs')
run = body('run', 'run.vgs')
stout = body('stout', 'stout.vgs', False)
stout.shape_key_clear()
vg.source.object, vg.source.kind, vg.count, vg.t_min, vg.t_max = keys, 'KEYS', 5, -0.5, 1.5
made = made_by(bpy.ops.vg.interpolate)
plays(made, 'between.vgs')
single = [o for o in (mesh_of('p%d' % i, f.values, stream('keys.vgs')[0].faces) for i, f in enumerate(stream('keys.vgs')[1]))]
poses = bpy.data.collections.new('poses')
for o in single: poses.objects.link(o); o.location.x += 5
vg.source.kind, vg.source.collection = 'OBJECTS', poses
made = made_by(bpy.ops.vg.interpolate)
assert made.location.x == 0
plays(made, 'first.vgs')
vg.source.kind, vg.source.object, vg.target, vg.count, vg.t_min, vg.t_max = 'FRAMES', run, stout, 3, 0, 1
made = made_by(bpy.ops.vg.morph)
plays(made, 'morphed.vgs')

scene.frame_end = 21
vg.patches, vg.map_file = 12, os.path.abspath('b.map')
assert bpy.ops.vg.patches() == {'FINISHED'}
patch, count = between.patches_of('horse.patches')
got = [v.value for v in run.data.attributes['vg patch'].data]
assert got == list(patch), 'other patches'
colours = numpy.array([tuple(c.color_srgb) for c in run.data.color_attributes['vg patches'].data])
ends = numpy.cumsum([len(p.vertices) for p in run.data.polygons])
assert len({tuple(colours[e - 1]) for e in ends}) == len(set(patch)) and run.data.color_attributes.active_color.name == 'vg patches'
assert all(numpy.ptp(colours[a:b], 0).max() == 0 for a, b in zip([0, *ends], ends)), 'a face of two colours'
assert bpy.ops.vg.map() == {'FINISHED'}
# the fit of a map to 21 poses amplifies the rounding to binary32, so the shell gets the rounded positions
bodies.all_of(bodies.poses(vg.source, scene)).write('run32.vgs')
import subprocess
subprocess.run("""set -e
vg-segment -q -k 12 --connected run32.vgs -o p.patches
vg-fitmap -q --patches p.patches run32.vgs -o horse.map
vg-play horse.map --at -0.5,0,0.5,1,1.5 keys.vgs -o mapped.vgs
vg-play horse.map run32.vgs -o played.vgs
vg-retarget --onto stout.obj --morph 0.5 horse.map -o half.map
vg-play half.map run32.vgs -o half.vgs
vg-play horse.map --at 0.3 keys.vgs -o slid.vgs""", shell=True, check=True)
made = made_by(bpy.ops.vg.play)
plays(made, 'played.vgs')
vg.source.kind, vg.source.object, vg.way, vg.count, vg.t_min, vg.t_max = 'KEYS', keys, 'MAP', 5, -0.5, 1.5
plays(made_by(bpy.ops.vg.interpolate), 'mapped.vgs')

vg.body = run
assert bpy.ops.vg.slide() == {'FINISHED'} and between.Slider.live
vg.slider = 0.3
between.Slider.live.wait()
vg.slider = 0.2; vg.slider = 0.3
points = between.Slider.live.wait()
check('slider', far(points, stream('slid.vgs')[1][0].values), 1e-4)
assert bpy.ops.vg.slide() == {'FINISHED'} and not between.Slider.live

vg.map_out, vg.morph_by, vg.source.kind, vg.source.object, vg.body = os.path.abspath('b-half.map'), 0.5, 'FRAMES', run, stout
assert bpy.ops.vg.retarget() == {'FINISHED'} and vg.map_file == vg.map_out
plays(made_by(bpy.ops.vg.play), 'half.vgs')
vg.map_file = os.path.abspath('nothing.map')
refused(bpy.ops.vg.play, 'there is no file')
END
    shows 'WORST keys between' 'WORST p0 between' 'WORST run morphed' 'WORST run played' 'WORST slider' 'WORST stout played'
}

@test "signals: fit, the pose plane's page, edits, speed, keyed moments, forth and back for ever; a network goes on" {
    must vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o run.vgs
    must vg-fitsignal -q --tolerance 0.01 run.vgs -o horse.signal
    echo 'control 5 0.1 0.3' >edits.txt
    must vg-sample --edit edits.txt horse.signal -o edited.vgs
    must vg-sample --speed 0.5 horse.signal -o slow.vgs
    must vg-sample --at 1,3.5,6,8.5,11 horse.signal -o retimed.vgs
    must vg-train -q --iterations 3 run.vgs -o horse.net
    must vg-encode --take 0-4 run.vgs -o some.vgs
    pipe 'vg-generate -q horse.net --frames 6 --diversity 0.3 --seed 3 some.vgs | vg-solve -o on.vgs'
    in_blender <<'END'
from world import *
run = body('run', 'run.vgs')
vg.source.object, vg.signal_file = run, os.path.abspath('b.signal')
assert bpy.ops.vg.fit_signal() == {'FINISHED'}
vg.edits_file = os.path.abspath('edits.txt')
plays(made_by(bpy.ops.vg.sample), 'edited.vgs', 2e-5)
vg.edits_file, vg.timing, vg.speed = '', 'SPEED', 0.5
plays(made_by(bpy.ops.vg.sample), 'slow.vgs', 2e-5)
vg.timing, scene.frame_end = 'KEYED', 5
refused(bpy.ops.vg.sample, "key 'Moment' at two frames")
for frame, moment in (1, 1), (5, 11):
    vg.moment = moment
    scene.keyframe_insert('vg.moment', frame=frame)
for c in scene.animation_data.action.fcurves:
    for p in c.keyframe_points: p.interpolation = 'LINEAR'
made = made_by(bpy.ops.vg.sample)
plays(made, 'retimed.vgs', 2e-5)
vg.timing, vg.cycle, scene.frame_end = 'FORTH', True, 21
made = made_by(bpy.ops.vg.sample)
assert len(made.data.shape_keys.key_blocks) == 1 + 41
check('round', far(shown(made, 1 + 40 * 3), shown(made, 1)), 1e-6)
check('back', far(shown(made, 22), shown(made, 20)), 1e-6)
assert bpy.ops.vg.plane() == {'FINISHED'}
text = open(vg.page).read()
assert '<canvas' in text and 'edits' in text

vg.network_file, vg.iterations, vg.cycle = os.path.abspath('b.net'), 3, False
assert bpy.ops.vg.train() == {'FINISHED'}
vg.source.whole, vg.source.start, vg.source.end, vg.count, vg.seed, vg.diversity = False, 1, 5, 6, 3, 0.3
vg.network_file = os.path.abspath('horse.net')
plays(made_by(bpy.ops.vg.generate), 'on.vgs', 2e-5)
vg.network_file = vg.signal_file
refused(bpy.ops.vg.generate, 'network')
END
    shows 'WORST run sampled' 'WORST round' 'WORST run generated'
}

@test "in a window: a button's work is modal, Cancel leaves the scene as it was, one undo takes a result back, the mesh follows by itself" {
    command -v xvfb-run >/dev/null || skip "xvfb-run is not installed"
    must vg-encode --take 0-9 "$DATA/horse-run.tar.xz" -o run.vgs
    must vg-segment -q -k 8 run.vgs -o horse.patches
    must vg-fitmap -q --patches horse.patches run.vgs -o horse.map
    cat >script.py <<'END'
import world
from world import *
from vg_tools.work import State
from vg_tools import between
bpy.context.preferences.view.show_splash = False
run, other = body('run', 'run.vgs'), body('other', 'run.vgs', False)
other.shape_key_clear()
vg.source.object, vg.target = run, other
bpy.ops.ed.undo_push(message='made')
names = lambda: sorted(o.name for o in bpy.data.objects)
start = names()
done = []

def steps():
    """Each yield lets the interface go on for a while."""
    global vg, scene
    yield
    assert bpy.ops.vg.transfer('INVOKE_DEFAULT') == {'RUNNING_MODAL'}
    assert State.title == 'Transfer' and not bpy.ops.vg.shapes.poll(), 'another could start'
    while State.job is None: yield
    assert bpy.ops.vg.cancel() == {'FINISHED'}
    while State.title: yield
    assert names() == start and State.lines == ['cancelled'] and bpy.context.scene.frame_current == 1
    done.append('CANCELLED')
    assert bpy.ops.vg.transfer('INVOKE_DEFAULT') == {'RUNNING_MODAL'}
    while State.title: yield
    assert names() == sorted(start + ['other as run']), names()
    yield
    bpy.ops.ed.undo()
    yield
    assert names() == start, names()
    done.append('UNDONE')
    scene = world.scene = bpy.context.scene
    vg = scene.vg
    for o in list(bpy.data.objects): bpy.data.objects.remove(o)
    horse = body('horse', 'run.vgs')
    vg.source.kind, vg.source.object, vg.map_file = 'KEYS', horse, os.path.abspath('horse.map')
    assert bpy.ops.vg.slide() == {'FINISHED'}
    for k in range(5):
        vg.slider = k
        before = between.envelope.Follow.count
        while between.envelope.Follow.count == before: yield
    shape = bodies.positions(horse.data.shape_keys.key_blocks['vg live'].data)
    want = bodies.from_file(stream('run.vgs')[1][4].values)
    assert numpy.abs(shape - want).max() < 0.05 * numpy.ptp(want), 'the slider shows something else'
    bpy.ops.vg.slide()
    done.append('FOLLOWED')

going = steps()
def tick():
    try:
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]): next(going)
    except StopIteration:
        print(*done, flush=True)
        bpy.ops.wm.quit_blender()
        return None
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    return 0.05
bpy.app.timers.register(tick, first_interval=0.5)
END
    capture env PYTHONPATH="$BATS_FILE_TMPDIR" LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a -s '-screen 0 640x480x24' timeout 300 \
        blender --factory-startup --python-use-system-env --window-geometry 0 0 640 480 --python script.py
    [ "$status" = 0 ] || fail "$output" "$stderr"
    shows 'CANCELLED UNDONE FOLLOWED'
}
