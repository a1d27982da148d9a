"""What an object remembers of its liquid, in the scene's file."""

import math

import bpy
from bpy.props import (BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty,
                       PointerProperty, StringProperty)

from . import mapping, words

_MAX_CONTROLS = 1000
_MAX_KEY_BYTES = 63  # of the name of a custom property
# How descriptions of our custom properties begin. Scenes of all versions have them.
_WEIGHT, _PARAMETER = "Blend weight of the target ", "Parameter "
_family_names = []  # of the server that was asked last


def set_family_names(names):
    _family_names[:] = [name for name in names if words.clean(name) == name]


def _suggest_families(_settings, _context, _text):
    return _family_names


def _changed(settings, _context):
    from . import playback
    playback.refresh_object(settings.id_data)


def _changed_family(settings, context):
    settings.published_version = 0
    _changed(settings, context)


class LiquidControl(bpy.types.PropertyGroup):
    """A weight or a parameter. Its value is a custom property of the object, so that it has keys,
    drivers and a range of its own."""

    # `name` is the target's or the parameter's.
    key: StringProperty(name="Custom property")
    is_parameter: BoolProperty()


class LiquidPair(bpy.types.PropertyGroup):
    """A place of the source and one of a target that belong together."""

    source: PointerProperty(name="Source", type=bpy.types.Object,
                            description="An empty at the place in the source")
    target: PointerProperty(name="Target", type=bpy.types.Object,
                            description="An empty at the place in the target")
    source_frame: FloatProperty(name="Frame", description="Frame of the scene of the source's place")
    target_frame: FloatProperty(name="Frame", description="Frame of the scene of the target's place")
    target_index: IntProperty(name="Target number", min=0,
                              description="Which target: 0 is the first one")
    kind: EnumProperty(name="Kind", items=(
        ('point', "Point", "A point in space and time belongs to another"),
        ('trajectory', "Trajectory", "A feature belongs to a feature for a while"),
        ('space', "Space", "Held in its place, free in time: for obstacles")))
    hard: BoolProperty(name="Hard", description="Must be met exactly; otherwise a start that the "
                       "rest of the surface may overrule")
    length_s: FloatProperty(name="Length", min=0.0, unit='TIME_ABSOLUTE',
                            description="Seconds of a trajectory or space; 0: to the end")


class LiquidSettings(bpy.types.PropertyGroup):
    """The panel's values. Those of the family are kept, so that a farm need not ask for them."""

    enabled: BoolProperty(description="The object's mesh is a liquid")
    kind: EnumProperty(name="From", update=_changed, items=(
        ('SERVER', "Server", "Frames of a server"),
        ('FILE', "File", "A family's file (liquidblend download), without a server"),
        ('BAKE', "Bake", "A baked folder, without server and library")))
    server: StringProperty(name="Server", default="127.0.0.1:50051", update=_changed_family,
                           description="HOST:PORT, or several of one store with commas between")
    tls: BoolProperty(name="TLS", update=_changed, description="Encrypt, and check the server")
    tls_ca: StringProperty(name="Authorities", subtype='FILE_PATH', update=_changed,
                           description="PEM file of authorities to trust; empty: the system's")
    family: StringProperty(name="Family", update=_changed_family, search=_suggest_families,
                           search_options={'SUGGESTION'})
    version: IntProperty(name="Version", min=0, update=_changed,
                         description="Of the family; 0: the one that is published at Connect")
    file: StringProperty(name="File", subtype='FILE_PATH', update=_changed)
    bake: StringProperty(name="Folder", subtype='DIR_PATH', default="//liquid_bake",
                         update=_changed)

    controls: CollectionProperty(type=LiquidControl)
    former_controls: CollectionProperty(type=LiquidControl)  # whose custom properties are there yet
    up: EnumProperty(name="Up of the family", update=_changed, default='z',
                     description="Which of the family's axes becomes the scene's z",
                     items=tuple((up, up, "") for up in mapping.UPS))
    duration_text: StringProperty(name="Duration", default="0.0", description=(
        "Seconds; a text, since Blender's own numbers have too few digits for the last frame"))
    published_version: IntProperty(description="At Connect; it stays, so that all frames are of one")
    fps: FloatProperty(name="Frames per second", description="0: not connected yet")

    level_of_detail: IntProperty(name="Level of detail", min=0, max=8, update=_changed,
                                 description="0: the finest; each level has half the vertices")
    smoothing_passes: IntProperty(name="Smoothing", min=0, max=32, update=_changed,
                                  description="Passes that even out triangles")
    shading: EnumProperty(name="Shading", default='SMOOTH', update=_changed, items=(
        ('SMOOTH', "Smooth", "Blender's own normals, smooth"),
        ('NORMALS', "Family's normals", "Normals of the family; slower"),
        ('FLAT', "Flat", "Triangles are seen")))
    velocities: BoolProperty(name="Velocities", default=True, update=_changed,
                             description="Attribute \"velocity\", by which Cycles blurs motion")
    rest_positions: BoolProperty(name="Rest positions", update=_changed, description=(
        "Attributes \"rest_position\" and \"rest_time\": texture coordinates that stick"))

    start_frame: FloatProperty(name="Start frame", default=1.0, update=_changed, options=set(),
                               description="Frame of the scene at which the family begins")
    offset_s: FloatProperty(name="Offset", update=_changed, options=set(),
                            unit='TIME_ABSOLUTE', description="Family's time at the start frame")
    speed: FloatProperty(name="Speed", default=1.0, update=_changed, options=set(),
                         description="Seconds of the family per second of the scene; negative: "
                         "backwards")

    pairs: CollectionProperty(type=LiquidPair)
    active_pair: IntProperty()
    new_family: StringProperty(name="Family", description="Family to register")
    source_animation: StringProperty(name="Source", description="Animation on the server")
    target_animations: StringProperty(name="Targets",
                                      description="Animations on the server, commas between")

    @property
    def duration_s(self):
        return float(self.duration_text)

    @duration_s.setter
    def duration_s(self, seconds):
        self.duration_text = repr(float(seconds))


