"""from_blender.py: a moving mesh of Blender, with its armature, modifiers and shape keys applied, as files for vg-encode.

    blender -b --python from_blender.py -- dance.fbx -o dance.pc2
    blender -b dance.blend --python from_blender.py -- --bvh dance.bvh -o dance.pc2
    vg-encode dance.pc2 | ...

OUT ending in .pc2 is a point cache, with the mesh in its first frame beside it as .obj; any other OUT is a directory with an OBJ file for each
frame, which hold no times (vg-encode --fps). Input is .blend, .fbx, .glb, .gltf or .dae, or the .blend file that Blender was started with.
Vertices keep their order, also those in no face; polygons, loose edges and texture coordinates of the active layer are kept. Positions are
those in the world, with y up. It leaves out materials and groups, and fails when a modifier changes the number of vertices over time.

--bvh writes the motion of the bones that deform the mesh, frame by frame beside the same mesh, for 'vg-fitmap --skeleton'. Scale of bones is left
out; bones that do not stay at their parents have position channels.

Written for Blender 3.4. Exit status: 0 done, 2 wrong usage, 3 input that does not fit, 4 the system refused.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import math
import os
import shutil
import sys

import addon_utils
import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from hand_over import INPUT, SYSTEM, USAGE, Trouble, finish, parser, run, write_obj, write_pc2, y_up  # noqa: E402


# ---- what is opened ------------------------------------------------------------------------------------------------


def add_on(name: str) -> None:
    if not addon_utils.enable(name):
        raise Trouble(f"this Blender lacks the add-on '{name}'", SYSTEM)


def import_gltf(path: str) -> None:
    if 'bool' not in numpy.__dict__:
        numpy.bool = bool  # Blender 3.4 asks for what NumPy 1.24 has dropped
    add_on('io_scene_gltf2')
    bpy.ops.import_scene.gltf(filepath=path)


def import_fbx(path: str) -> None:
    add_on('io_scene_fbx')
    bpy.ops.import_scene.fbx(filepath=path)


def animated_range():
    """The frames that the actions of what was imported cover: importers leave the scene's own range as it is."""
    ranges = [action.frame_range for action in bpy.data.actions if action.fcurves]
    scene = bpy.context.scene
    if ranges:
        scene.frame_start = math.floor(min(r[0] for r in ranges))
        scene.frame_end = math.ceil(max(r[1] for r in ranges))
    else:
        scene.frame_end = scene.frame_start


def open_input(path) -> None:
    if path is None:
        if not bpy.data.filepath:
            raise Trouble('name a file, or start Blender with a .blend file', USAGE)
        return
    importers = {'.fbx': import_fbx, '.glb': import_gltf, '.gltf': import_gltf,
                 '.dae': lambda p: bpy.ops.wm.collada_import(filepath=p)}
    kind = os.path.splitext(path)[1].lower()
    if kind != '.blend' and kind not in importers:
        raise Trouble(f"cannot read '{path}': known are .blend, {', '.join(sorted(importers))}", USAGE)
    with open(path, 'rb'):
        pass  # Blender's own words for a file that does not exist are many
    try:
        if kind == '.blend':
            bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
            return
        bpy.ops.wm.read_factory_settings(use_empty=True)
        importers[kind](path)
    except (RuntimeError, ValueError, KeyError, IndexError, AssertionError, AttributeError) as error:
        raise Trouble(f"cannot read '{path}': {str(error).strip().splitlines()[-1] if str(error).strip() else type(error).__name__}",
                      INPUT) from None
    animated_range()


def find_object(name):
    meshes = [o for o in bpy.context.scene.objects if o.type == 'MESH']
    if name is not None:
        meshes = [o for o in meshes if o.name == name]
    if not meshes:
        there = ', '.join(f"'{o.name}'" for o in bpy.context.scene.objects if o.type == 'MESH') or 'none'
        raise Trouble(f"there is no mesh object '{name}': the scene has {there}" if name is not None else 'the scene has no mesh object')
    return max(meshes, key=lambda o: len(o.data.vertices))


def frame_range(text):
    scene = bpy.context.scene
    if text is None:
        return range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
    try:
        numbers = [int(word) for word in text.split(':')]
        frames = range(numbers[0], numbers[1] + 1, numbers[2] if len(numbers) > 2 else 1)
        if len(numbers) > 3 or not frames:
            raise ValueError
    except (ValueError, IndexError):
        raise Trouble(f"--frames '{text}' is not FIRST:LAST or FIRST:LAST:STEP", USAGE) from None
    return frames


# ---- the mesh ------------------------------------------------------------------------------------------------------


