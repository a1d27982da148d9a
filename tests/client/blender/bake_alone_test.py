"""Run in Blender by run.sh, without server and library: a baked folder plays."""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from in_blender import ADDON, arrays_of, parse_arguments  # noqa: E402

folder = parse_arguments().folder
bpy.ops.preferences.addon_enable(module=ADDON)
bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "bake_alone.blend"))
bpy.context.scene.frame_set(21)
wanted = np.load(os.path.join(folder, "bake_alone.npz"))["positions"]
shown = arrays_of(bpy.context.scene.objects["Liquid"].data)[0]
assert shown.tobytes() == wanted.tobytes(), "the bake is not what was baked"
assert "liquidblend" not in sys.modules, "the package was imported"
print("a bake plays without the library")
