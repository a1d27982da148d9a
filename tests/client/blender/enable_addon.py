"""Run in Blender: enables the add-on that an earlier run has installed, as a farm's start does."""

import bpy

bpy.ops.preferences.addon_enable(module="liquidblend_blender")
bpy.context.preferences.addons["liquidblend_blender"].preferences.patience_s = 0.5
