"""What a scene keeps for the panel: which objects, which numbers.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import between


def is_mesh(_, thing):
    return thing.type == "MESH"


def is_armature(_, thing):
    return thing.type == "ARMATURE"


def a_file(name, what):
    return StringProperty(name=name, subtype="FILE_PATH", description=what)


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

    # envelope
    armature: PointerProperty(name="Armature", type=bpy.types.Object, poll=is_armature, description="The skeleton of the rig")
    body: PointerProperty(name="Body", type=bpy.types.Object, poll=is_mesh, description="The mesh that the rig or the map moves; empty: the source")
    rig_file: a_file("Rig", "The file of the rig")
    learn: BoolProperty(name="Learn bones", description="The armature does not move with the poses: learn from them how its bones move")
    holdout: IntProperty(name="Hold out", min=0, max=100, description="Leave every Nth pose out, and report how far the rig is from these; 0: none")
    method: EnumProperty(name="Method", items=[
        ("DEFAULT", "Mixed", "Envelope and skinning, mixed by how they do on poses that are left out"),
        ("ENVELOPE", "Envelope", "Turned vectors and held vertices"), ("LBS", "Skinning", "Linear blend skinning alone")])

    # between, patches, maps
    way: EnumProperty(name="By", items=[("GEODESIC", "Geodesic", "Each corner turns the shortest way"),
                                        ("MAP", "Map", "A map that was learnt from poses: no solve")])
    count: IntProperty(name="Poses", default=30, min=1, max=100000)
    t_min: FloatProperty(name="From", default=0.0, description="0 is the first pose; below it the path goes on backwards")
    t_max: FloatProperty(name="To", default=1.0, description="1 is the second pose; beyond the last the path goes on")
    smooth: BoolProperty(name="Smooth", description="Keep the velocity at the keys")
    patches: IntProperty(name="Patches", default=50, min=0, max=4096, description="0: as many as the poses ask for")
    connected: BoolProperty(name="In one piece", default=True, description="Every patch is connected")
    map_file: a_file("Map", "The file of the map")
    map_out: a_file("New map", "The file of the map for the target")
    morph_by: FloatProperty(name="Morph", default=1.0, soft_min=0.0, soft_max=1.0, description="1: the target's body, 0.5: half-way to it")
    slider: FloatProperty(name="Slider", update=lambda self, context: between.slid(self, context), soft_min=-1.0, soft_max=3.0, step=1,
                          description="Which moment is shown: 0 the first pose, 1 the second")

    # signals, networks
    signal_file: a_file("Signal", "The file of the signal")
    tolerance: FloatProperty(name="Tolerance", default=0.01, min=1e-6, max=1.0, precision=4,
                             description="The largest distance of a vertex from its place in a frame, in diagonals of the body")
    edits_file: a_file("Edits", "What the pose plane's page has saved; empty: none")
    timing: EnumProperty(name="Times", items=[("FRAMES", "Its frames", "The frames it was fitted to"), ("SPEED", "Speed", "Slower or faster"),
                                              ("KEYED", "Keyed", "At the moments of the keyed property below"),
                                              ("FORTH", "Forth and back", "The end meets the beginning")])
    speed: FloatProperty(name="Speed", default=0.5, min=0.001, max=1000.0)
    moment: FloatProperty(name="Moment", default=1.0, description="Key this: the moment of the signal that a frame shows, 1 being its first frame")
    cycle: BoolProperty(name="Repeat for ever", description="The curves of the shape keys go round and round")
    page: StringProperty()
    network_file: a_file("Network", "The file of the network")
    generate: EnumProperty(name="What", items=[("ON", "Go on", "From the last of the poses"), ("BETWEEN", "Between", "From each pose to the next")])
    between: IntProperty(name="Between", default=10, min=1, max=10000, description="Poses between each pose and the next")
    diversity: FloatProperty(name="Diversity", default=0.0, min=0.0, soft_max=1.0, description="0: as the training began; 0.3 is lively")
    seed: IntProperty(name="Seed", default=1, min=0)
    iterations: IntProperty(name="Iterations", default=0, min=0, description="0: as many as vg-train finds right")


def attach():
    bpy.types.Scene.vg = PointerProperty(type=VG_Scene)


def detach():
    del bpy.types.Scene.vg


classes = (VG_Source, VG_Scene)
