"""Keeps meshes at the scene's frame: in the viewport the newest surface that is there, in renders
and in the background the exact one."""

import contextlib
import ctypes
import dataclasses
import os
import sys
from typing import Optional

import bpy

from . import ask, connection, preferences, settings, surface
from .cache import SurfaceCache

AHEAD = 6  # frames that are made ahead
_TICK_S = 0.02
_RETRY_S = 2.0


@dataclasses.dataclass
class State:
    """Of one object, while Blender runs."""

    shown: Optional[object] = None  # (request, shading) that the mesh is made of
    pending: list = dataclasses.field(default_factory=list)  # requests, the newest one last
    ahead: list = dataclasses.field(default_factory=list)
    error: str = ""
    num_triangles: int = 0


_states = {}
_cache = None
_is_writing = False
_is_held = False
num_renders = 0  # that run in a window; handlers.py counts


def state_of(object):
    return _states.setdefault(object.name_full, State())


def cache():
    global _cache
    if _cache is None:
        _cache = SurfaceCache(connection.make_surface)
    _cache.max_bytes = int(preferences.get("cache_mb")) << 20
    return _cache


def forget():
    """Drops all that was made: a server, a file or a family may be another one now."""
    _states.clear()
    if _cache is not None:
        _cache.clear()
    connection.disconnect()


@contextlib.contextmanager
def held():
    """Several settings change in here; meshes follow afterwards, by refresh_object()."""
    global _is_held
    _is_held, before = True, _is_held
    try:
        yield
    finally:
        _is_held = before


# ---- writing meshes


def _write(object, request, made):
    """Main thread, or a handler of a render."""
    global _is_writing
    shading = object.liquidblend.shading
    _is_writing = True
    try:
        surface.write_mesh(object.data, made, shading)
    finally:
        _is_writing = False
    state = state_of(object)
    state.shown, state.error = (request, shading), ""
    state.num_triangles = len(made.triangles)


def _can_write(object):
    """Neither a linked mesh nor one in edit mode is changed, nor is one that nothing is known of
    before Connect."""
    mesh = object.data
    return mesh.library is None and not mesh.is_editmode and object.liquidblend.fps > 0.0


def _is_shown(object, request):
    return state_of(object).shown == (request, object.liquidblend.shading)


# ---- exact frames


def _show_exact(object, request):
    try:
        made = cache().get(request)
    except Exception as error:
        _tell_missing(object, error)
        return False
    _write(object, request, made)
    return True


def _tell_missing(object, error):
    """A frame that is missing leaves an empty mesh, never that of another frame."""
    state = state_of(object)
    _write(object, None, surface.EMPTY)
    state.shown, state.error = None, str(error)
    print(f"liquidblend: {object.name}: no frame: {error}", file=sys.stderr, flush=True)


# ---- the viewport


def _show_newest(object, request):
    """Shows the surface if it is there; if not, _tick() shows it when it comes."""
    state = state_of(object)
    try:
        made = cache().peek(request)
    except Exception as error:
        state.error = str(error)
        made = None
    if made is not None:
        _write(object, request, made)
        state.pending.clear()
        return
    if request in state.pending:
        state.pending.remove(request)
    state.pending.append(request)
    del state.pending[:-AHEAD]
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK_S)


def _want_all():
    """What all objects wait for, the newest first, then what comes next."""
    pending = [r for state in _states.values() for r in reversed(state.pending)]
    cache().want(pending + [r for state in _states.values() for r in state.ahead])


def _newest_that_is_there(state):
    for at in reversed(range(len(state.pending))):
        try:
            made = cache().peek(state.pending[at])
        except Exception as error:
            state.error = str(error)
            continue
        if made is not None:
            request = state.pending[at]
            del state.pending[:at + 1]
            return request, made
    return None, None


def _redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ('VIEW_3D', 'PROPERTIES'):
                area.tag_redraw()


def _tick():
    """A timer of the main thread, while anything is pending."""
    if num_renders > 0:
        return _RETRY_S
    had_error = False
    for object in settings.liquids_of(bpy.context.scene):
        state = state_of(object)
        request, made = _newest_that_is_there(state)
        if made is not None and _can_write(object):
            _write(object, request, made)
        had_error = had_error or bool(state.error)
    _redraw()
    if not any(state.pending for state in _states.values()):
        return None
    if had_error:
        _want_all()  # once more
    return _RETRY_S if had_error else _TICK_S


# ---- all objects of a scene


def _requests_ahead(object, scene, frame, values):
    step = 1.0 if num_renders else float(max(scene.frame_step, 1))
    frames = [frame + step * (i + 1) for i in range(AHEAD)]
    return [ask.request_of(object, scene, f, ask.values_ahead(object, f, values))
            for f in frames if f <= scene.frame_end]


def update_scene(scene, depsgraph, is_exact):
    """Brings all liquids to the scene's frame. False if an exact frame is missing."""
    frame, all_there = scene.frame_current_final, True
    for object in settings.liquids_of(scene):
        if not _can_write(object):
            continue
        values = ask.values_now(object, depsgraph)
        request = ask.request_of(object, scene, frame, values)
        state = state_of(object)
        state.ahead = _requests_ahead(object, scene, frame, values)
        if _is_shown(object, request):
            state.pending.clear()
        elif is_exact:
            all_there = _show_exact(object, request) and all_there
        else:
            _show_newest(object, request)
    if _states:
        _want_all()
    return all_there


def refresh_object(object):
    """A setting has changed: what is shown, or could not be, is asked for again."""
    if object is None or _is_held or not object.liquidblend.enabled:
        return
    state = state_of(object)
    state.shown, state.error = None, ""
    for scene in object.users_scene:
        if object in settings.liquids_of(scene):
            update_scene(scene, None, bpy.app.background)


def close():
    """Ends the threads, and forgets everything."""
    global _cache
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _cache is not None:
        _cache.close()
        _cache = None
    _states.clear()
    connection.disconnect()


def forget_objects():
    """They are those of another file now."""
    _states.clear()


def forget_shown():
    """Meshes are those of another step of the undo now."""
    for state in _states.values():
        state.shown = None


def is_changing():
    """A mesh is being written, or settings of ours change: neither is news."""
    return _is_writing or _is_held


def end_render():
    """A render in the background ends before it writes a wrong picture: a farm sees the status.
    Blender has no way to stop a render from a handler. Its own end would free what the renderer is
    in the midst of, so there is none."""
    print("liquidblend: the render ends, exit status 1", file=sys.stderr, flush=True)
    sys.stdout.flush()
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)  # what Blender has printed
    os._exit(1)
