"""Keeps meshes at the scene's frame: in the viewport the newest surface that is there, in renders
and in the background the exact one."""

import contextlib
import ctypes
import dataclasses
import os
import sys
import time
from typing import Optional

import bpy

from . import ask, connection, preferences, settings, surface, words
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
_is_held = False
_retry_at = 0.0  # when what has failed is asked for again
is_rendering = False  # in a window; handlers.py sets it


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
    shading = object.liquidblend.shading
    surface.write_mesh(object.data, made, shading)
    state = state_of(object)
    state.shown, state.error = (request, shading), ""
    state.num_triangles = len(made.triangles)


def _why_not_written(object, others):
    """Why the mesh cannot be changed; "" if it can. `others` are liquids that come before."""
    mesh = object.data
    if mesh.library is not None:
        return "the mesh is linked from another file: make it local"
    if mesh.is_editmode:
        return "the mesh is being edited"
    if not object.liquidblend.fps > 0.0:
        return "not connected yet"
    twins = [other.name for other in others if other.data == mesh]
    return f"the mesh is also that of {twins[0]}: make it single-user" if twins else ""


def _is_shown(object, request):
    return state_of(object).shown == (request, object.liquidblend.shading)


# ---- exact frames


def _show_exact(object, request, is_patient):
    try:
        made = cache().get(request, is_patient)
    except Exception as error:
        _tell_missing(object, error)
        return False
    _write(object, request, made)
    return True


def _tell_missing(object, error):
    """A frame that is missing leaves an empty mesh, never that of another frame."""
    state = state_of(object)
    _write(object, None, surface.EMPTY)
    state.shown, state.error = None, words.of_error(error)
    words.tell(f"{object.name}: no frame: {state.error}")


# ---- the viewport


def _show_newest(object, request):
    """Shows the surface if it is there; if not, _tick() shows it when it comes."""
    state = state_of(object)
    try:
        made = cache().peek(request)
    except Exception as error:
        state.error = words.of_error(error)
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


def _want_all(with_failed=False):
    """What objects wait for, the newest first, then what comes next. What has failed takes a thread
    until it fails again, so it comes last and seldom."""
    states = [state for state in _states.values() if not state.error]
    wanted = [r for state in states for r in reversed(state.pending)]
    wanted += [r for state in states for r in state.ahead]
    if with_failed:
        wanted += [r for state in _states.values() if state.error for r in state.pending[-1:]]
    cache().want(wanted)


def _newest_that_is_there(state):
    for at in reversed(range(len(state.pending))):
        try:
            made = cache().peek(state.pending[at])
        except Exception as error:
            state.error = words.of_error(error)
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


def _liquids():
    """Objects that have a state, of all scenes. States of those that are gone are dropped."""
    found = {object.name_full: object for object in bpy.data.objects
             if object.name_full in _states and object.type == 'MESH'
             and object.liquidblend.enabled}
    for name in set(_states) - set(found):
        del _states[name]
    return found.values()


def _tick():
    """A timer of the main thread, while anything is pending."""
    global _retry_at
    if is_rendering:
        return _RETRY_S
    for object in list(_liquids()):
        request, made = _newest_that_is_there(state_of(object))
        if made is not None and not _why_not_written(object, ()):
            _write(object, request, made)
    _redraw()
    pending = [state for state in _states.values() if state.pending]
    if any(state.error for state in pending) and time.monotonic() >= _retry_at:
        _retry_at = time.monotonic() + _RETRY_S
        _want_all(with_failed=True)
    if not pending:
        return None
    return _RETRY_S if all(state.error for state in pending) else _TICK_S


# ---- all objects of a scene


def _requests_ahead(object, scene, frame, values):
    frames = [frame + i + 1.0 for i in range(AHEAD)]
    return [ask.request_of(object, scene, f, ask.values_ahead(object, f, values))
            for f in frames if f <= scene.frame_end]


def update_scene(scene, depsgraph, is_exact, is_patient=True):
    """Brings all liquids to the scene's frame. False if an exact frame is missing.

    is_patient  waits for an exact frame of a server that is gone
    """
    is_render = depsgraph is not None and depsgraph.mode == 'RENDER'
    liquids, all_there = settings.liquids_of(scene), True
    for at, object in enumerate(liquids):
        if is_render and object.hide_render:
            continue
        why = _why_not_written(object, liquids[:at])
        if why:
            all_there = _tell_unwritten(object, why, is_render) and all_there
        else:
            all_there = _update(object, scene, depsgraph, is_exact, is_patient) and all_there
    if _states:
        _want_all()
    return all_there


def _tell_unwritten(object, why, is_render):
    """True: nobody needs the mesh."""
    if object.liquidblend.fps > 0.0 or is_render:  # otherwise the panel says to connect
        state_of(object).error = why
    if is_render:
        words.tell(f"{object.name}: no frame: {why}")
    return not is_render


def _update(object, scene, depsgraph, is_exact, is_patient):
    frame = scene.frame_current_final
    values = ask.values_now(object, depsgraph)
    request = ask.request_of(object, scene, frame, values)
    state = state_of(object)
    state.ahead = _requests_ahead(object, scene, frame, values)
    if _is_shown(object, request):
        state.pending.clear()
    elif is_exact:
        return _show_exact(object, request, is_patient)
    else:
        _show_newest(object, request)
    return True


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


def is_held():
    return _is_held


def end_render():
    """A render in the background ends before it writes a wrong picture: a farm sees the status.
    Blender has no way to stop a render from a handler. Its own end would free what the renderer is
    in the midst of, so there is none."""
    words.tell("the render ends, exit status 1")
    sys.stdout.flush()
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)  # what Blender has printed
    os._exit(1)
