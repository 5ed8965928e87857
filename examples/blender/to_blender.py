"""to_blender.py: a sequence from vg-decode as a .blend file: shape keys that play it, or a Mesh Cache modifier.

    vg-decode -o walk.pc2 walk.vgs        # or .mdd; walk.obj beside it has the faces
    blender -b --python to_blender.py -- walk.pc2 -o walk.blend
    blender -b --python to_blender.py -- --cache walk.pc2 -o walk.blend

Input is .pc2 or .mdd with its mesh, NAME.obj beside it or --mesh, or .glb or .gltf. Of a cache all vertices keep their order, also those in no face. Each
frame is a shape key that is 1 at its time and 0 at those of its neighbours; the rest shape is the mesh. With --cache the .blend refers to the cache, which must
stay where it is. The frame rate is that of the cache, if it has one. A GLB goes through Blender's own importer: its shape keys have the frames' names,
which caches do not hold, but polygons come as triangles and vertices in no face are dropped. It leaves out groups and materials.

Written for Blender 3.4. Exit status: 0 done, 2 wrong usage, 3 input that does not fit, 4 the system refused.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import os
import sys

import addon_utils
import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from hand_over import INPUT, SYSTEM, USAGE, Trouble, finish, parser, read_mdd, read_obj, read_pc2, run, z_up  # noqa: E402

FIRST = 1  # the scene's frame at which a sequence begins
HALF_TURN = 1.5707963267948966


def make_mesh(path: str, name: str):
    """The mesh with the axes of the file, as Mesh Cache wants it; the object stands upright. Blender's import of OBJ would drop vertices in no face."""
    points, faces, texture = read_obj(path)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [f for f in faces if len(f) == 2], [f for f in faces if len(f) > 2])
    if mesh.validate():
        raise Trouble(f"'{path}' is a mesh that Blender does not take as it is: a face names a vertex twice, or is there twice")
    if texture is not None:
        mesh.uv_layers.new().data.foreach_set('uv', texture.astype(numpy.float32).ravel())
    mesh.update()
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    return thing, points


def read_cache(path: str):
    return read_pc2(path) if path.lower().endswith('.pc2') else read_mdd(path)


def set_rate(scene, times, fps) -> float:
    """Frames of the scene a second: those asked for, or those of the cache, or what the scene has."""
    if fps is None and times is not None and len(times) > 1 and times[1] > times[0]:
        fps = round(float(1 / (times[1] - times[0])), 4)
    if fps is not None:
        scene.render.fps = max(1, round(fps))
        scene.render.fps_base = scene.render.fps / fps
    return scene.render.fps / scene.render.fps_base


def places_of(count: int, times, rate: float):
    """Where on the scene's time line each frame is."""
    if times is None or not (numpy.diff(times) > 0).all():
        return FIRST + numpy.arange(count)
    return FIRST + numpy.round((times - times[0]) * rate, 3)


def play_key(action, key: str, place, before, behind) -> None:
    moments = [(t, v) for t, v in ((before, 0.0), (place, 1.0), (behind, 0.0)) if t is not None]
    curve = action.fcurves.new(f'key_blocks["{key}"].value')
    curve.keyframe_points.add(len(moments))
    for spot, moment in zip(curve.keyframe_points, moments):
        spot.co, spot.interpolation = moment, 'LINEAR'
    curve.update()


def add_keys(thing, frames, places) -> None:
    """Shape keys with Blender's own axes: they may be edited."""
    thing.shape_key_add(name='rest')
    keys = thing.data.shape_keys
    action = keys.animation_data_create().action = bpy.data.actions.new('sequence')
    for i, points in enumerate(frames):
        key = thing.shape_key_add(name=f'frame {i + 1:04d}')
        key.data.foreach_set('co', z_up(points).astype(numpy.float32).ravel())
        play_key(action, key.name, places[i], places[i - 1] if i else None, places[i + 1] if i + 1 < len(frames) else None)


def add_cache(thing, path: str, output: str) -> None:
    cache = thing.modifiers.new('cache', 'MESH_CACHE')
    cache.cache_format = 'PC2' if path.lower().endswith('.pc2') else 'MDD'
    cache.filepath = bpy.path.relpath(os.path.abspath(path), start=os.path.dirname(os.path.abspath(output)))
    cache.frame_start, cache.interpolation = FIRST, 'LINEAR'


