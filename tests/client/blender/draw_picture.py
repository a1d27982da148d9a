"""Draws docs/blender.png in Blender: three liquids at the weights 0, 0.5 and 1, blurred.

  blender -b --factory-startup --python tests/client/blender/draw_picture.py -- \\
    --zip liquidblend_blender.zip --server HOST:PORT --folder DIR

The server has the family two_drops, registered with the default options; DIR gets blender.png.
"""

import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
from in_blender import (add_camera, add_liquid, empty_scene, install,  # noqa: E402
                        parse_arguments, render_picture, set_up_cycles)

ARGUMENTS = parse_arguments()
FRAME = 8


def make_material(name, color, roughness, metallic=0.0):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*color, 1.0)
    inputs["Roughness"].default_value, inputs["Metallic"].default_value = roughness, metallic
    return material


def light(scene):
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.4, 0.5, 0.65, 1.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", 'SUN'))
    sun.data.energy, sun.data.angle = 2.5, 0.1
    sun.rotation_euler = (math.radians(40), math.radians(-25), 0.0)
    scene.collection.objects.link(sun)


def add_floor():
    bpy.ops.mesh.primitive_plane_add(size=200.0, location=(0.0, 0.0, -1.62))
    bpy.context.object.data.materials.append(make_material("Floor", (0.5, 0.5, 0.5), 0.9))


install(ARGUMENTS.zip)
scene = empty_scene()
water = make_material("Water", (0.01, 0.12, 0.35), 0.1)
for column, weight in enumerate((0.0, 0.5, 1.0)):
    liquid = add_liquid(kind='SERVER', server=ARGUMENTS.server, family="two_drops")
    liquid["drops_b"], liquid.location.x = weight, 5.2 * (column - 1)
    liquid.data.materials.append(water)
light(scene)
add_floor()
set_up_cycles(scene, (960, 320), 128)
add_camera(scene, (0.0, -19.0, 6.5), (math.radians(72.0), 0.0, 0.0)).data.lens = 44
scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.6
scene.frame_set(FRAME)
render_picture(scene, os.path.join(ARGUMENTS.folder, "blender.png"))
