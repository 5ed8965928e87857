"""Between Blender's objects and the bodies that the programs take: what an object plays as a sequence of poses, and a sequence as shape keys
or as a cache. Blender has z up and the scene's unit; bodies have y up and metres.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import os
import re
import struct
from contextlib import contextmanager

import bpy
import numpy

from .programs import Body, Trouble

# Modifiers that move vertices and leave the mesh as it is; others are switched off where the mesh has to stay the same.
MOVERS = {"ARMATURE", "CAST", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE", "MESH_DEFORM", "SHRINKWRAP", "SIMPLE_DEFORM",
          "SMOOTH", "CORRECTIVE_SMOOTH", "LAPLACIANSMOOTH", "SURFACE_DEFORM", "WARP", "WAVE", "MESH_CACHE", "CLOTH", "SOFT_BODY",
          "VOLUME_DISPLACE", "MESH_SEQUENCE_CACHE", "NORMAL_EDIT", "WEIGHTED_NORMAL", "UV_PROJECT", "UV_WARP", "DATA_TRANSFER"}


# ---- axes and units ----


def metres(scene):
    """Of one unit of the scene."""
    return scene.unit_settings.scale_length if scene.unit_settings.system != "NONE" else 1.0


def to_file(points, scale=1.0):
    """From Blender's axes to those of files: x, z, -y."""
    points = numpy.asarray(points, float)
    return numpy.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1) * scale


def from_file(points, scale=1.0):
    points = numpy.asarray(points, float)
    return numpy.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1) / scale


BLENDERS = numpy.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)  # takes a point of a file to Blender's axes


def moved(points, matrix):
    m = numpy.array(matrix, float)
    return points @ m[:3, :3].T + m[:3, 3]


# ---- what an object plays ----


def positions(vertices):
    flat = numpy.empty(3 * len(vertices), numpy.float32)
    vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3).astype(float)


def faces_of(mesh):
    """Polygons, then edges that are in none, as lists of two."""
    def numbers(things, name, count):
        values = numpy.empty(count, numpy.int32)
        things.foreach_get(name, values)
        return values
    starts = numbers(mesh.polygons, "loop_start", len(mesh.polygons)).tolist()
    corners = numbers(mesh.loops, "vertex_index", len(mesh.loops)).tolist()
    faces = [corners[a:b] for a, b in zip(starts, starts[1:] + [len(corners)])]
    bare = numpy.ones(len(mesh.edges), bool)
    bare[numbers(mesh.loops, "edge_index", len(mesh.loops))] = False
    ends = numbers(mesh.edges, "vertices", 2 * len(mesh.edges)).reshape(-1, 2)[bare]
    return faces + sorted(sorted(e) for e in ends.tolist())


def rest_points(thing):
    """Of the mesh as edit mode has it, in its own space: the basis of the shape keys if there are any."""
    keys = thing.data.shape_keys
    return positions(keys.reference_key.data if keys else thing.data.vertices)


def rest_body(thing, scene, matrix=None):
    points = moved(rest_points(thing), matrix or thing.matrix_world)
    return Body(to_file(points, metres(scene)), faces_of(thing.data))


def shown_body(thing, scene):
    """Positions in the world, and faces, as it is shown now."""
    shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()
    try:
        return to_file(moved(positions(mesh.vertices), shown.matrix_world), metres(scene)), faces_of(mesh)
    finally:
        shown.to_mesh_clear()


def shown_points(thing, scene):
    shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()
    try:
        return to_file(moved(positions(mesh.vertices), shown.matrix_world), metres(scene))
    finally:
        shown.to_mesh_clear()


@contextmanager
def without_makers(thing):
    """Modifiers that change the mesh are switched off inside."""
    makers = [m for m in thing.modifiers if m.type not in MOVERS and m.show_viewport]
    for m in makers:
        m.show_viewport = False
    try:
        yield
    finally:
        for m in makers:
            m.show_viewport = True


@contextmanager
def at_frame(scene, frame):
    """The scene at another frame inside, and back at its own behind it."""
    before, part = scene.frame_current, scene.frame_subframe
    scene.frame_set(frame)
    try:
        yield
    finally:
        scene.frame_set(before, subframe=part)


def frames_of(source, scene):
    if source.whole:
        return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    if source.end < source.start:
        raise Trouble(f"the last frame, {source.end}, comes before the first, {source.start}")
    return list(range(source.start, source.end + 1, source.step))


def mesh_object(thing, what):
    if thing is None:
        raise Trouble(f"choose {what}")
    if thing.type != "MESH" or not len(thing.data.vertices):
        raise Trouble(f"'{thing.name}' is no mesh with vertices")
    return thing


