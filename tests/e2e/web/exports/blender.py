"""Prints what Blender shows of a GLB at each frame, for tests/e2e/web/exports.test.mjs.

  blender --background --python blender.py -- FILE FPS COUNT
"""

import json
import sys

import bpy
import numpy

if not hasattr(numpy, "bool"):
    numpy.bool = bool  # the importer of Debian's Blender 3.4.1 uses it, its numpy has it no more

file, fps, count = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = int(fps)
bpy.ops.import_scene.gltf(filepath=file)

frames = []
for number in range(int(count)):
    scene.frame_set(number)
    shown = [o for o in bpy.data.objects if o.type == "MESH" and o.matrix_world.determinant() > 0.5]
    mesh = shown[0].data
    positions = [c for v in mesh.vertices for c in shown[0].matrix_world @ v.co]
    frames.append({"names": [o.name for o in shown], "positions": positions,
                   "num_triangles": len(mesh.polygons)})
print("FRAMES", json.dumps(frames))
