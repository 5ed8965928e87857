"""The panel VG in the sidebar of the 3D view.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import textwrap
import time

import bpy

from . import between, envelope, transfer
from .programs import Programs
from .work import State


class Panel:
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "VG"

    def column(self, heading=None):
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        return self.layout.column(align=True)


def spread(context, column, lines, icon="NONE"):
    """Lines of text, broken to the width of the panel."""
    width = max(20, int(context.region.width / (7 * context.preferences.system.ui_scale)) - 4)
    for line in lines:
        for i, part in enumerate(textwrap.wrap(line, width) or [""]):
            column.label(text=part, icon=icon if i == 0 else "BLANK1" if icon != "NONE" else "NONE")


class VG_PT_source(Panel, bpy.types.Panel):
    bl_label = "Poses"

    def draw(self, context):
        s, c = context.scene.vg.source, self.column()
        c.prop(s, "kind")
        c.prop(s, "collection" if s.kind == "OBJECTS" else "object")
        if s.kind == "FRAMES":
            c.prop(s, "whole")
            if not s.whole:
                c.prop(s, "start")
                c.prop(s, "end")
                c.prop(s, "step")
            if s.object and s.object.type == "MESH":
                c.prop(s, "rest")


class VG_PT_transfer(Panel, bpy.types.Panel):
    bl_label = "Transfer"

    def draw(self, context):
        vg, c = context.scene.vg, self.column()
        source, target = vg.source.object, vg.target
        c.prop(vg, "target")
        skeletons = source and source.type == "ARMATURE"
        if not skeletons:
            c.prop(vg, "by")
        c.prop(vg, "root")
        if not skeletons:
            c.prop(vg, "fast")
            c.prop(vg, "planar")
            self.pairs(context, c, source, target)
            c.separator()
            c.prop(vg, "guide")
            if vg.guide:
                c.prop(vg, "guide_by")
            c.prop(vg, "picks")
            c.operator("vg.pick", icon="SCULPTMODE_HLT")
            c.separator()
            c.prop(vg, "result")
            if vg.result == "CACHE":
                c.prop(vg, "folder")
        c.operator("vg.transfer", icon="MOD_MESHDEFORM")

    def pairs(self, context, c, source, target):
        if not (source and target and source.type == target.type == "MESH") or alike(source, target):
            return
        row = c.row(align=True)
        n = Counted.pairs(source, target)
        row.label(text=f"{n} pairs of vertices" + ("" if n > 2 else ": 3 are needed"), icon="NONE" if n > 2 else "ERROR")
        row.operator("vg.pair", text="Pair Selected")


class Counted:
    """The number of pairs, counted anew once a second at most: a redraw must not walk through all vertices."""
    key, at, n = None, 0.0, 0

    @classmethod
    def pairs(cls, source, target):
        key, now = (source.name, target.name, bpy.context.mode), time.monotonic()
        if key != cls.key or now - cls.at > 1:
            cls.key, cls.n, cls.at = key, len(transfer.pairs(source, target)), time.monotonic()
        return cls.n


def alike(a, b):
    """The same numbers of everything: whether all faces are the same is looked at when it counts."""
    return all(len(getattr(a.data, n)) == len(getattr(b.data, n)) for n in ("vertices", "edges", "polygons", "loops"))


class VG_PT_shapes(Panel, bpy.types.Panel):
    bl_label, bl_options = "Shapes", {"DEFAULT_CLOSED"}

    def draw(self, context):
        vg, c = context.scene.vg, self.column()
        c.prop(vg, "target")
        source = vg.source.object
        keys = source.data.shape_keys if source and source.type == "MESH" else None
        c.label(text=f"{len(keys.key_blocks) - 1} shape keys of '{source.name}'" if keys else "the source has no shape keys")
        c.prop(vg, "fast")
        c.operator("vg.shapes", icon="SHAPEKEY_DATA")


class VG_PT_envelope(Panel, bpy.types.Panel):
    bl_label, bl_options = "Envelope", {"DEFAULT_CLOSED"}

    def draw(self, context):
        vg, c = context.scene.vg, self.column()
        c.prop(vg, "armature")
        c.prop(vg, "rig_file")
        c.prop(vg, "method")
        c.prop(vg, "learn")
        c.prop(vg, "holdout")
        c.operator("vg.envelope", icon="MOD_ARMATURE")
        c.separator()
        c.prop(vg, "body")
        c.operator("vg.follow", icon="PAUSE" if envelope.Follow.active() else "PLAY", depress=envelope.Follow.active())
        row = c.row(align=True)
        row.operator("vg.turn", text="Twist").axis = "TWIST"
        for axis in "XYZ":
            row.operator("vg.turn", text=axis.lower()).axis = axis
        c.separator()
        c.prop(vg, "result")
        if vg.result == "CACHE":
            c.prop(vg, "folder")
        c.operator("vg.bake", icon="ACTION")


class VG_PT_between(Panel, bpy.types.Panel):
    bl_label, bl_options = "Interpolate and Morph", {"DEFAULT_CLOSED"}

    def draw(self, context):
        vg, c = context.scene.vg, self.column()
        for name in "count", "t_min", "t_max", "way":
            c.prop(vg, name)
        c.prop(vg, "map_file" if vg.way == "MAP" else "smooth")
        c.operator("vg.interpolate", icon="IPO_EASE_IN_OUT")
        c.separator()
        c.prop(vg, "target")
        c.operator("vg.morph", icon="MOD_SIMPLEDEFORM")


class VG_PT_patches(Panel, bpy.types.Panel):
    bl_label, bl_options = "Patches and Maps", {"DEFAULT_CLOSED"}

    def draw(self, context):
        vg, c = context.scene.vg, self.column()
        c.prop(vg, "patches")
        c.prop(vg, "connected")
        c.operator("vg.patches", icon="COLOR")
        c.separator()
        c.prop(vg, "map_file")
        c.operator("vg.map", icon="MOD_MESHDEFORM")
        c.separator()
        c.prop(vg, "body")
        c.operator("vg.play", icon="PLAY")
        running = between.Slider.live is not None
        c.operator("vg.slide", icon="PAUSE" if running else "PLAY", depress=running)
        if running:
            c.prop(vg, "slider", slider=True)
        c.separator()
        for name in "target", "morph_by", "map_out":
            c.prop(vg, name)
        c.operator("vg.retarget", icon="CON_TRANSLIKE")


class VG_PT_signals(Panel, bpy.types.Panel):
    bl_label, bl_options = "Signals", {"DEFAULT_CLOSED"}

    def draw(self, context):
        vg, c = context.scene.vg, self.column()
        c.prop(vg, "signal_file")
        c.prop(vg, "tolerance")
        c.operator("vg.fit_signal", icon="FCURVE")
        c.separator()
        c.operator("vg.plane", icon="URL")
        c.prop(vg, "edits_file")
        c.prop(vg, "timing")
        if vg.timing == "SPEED":
            c.prop(vg, "speed")
        if vg.timing == "KEYED":
            self.layout.use_property_decorate = True
            self.layout.prop(vg, "moment")
        c = self.column()
        c.prop(vg, "cycle")
        c.operator("vg.sample", icon="PLAY")


class VG_PT_generate(Panel, bpy.types.Panel):
    bl_label, bl_options = "Generate", {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return Programs.has("vg-generate")

    def draw(self, context):
        vg, c = context.scene.vg, self.column()
        c.prop(vg, "network_file")
        c.prop(vg, "iterations")
        c.operator("vg.train", icon="SORTTIME")
        c.separator()
        c.prop(vg, "generate")
        c.prop(vg, "between" if vg.generate == "BETWEEN" else "count")
        c.prop(vg, "diversity")
        if vg.diversity > 0:
            c.prop(vg, "seed")
        c.operator("vg.generate", icon="PLAY")


class VG_PT_messages(Panel, bpy.types.Panel):
    """What runs, and what the programs said."""
    bl_label = "Messages"
    bl_order = 100

    def draw(self, context):
        c = self.layout.column()
        if not Programs.has("vg-deform"):
            c.label(text="The vg programs are not found", icon="ERROR")
            c.label(text="Name their folder in the preferences")
        if State.title:
            done, total = State.progress
            step = State.job.step if State.job else "reading the scene"
            c.label(text=f"{State.title}: {step}" + (f", {done} of {total}" if total else f", {done}" if done else ""), icon="SORTTIME")
            c.operator("vg.cancel", icon="X")
        lines = State.job.text() if State.job else State.lines
        spread(context, c.box().column(align=True), lines[-24:] or ["nothing to say"], "ERROR" if State.failed else "NONE")


classes = (VG_PT_source, VG_PT_transfer, VG_PT_shapes, VG_PT_envelope, VG_PT_between, VG_PT_patches, VG_PT_signals, VG_PT_generate, VG_PT_messages)
