"""Bakes a liquid's surfaces, as the scene shows them, into a folder."""

import bpy

from . import ask, mapping, playback
from . import settings as settings_module
from .bake_files import BakeError, BakeWriter, is_same_folder


def default_folder(object):
    """A folder of the object's own, beside the scene's file."""
    return f"//liquid_bake_{bpy.path.clean_name(object.name)}"


def _about(object):
    settings = object.liquidblend
    return {"object": object.name, "from": settings.kind, "family": settings.family,
            "controls": [control.name for control in settings.controls]}


def _check_is_not_played(folder, object):
    for scene in bpy.data.scenes:
        for other in settings_module.liquids_of(scene):
            origin = ask.origin_of(other.liquidblend)
            if other != object and origin.kind == 'BAKE' and is_same_folder(origin.place, folder):
                raise BakeError(f"{other.name} plays {folder}: choose another folder")


def bake_steps(context, object, folder, first, last, step):
    """A generator of (stage, fraction): a frame of the scene each time. The frame of the scene is
    as before at the end, however it ends. An earlier bake of the object is replaced at the end."""
    _check_is_not_played(folder, object)
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
        writer.close()
        scene.frame_set(int(before // 1), subframe=before % 1)
    return f"{num_frames} frames in {bpy.path.relpath(folder) if bpy.data.filepath else folder}"
