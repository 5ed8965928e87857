"""VG: deform mesh animations with the vg programs, in Blender. The panel is in the sidebar of the 3D view (N), tab VG; manual.md explains it.

Needs the vg programs installed; uses nothing but bpy and NumPy, which Blender brings. Written for Blender 3.4 and later.

SPDX-License-Identifier: GPL-3.0-or-later
"""
bl_info = {
    "name": "VG: deformation transfer, envelopes, interpolation",
    "author": "the vg authors",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "View3D > Sidebar > VG",
    "description": "Carry the motion of one mesh over to another, fit rigs and maps from poses, interpolate, edit signals, with the vg programs",
    "category": "Animation",
}

import bpy  # noqa: E402

from . import between, envelope, panels, scene, shapes, signals, transfer, work  # noqa: E402
from .programs import Programs  # noqa: E402


class VG_Preferences(bpy.types.AddonPreferences):
    bl_idname = __name__

    def changed(self, context):
        Programs.folder = bpy.path.abspath(self.folder) if self.folder else ""

    folder: bpy.props.StringProperty(name="Programs", subtype="DIR_PATH", update=changed,
                                     description="The folder with the vg programs; empty: they are in the search path")

    def draw(self, context):
        self.layout.prop(self, "folder")
        if not Programs.has("vg-deform"):
            self.layout.label(text="The vg programs are not found", icon="ERROR")


@bpy.app.handlers.persistent
def leave_file(*_):
    """Another file is opened: what runs for this one ends."""
    between.end_slide()


modules = (scene, work, transfer, shapes, envelope, between, signals, panels)


def register():
    bpy.utils.register_class(VG_Preferences)
    for module in modules:
        for c in module.classes:
            bpy.utils.register_class(c)
    scene.attach()
    bpy.app.handlers.load_pre.append(leave_file)
    entry = bpy.context.preferences.addons.get(__name__)
    if entry and entry.preferences:
        entry.preferences.changed(bpy.context)


def unregister():
    between.end_slide()
    bpy.app.handlers.load_pre.remove(leave_file)
    scene.detach()
    for module in reversed(modules):
        for c in reversed(module.classes):
            bpy.utils.unregister_class(c)
    bpy.utils.unregister_class(VG_Preferences)