def evaluated(thing):
    return thing.evaluated_get(bpy.context.evaluated_depsgraph_get())


def points_of(thing):
    """Positions in the world, y up, as binary32."""
    shown = evaluated(thing)
    mesh = shown.to_mesh()
    local = numpy.empty(3 * len(mesh.vertices), numpy.float32)
    mesh.vertices.foreach_get('co', local)
    world = numpy.array(shown.matrix_world, float)
    shown.to_mesh_clear()
    points = local.reshape(-1, 3).astype(float) @ world[:3, :3].T + world[:3, 3]
    return y_up(points).astype(numpy.float32)


def shape_of(thing):
    """Polygons and loose edges, and the texture coordinates of the polygons' corners."""
    shown = evaluated(thing)
    mesh = shown.to_mesh()
    faces = [tuple(p.vertices) for p in mesh.polygons]
    joined = {frozenset((f[i - 1], f[i])) for f in faces for i in range(len(f))}
    faces += [tuple(edge.vertices) for edge in mesh.edges if frozenset(edge.vertices) not in joined]
    texture, layer = None, mesh.uv_layers.active
    if layer and mesh.polygons:
        flat = numpy.empty(2 * len(mesh.loops), numpy.float32)
        layer.data.foreach_get('uv', flat)
        texture = [tuple(flat[2 * i:2 * i + 2].tolist()) for p in mesh.polygons for i in p.loop_indices]
    shown.to_mesh_clear()
    return faces, texture


def write_frames(out: str, poses, faces, texture, seconds: float) -> None:
    if out.lower().endswith('.pc2'):
        write_obj(out[:-4] + '.obj', poses[0], faces, texture)
        write_pc2(out, numpy.stack(poses), seconds)
        return
    out = out.rstrip('/') or '/'
    if os.path.isdir(out) and os.listdir(out):
        raise Trouble(f"'{out}' is there already and not empty: its files would be taken for frames", USAGE)
    stem, part = os.path.basename(out), out + '.part'
    os.mkdir(part)
    try:
        for i, points in enumerate(poses):
            write_obj(os.path.join(part, f'{stem}.{i + 1:04d}.obj'), points, faces, texture)
        os.replace(part, out)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise


# ---- the armature --------------------------------------------------------------------------------------------------


class Joint:
    """A bone that deforms; its parent is the nearest one above it that does. Arrays have y up."""

    def __init__(self, bone, parent, world):
        self.name, self.parent, self.children = bone.name.replace(' ', '_'), parent, []
        self.bone, self.moves = bone.name, parent is None
        self.rest = point(world @ bone.matrix_local)
        self.tail = point(world @ bone.matrix_local, (0, bone.length, 0))
        self.rest_turn = turn(world @ bone.matrix_local)
        self.offset = self.rest - parent.rest if parent else self.rest
        self.places, self.turns = [], []
        if parent:
            parent.children.append(self)


def point(matrix, local=(0, 0, 0)):
    m = numpy.array(matrix, float)
    return y_up(m[:3, :3] @ numpy.array(local, float) + m[:3, 3])


def turn(matrix):
    """How it turns, without its scale, as a matrix with y up: the nearest rotation."""
    u, _, v = numpy.linalg.svd(upright(matrix))
    return u @ numpy.diag([1, 1, numpy.linalg.det(u @ v)]) @ v


def upright(matrix):
    """The 3 x 3 part between directions that have y up."""
    axes = y_up(numpy.eye(3)).T  # takes Blender's directions to those of files
    return axes @ numpy.array(matrix, float)[:3, :3] @ axes.T


def armature_of(thing):
    rigs = [m.object for m in thing.modifiers if m.type == 'ARMATURE' and m.object]
    if not rigs and thing.parent and thing.parent.type == 'ARMATURE':
        rigs = [thing.parent]
    if not rigs:
        raise Trouble(f"no armature bends '{thing.name}': leave out --bvh")
    return rigs[0]


def joints_of(rig):
    joints, found = [], {}

    def visit(bone, parent):
        if bone.use_deform:
            parent = found[bone.name] = Joint(bone, parent, rig.matrix_world)
            joints.append(parent)
        for child in bone.children:
            visit(child, parent)

    for bone in rig.data.bones:
        if bone.parent is None:
            visit(bone, None)
    if not joints:
        raise Trouble(f"no bone of '{rig.name}' deforms: leave out --bvh")
    return joints


def note_pose(rig, joints) -> None:
    shown = evaluated(rig)
    for j in joints:
        matrix = shown.matrix_world @ shown.pose.bones[j.bone].matrix
        j.places.append(point(matrix))
        j.turns.append(turn(matrix) @ j.rest_turn.T)


