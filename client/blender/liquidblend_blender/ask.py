"""From an object and a frame of its scene to the request for its surface. Main thread."""

import bpy

from . import mapping
from .request import Origin, Request

_FACTS = ("level_of_detail", "smoothing_passes", "velocities", "rest_positions")


def server_of(settings, family="", version=0):
    """The Origin of a liquid's server, or of an operator's that has the same properties."""
    return Origin('SERVER', settings.server, family, version, settings.tls,
                  bpy.path.abspath(settings.tls_ca))


def origin_of(settings):
    if settings.kind == 'SERVER':
        return server_of(settings, settings.family.strip(),
                         settings.version or settings.published_version)
    path = settings.file if settings.kind == 'FILE' else settings.bake
    return Origin(settings.kind, bpy.path.abspath(path, library=settings.id_data.library))


def time_mapping(settings, scene):
    return mapping.TimeMapping(
        fps=mapping.scene_fps(scene), start_frame=settings.start_frame, speed=settings.speed,
        offset_s=settings.offset_s, duration_s=settings.duration_s)


def _path_of(control):
    return f'["{bpy.utils.escape_identifier(control.key)}"]'


def _curves_of(object):
    """The curves of keys, by the path of what they animate."""
    action = object.animation_data.action if object.animation_data else None
    return {curve.data_path: curve for curve in getattr(action, "fcurves", ())}


def _animated_paths(object):
    """The paths that keys or drivers set; None if any may be: by strips of the nonlinear animation,
    or an action whose curves are elsewhere, as in Blender 5."""
    animation = object.animation_data
    if animation is None:
        return frozenset()
    if animation.nla_tracks or (animation.action and not hasattr(animation.action, "fcurves")):
        return None
    return frozenset(_curves_of(object)) | {driver.data_path for driver in animation.drivers}


def values_now(object, depsgraph):
    """The controls' values at the frame that the depsgraph is at. What is animated is evaluated
    there; in a render the object itself is at another frame. What is not is the object's own, since
    a script that sets it need not tell the depsgraph."""
    evaluated = object if depsgraph is None else object.evaluated_get(depsgraph)
    animated = _animated_paths(object)
    values = []
    for control in object.liquidblend.controls:
        is_animated = animated is None or _path_of(control) in animated
        values.append(float((evaluated if is_animated else object).get(control.key, 0.0)))
    return values


def values_ahead(object, frame, now):
    """The controls' values at another frame, as far as their curves tell. Drivers, and strips of
    the nonlinear animation, are taken to stay: a wrong guess costs time and no wrong frame."""
    curves = _curves_of(object)
    values = []
    for control, value in zip(object.liquidblend.controls, now):
        curve = curves.get(_path_of(control))
        values.append(value if curve is None else curve.evaluate(frame))
    return values


def request_of(object, scene, frame, values):
    """The request for a frame of the scene, with the controls' `values`."""
    settings = object.liquidblend
    origin = origin_of(settings)
    if settings.kind == 'BAKE':
        return Request(origin, frame, normals=settings.shading == 'NORMALS',
                       velocities=settings.velocities, rest_positions=settings.rest_positions,
                       fps=mapping.scene_fps(scene))
    times = time_mapping(settings, scene)
    pairs = list(zip(settings.controls, values))
    return Request(
        origin, times.time_of(frame),
        weights=tuple(value for control, value in pairs if not control.is_parameter),
        parameters=tuple((c.name, value) for c, value in pairs if c.is_parameter),
        normals=settings.shading == 'NORMALS', up=settings.up,
        velocity_scale=times.velocity_scale(frame) if settings.velocities else 1.0,
        **{name: getattr(settings, name) for name in _FACTS})
