"""What the scripts that run in Blender share: arguments, the add-on, scenes, meshes as arrays."""

import argparse
import importlib
import os
import sys

import bpy
import numpy as np

ADDON = "liquidblend_blender"


def parse_arguments(*more):
    parser = argparse.ArgumentParser()
    for name in ("--zip", "--server", "--file", "--folder", "--data", *more):
        parser.add_argument(name)
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:])


def install(path):
    bpy.ops.preferences.addon_install(overwrite=True, filepath=path)
    bpy.ops.preferences.addon_enable(module=ADDON)


def module(name):
    return importlib.import_module(f"{ADDON}.{name}")


def package():
    return module("connection").package()


def empty_scene():
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 24, 1.0
    scene.frame_start, scene.frame_end = 1, 72
    return scene


def add_liquid(**arguments):
    bpy.ops.liquidblend.add(**arguments)
    return bpy.context.object


def arrays_of(mesh):
    """(positions, triangles)"""
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", positions.ravel())
    corners = np.empty(len(mesh.loops), np.uint32)
    mesh.loops.foreach_get("vertex_index", corners)
    return positions, corners.reshape(-1, 3)


def attribute_of(mesh, name, width, field):
    data = mesh.attributes[name].data
    values = np.empty(len(data) * width, np.float32)
    data.foreach_get(field, values)
    return values.reshape(-1, width)


def set_up_cycles(scene, size=(32, 32), samples=1):
    scene.render.engine = 'CYCLES'
    scene.cycles.device, scene.cycles.samples = 'CPU', samples
    scene.cycles.use_denoising = False  # Debian's Blender has no denoiser
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = 'PNG'


def add_camera(scene, location, rotation=(0.0, 0.0, 0.0), orthographic=None):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = location, rotation
    if orthographic:
        camera.data.type, camera.data.ortho_scale = 'ORTHO', orthographic
    scene.camera = camera
    return camera


def render_picture(scene, path):
    """Renders the frame; returns rows from below of (r, g, b, a)."""
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path if os.path.exists(path) else path + ".png")
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    height, width = image.size[1], image.size[0]
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)
