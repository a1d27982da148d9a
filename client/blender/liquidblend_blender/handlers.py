"""When meshes change: at frames, at changes of the scene, and when files are loaded."""

import bpy
from bpy.app.handlers import persistent

from . import playback, settings, words


def _guarded(work, *arguments):
    """No error of ours may leave a handler: Blender would go on with a wrong mesh in silence."""
    try:
        return work(*arguments)
    except Exception:
        words.tell_trace()
        return False


@persistent
def on_frame_change(scene, depsgraph=None):
    is_render = depsgraph is not None and depsgraph.mode == 'RENDER'
    if playback.is_rendering and not is_render and not bpy.app.is_job_running('RENDER'):
        playback.is_rendering = False  # a render that could not begin does not tell its end
    is_exact = is_render or bpy.app.background or playback.is_rendering
    all_there = _guarded(playback.update_scene, scene, depsgraph, is_exact)
    if is_render and not all_there and bpy.app.background:
        playback.end_render()


@persistent
def on_depsgraph_update(scene, depsgraph=None):
    """Weights that are dragged, and drivers."""
    if playback.is_held() or playback.is_rendering:
        return
    _guarded(playback.update_scene, scene, depsgraph, bpy.app.background, False)


@persistent
def on_load(_file=None):
    playback.forget_objects()
    playback.is_rendering = False
    scene = bpy.context.scene
    if settings.liquids_of(scene):
        _guarded(playback.update_scene, scene, None, bpy.app.background, False)


@persistent
def on_undo(_scene=None, _other=None):
    playback.forget_shown()


@persistent
def on_render_start(_scene=None, _other=None):
    playback.is_rendering = True


@persistent
def on_render_end(_scene=None, _other=None):
    playback.is_rendering = False


def _handlers():
    handlers = bpy.app.handlers
    return ((handlers.frame_change_post, on_frame_change),
            (handlers.depsgraph_update_post, on_depsgraph_update),
            (handlers.load_post, on_load), (handlers.undo_post, on_undo),
            (handlers.redo_post, on_undo), (handlers.render_init, on_render_start),
            (handlers.render_complete, on_render_end), (handlers.render_cancel, on_render_end))


def register():
    for handlers, handler in _handlers():
        if handler not in handlers:
            handlers.append(handler)


def unregister():
    for handlers, handler in _handlers():
        if handler in handlers:
            handlers.remove(handler)
    playback.close()
