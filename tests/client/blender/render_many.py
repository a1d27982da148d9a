"""Renders 300 frames and more in Blender, and checks that each has the exact surface: run by run.sh.

  --frames N   frames, 300 unless given
Weights have keys, so that all frames differ. Every tenth frame is blurred.
"""

import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
from in_blender import (add_camera, add_liquid, arrays_of, empty_scene, install,  # noqa: E402
                        module, package, parse_arguments, set_up_cycles)

ARGUMENTS = parse_arguments("--frames")
NUM_FRAMES = int(ARGUMENTS.frames or 300)

install(ARGUMENTS.zip)
scene = empty_scene()
liquid = add_liquid(kind='SERVER', server=ARGUMENTS.server, family="two_drops")
duration_s = liquid.liquidblend.duration_s
liquid.liquidblend.speed = duration_s * 24.0 / NUM_FRAMES
for frame, weight in ((1, 0.0), (NUM_FRAMES, 1.0)):
    liquid["drops_b"] = weight
    liquid.keyframe_insert('["drops_b"]', frame=frame)
set_up_cycles(scene)
add_camera(scene, (0, 0, 12))
scene.frame_start, scene.frame_end = 1, NUM_FRAMES
scene.render.filepath = os.path.join(ARGUMENTS.folder, "many_####")
client = package().Client(ARGUMENTS.server)
curve = liquid.animation_data.action.fcurves[0]
rendered, wrong = [], []


def check(scene, _=None):
    frame = scene.frame_current
    time_s = module("ask").time_mapping(liquid.liquidblend, scene).time_of(frame)
    wanted = client.frame("two_drops", curve.evaluate(frame), time_s)
    shown = arrays_of(liquid.data)
    rendered.append(frame)
    if shown[0].tobytes() != wanted.positions.tobytes() or (
            shown[1].tobytes() != wanted.triangles.tobytes()):
        wrong.append(frame)
    scene.render.use_motion_blur = (frame + 1) % 10 == 0


bpy.app.handlers.render_post.append(check)
start = time.monotonic()
bpy.ops.render.render(animation=True)
seconds = time.monotonic() - start
pictures = [f for f in os.listdir(ARGUMENTS.folder) if f.startswith("many_")]
print(f"{len(rendered)} frames rendered in {seconds:.0f} s, {len(pictures)} pictures, "
      f"{len(wrong)} with another surface {wrong[:5]}")
sys.exit(0 if len(rendered) == len(pictures) == NUM_FRAMES and not wrong else 1)
