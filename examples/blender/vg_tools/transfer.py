"""Transfer: what the source plays, played by the target. By the same faces, or by pairs of vertices; or a skeleton's motion for a skeleton.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import re

import bpy
import numpy

from . import bodies, skeleton
from .programs import Body, Trouble
from .work import Work

# ---- pairs of vertices ----


def lone_vertices(thing):
    """Of vertex groups that hold one vertex: name -> vertex."""
    held = {}
    for v in thing.data.vertices if thing.vertex_groups else ():
        for g in v.groups:
            held.setdefault(g.group, []).append(v.index)
    return {thing.vertex_groups[g].name: v[0] for g, v in held.items() if len(v) == 1}


def plain(name):
    return re.sub(r"\.\d{3}$", "", name)


def near_empties(thing):
    """Of the empties that are children of an object: name without number -> the nearest vertex."""
    empties = [o for o in thing.children if o.type == "EMPTY"]
    if not empties:
        return {}
    points = bodies.moved(bodies.rest_points(thing), thing.matrix_world)
    return {plain(o.name): int(((points - numpy.array(o.matrix_world.translation)) ** 2).sum(1).argmin()) for o in empties}


def pairs(source, target):
    """(name, vertex of the source, vertex of the target) of all that are named alike."""
    made = []
    for of in (lone_vertices, near_empties):
        a, b = of(source), of(target)
        made += [(name.replace(" ", "_"), a[name], b[name]) for name in sorted(set(a) & set(b))]
    return made


class VG_OT_pair(bpy.types.Operator):
    """One selected vertex of each of two meshes in edit mode become a pair: a vertex group of the same name in both"""
    bl_idname, bl_label, bl_options = "vg.pair", "Pair Selected Vertices", {"UNDO"}

    def execute(self, context):
        things = [o for o in context.objects_in_mode if o.type == "MESH"] if context.mode == "EDIT_MESH" else \
                 [o for o in context.selected_objects if o.type == "MESH"]
        if len(things) != 2:
            self.report({"ERROR"}, "select two meshes and one vertex in each, in edit mode")
            return {"CANCELLED"}
        editing = context.mode == "EDIT_MESH"
        if editing:
            bpy.ops.object.mode_set(mode="OBJECT")
        try:
            chosen = [[v.index for v in o.data.vertices if v.select] for o in things]
            if [len(c) for c in chosen] != [1, 1]:
                self.report({"ERROR"}, "select one vertex in each: " + ", ".join(f"{len(c)} in '{o.name}'" for o, c in zip(things, chosen)))
                return {"CANCELLED"}
            taken = {g.name for o in things for g in o.vertex_groups}
            name = next(f"pair {i:02d}" for i in range(1, 10000) if f"pair {i:02d}" not in taken)
            for o, c in zip(things, chosen):
                o.vertex_groups.new(name=name).add(c, 1.0, "REPLACE")
        finally:
            if editing:
                bpy.ops.object.mode_set(mode="EDIT")
        self.report({"INFO"}, f"'{name}'")
        return {"FINISHED"}


# ---- commands ----


def registered(job, source, target, markers):
    """The file of the correspondence between two rest bodies."""
    if len(markers) < 3:
        raise Trouble(f"the meshes have different vertices or faces: {len(markers)} pairs of vertices are named alike on both, at least 3 are needed, "
                      "10 to 60 are usual")
    text = job.path("markers.txt")
    with open(text, "w", encoding="utf-8") as out:
        out.writelines(f"{name} {a} {b}\n" for name, a, b in markers)
    made = job.path("pairs.vgs")
    job.call(["vg-register", job.write("source.vgs", source), job.write("target-rest.vgs", target), "--markers", text, "-o", made],
             step="pairing faces")
    return made


def deform_words(job, gathered):
    """The command line of vg-deform."""
    s = gathered
    words = ["vg-deform", "--onto", job.write("target.vgs", s.target)]
    if not s.body.same_mesh(s.target):
        words += ["--correspondence", registered(job, Body(s.body.reference, s.body.faces), s.target, s.markers)]
    if s.by != "DEFAULT":
        words += ["--by", s.by.lower()]
    if s.root == "STAY":
        words += ["--root", "stay"]
    return words


def solve_words(s):
    if s.by == "SHAPE":
        return []
    return [["vg-solve", "--fit", "squares" if s.fast else "absolute"] + (["--planar"] if s.planar else [])]


def matching(keyed, body, what):
    """Shapes of a keyed body that have the name of a pose: (index of the pose, shape)."""
    found = [(body.names.index(name), shape) for name, shape in zip(keyed.names, keyed.points) if name in body.names]
    if not found:
        raise Trouble(f"no shape key of {what} has the name of a pose of the source, such as '{body.names[0]}'")
    return sorted(found, key=lambda pair: pair[0])


def chosen(body, picked, of):
    """A sequence of some poses."""
    return Body(of.reference, of.faces, [shape for _, shape in picked], [body.names[i] for i, _ in picked])


def transferred(job, s):
    """The poses of the target."""
    words = deform_words(job, s)
    if s.guide and s.guide_by == "EXAMPLES":
        picked = matching(s.guide, s.body, "the sculpted mesh")
        known = chosen(s.body, [(i, s.body.points[i]) for i, _ in picked], s.body)
        words += ["--examples", job.write("known.vgs", known), job.write("sculpted.vgs", chosen(s.body, picked, s.target))]
    pipe = [words] + solve_words(s)
    if s.guide and s.guide_by == "POISSON":
        guide = ["vg-poisson"]
        for i, shape in matching(s.guide, s.body, "the sculpted mesh"):
            guide += ["--key", f"#{i}={job.write(f'key{i}.vgs', Body(s.target.reference, s.target.faces, [shape], ['key']))}"]
        pipe.append(guide)
    _, frames = job.pipe(*pipe, feed=s.body, expect=s.body.count, step="transfer")
    return [f.values for f in frames]


# ---- the operators ----


class Settings:
    """What compute() needs, without Blender."""


def keyed_body(thing, scene):
    class Source:
        object = thing
    return bodies.all_of(bodies.from_keys(Source, scene))


def settings(scene, body, target_object):
    vg, s = scene.vg, Settings()
    s.body, s.target = body, bodies.rest_body(target_object, scene)
    s.by, s.root, s.fast, s.planar = vg.by, vg.root, vg.fast, vg.planar
    s.markers = pairs(vg.source.object, target_object) if vg.source.object and vg.source.object.type == "MESH" else []
    s.guide, s.guide_by = None, vg.guide_by
    if vg.guide:
        s.guide = keyed_body(bodies.mesh_object(vg.guide, "the sculpted mesh"), scene)
        if not s.guide.same_mesh(s.target):
            raise Trouble(f"'{vg.guide.name}' is another mesh than '{target_object.name}': other vertices or faces")
    return s


class VG_OT_transfer(Work, bpy.types.Operator):
    """The target does what the source does: a copy of it, with shape keys or a cache; a skeleton's motion for a skeleton"""
    bl_idname, bl_label = "vg.transfer", "Transfer"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        self.of_skeletons = bool(vg.source.kind == "FRAMES" and vg.source.object and vg.source.object.type == "ARMATURE")
        if self.of_skeletons:
            return (yield from skeleton.gather_transfer(vg, scene))
        target = bodies.mesh_object(vg.target, "a target")
        if vg.result == "CACHE":
            bodies.cache_path(vg.folder, "x")
        self.target, self.moments = target.name, bodies.moments_of(vg.source, scene, 0)
        body = yield from bodies.poses(vg.source, scene)
        return settings(scene, body, target)

    def compute(self, job, s):
        if self.of_skeletons:
            return skeleton.compute_transfer(job, s)
        return s.body.names, transferred(job, s)

    def finish(self, context, result):
        scene, vg = context.scene, context.scene.vg
        if self.of_skeletons:
            return skeleton.finish_transfer(vg, scene, result)
        names, shapes = result
        target = scene.objects.get(self.target)
        if target is None:
            raise Trouble(f"'{self.target}' has been removed")
        what = vg.source.object.name if vg.source.object else vg.source.collection.name
        made = bodies.new_object(target, f"{target.name} as {what}")
        return bodies.play_shapes(context, made, names, shapes, self.moments)