def from_frames(source, scene):
    """Generator: what the object plays on the time line; each step takes one frame. Ends with the Body."""
    thing = mesh_object(source.object, "a source")
    frames = frames_of(source, scene)
    with at_frame(scene, frames[0]):
        shown, faces = shown_body(thing, scene)
        rest = rest_body(thing, scene, thing.matrix_world.copy())
        plain = len(shown) == len(rest.reference) and faces == rest.faces
        if not plain:
            with without_makers(thing):
                shown, faces = shown_body(thing, scene)
            plain = len(shown) == len(rest.reference) and faces == rest.faces
    body = Body(rest.reference if plain and source.rest == "MESH" else shown, faces, [], [], [])
    rate = scene.render.fps / scene.render.fps_base
    for i, frame in enumerate(frames):
        with at_frame(scene, frame):
            if plain:
                with without_makers(thing):
                    points = shown_points(thing, scene)
            else:
                points = shown_points(thing, scene)
        if len(points) != len(body.reference):
            raise Trouble(f"'{thing.name}' has {len(points)} vertices in frame {frame}, {len(body.reference)} in the first")
        body.points.append(points)
        body.names.append(f"{thing.name}.{frame:04d}")
        body.times.append((frame - frames[0]) / rate)
        yield i + 1, len(frames)
    return body


def key_points(key, basis):
    """A key's shape by itself, with value 1."""
    points = positions(key.data)
    return points if key.relative_key == basis else points - positions(key.relative_key.data) + positions(basis.data)


def from_keys(source, scene):
    thing = mesh_object(source.object, "a source")
    keys = thing.data.shape_keys
    if not keys or len(keys.key_blocks) < 2:
        raise Trouble(f"'{thing.name}' has no shape keys beside its basis")
    body = rest_body(thing, scene)
    shapes = [k for k in keys.key_blocks if k != keys.reference_key]
    for i, key in enumerate(shapes):
        points = moved(key_points(key, keys.reference_key), thing.matrix_world)
        body.points.append(to_file(points, metres(scene)))
        body.names.append(key.name)
        yield i + 1, len(shapes)
    return body


def in_order(thing):
    """pose2 comes before pose10."""
    return [int(w) if w.isdigit() else w.lower() for w in re.split(r"(\d+)", thing.name)]


def from_objects(source, scene):
    """Meshes of a collection, each a pose. Where they stand is not looked at, for people lay them out in rows: only how they are turned and scaled."""
    things = sorted((o for o in (source.collection.objects if source.collection else ()) if o.type == "MESH"), key=in_order)
    if not things:
        raise Trouble("choose a collection with a mesh for each pose")
    body = None
    for i, thing in enumerate(things):
        matrix = thing.matrix_world.copy()
        matrix.translation = (0, 0, 0)
        pose = rest_body(thing, scene, matrix)
        body = body or Body(pose.reference, pose.faces)
        if not pose.same_mesh(body):
            raise Trouble(f"'{thing.name}' is another mesh than '{things[0].name}': other vertices or faces")
        body.points.append(pose.reference)
        body.names.append(thing.name)
        yield i + 1, len(things)
    return body


def poses(source, scene):
    """Generator over the progress (done, total); its value is the Body."""
    body = yield from {"FRAMES": from_frames, "KEYS": from_keys, "OBJECTS": from_objects}[source.kind](source, scene)
    for name, points in zip(body.names, body.points):
        if not numpy.isfinite(points).all():
            raise Trouble(f"pose '{name}' has a position that is not a finite number")
    return body


def all_of(generator):
    """Run a generator to its end and return its value."""
    while True:
        try:
            next(generator)
        except StopIteration as end:
            return end.value


def moments_of(source, scene, count):
    """Where on the time line the poses of a source stand; None when they are not of the time line."""
    return frames_of(source, scene) if source.kind == "FRAMES" else None


# ---- results ----


def free_name(name):
    """Blender would give a name that is taken to the newcomer, and rename the other."""
    taken = bpy.data.objects
    return name if name not in taken else next(f"{name}.{i:03d}" for i in range(1, 1000000) if f"{name}.{i:03d}" not in taken)


def new_object(target, name, source=None):
    """A copy of the target, with its materials, texture coordinates, normals and modifiers, that moves by nothing but what is given to it.
    source: where the poses come from; of a collection they do not say where objects stand."""
    made = target.copy()
    made.data = target.data.copy()
    made.name = made.data.name = free_name(name)
    if made.data.shape_keys:
        made.shape_key_clear()
    made.animation_data_clear()
    made.constraints.clear()
    world = target.matrix_world.copy()
    if source and source.kind == "OBJECTS":
        world.translation = (0, 0, 0)
    made.parent, made.matrix_world = None, world
    for m in made.modifiers:
        if m.type in ("ARMATURE", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "CLOTH", "SOFT_BODY"):
            m.show_viewport = m.show_render = False
    for collection in target.users_collection or [bpy.context.scene.collection]:
        collection.objects.link(made)
    return made