def angles(r):
    """Degrees about z, x, y with r = Z X Y."""
    x = math.asin(max(-1.0, min(1.0, r[2, 1])))
    if abs(r[2, 1]) > 1 - 1e-12:
        return math.degrees(math.atan2(r[1, 0], r[0, 0])), math.degrees(x), 0.0
    return math.degrees(math.atan2(-r[0, 1], r[1, 1])), math.degrees(x), math.degrees(math.atan2(-r[2, 0], r[2, 2]))


def local_place(j, i: int):
    return j.places[i] if j.parent is None else j.parent.turns[i].T @ (j.places[i] - j.parent.places[i])


def say_joint(out, j, depth: int) -> None:
    pad = '\t' * depth
    channels = ('6 Xposition Yposition Zposition' if j.moves else '3') + ' Zrotation Xrotation Yrotation'
    out.write(f'{pad}{"JOINT" if j.parent else "ROOT"} {j.name}\n{pad}{{\n')
    out.write(f'{pad}\tOFFSET %.9g %.9g %.9g\n{pad}\tCHANNELS {channels}\n' % tuple(j.offset))
    for child in j.children:
        say_joint(out, child, depth + 1)
    if not j.children:
        out.write(f'{pad}\tEnd Site\n{pad}\t{{\n{pad}\t\tOFFSET %.9g %.9g %.9g\n{pad}\t}}\n' % tuple(j.tail - j.rest))
    out.write(f'{pad}}}\n')


def write_bvh(path: str, joints, seconds: float) -> None:
    size = max(float(numpy.abs(j.rest).max()) for j in joints) + 1e-12
    count = len(joints[0].places)
    for j in joints:
        j.moves |= any(numpy.abs(local_place(j, i) - j.offset).max() > 1e-5 * size for i in range(count))
    with open(path + '.part', 'w', encoding='utf-8') as out:
        out.write('HIERARCHY\n')
        for j in joints:
            if j.parent is None:
                say_joint(out, j, 0)
        out.write(f'MOTION\nFrames: {count}\nFrame Time: {seconds:.9g}\n')
        for i in range(count):
            numbers = []
            for j in joints:
                local = j.turns[i] if j.parent is None else j.parent.turns[i].T @ j.turns[i]
                numbers += [*local_place(j, i)] * j.moves + [*angles(local)]
            out.write(' '.join('%.9g' % x for x in numbers) + '\n')
    finish(path)


# ---- the whole -----------------------------------------------------------------------------------------------------


def main(arguments) -> None:
    p = parser('from_blender', '[IN] -o OUT', 'Write a moving mesh of Blender as files for vg-encode.')
    p.add_argument('input', nargs='?', metavar='IN', help='.blend, .fbx, .glb, .gltf or .dae; default: the file that Blender has open')
    p.add_argument('-o', '--output', required=True, metavar='OUT', help='NAME.pc2, or a directory')
    p.add_argument('--object', metavar='NAME', help='the mesh object; default: the one with most vertices')
    p.add_argument('--frames', metavar='FIRST:LAST[:STEP]', help="default: the scene's, or of an import all that its animation covers")
    p.add_argument('--bvh', metavar='FILE', help='the motion of the armature that bends it')
    o = p.parse_args(arguments)
    open_input(o.input)
    thing, scene, poses, faces, texture = find_object(o.object), bpy.context.scene, [], None, None
    rig = armature_of(thing) if o.bvh else None
    joints = joints_of(rig) if rig else []
    frames = frame_range(o.frames)
    for frame in frames:
        scene.frame_set(frame)
        poses.append(points_of(thing))
        if faces is None:
            faces, texture = shape_of(thing)
        if len(poses[-1]) != len(poses[0]):
            raise Trouble(f"'{thing.name}' has {len(poses[-1])} vertices in frame {frame}, {len(poses[0])} in the first: "
                          'a modifier changes the mesh over time')
        if not numpy.isfinite(poses[-1]).all():
            raise Trouble(f"'{thing.name}' has a vertex in frame {frame} whose position is not a finite number")
        if rig:
            note_pose(rig, joints)
    if len(poses[0]) == 0:
        raise Trouble(f"'{thing.name}' has no vertices")
    seconds = frames.step * scene.render.fps_base / scene.render.fps
    write_frames(o.output, poses, faces, texture, seconds)
    if rig:
        write_bvh(o.bvh, joints, seconds)
    print(f"from_blender: '{thing.name}': {len(poses)} frames of {len(poses[0])} vertices, {1 / seconds:.6g} a second")


run('from_blender', main)
