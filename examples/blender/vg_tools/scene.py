"""What a scene keeps for the panel: which objects, which numbers.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, PointerProperty, StringProperty


def is_mesh(_, thing):
    return thing.type == "MESH"


def is_body(_, thing):
    return thing.type in ("MESH", "ARMATURE")


class VG_Source(bpy.types.PropertyGroup):
    kind: EnumProperty(name="Poses", description="Where the poses come from", items=[
        ("FRAMES", "Time line", "What the object plays: shape keys, armature, cache, simulation"),
        ("KEYS", "Shape keys", "Each shape key of the object by itself"),
        ("OBJECTS", "Collection", "Each mesh of a collection is a pose; the first, by name, is the rest pose")])
    object: PointerProperty(name="Source", type=bpy.types.Object, poll=is_body, description="The mesh, or the armature, whose motion is taken")
    collection: PointerProperty(name="Collection", type=bpy.types.Collection)
    whole: BoolProperty(name="Scene's frames", default=True, description="All frames of the scene; else those below")
    start: IntProperty(name="From", default=1)
    end: IntProperty(name="To", default=250)
    step: IntProperty(name="Step", default=1, min=1)
    rest: EnumProperty(name="Rest", description="The pose against which deformations are measured; the target should stand like it", items=[
        ("MESH", "Mesh", "The mesh as edit mode shows it"), ("FIRST", "First pose", "The first of the frames")])


class VG_Scene(bpy.types.PropertyGroup):
    source: PointerProperty(type=VG_Source)
    target: PointerProperty(name="Target", type=bpy.types.Object, poll=is_body, description="The mesh, or the armature, that shall move likewise")
    by: EnumProperty(name="By", description="What is carried over to the target", items=[
        ("DEFAULT", "Default", "Blend for the same faces, gradient for others"),
        ("BLEND", "Blend", "The mean of pose and gradient"),
        ("POSE", "Pose", "The turn and stretch of each corner"),
        ("GRADIENT", "Gradient", "The linear map of each face, which may also shear"),
        ("SHAPE", "Shape", "The difference of shapes: small deformations of bodies alike")])
    root: EnumProperty(name="Root", description="Where the target goes", items=[
        ("CENTROID", "As the source", "Its centre moves as that of the source, scaled by the sizes"),
        ("STAY", "Stays", "Its centre stays where it is")])
    fast: BoolProperty(name="Fast", description="Least squares: one solve a pose instead of about ten, and further from the truth")
    planar: BoolProperty(name="Planar", description="Keep polygons of four and more corners more nearly plane")
    result: EnumProperty(name="Result", items=[
        ("KEYS", "Shape keys", "A shape key for each pose, played on the time line"),
        ("CACHE", "Cache", "A point cache beside the .blend file, for long sequences")])
    folder: StringProperty(name="Folder", subtype="DIR_PATH", default="//", description="Where caches are written")
    guide: PointerProperty(name="Sculpted", type=bpy.types.Object, poll=is_mesh,
                           description="A copy of the target whose shape keys have the names of poses, sculpted: what these poses shall be")
    guide_by: EnumProperty(name="Follow", items=[
        ("EXAMPLES", "In all poses", "What the transfer misses in the sculpted poses is added to others, as far as they are like them"),
        ("POISSON", "In time", "The sequence passes through the sculpted poses, and changes smoothly between them")])
    picks: IntProperty(name="Poses", default=4, min=1, max=64, description="How many poses to sculpt")


def attach():
    bpy.types.Scene.vg = PointerProperty(type=VG_Scene)


def detach():
    del bpy.types.Scene.vg


classes = (VG_Source, VG_Scene)
