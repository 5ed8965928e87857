"""Shapes: all shape keys of one head onto another, with their names, ranges and drivers.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import bpy
import numpy

from . import bodies, transfer
from .programs import Trouble
from .work import Work


class VG_OT_shapes(Work, bpy.types.Operator):
    """Every shape key of the source for the target, with names, ranges and drivers; keys of these names are replaced"""
    bl_idname, bl_label = "vg.shapes", "Transfer Shapes"

    def gather(self, context):
        scene, vg = context.scene, context.scene.vg
        target = bodies.mesh_object(vg.target, "a target")
        source = bodies.mesh_object(vg.source.object, "a source")
        self.target, self.source = target.name, source.name
        body = yield from bodies.from_keys(vg.source, scene)
        return transfer.settings(scene, body, target)

    def compute(self, job, s):
        return s.body.names, transfer.transferred(job, s)

    def finish(self, context, result):
        scene, (names, shapes) = context.scene, result
        target, source = scene.objects.get(self.target), scene.objects.get(self.source)
        if target is None or source is None:
            raise Trouble("source or target has been removed")
        local = [bodies.to_local(target, points, scene) for points in shapes]
        for name, points in zip(names, local):
            take_key(target, name, points)
        like(target.data.shape_keys, source.data.shape_keys, names)
        target.data.update()
        bodies.show_only(context, target)
        return f"'{target.name}': {len(names)} shapes"


def take_key(thing, name, points):
    keys = thing.data.shape_keys
    key = keys.key_blocks.get(name) if keys else None
    if key is None or key == keys.reference_key:
        bodies.add_key(thing, name, points)
        return
    relative = bodies.positions(key.relative_key.data) - bodies.positions(keys.reference_key.data)
    key.data.foreach_set("co", numpy.ascontiguousarray(points + relative, numpy.float32).ravel())


def like(keys, source, names):
    """Ranges and values, whether it is switched off, and drivers, which keep what they look at."""
    for name in names:
        made, given = keys.key_blocks[name], source.key_blocks[name]
        made.slider_min, made.slider_max, made.mute, made.value = given.slider_min, given.slider_max, given.mute, given.value
        made.interpolation = given.interpolation
    paths = {f'key_blocks["{bpy.utils.escape_identifier(name)}"].{what}' for name in names for what in ("value", "mute")}
    drivers = [d for d in (source.animation_data.drivers if source.animation_data else ()) if d.data_path in paths]
    for driver in drivers:
        data = keys.animation_data_create()
        old = data.drivers.find(driver.data_path, index=driver.array_index)
        if old:
            data.drivers.remove(old)
        made = data.drivers.from_existing(src_driver=driver)
        for variable in made.driver.variables:
            for aim in variable.targets:
                if aim.id == source:
                    aim.id = keys


classes = (VG_OT_shapes,)