def show_cache(o) -> None:
    scene, stem = bpy.context.scene, os.path.splitext(o.input)[0]
    frames, times = read_cache(o.input)
    thing, points = make_mesh(o.mesh or stem + '.obj', os.path.basename(stem))
    if len(points) != frames.shape[1]:
        raise Trouble(f"'{o.mesh or stem + '.obj'}' has {len(points)} vertices where '{o.input}' has {frames.shape[1]}")
    if not numpy.isfinite(frames).all():
        raise Trouble(f"'{o.input}' has a position that is not a finite number")
    places = places_of(len(frames), times, set_rate(scene, times, o.fps))
    if o.cache:
        thing.rotation_euler[0] = HALF_TURN
        add_cache(thing, o.input, o.output)
        places = FIRST + numpy.arange(len(frames))
    else:
        thing.data.vertices.foreach_set('co', z_up(points).astype(numpy.float32).ravel())
        add_keys(thing, frames, places)
    scene.frame_start, scene.frame_end = FIRST, int(numpy.ceil(places[-1]))
    print(f"to_blender: '{thing.name}': {len(frames)} frames of {len(points)} vertices")


def show_gltf(o) -> None:
    if o.cache or o.mesh:
        raise Trouble(f"'{o.input}' holds its faces, and is no cache: leave out --cache and --mesh", USAGE)
    if 'bool' not in numpy.__dict__:
        numpy.bool = bool  # Blender 3.4 asks for what NumPy 1.24 has dropped
    if not addon_utils.enable('io_scene_gltf2'):
        raise Trouble("this Blender lacks the add-on 'io_scene_gltf2'", SYSTEM)
    scene = bpy.context.scene
    if o.fps is not None:
        set_rate(scene, None, o.fps)
    try:
        bpy.ops.import_scene.gltf(filepath=o.input)
    except (RuntimeError, ValueError, KeyError, IndexError, AttributeError) as error:
        raise Trouble(f"cannot read '{o.input}': {str(error).strip() or type(error).__name__}", INPUT) from None
    ranges = [action.frame_range for action in bpy.data.actions]
    if ranges:
        scene.frame_start, scene.frame_end = int(min(r[0] for r in ranges)), int(numpy.ceil(max(r[1] for r in ranges)))


def main(arguments) -> None:
    p = parser('to_blender', 'IN -o OUT.blend', 'Make a .blend file of a sequence from vg-decode.')
    p.add_argument('input', metavar='IN', help='.pc2 or .mdd with its mesh beside it, .glb or .gltf')
    p.add_argument('-o', '--output', required=True, metavar='OUT.blend')
    p.add_argument('--mesh', metavar='MESH.obj', help='the faces and the rest shape; default: IN with .obj at its end')
    p.add_argument('--cache', action='store_true', help='a Mesh Cache modifier that plays IN, instead of shape keys')
    p.add_argument('--fps', type=float, metavar='X', help="frames of the scene a second; default: the cache's")
    o = p.parse_args(arguments)
    kind = os.path.splitext(o.input)[1].lower()
    if kind not in ('.pc2', '.mdd', '.glb', '.gltf'):
        raise Trouble(f"cannot read '{o.input}': known are .pc2, .mdd, .glb, .gltf (vg-decode writes them)", USAGE)
    if not o.output.lower().endswith('.blend'):
        raise Trouble(f"'{o.output}' does not end in .blend", USAGE)
    if o.fps is not None and not 0.1 <= o.fps <= 10000:
        raise Trouble('--fps must be between 0.1 and 10000', USAGE)
    with open(o.input, 'rb'):
        pass
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if kind in ('.pc2', '.mdd'):
        show_cache(o)
    else:
        show_gltf(o)
    try:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(o.output) + '.part', check_existing=False, relative_remap=False)
    except RuntimeError as error:
        raise Trouble(f"cannot write '{o.output}': {str(error).strip()}", SYSTEM) from None
    finish(o.output)


run('to_blender', main)
