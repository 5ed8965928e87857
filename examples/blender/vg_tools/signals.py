"""Signals: a sequence as a curve through a plane of poses. The plane is drawn by the page that vg-view makes, in the browser; the edits that the page
saves come back here. Retiming is a curve of the Graph Editor. Networks that have learned how a sequence goes on are asked here, too.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import os
import tempfile
import webbrowser

import bpy

from . import bodies
from .envelope import artefact, artefact_to_be
from .programs import Trouble
from .work import Work


def give_result(context, thing, title, names, shapes, first):
    """A copy of an object that plays shapes from a frame on."""
    scene, vg = context.scene, context.scene.vg
    if len(thing.data.vertices) != len(shapes[0]):
        raise Trouble(f"the result has {len(shapes[0])} vertices, '{thing.name}' {len(thing.data.vertices)}: choose its body")
    made = bodies.new_object(thing, f"{thing.name} {title}", vg.source)
    said = bodies.play_shapes(context, made, names, shapes, [first + i for i in range(len(shapes))])
    if vg.cycle:
        repeat(made)
    return said


def repeat(thing):
    """The keys' curves go on for ever, round and round; the last pose is the first of the next round."""
    keys = thing.data.shape_keys
    curves = keys.animation_data.action.fcurves if keys and keys.animation_data else []
    if not curves:
        raise Trouble("a cache does not repeat: choose shape keys")
    spots = [p.co[0] for c in curves for p in c.keyframe_points]
    first, last = min(spots), max(spots)
    for curve in curves:
        for moment in first, last:
            if not any(p.co[0] == moment for p in curve.keyframe_points):
                curve.keyframe_points.insert(moment, 0.0, options={"FAST"}).interpolation = "LINEAR"
        curve.update()
        curve.modifiers.new("CYCLES")


def body_of(vg):
    """The object whose mesh the results are of."""
    thing = vg.source.object
    if vg.source.kind == "OBJECTS" and vg.source.collection:
        thing = next(iter(sorted((o for o in vg.source.collection.objects if o.type == "MESH"), key=bodies.in_order)), None)
    return bodies.mesh_object(thing, "a source")


class VG_OT_fit_signal(Work, bpy.types.Operator):
    """Fit a signal to the poses of the source, within the tolerance, and write it to a file"""
    bl_idname, bl_label = "vg.fit_signal", "Fit Signal"

    def gather(self, context):
        vg = context.scene.vg
        self.path = artefact_to_be(vg.signal_file, "signal")
        return (yield from bodies.poses(vg.source, context.scene)), vg.tolerance

    def compute(self, job, gathered):
        body, tolerance = gathered
        job.call(["vg-fitsignal", "--tolerance", f"{tolerance:.6g}", "-o", self.path], feed=body, step="fitting the signal")

    def finish(self, context, result):
        return f"'{self.path}'"


class VG_OT_plane(Work, bpy.types.Operator):
    """Open the pose plane in the browser: drag the curve, see the mesh, save the edits, and load them here"""
    bl_idname, bl_label = "vg.plane", "Open Pose Plane"

    def gather(self, context):
        self.path = artefact(context.scene.vg.signal_file, "signal")
        yield 1, 1

    def compute(self, job, gathered):
        page = os.path.join(bpy.app.tempdir or tempfile.gettempdir(), "pose-plane.html")
        job.call(["vg-view", self.path, "-o", page], step="drawing the page")
        return page

    def finish(self, context, page):
        context.scene.vg.page = page
        if not bpy.app.background:
            webbrowser.open("file://" + page)
        return f"'{page}' is open in the browser"


def keyed_times(scene):
    """The moments of the signal at each frame of the scene, as the keyed property says."""
    curves = scene.animation_data.action.fcurves if scene.animation_data and scene.animation_data.action else []
    curve = next((c for c in curves if c.data_path == "vg.moment"), None)
    if curve is None:
        raise Trouble("key 'Moment' at two frames or more: which moment of the signal is shown there")
    return [curve.evaluate(f) for f in range(scene.frame_start, scene.frame_end + 1)]


def clipped(times, last):
    """Within the signal: 1 to its number of frames."""
    return [min(max(t, 1.0), last) for t in times]


def there_and_back(count):
    """Forth and back, so that the end meets the beginning."""
    forth = [float(i) for i in range(1, count + 1)]
    return forth + forth[-2::-1]


class VG_OT_sample(Work, bpy.types.Operator):
    """Poses of the signal: edited, slower or faster, at keyed moments, or forth and back; repeated for ever if asked for"""
    bl_idname, bl_label = "vg.sample", "Sample Signal"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        self.path, self.thing = artefact(vg.signal_file, "signal"), body_of(vg).name
        self.edits = ["--edit", artefact(vg.edits_file, "list of edits")] if vg.edits_file else []
        self.times = keyed_times(scene) if vg.timing == "KEYED" else None
        yield 1, 1
        return vg.timing, vg.speed

    def compute(self, job, gathered):
        timing, speed = gathered
        words = ["vg-sample", *self.edits]
        if timing == "SPEED":
            words += ["--speed", f"{speed:.6g}"]
        elif timing != "FRAMES":
            import json
            count = json.loads(job.call(["vg-info", "--json", self.path]))["signal"]["frames"]
            times = clipped(self.times, count) if timing == "KEYED" else there_and_back(count)
            words += ["--at", ",".join(f"{t:.9g}" for t in times)]
        _, frames = job.pipe([*words, self.path], step="sampling")
        return [f.name for f in frames], [f.values for f in frames]

    def finish(self, context, result):
        return give_result(context, context.scene.objects[self.thing], "sampled", *result, context.scene.frame_start)


class VG_OT_generate(Work, bpy.types.Operator):
    """Go on from the poses of the source as the network has learned, or lead from each pose to the next"""
    bl_idname, bl_label = "vg.generate", "Generate"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        self.path, self.thing = artefact(vg.network_file, "network"), body_of(vg).name
        words = ["--between", str(vg.between)] if vg.generate == "BETWEEN" else ["--frames", str(vg.count)]
        body = yield from bodies.poses(vg.source, scene)
        return body, words + (["--diversity", f"{vg.diversity:.6g}", "--seed", str(vg.seed)] if vg.diversity > 0 else []) + (["--root", "stay"] if vg.root == "STAY" else [])

    def compute(self, job, gathered):
        body, words = gathered
        _, frames = job.pipe(["vg-generate", self.path, *words], ["vg-solve"], feed=body, step="generating")
        return [f.name for f in frames], [f.values for f in frames]

    def finish(self, context, result):
        return give_result(context, context.scene.objects[self.thing], "generated", *result, context.scene.frame_start)


class VG_OT_train(Work, bpy.types.Operator):
    """Learn from the poses of the source how they go on: a network, written to a file. This takes minutes"""
    bl_idname, bl_label = "vg.train", "Train Network"

    def gather(self, context):
        vg = context.scene.vg
        self.path = artefact_to_be(vg.network_file, "network")
        words = ["--iterations", str(vg.iterations)] if vg.iterations else []
        return (yield from bodies.poses(vg.source, context.scene)), words

    def compute(self, job, gathered):
        body, words = gathered
        job.call(["vg-train", *words, "-o", self.path], feed=body, step="training")

    def finish(self, context, result):
        return f"'{self.path}'"


classes = (VG_OT_fit_signal, VG_OT_plane, VG_OT_sample, VG_OT_generate, VG_OT_train)
