"""Bakes a liquid's surfaces, as the scene shows them, into a folder."""

import bpy

from . import ask, mapping, playback
from .bake_files import BakeWriter


def _about(object):
    settings = object.liquidblend
    return {"object": object.name, "from": settings.kind, "family": settings.family,
            "controls": [control.name for control in settings.controls]}


def bake_steps(context, object, folder, first, last, step):
    """A generator of (stage, fraction): a frame of the scene each time. The frame of the scene is
    as before at the end, however it ends."""
    scene, before = context.scene, context.scene.frame_current_final
    writer = BakeWriter(folder, first, step, mapping.scene_fps(scene), _about(object))
    num_frames = int((last - first) / step + 1e-6) + 1
    try:
        for i in range(num_frames):
            frame = first + i * step
            scene.frame_set(int(frame // 1), subframe=frame % 1)
            values = ask.values_now(object, context.evaluated_depsgraph_get())
            writer.add(playback.cache().get(ask.request_of(object, scene, frame, values)))
            yield f"frame {frame:g}", (i + 1) / num_frames
        writer.finish()
    finally:
        scene.frame_set(int(before // 1), subframe=before % 1)
    return f"{num_frames} frames in {bpy.path.relpath(folder) if bpy.data.filepath else folder}"
