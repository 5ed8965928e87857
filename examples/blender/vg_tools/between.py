"""Between: poses between key poses and beyond them, or bodies half-way to other bodies; patches as colours; maps that are learnt from poses; a slider.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import struct

import bpy
import numpy

from . import bodies, envelope, vgstream
from .envelope import artefact, artefact_to_be
from .live import Live
from .programs import Body, Trouble
from .work import State, Work, redraw

# ---- keys ----


def key_poses(vg, scene):
    """Generator: the poses of the source; where they are frames, those of the keys alone."""
    body = yield from bodies.poses(vg.source, scene)
    if body.count < 2:
        raise Trouble("two poses or more are needed")
    return body


def with_body(vg, scene, body):
    """For morphing: the rest pose of the source, then that of the target; or only what the source has."""
    target = bodies.mesh_object(vg.target, "the body to morph into")
    end = bodies.rest_body(target, scene)
    if not end.same_mesh(body):
        raise Trouble(f"'{target.name}' is another mesh than the source: bodies are morphed that have the same vertices and faces; a transfer makes such ones")
    return Body(body.reference, body.faces, [body.reference, end.reference], [vg.source.object.name, target.name])


def moments(vg):
    """From the lower to the upper bound, evenly."""
    n = max(2, vg.count)
    return [vg.t_min + (vg.t_max - vg.t_min) * i / (n - 1) for i in range(n)]


def at(values):
    return "--at=" + ",".join(f"{t:.9g}" for t in values)


class Between(Work):
    """What interpolation and morphing have in common."""
    morph = False

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        thing = vg.source.object
        if vg.source.kind == "OBJECTS":
            thing = next((o for o in sorted((o for o in vg.source.collection.objects if o.type == "MESH"), key=bodies.in_order)), None) \
                if vg.source.collection else None
        self.thing = bodies.mesh_object(thing, "a source").name
        self.map = artefact(vg.map_file, "map") if vg.way == "MAP" and not self.morph else None
        if self.morph:
            body = with_body(vg, scene, bodies.rest_body(thing, scene))
            yield 1, 1
        else:
            body = yield from key_poses(vg, scene)
        smooth = ["--smooth"] if vg.smooth else []
        return body, moments(vg), smooth

    def compute(self, job, gathered):
        body, times, smooth = gathered
        pipe = [["vg-play", self.map, at(times)]] if self.map else [["vg-interpolate", *smooth, at(times)], ["vg-solve"]]
        _, frames = job.pipe(*pipe, feed=body, expect=len(times), step="interpolating")
        names = [f"{f.name}" for f in frames]
        return names, [f.values for f in frames]

    def finish(self, context, result):
        scene, vg, (names, shapes) = context.scene, context.scene.vg, result
        made = bodies.new_object(scene.objects[self.thing], f"{self.thing} {'morphed' if self.morph else 'between'}", None if self.morph else vg.source)
        return bodies.play_shapes(context, made, names, shapes, [scene.frame_start + i for i in range(len(shapes))])


class VG_OT_interpolate(Between, bpy.types.Operator):
    """Poses between the poses of the source and beyond them, through any number of turns; 0 is the first, 1 the second"""
    bl_idname, bl_label = "vg.interpolate", "Interpolate"


class VG_OT_morph(Between, bpy.types.Operator):
    """From the body of the source to that of the target, both in their rest poses"""
    bl_idname, bl_label = "vg.morph", "Morph"
    morph = True


# ---- patches and maps ----


def patches_of(path):
    """The patch of each face, and how many there are."""
    with vgstream.Reader(path) as reader:
        payload = reader.record("PTCH")
        if payload is None:
            raise Trouble(f"'{path}' holds no patches")
        count = struct.unpack_from("<Q", payload)[0]
        faces = len(reader.faces)
        return numpy.frombuffer(payload, "<u4", faces, 8).astype(int), count


def hues(n):
    """Colours that differ, neighbours in number most of all: the golden angle round the circle, three brightnesses."""
    import colorsys
    return [colorsys.hsv_to_rgb(i * 0.61803398875 % 1, 0.65, (0.95, 0.75, 0.55)[i % 3]) for i in range(n)]


def paint(thing, patch, count):
    """The patches as a number and a colour of each face, which the view then shows."""
    mesh = thing.data
    polygons = len(mesh.polygons)
    numbers = mesh.attributes.get("vg patch") or mesh.attributes.new("vg patch", "INT", "FACE")
    numbers.data.foreach_set("value", patch[:polygons].astype(numpy.int32))
    layer = mesh.color_attributes.get("vg patches") or mesh.color_attributes.new("vg patches", "BYTE_COLOR", "CORNER")
    sizes = numpy.empty(polygons, numpy.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    colours = numpy.array([(*c, 1.0) for c in hues(count)])
    layer.data.foreach_set("color_srgb" if hasattr(layer.data[0], "color_srgb") else "color",
                           numpy.repeat(colours[patch[:polygons]], sizes, axis=0).astype(numpy.float32).ravel())
    mesh.color_attributes.active_color = mesh.color_attributes["vg patches"]
    mesh.update()


def show_colours(context):
    for window in context.window_manager.windows if context.window_manager else ():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.spaces.active.shading.color_type = "VERTEX"


class VG_OT_patches(Work, bpy.types.Operator):
    """Parts of the mesh that turn alike in the poses, as colours of its faces"""
    bl_idname, bl_label = "vg.patches", "Find Patches"

    def gather(self, context):
        vg = context.scene.vg
        self.thing = bodies.mesh_object(vg.source.object, "a source").name
        return (yield from bodies.poses(vg.source, context.scene)), \
            ["-k", str(vg.patches) if vg.patches else "auto"] + (["--connected"] if vg.connected else [])

    def compute(self, job, gathered):
        body, words = gathered
        path = job.path("body.patches")
        job.call(["vg-segment", *words, "-o", path], feed=body, step="finding patches")
        return patches_of(path)

    def finish(self, context, result):
        patch, count = result
        thing = context.scene.objects[self.thing]
        if len(patch) < len(thing.data.polygons):
            raise Trouble(f"'{thing.name}' shows other faces than it has: its patches cannot be drawn")
        paint(thing, patch, count)
        show_colours(context)
        return f"{count} patches"


class VG_OT_map(Work, bpy.types.Operator):
    """Learn from the poses how patches move the mesh: a map, written to a file, that interpolates and transfers in real time"""
    bl_idname, bl_label = "vg.map", "Fit Map"

    def gather(self, context):
        vg = context.scene.vg
        self.path = artefact_to_be(vg.map_file, "map")
        self.thing = vg.source.object.name if vg.source.object else ""
        return (yield from bodies.poses(vg.source, context.scene)), \
            ["-k", str(vg.patches) if vg.patches else "auto"] + (["--connected"] if vg.connected else [])

    def compute(self, job, gathered):
        body, words = gathered
        patches = job.path("body.patches")
        job.call(["vg-segment", *words, "-o", patches], feed=body, step="finding patches")
        job.call(["vg-fitmap", "--patches", patches, "-o", self.path], feed=body, step="fitting the map")
        return patches_of(patches)

    def finish(self, context, result):
        patch, count = result
        thing = context.scene.objects.get(self.thing)
        if thing and len(patch) >= len(thing.data.polygons):
            paint(thing, patch, count)
        return f"'{self.path}': {count} patches"


class VG_OT_retarget(Work, bpy.types.Operator):
    """The same map, or rig, for the target's body, or for a body on the way to it"""
    bl_idname, bl_label = "vg.retarget", "Map for Target"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        self.path, self.out = artefact(vg.map_file, "map"), artefact_to_be(vg.map_out, "new map")
        if self.path == self.out:
            raise Trouble("the new map needs another name than the map")
        target = bodies.rest_body(bodies.mesh_object(vg.target, "a target"), scene)
        yield 1, 1
        return target, vg.morph_by

    def compute(self, job, gathered):
        target, morph = gathered
        words = [] if morph == 1 else ["--morph", f"{morph:.9g}"]
        job.call(["vg-retarget", "--onto", job.write("target.vgs", target), *words, self.path, "-o", self.out], step="the map for the target")

    def finish(self, context, result):
        context.scene.vg.map_file = context.scene.vg.map_out
        return f"'{self.out}'"


