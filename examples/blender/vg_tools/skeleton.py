"""Armatures as skeletons of the stream, and motions of skeletons as baked actions. A joint is the head of a bone that deforms; the tails of the last
bones are joints without channels. Positions have y up, in metres; turns are those against the rest pose, in the world.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import struct

import bpy
import numpy
from mathutils import Matrix, Quaternion

from . import bodies, vgstream
from .programs import Body, Trouble

NONE = 0xFFFFFFFF
UPRIGHT = numpy.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)  # Blender's directions to those of files


def turn_of(matrix):
    """How a matrix of Blender turns, without its scale: the nearest rotation, between directions of files."""
    u, _, v = numpy.linalg.svd(UPRIGHT @ numpy.array(matrix, float)[:3, :3] @ UPRIGHT.T)
    return u @ numpy.diag([1, 1, numpy.linalg.det(u @ v)]) @ v


def turns_of(matrices):
    """The same of many: (n, 3, 3). Most have no shear: their columns are at right angles."""
    m = UPRIGHT @ matrices @ UPRIGHT.T
    turns = m / numpy.maximum(numpy.linalg.norm(m, axis=1, keepdims=True), 1e-30)
    bent = numpy.abs(numpy.transpose(turns, (0, 2, 1)) @ turns - numpy.eye(3)).max((1, 2)) > 1e-6
    bent |= numpy.linalg.det(turns) < 0
    for i in numpy.flatnonzero(bent):
        turns[i] = turn_of(matrices[i])
    return turns


def quaternions(turns):
    """w x y z of rotations (n, 3, 3), by the largest of the four."""
    m, k = turns, numpy.empty((len(turns), 4, 4))
    diagonal = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    k[:, 0, 0] = 1 + diagonal[0] + diagonal[1] + diagonal[2]
    for i in range(3):
        j, l = (i + 1) % 3, (i + 2) % 3
        k[:, i + 1, i + 1] = 1 + diagonal[i] - diagonal[j] - diagonal[l]
        k[:, 0, i + 1] = k[:, i + 1, 0] = m[:, l, j] - m[:, j, l]
        k[:, i + 1, j + 1] = k[:, j + 1, i + 1] = m[:, i, j] + m[:, j, i]
    rows = k[numpy.arange(len(k)), numpy.argmax(numpy.diagonal(k, axis1=1, axis2=2), axis=1)]
    return rows / numpy.linalg.norm(rows, axis=1, keepdims=True)


def pose_matrices(thing):
    """Of all pose bones in their order, in the world: (n, 4, 4)."""
    bones = thing.pose.bones
    flat = numpy.empty(16 * len(bones), numpy.float32)
    bones.foreach_get("matrix", flat)
    return numpy.array(thing.matrix_world, float) @ flat.reshape(-1, 4, 4).transpose(0, 2, 1).astype(float)


def rotation(q):
    """Of a quaternion w x y z, unit or not."""
    return numpy.array(Quaternion(q).normalized().to_matrix())


def place(matrix, local=(0, 0, 0), scale=1.0):
    m = numpy.array(matrix, float)
    return bodies.to_file(m[:3, :3] @ numpy.array(local, float) + m[:3, 3], scale)


class Joints:
    """Of an armature: names, parents (numbers or None), bones (of end sites: that of the parent), rest places and turns."""

    def __init__(self, rig, scene):
        self.names, self.parents, self.bones, self.ends = [], [], [], []
        self.scale = bodies.metres(scene)
        bones = rig.data.bones
        deforming = {b.name for b in bones if b.use_deform} or {b.name for b in bones}
        for bone in bones:
            if bone.parent is None:
                self._visit(bone, None, deforming)
        if not self.names:
            raise Trouble(f"'{rig.name}' has no bone")
        world = rig.matrix_world
        self.rest_turns = [turn_of(world @ bones[name].matrix_local) for name in self.bones]
        self.rest = numpy.array([place(world @ bones[b].matrix_local, (0, bones[b].length * end, 0), self.scale)
                                 for b, end in zip(self.bones, self.ends)])
        self.lengths = [bones[b].length for b in self.bones]

    def _visit(self, bone, parent, deforming):
        if bone.name in deforming:
            parent = self._add(bone.name.replace(" ", "_"), parent, bone.name, False)
        below = len(self.names)
        for child in bone.children:
            self._visit(child, parent, deforming)
        if bone.name in deforming and len(self.names) == below:
            self._add(self.names[parent] + ".end", parent, bone.name, True)

    def _add(self, name, parent, bone, end):
        self.names.append(name)
        self.parents.append(parent)
        self.bones.append(bone)
        self.ends.append(end)
        return len(self.names) - 1

    def pose(self, rig):
        """Places (n, 3) and turns (n, 3, 3) of the joints as the armature stands now."""
        shown = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
        matrices = {name: shown.matrix_world @ shown.pose.bones[name].matrix for name in set(self.bones)}
        places = numpy.array([place(matrices[b], (0, length * end, 0), self.scale)
                              for b, length, end in zip(self.bones, self.lengths, self.ends)])
        turns = {name: turn_of(m) for name, m in matrices.items()}
        return places, numpy.array([turns[b] @ rest.T for b, rest in zip(self.bones, self.rest_turns)])


class Skeleton(Body):
    """A sequence of poses of a skeleton. turns: for each pose (n, 3, 3)."""

    def __init__(self, joints):
        faces = [[p, j] for j, p in enumerate(joints.parents) if p is not None]
        super().__init__(joints.rest, faces, (), (), [])
        self.joints, self.turns = joints, []

    def add(self, name, places, turns, time):
        self.points.append(places)
        self.turns.append(turns)
        self.names.append(name)
        self.times.append(time)

    def moving(self):
        """Joints whose place beside their parent changes."""
        size = numpy.abs(self.reference).max() + 1e-12
        found = set()
        for j, p in enumerate(self.joints.parents):
            rest = self.reference[j] - self.reference[p] if p is not None else None
            if p is None or any(numpy.abs(t[p].T @ (x[j] - x[p]) - rest).max() > 1e-5 * size for x, t in zip(self.points, self.turns)):
                found.add(j)
        return found

    def record(self):
        n, moving = len(self.names_of_joints), self.moving()
        channels = [b"\1\2\3\6\4\5" if j in moving and not end else b"\6\4\5\0\0\0" if not end else bytes(6)
                    for j, end in enumerate(self.joints.ends)]
        counts = [0 if end else 6 if j in moving else 3 for j, end in enumerate(self.joints.ends)]
        offsets = [self.reference[j] - (self.reference[p] if p is not None else 0) for j, p in enumerate(self.joints.parents)]
        pad = lambda b: b + bytes(-len(b) % 8)  # noqa: E731
        numbers = lambda values: pad(numpy.array(values, "<u4").tobytes())  # noqa: E731
        text = lambda t: struct.pack("<Q", len(t)) + pad(t)  # noqa: E731
        return b"".join([struct.pack("<Q", n), numbers([NONE if p is None else p for p in self.joints.parents]), numbers(counts),
                         pad(b"".join(channels)), numpy.array(offsets, "<f8").tobytes(), *[text(name.encode()) for name in self.names_of_joints]])

    @property
    def names_of_joints(self):
        return self.joints.names

    def write(self, file, job=None, precision=8):
        head = vgstream.mesh(self.reference, self.faces, precision)
        head.records.append(("SKEL", 0, self.record()))
        with vgstream.Writer(file, head) as out:
            for i, points in enumerate(self.points):
                if job:
                    job.check()
                turns = quaternions(self.turns[i]).ravel()
                frame = vgstream.Frame(self.names[i], numpy.ascontiguousarray(points, float),
                                       [vgstream.Channel("turns", "", "joint", 4, turns)])
                frame.time = self.times[i]
                out.put(frame)


def armature(thing, what):
    if thing is None or thing.type != "ARMATURE":
        raise Trouble(f"choose an armature as {what}")
    return thing


def walk(rig, source, scene):
    """Generator: the motion of an armature on the time line, as a Skeleton."""
    made, frames = Skeleton(Joints(rig, scene)), bodies.frames_of(source, scene)
    rate = scene.render.fps / scene.render.fps_base
    for i, frame in enumerate(frames):
        with bodies.at_frame(scene, frame):
            made.add(f"{rig.name}.{frame:04d}", *made.joints.pose(rig), (frame - frames[0]) / rate)
        yield i + 1, len(frames)
    return made


# ---- baked actions ----


def settle(rig, joints, places, turns):
    """Bone name -> matrix_basis with which the joints are there and turned so."""
    world = rig.matrix_world.inverted_safe()
    number = {b: j for j, (b, end) in enumerate(zip(joints.bones, joints.ends)) if not end}
    stands, basis = {}, {}
    for bone in parents_first(rig.data.bones):
        j = number.get(bone.name)
        above = stands[bone.parent.name] @ bone.parent.matrix_local.inverted_safe() if bone.parent else Matrix()
        follow = above @ bone.matrix_local
        if j is None:
            stands[bone.name] = follow
            continue
        turned = UPRIGHT.T @ turns[j] @ joints.rest_turns[j] @ UPRIGHT
        matrix = Matrix(turned.tolist()).to_4x4()
        matrix.translation = bodies.from_file(places[j], joints.scale).tolist()
        local = world @ matrix
        local = Matrix.LocRotScale(local.translation, local.to_quaternion(), None)
        if bone.use_connect and bone.parent:
            local.translation = follow.translation
        stands[bone.name], basis[bone.name] = local, follow.inverted_safe() @ local
    return basis


def parents_first(bones):
    waiting = [b for b in bones if b.parent is None]
    for bone in waiting:
        waiting.extend(bone.children)
        yield bone


def bake(rig, joints, motion, moments, name):
    """Key the pose bones: motion is a list of (places, turns)."""
    action = bpy.data.actions.new(name)
    if rig.animation_data:
        rig.animation_data_clear()
    rig.animation_data_create().action = action
    keys = {}
    for places, turns in motion:
        for bone, matrix in settle(rig, joints, places, turns).items():
            keys.setdefault(bone, []).append((matrix.to_quaternion(), matrix.translation))
    size = numpy.abs(joints.rest).max() + 1e-12
    for bone, row in keys.items():
        posed = rig.pose.bones[bone]
        posed.rotation_mode = "QUATERNION"
        turns = [row[0][0]]
        for q, _ in row[1:]:
            turns.append(-q if turns[-1].dot(q) < 0 else q)
        path = f'pose.bones["{bpy.utils.escape_identifier(bone)}"]'
        draw(action, path + ".rotation_quaternion", bone, moments, numpy.array(turns))
        shifts = numpy.array([t for _, t in row])
        if numpy.abs(shifts).max() > 1e-5 * size:
            draw(action, path + ".location", bone, moments, shifts)


def draw(action, path, group, moments, values):
    for k in range(values.shape[1]):
        curve = action.fcurves.new(path, index=k, action_group=group)
        curve.keyframe_points.add(len(moments))
        curve.keyframe_points.foreach_set("co", numpy.stack([numpy.array(moments, float), values[:, k]], 1).ravel())
        for spot in curve.keyframe_points:
            spot.interpolation = "LINEAR"
        curve.update()


# ---- a motion for another skeleton ----


def gather_transfer(vg, scene):
    target = armature(vg.target, "the target: the source is one")
    onto = Skeleton(Joints(target, scene))
    motion = yield from walk(armature(vg.source.object, "the source"), vg.source, scene)
    return motion, onto, ["--root", "stay"] if vg.root == "STAY" else []


def compute_transfer(job, gathered):
    motion, onto, root = gathered
    out = job.path("out.bvh")
    job.call(["vg-deform", "--onto", job.write("target.vgs", onto), *root], ["vg-solve"], ["vg-decode", "-o", out], feed=motion, step="transfer")
    _, frames = job.pipe(["vg-encode", out], step="reading the motion")
    return [(f.values, numpy.array([rotation(q) for q in numpy.array(f.channel("turns").numbers).reshape(-1, 4)])) for f in frames]


def finish_transfer(vg, scene, motion):
    target = vg.target
    made = target.copy()
    made.name = bodies.free_name(f"{target.name} as {vg.source.object.name}")
    for collection in target.users_collection:
        collection.objects.link(made)
    bake(made, Joints(made, scene), motion, bodies.frames_of(vg.source, scene), made.name)
    return f"'{made.name}': {len(motion)} poses"
