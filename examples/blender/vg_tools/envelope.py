"""Envelope: a rig from an armature and poses; the mesh follows the bones while they are moved; bones turned and twisted by numbers; baked motion.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import math
import os
import struct

import bpy
import numpy
from mathutils import Matrix, Vector

from . import bodies, skeleton, vgstream
from .live import Live
from .programs import Body, Trouble
from .work import State, Work, redraw

# ---- files of artefacts: rigs, maps, signals, networks ----


def artefact(path, what):
    """A file that somebody has named, to read."""
    if not path:
        raise Trouble(f"choose a file with a {what}")
    path = bpy.path.abspath(path)
    if not os.path.isfile(path):
        raise Trouble(f"there is no file '{path}': make the {what} first, or choose another")
    return path


def artefact_to_be(path, what):
    if not path:
        raise Trouble(f"choose where the {what} is written")
    if path.startswith("//") and not bpy.data.filepath:
        raise Trouble(f"the {what} needs a place: save the .blend file first, or choose a whole path")
    path = bpy.path.abspath(path)
    if not os.path.isdir(os.path.dirname(path)):
        raise Trouble(f"there is no folder '{os.path.dirname(path)}'")
    return path


class Rig:
    """Of a stream with a RIG record: names of its bones, their places and turns in the reference pose, and that pose."""

    def __init__(self, path):
        try:
            with vgstream.Reader(path) as reader:
                payload = reader.record("RIG ")
                if payload is None:
                    raise Trouble(f"'{path}' holds no rig")
                self.reference, self.faces = numpy.array(reader.reference).reshape(-1, 3), reader.faces
        except (vgstream.StreamError, OSError) as error:
            raise Trouble(f"cannot read '{path}': {error}") from None
        n = struct.unpack_from("<Q", payload)[0]
        padded = lambda size: -(-size // 8) * 8  # noqa: E731
        at = 8 + padded(4 * n)
        channels = numpy.frombuffer(payload, "<u4", n, at)
        at += padded(4 * n) + padded(6 * n) + 24 * n
        names = []
        for _ in range(n):
            size = struct.unpack_from("<Q", payload, at)[0]
            names.append(payload[at + 8:at + 8 + size].decode())
            at += 8 + padded(size)
        places = numpy.frombuffer(payload, "<f8", 3 * n, at).reshape(n, 3)
        turns = numpy.frombuffer(payload, "<f8", 4 * n, at + 24 * n).reshape(n, 4)
        bones = [j for j in range(n) if channels[j]]
        self.bones, self.places = [names[j] for j in bones], places[bones]
        self.turns = [skeleton.rotation(turns[j]) for j in bones]


class Driver:
    """Takes the pose of an armature to the motions of a rig's bones."""

    def __init__(self, rig, thing, scene):
        self.rig, self.scale = rig, bodies.metres(scene)
        number = {b.name.replace(" ", "_"): i for i, b in enumerate(thing.pose.bones)}
        for name in rig.bones:
            if name not in number:
                raise Trouble(f"'{thing.name}' has no bone '{name}': the rig is that of another armature")
        self.posed = numpy.array([number[name] for name in rig.bones])
        rest = [thing.matrix_world @ thing.pose.bones[i].bone.matrix_local for i in self.posed.tolist()]
        self.back = numpy.array([skeleton.turn_of(m).T @ turn.T for m, turn in zip(rest, rig.turns)])

    def motions(self, thing):
        """(bones, 7) of the armature as it stands; thing may be the evaluated one."""
        matrices = skeleton.pose_matrices(thing)[self.posed]
        turns = skeleton.turns_of(matrices[:, :3, :3]) @ self.back
        places = bodies.to_file(matrices[:, :3, 3], self.scale)
        return numpy.hstack([skeleton.quaternions(turns), places - numpy.einsum("nab,nb->na", turns, self.rig.places)])


# ---- fitting ----


class VG_OT_envelope(Work, bpy.types.Operator):
    """Learn from poses how the armature moves the mesh: a rig, written to a file"""
    bl_idname, bl_label = "vg.envelope", "Fit Rig"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        rig, self.path = skeleton.armature(vg.armature, "the skeleton"), artefact_to_be(vg.rig_file, "rig")
        joints = skeleton.Skeleton(skeleton.Joints(rig, scene))
        learn = vg.source.kind != "FRAMES" or vg.learn
        joints.add("rest", joints.reference, numpy.array([numpy.eye(3)] * len(joints.reference)), 0.0)
        body = yield from bodies.poses(vg.source, scene)
        if not learn:
            if vg.source.rest != "MESH":
                raise Trouble("the rest pose has to be that of the mesh, for it is that of the armature")
            motion = yield from skeleton.walk(rig, vg.source, scene)
            for row in zip(motion.names, motion.points, motion.turns, motion.times):
                joints.add(*row)
        if not body.count:
            raise Trouble("a rig is learned from poses: there is none")
        known = Body(body.reference, body.faces, [body.reference, *body.points], ["rest", *body.names])
        words = ["--holdout", str(vg.holdout)] if vg.holdout else []
        return known, joints, words + (["--learn"] if learn else []) + ([] if vg.method == "DEFAULT" else ["--method", vg.method.lower()])

    def compute(self, job, gathered):
        body, joints, words = gathered
        job.call(["vg-fitmap", "--skeleton", job.write("skeleton.vgs", joints), *words, "-o", self.path], feed=body, step="fitting the rig")

    def finish(self, context, result):
        return f"'{self.path}'"