class VG_OT_play(Work, bpy.types.Operator):
    """What the map makes of the poses of the source: on the body of the map, in real time's way, without a solve"""
    bl_idname, bl_label = "vg.play", "Play Map"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        self.path = artefact(vg.map_file, "map")
        self.target = bodies.mesh_object(vg.body or vg.source.object, "the body of the map").name
        self.moments = bodies.moments_of(vg.source, scene, 0)
        return (yield from bodies.poses(vg.source, scene))

    def compute(self, job, body):
        _, frames = job.pipe(["vg-play", self.path], feed=body, expect=body.count, step="playing the map")
        return body.names, [f.values for f in frames]

    def finish(self, context, result):
        scene, (names, shapes) = context.scene, result
        thing = scene.objects[self.target]
        if len(thing.data.vertices) != len(shapes[0]):
            raise Trouble(f"the map has {len(shapes[0])} vertices, '{thing.name}' {len(thing.data.vertices)}: choose its body")
        made = bodies.new_object(thing, f"{thing.name} played")
        return bodies.play_shapes(context, made, names, shapes, self.moments)


# ---- the slider ----

STEPS = 64  # motions kept for each stretch between two keys; between them quaternions and places are mixed


class Slider:
    """A map that the slider drives, between the keys that were there when it began."""
    live, thing, scene, times, motions = None, "", "", None, None

    @classmethod
    def at(cls, t):
        x = numpy.interp(t, cls.times, numpy.arange(len(cls.times)))
        i = min(int(x), len(cls.times) - 2)
        a, b, w = cls.motions[i], cls.motions[i + 1], x - i
        sign = numpy.where((a[:, :4] * b[:, :4]).sum(1) < 0, -1.0, 1.0)[:, None]
        mixed = (1 - w) * a + w * numpy.hstack([sign * b[:, :4], b[:, 4:]])
        length = (1 - w) * numpy.linalg.norm(a[:, :4], axis=1) + w * numpy.linalg.norm(b[:, :4], axis=1)
        mixed[:, :4] *= (length / numpy.linalg.norm(mixed[:, :4], axis=1))[:, None]
        return mixed