class VG_OT_pick(Work, bpy.types.Operator):
    """Which poses help most when they are sculpted by hand: the result of a transfer gets a copy that has these poses as shape keys, to sculpt"""
    bl_idname, bl_label = "vg.pick", "Poses to Sculpt"

    def gather(self, context):
        vg = context.scene.vg
        thing = bodies.mesh_object(context.object, "the result of a transfer: select it")
        if not thing.data.shape_keys:
            raise Trouble(f"'{thing.name}' has no shape keys: select the result of a transfer")
        self.thing, self.count = thing.name, vg.picks
        return (yield from bodies.poses(vg.source, context.scene))

    def compute(self, job, body):
        path = job.write("poses.vgs", body)
        text = job.call(["vg-fitsignal", "--pick", str(self.count), "--json", path], step="picking")
        return [body.names[i] for i in picked_numbers(text)]

    def finish(self, context, names):
        thing = context.scene.objects[self.thing]
        missing = [n for n in names if n not in thing.data.shape_keys.key_blocks]
        if missing:
            raise Trouble(f"'{thing.name}' has no shape key '{missing[0]}': it is not the result of a transfer from this source")
        made = bodies.new_object(thing, f"{thing.name} sculpt")
        for name in names:
            bodies.add_key(made, name, bodies.positions(thing.data.shape_keys.key_blocks[name].data))
        bodies.show_only(context, made)
        made.active_shape_key_index, made.show_only_shape_key = 1, True
        context.scene.vg.guide = made
        return "sculpt " + ", ".join(names)


def picked_numbers(text):
    import json
    return [int(n) for n in json.loads(text)["take"].split(",")]


classes = (VG_OT_pair, VG_OT_transfer, VG_OT_pick)