# ---- live ----


class Follow:
    """The mesh that follows an armature now."""
    live, mesh, armature, driver, key, muted, scene = None, "", "", None, "", [], ""
    count, changed = 0, False

    @classmethod
    def active(cls):
        return cls.live is not None


KEY = "vg live"


def live_key(thing):
    """The shape key that shows what comes out; the mesh below stays as it is."""
    if not thing.data.shape_keys:
        thing.shape_key_add(name="Basis", from_mix=False)
    key = thing.data.shape_keys.key_blocks.get(KEY) or thing.shape_key_add(name=KEY, from_mix=False)
    key.value = 1.0
    return key


def mute_armatures(thing):
    """The armature's own skinning, and other shapes, would move the mesh a second time."""
    muted = [m for m in thing.modifiers if m.type in ("ARMATURE", "MESH_CACHE") and m.show_viewport]
    for m in muted:
        m.show_viewport = False
    return [m.name for m in muted]


def begin_follow(context):
    scene, vg = context.scene, context.scene.vg
    thing, arm = bodies.mesh_object(vg.body, "the mesh of the rig"), skeleton.armature(vg.armature, "the skeleton")
    rig = Rig(artefact(vg.rig_file, "rig"))
    if len(thing.data.vertices) != len(rig.reference):
        raise Trouble(f"the rig has {len(rig.reference)} vertices, '{thing.name}' {len(thing.data.vertices)}")
    Follow.driver = Driver(rig, arm, scene)
    Follow.live = Live(bpy.path.abspath(vg.rig_file), len(rig.bones))
    Follow.mesh, Follow.armature, Follow.scene, Follow.count = thing.name, arm.name, scene.name, 0
    live_key(thing)
    Follow.muted = mute_armatures(thing)
    bpy.app.handlers.depsgraph_update_post.append(pose_changed)
    bpy.app.handlers.frame_change_post.append(pose_changed)
    bpy.app.timers.register(show_newest, first_interval=0.01)
    Follow.changed = True


def end_follow():
    live, Follow.live = Follow.live, None
    for handlers in bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post:
        if pose_changed in handlers:
            handlers.remove(pose_changed)
    if live:
        live.close()
    thing = bpy.data.objects.get(Follow.mesh)
    if thing is None:
        return
    for name in Follow.muted:
        if name in thing.modifiers:
            thing.modifiers[name].show_viewport = True
    keys = thing.data.shape_keys
    if keys and KEY in keys.key_blocks:
        thing.shape_key_remove(keys.key_blocks[KEY])
        if len(thing.data.shape_keys.key_blocks) == 1:
            thing.shape_key_clear()
    redraw()


def pose_changed(scene, graph=None):
    if not Follow.live or scene.name != Follow.scene:
        return
    arm = bpy.data.objects.get(Follow.armature)
    if arm is None:
        return
    if graph is not None:
        if graph.updates and not any(u.id and u.id.original in (arm, arm.data) for u in graph.updates):
            return
    Follow.changed = True


def fail(error):
    State.lines, State.failed = [str(error)], True
    end_follow()


def show(points):
    thing = bpy.data.objects.get(Follow.mesh)
    if thing is None or not thing.data.shape_keys or KEY not in thing.data.shape_keys.key_blocks:
        raise Trouble("the mesh that follows has been removed")
    local = bodies.to_local(thing, points, bpy.data.scenes[Follow.scene])
    thing.data.shape_keys.key_blocks[KEY].data.foreach_set("co", numpy.ascontiguousarray(local, numpy.float32).ravel())
    thing.data.update_tag()
    Follow.count += 1


def show_newest():
    """A timer: what has come out since goes into the mesh, and if the pose has changed meanwhile, it goes in."""
    if not Follow.live:
        return None
    try:
        points = Follow.live.newest()
        if Follow.changed and Follow.live.idle:
            arm = bpy.data.objects[Follow.armature].evaluated_get(bpy.context.evaluated_depsgraph_get())
            Follow.changed = False
            Follow.live.send(Follow.driver.motions(arm))
        if points is not None:
            show(points)
            redraw()
    except (Trouble, KeyError) as error:
        fail(error)
        return None
    return 0.004