class VG_OT_slide(Work, bpy.types.Operator):
    """The slider moves the body through the poses of the source by the map, in real time, until the button is pressed again"""
    bl_idname, bl_label = "vg.slide", "Slider"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        if Slider.live:
            return None
        if envelope.Follow.active():
            raise Trouble("a mesh follows bones: end that first")
        self.path = artefact(vg.map_file, "map")
        self.thing = bodies.mesh_object(vg.body or vg.source.object, "the body of the map").name
        body = yield from key_poses(vg, scene)
        low, high = min(vg.t_min, 0.0), max(vg.t_max, float(body.count - 1))
        times = numpy.linspace(low, high, max(2, int(round((high - low) * STEPS)) + 1))
        return body, times

    def compute(self, job, gathered):
        if gathered is None:
            return None
        body, times = gathered
        _, frames = job.pipe(["vg-play", self.path, "--transforms", at(times)], feed=body, expect=len(times), step="interpolating motions")
        return times, numpy.array([f.values for f in frames])

    def finish(self, context, result):
        if result is None:
            end_slide()
            return "the slider has ended"
        scene = context.scene
        Slider.times, Slider.motions = result
        Slider.thing, Slider.scene = self.thing, scene.name
        Slider.live = Live(self.path, Slider.motions.shape[1])
        envelope.Follow.mesh, envelope.Follow.scene = self.thing, scene.name
        thing = scene.objects[self.thing]
        envelope.live_key(thing)
        envelope.Follow.muted = envelope.mute_armatures(thing)
        bpy.app.timers.register(show_slide, first_interval=0.01)
        slid(scene.vg, context)
        return "move the slider"


def slid(vg, context):
    """The slider has been moved."""
    if Slider.live:
        try:
            Slider.live.send(Slider.at(vg.slider))
        except Trouble as error:
            State.lines, State.failed = [str(error)], True
            end_slide()


def show_slide():
    if not Slider.live:
        return None
    try:
        points = Slider.live.newest()
        if points is not None:
            envelope.show(points)
            redraw()
    except (Trouble, KeyError) as error:
        State.lines, State.failed = [str(error)], True
        end_slide()
        return None
    return 0.01


def end_slide():
    live, Slider.live = Slider.live, None
    if live:
        live.close()
    envelope.end_follow()


classes = (VG_OT_interpolate, VG_OT_morph, VG_OT_patches, VG_OT_map, VG_OT_retarget, VG_OT_play, VG_OT_slide)
