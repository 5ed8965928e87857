"""screenshots.py: make the pictures of manual.md, in a Blender with a window:

    make blender
    xvfb-run -s '-screen 0 1180x720x24' blender --factory-startup --window-geometry 0 0 1180 720 --python examples/blender/screenshots.py -- OUTDIR

Installs build/vg_tools.zip, needs the vg programs and xdotool in the search path, and reads tests/data. One scene and one picture for each section of the panel.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import os
import subprocess
import sys
import tempfile
import traceback

import bpy
import numpy

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
DATA = os.path.join(ROOT, "tests", "data")
OUT = os.path.abspath(sys.argv[sys.argv.index("--") + 1])
WORK = tempfile.mkdtemp(prefix="vg-pictures-")

bpy.ops.preferences.addon_install(filepath=os.path.join(ROOT, "build", "vg_tools.zip"))
bpy.ops.preferences.addon_enable(module="vg_tools")
import vg_tools  # noqa: E402
from vg_tools import bodies, envelope, panels, skeleton, vgstream  # noqa: E402

bpy.context.preferences.view.show_splash = False
scene = bpy.context.scene
vg = scene.vg


def shell(line):
    subprocess.run(["bash", "-o", "pipefail", "-c", line], check=True, cwd=WORK)


def stream(path):
    with vgstream.Reader(os.path.join(WORK, path)) as reader:
        return reader, list(reader)


def body(name, path, played=True, at=(0, 0, 0), colour=None, turned=None):
    """A stream as an object that plays it. turned: another way up, degrees about x, y, z."""
    reader, frames = stream(path)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(bodies.from_file(numpy.array(reader.reference).reshape(-1, 3)).tolist(), [], [f for f in reader.faces if len(f) > 2])
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    thing = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(thing)
    if played:
        bodies.give_keys(thing, [f.name for f in frames], [f.values for f in frames], list(range(1, len(frames) + 1)), scene)
        scene.frame_start, scene.frame_end = 1, len(frames)
    elif frames:
        bodies.give_keys(thing, [f.name for f in frames], [f.values for f in frames], None, scene)
    thing.location = at
    bpy.context.view_layer.update()
    return thing


def fresh():
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    vg.source.object = vg.target = vg.armature = vg.body = vg.guide = None
    vg.source.kind, vg.way, vg.t_min, vg.t_max, vg.count = "FRAMES", "GEODESIC", 0, 1, 30


def shift(thing, x):
    thing.location.x = x


# ---- the scenes: each returns the panels that are open, and the frame ----


def transfer():
    shell(f"vg-encode {DATA}/human-man-poses.tar.xz -o man.vgs; vg-encode --take 0 {DATA}/human-heavy-poses.tar.xz -o heavy.vgs")
    vg.source.object, vg.target = body("man", "man.vgs"), body("heavy", "heavy.vgs", False)
    vg.target.shape_key_clear()
    bpy.ops.vg.transfer()
    shift(scene.objects["man"], -1.6)
    shift(scene.objects["heavy as man"], 1.6)
    return ["VG_PT_source", "VG_PT_transfer", "VG_PT_messages"], 5


def shapes():
    shell(f"vg-encode {DATA}/faceA.tar.xz -o a.vgs; vg-encode --take 0 {DATA}/faceB.tar.xz -o b.vgs; vg-encode --take 1-14 a.vgs -o shapes.vgs")
    source, target = body("face A", "shapes.vgs", False), body("face B", "b.vgs", False)
    target.shape_key_clear()
    vg.source.kind, vg.source.object, vg.target = "KEYS", source, target
    bpy.ops.vg.shapes()
    for thing, x in (source, -10), (target, 10):
        shift(thing, x)
        thing.data.shape_keys.key_blocks[8].value = 1
    return ["VG_PT_source", "VG_PT_shapes", "VG_PT_messages"], 1


def armature(path):
    thing = bpy.data.objects.new("skeleton", bpy.data.armatures.new("skeleton"))
    scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.mode_set(mode="EDIT")
    for words in (line.split() for line in open(path) if not line.startswith("#")):
        bone = thing.data.edit_bones.new(words[0])
        bone.head, bone.tail = bodies.from_file(numpy.array([words[2:5], words[5:8]], float))
        bone.parent = thing.data.edit_bones.get(words[1])
    bpy.ops.object.mode_set(mode="OBJECT")
    thing.show_in_front = True
    return thing


def envelopes():
    shell(f"vg-encode --reference {DATA}/trex.rest.obj {DATA}/trex-attack.tar.xz -o trex.vgs")
    vg.source.object, vg.armature = body("trex", "trex.vgs"), armature(os.path.join(DATA, "trex.skeleton.txt"))
    vg.learn, vg.rig_file, vg.body = True, os.path.join(WORK, "trex.rig"), vg.source.object
    bpy.ops.vg.envelope()
    vg.source.object.data.shape_keys.animation_data_clear()
    for key in vg.source.object.data.shape_keys.key_blocks[1:]:
        key.value = 0
    bpy.ops.vg.follow()
    bpy.context.view_layer.objects.active = vg.armature
    bpy.ops.object.mode_set(mode="POSE")
    for name, axis, angle in ("Head", "Y", 0.6), ("Neck", "Y", 0.5), ("Tail2", "Y", -0.5), ("Tail3", "Y", -0.5):
        if name in vg.armature.data.bones:
            vg.armature.data.bones.active = vg.armature.data.bones[name]
            bpy.ops.vg.turn(axis=axis, angle=angle)
    envelope.follow_now(bpy.context)
    return ["VG_PT_envelope", "VG_PT_messages"], 1


def interpolation():
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.vg.follow()
    fresh()
    shell(f"vg-encode --reference {DATA}/horse.rest.obj --take 0,5 {DATA}/horse-run.tar.xz -o keys.vgs")
    vg.source.kind, vg.source.object, vg.count, vg.t_min, vg.t_max = "KEYS", body("horse", "keys.vgs", False), 11, -0.5, 1.5
    bpy.ops.vg.interpolate()
    shift(scene.objects["horse"], -6)
    shift(scene.objects["horse between"], 6)
    return ["VG_PT_source", "VG_PT_between", "VG_PT_messages"], 11


def maps():
    shell(f"vg-encode {DATA}/human-man-poses.tar.xz -o man.vgs")
    vg.source.object = man = body("man", "man.vgs")
    vg.patches, vg.map_file = 40, os.path.join(WORK, "man.map")
    bpy.ops.vg.map()
    vg.t_max = 14
    bpy.ops.vg.slide()
    vg.slider = 2.5
    from vg_tools import between
    points = between.Slider.live.wait()
    envelope.show(points)
    for key in man.data.shape_keys.key_blocks[1:-1]:
        key.mute = True
    return ["VG_PT_source", "VG_PT_patches", "VG_PT_messages"], 1


def signals():
    bpy.ops.vg.slide()
    fresh()
    shell(f"vg-encode --reference {DATA}/horse.rest.obj {DATA}/horse-run.tar.xz -o run.vgs")
    vg.source.object, vg.signal_file = body("horse", "run.vgs"), os.path.join(WORK, "horse.signal")
    bpy.ops.vg.fit_signal()
    vg.timing, vg.speed = "SPEED", 0.25
    bpy.ops.vg.sample()
    shift(scene.objects["horse"], -6)
    shift(scene.objects["horse sampled"], 6)
    return ["VG_PT_source", "VG_PT_signals", "VG_PT_messages"], 9


def networks():
    shell("vg-train -q --iterations 20 run.vgs -o horse.net")
    vg.source.object, vg.network_file, vg.count = body("horse", "run.vgs"), os.path.join(WORK, "horse.net"), 20
    bpy.ops.vg.generate()
    shift(scene.objects["horse"], -6)
    shift(scene.objects["horse generated"], 6)
    return ["VG_PT_source", "VG_PT_generate", "VG_PT_messages"], 5


SCENES = [("transfer", transfer), ("shapes", shapes), ("envelope", envelopes), ("between", interpolation), ("patches", maps),
          ("signals", signals), ("generate", networks)]

# ---- the window ----


def lone_panels(names):
    """These panels alone, open, in the sidebar."""
    for c in panels.classes:
        if c.is_registered:
            bpy.utils.unregister_class(c)
    for c in panels.classes:
        if c.__name__ in names:
            c.bl_options = set()
            bpy.utils.register_class(c)


def no_other_tabs():
    for c in bpy.types.Panel.__subclasses__():
        if getattr(c, "bl_space_type", "") == "VIEW_3D" and getattr(c, "bl_region_type", "") == "UI" and not c.__name__.startswith("VG_"):
            try:
                bpy.utils.unregister_class(c)
            except RuntimeError:
                pass


class Show:
    step, scene, ready = 0, 0, False


def area():
    return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")


def within(f):
    window, place = bpy.context.window_manager.windows[0], area()
    with bpy.context.temp_override(window=window, area=place, region=next(r for r in place.regions if r.type == "WINDOW")):
        return f()


def prepare():
    if Show.ready:
        return
    no_other_tabs()
    space = area().spaces.active
    space.show_region_ui, space.show_region_toolbar, space.show_region_tool_header, space.show_gizmo = True, False, False, False
    space.shading.light, space.shading.show_cavity, space.shading.show_shadows = "STUDIO", True, False
    space.overlay.show_cursor = space.overlay.show_text = False
    within(bpy.ops.screen.screen_full_area)
    Show.ready = True


def view():
    space = area().spaces.active
    space.show_region_ui, space.show_region_toolbar = True, False
    within(lambda: bpy.ops.view3d.view_axis(type="FRONT"))
    within(lambda: bpy.ops.view3d.view_orbit(angle=0.45, type="ORBITRIGHT"))
    within(lambda: bpy.ops.view3d.view_orbit(angle=0.2, type="ORBITDOWN"))
    for thing in scene.objects:
        thing.select_set(False)
    within(lambda: bpy.ops.view3d.view_all(center=False))
    space.region_3d.view_perspective = "ORTHO"
    space.region_3d.view_distance *= 0.72


def point(x, y, press):
    subprocess.run(["xdotool", "mousemove", str(x), str(y)] + (["sleep", "0.1", "click", "1"] if press else []), check=True)


def tick():
    try:
        prepare()
        if Show.scene == len(SCENES):
            bpy.ops.wm.quit_blender()
            return None
        name, make = SCENES[Show.scene]
        if Show.step == 0:
            if name in ("transfer", "shapes", "envelope", "patches", "generate"):
                fresh()
            names, frame = make()
            scene.frame_set(frame)
            if name == "patches":
                area().spaces.active.shading.color_type = "VERTEX"
            else:
                area().spaces.active.shading.color_type = "MATERIAL"
            lone_panels(names)
            view()
        if Show.step in (2, 3, 4) and bpy.context.active_object:  # the tab of an active object stands before ours
            point(*((1166, 122), (1167, 123), (300, 690))[Show.step - 2], Show.step == 3)
        if Show.step == 6:
            bpy.ops.screen.screenshot(filepath=os.path.join(OUT, f"blender-{name}.png"))
            print("made", name, flush=True)
            Show.scene, Show.step = Show.scene + 1, -1
        Show.step += 1
    except Exception:
        traceback.print_exc()
        sys.stdout.flush()
        os._exit(1)
    return 0.4


bpy.app.timers.register(tick, first_interval=0.5)