def follow_now(context):
    """For scripts: send the pose as it is and wait for the mesh."""
    graph = context.evaluated_depsgraph_get()
    graph.update()
    Follow.live.send(Follow.driver.motions(bpy.data.objects[Follow.armature].evaluated_get(graph)))
    points = Follow.live.wait()
    if points is not None:
        show(points)
    return points


class VG_OT_follow(bpy.types.Operator):
    """The mesh follows the bones while they are moved, until the button is pressed again; the mesh below stays as it is"""
    bl_idname, bl_label, bl_options = "vg.follow", "Follow Bones", {"UNDO"}

    def execute(self, context):
        if Follow.active():
            end_follow()
            return {"FINISHED"}
        try:
            begin_follow(context)
        except Trouble as error:
            State.lines, State.failed = [str(error)], True
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


# ---- by numbers ----


class VG_OT_turn(bpy.types.Operator):
    """Turn the active bone, and all below it, about itself or about an axis of the armature's rest pose, as vg-play --edit does"""
    bl_idname, bl_label, bl_options = "vg.turn", "Turn Bone", {"REGISTER", "UNDO"}
    axis: bpy.props.EnumProperty(name="About", items=[("TWIST", "Itself", "From its head to its tail"), ("X", "x", "To the right"),
                                                      ("Y", "y", "Upwards"), ("Z", "z", "Towards the viewer")])
    angle: bpy.props.FloatProperty(name="Angle", subtype="ANGLE", default=0.0, soft_min=-math.pi, soft_max=math.pi)

    @classmethod
    def poll(cls, context):
        return context.mode == "POSE" and context.active_pose_bone is not None

    def execute(self, context):
        posed, thing = context.active_pose_bone, context.active_pose_bone.id_data
        rest = (thing.matrix_world @ posed.bone.matrix_local).to_3x3().normalized()
        # the axes of files: y up, z towards the viewer; carried along with the bone
        axis = (0, 1, 0) if self.axis == "TWIST" else rest.inverted() @ axis_of_files(self.axis)
        posed.matrix_basis = posed.matrix_basis @ Matrix.Rotation(self.angle, 4, axis)
        return {"FINISHED"}


def axis_of_files(name):
    return Vector({"X": (1, 0, 0), "Y": (0, 0, 1), "Z": (0, -1, 0)}[name])


# ---- baking ----


class VG_OT_bake(Work, bpy.types.Operator):
    """The mesh as the rig moves it by the armature's motion: a copy with shape keys or a cache"""
    bl_idname, bl_label = "vg.bake", "Bake Motion"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        thing, arm = bodies.mesh_object(vg.body, "the mesh of the rig"), skeleton.armature(vg.armature, "the skeleton")
        self.path, self.mesh = artefact(vg.rig_file, "rig"), thing.name
        driver = Driver(Rig(self.path), arm, scene)
        if len(thing.data.vertices) != len(driver.rig.reference):
            raise Trouble(f"the rig has {len(driver.rig.reference)} vertices, '{thing.name}' {len(thing.data.vertices)}")
        self.moments, motions = bodies.frames_of(vg.source, scene), []
        for frame in self.moments:
            with bodies.at_frame(scene, frame):
                motions.append(driver.motions(arm.evaluated_get(context.evaluated_depsgraph_get())))
            yield len(motions), len(self.moments)
        return Motions(motions, [f"{arm.name}.{frame:04d}" for frame in self.moments])

    def compute(self, job, motions):
        _, frames = job.pipe(["vg-play", self.path], feed=motions, expect=len(motions.rows), step="playing the rig")
        return motions.names, [f.values for f in frames]

    def finish(self, context, result):
        scene, (names, shapes) = context.scene, result
        made = bodies.new_object(scene.objects[self.mesh], f"{self.mesh} baked")
        return bodies.play_shapes(context, made, names, shapes, self.moments)


class Motions:
    """A stream of transforms."""

    def __init__(self, rows, names):
        self.rows, self.names = rows, names

    def write(self, file, job=None, precision=8):
        with vgstream.Writer(file, vgstream.Head([], "transforms", "transform", 7, len(self.rows[0]), precision)) as out:
            for name, row in zip(self.names, self.rows):
                if job:
                    job.check()
                out.put(vgstream.Frame(name, numpy.ascontiguousarray(row, float)))


classes = (VG_OT_envelope, VG_OT_follow, VG_OT_turn, VG_OT_bake)