def to_local(thing, points, scene, matrix=None):
    """Points of a stream in the space of an object."""
    inverse = numpy.array((matrix or thing.matrix_world).inverted_safe(), float)
    turn = inverse[:3, :3] @ BLENDERS / metres(scene)
    return points @ turn.T + inverse[:3, 3]


def play_key(action, key, place, before, behind):
    moments = [(t, v) for t, v in ((before, 0.0), (place, 1.0), (behind, 0.0)) if t is not None]
    curve = action.fcurves.new(f'key_blocks["{bpy.utils.escape_identifier(key)}"].value')
    curve.keyframe_points.add(len(moments))
    for spot, moment in zip(curve.keyframe_points, moments):
        spot.co, spot.interpolation = moment, "LINEAR"
    curve.update()


def add_key(thing, name, points):
    """points in the object's own space."""
    if not thing.data.shape_keys:
        thing.shape_key_add(name="Basis", from_mix=False)
    key = thing.shape_key_add(name=name, from_mix=False)
    key.data.foreach_set("co", numpy.ascontiguousarray(points, numpy.float32).ravel())
    return key


def give_keys(thing, names, shapes, moments, scene):
    """Shape keys; played one after the other if there are moments."""
    action = None
    for i, points in enumerate(shapes):
        key = add_key(thing, names[i], to_local(thing, points, scene))
        if moments:
            keys = thing.data.shape_keys
            if action is None:
                action = keys.animation_data_create().action = bpy.data.actions.new(thing.name)
            play_key(action, key.name, moments[i], moments[i - 1] if i else None, moments[i + 1] if i + 1 < len(shapes) else None)
    thing.data.update()


def cache_path(folder, name):
    if folder.startswith("//") and not bpy.data.filepath:
        raise Trouble("a cache needs a place: save the .blend file first, or choose a folder")
    folder = bpy.path.abspath(folder)
    if not os.path.isdir(folder):
        raise Trouble(f"there is no folder '{folder}' for the cache")
    return os.path.join(folder, bpy.path.clean_name(name) + ".pc2")


def give_cache(thing, shapes, moments, scene, folder):
    """A point cache in the object's own space, and the modifier that plays it."""
    path = cache_path(folder, thing.name)
    local = numpy.stack([to_local(thing, points, scene) for points in shapes]).astype("<f4")
    part = path + ".part"
    try:
        with open(part, "wb") as out:
            out.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, local.shape[1], 0.0, 1.0, local.shape[0]))
            out.write(local.tobytes())
        os.replace(part, path)
    except OSError as error:
        raise Trouble(f"cannot write '{path}': {error.strerror}") from None
    cache = thing.modifiers.new("vg", "MESH_CACHE")
    with bpy.context.temp_override(object=thing):
        bpy.ops.object.modifier_move_to_index(modifier=cache.name, index=0)
    cache.cache_format, cache.filepath = "PC2", path
    cache.forward_axis, cache.up_axis = "POS_Y", "POS_Z"
    cache.interpolation = "LINEAR"
    if moments and len(moments) > 1:
        step = moments[1] - moments[0]  # the modifier shows sample frame * scale - start
        cache.frame_start, cache.frame_scale = moments[0] / step, 1.0 / step
    else:
        cache.frame_start = scene.frame_start


def give(thing, how, names, shapes, moments, scene, folder):
    if how == "CACHE":
        give_cache(thing, shapes, moments, scene, folder)
    else:
        give_keys(thing, names, shapes, moments, scene)


def remove(thing):
    data = thing.data
    bpy.data.objects.remove(thing)
    if data.users == 0:
        bpy.data.meshes.remove(data)


def play_shapes(context, made, names, shapes, moments):
    """Give the poses to an object that new_object made, select it, and say so; on failure the object is removed."""
    vg = context.scene.vg
    try:
        give(made, vg.result, names, shapes, moments, context.scene, vg.folder)
    except BaseException:
        remove(made)
        raise
    show_only(context, made)
    return f"'{made.name}': {len(shapes)} poses"


def show_only(context, thing):
    """Select it, alone, and make it active."""
    for other in context.view_layer.objects:
        other.select_set(False)
    if thing.name in context.view_layer.objects:
        thing.select_set(True)
        context.view_layer.objects.active = thing