CLASSES = (LiquidControl, LiquidPair, LiquidSettings)


def liquids_of(scene):
    """The scene's objects that are liquids."""
    return [object for object in scene.objects
            if object.type == 'MESH' and object.liquidblend.enabled]


def _key_of(name):
    """As much of a name as the name of a custom property may have."""
    return name.encode()[:_MAX_KEY_BYTES].decode(errors="ignore")


def _is_of_an_add_on(object, key):
    """Until Blender 5 an add-on's values are custom properties of the same names. Who puts a number
    in the place of a group of them frees what the add-on reads."""
    found = object.bl_rna.properties.get(key)
    return found is not None and found.is_runtime


def _animated_paths(object):
    """The paths that keys, strips of the nonlinear animation or drivers of an object set."""
    animation = object.animation_data
    if animation is None:
        return frozenset()
    actions = [strip.action for track in animation.nla_tracks for strip in track.strips]
    curves = [curve for action in [animation.action, *actions]
              for curve in getattr(action, "fcurves", ())]  # others in Blender 5
    return frozenset(curve.data_path for curve in [*curves, *animation.drivers])


def _is_weight(object, name, key, animated):
    """Whether a number, of which the scene's file does not say that it is ours, is a weight or
    parameter: the add-on has described it, as it did before it kept lists, or it is animated, as by
    a script that makes it before the first Connect."""
    description = object.id_properties_ui(key).as_dict().get("description", "")
    return (description in (_WEIGHT + name, _PARAMETER + name)
            or f'["{bpy.utils.escape_identifier(key)}"]' in animated)


def _check_control(object, control, our_keys, animated):
    name, _, *numbers = control
    key, shown = _key_of(name), f"weight or parameter '{words.clean(name, 80)}'"
    if not key or words.clean(name) != name:
        raise ValueError(f"{shown}: that is no name")
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"{shown}: its range is not of numbers")
    if _is_of_an_add_on(object, key):
        raise ValueError(f"{shown}: an add-on's values have that name")
    value = object.get(key)
    is_ours = value is None or isinstance(value, (int, float)) and (
        key in our_keys or _is_weight(object, name, key, animated))
    if not is_ours:
        raise ValueError(f"{shown}: the object has another custom property of that name; rename or "
                         "remove it")


def _check_controls(object, controls):
    """Names are a server's, and become those of custom properties, where the user's and those of
    other add-ons are, too."""
    if len(controls) > _MAX_CONTROLS:
        raise ValueError(f"{len(controls)} weights or parameters, which may be {_MAX_CONTROLS}")
    settings = object.liquidblend
    our_keys = {control.key for control in settings.controls}
    our_keys.update(control.key for control in settings.former_controls)
    animated = _animated_paths(object)
    for control in controls:
        _check_control(object, control, our_keys, animated)


def _forget_controls(object):
    """Custom properties of former controls stay, for when the family is chosen again."""
    settings = object.liquidblend
    former = {control.key for control in settings.former_controls}
    for control in settings.controls:
        if control.key not in former:
            settings.former_controls.add().key = control.key
    settings.controls.clear()


def set_controls(object, controls):
    """Makes the custom properties of weights and parameters; values that are there stay.

    controls  (name, is parameter, default, smallest, largest, soft smallest, soft largest) each
    Raises ValueError, and changes nothing, if a name is not fit for a custom property, or is that
    of a property which neither the add-on has made nor keys or drivers set.
    """
    _check_controls(object, controls)
    _forget_controls(object)
    settings = object.liquidblend
    for name, is_parameter, default, smallest, largest, soft_min, soft_max in controls:
        control = settings.controls.add()
        control.name, control.is_parameter = name, is_parameter
        control.key = _key_of(name)
        value = object.get(control.key)
        value = float(value) if isinstance(value, (int, float)) else default
        object[control.key] = min(max(value, smallest), largest)
        object.id_properties_ui(control.key).update(
            min=smallest, max=largest, soft_min=soft_min, soft_max=soft_max, default=default,
            step=1.0, precision=3, description=f"{_PARAMETER if is_parameter else _WEIGHT}{name}")


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.liquidblend = PointerProperty(type=LiquidSettings)


def unregister():
    del bpy.types.Object.liquidblend
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
