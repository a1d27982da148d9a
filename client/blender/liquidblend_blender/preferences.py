"""The add-on's preferences: what belongs to a user or a machine, not to a scene."""

import os

import bpy
from bpy.props import FloatProperty, IntProperty, StringProperty

_DEFAULTS = {"library": "", "token": "", "token_servers": "", "patience_s": 120.0, "cache_mb": 512}
_values = dict(_DEFAULTS)


def _changed(_preferences, _context):
    from . import playback
    refresh()
    playback.forget()


def _refreshed(_preferences, _context):
    refresh()


class LiquidPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    library: StringProperty(name="Library", subtype='FILE_PATH', description=(
        "libliquidblend.so.1; empty: LIQUIDBLEND_LIBRARY, beside the add-on, or the system's. "
        "Counts from Blender's next start on"))
    token: StringProperty(name="Token", subtype='PASSWORD', update=_changed, description=(
        "Sent to the servers below; empty: LIQUIDBLEND_TOKEN. It is kept here, so that scenes hold "
        "none"))
    token_servers: StringProperty(name="Servers of the token", update=_changed, description=(
        "HOST:PORT, commas between. These and the ones of LIQUIDBLEND_SERVER get the token, and no "
        "others that a scene's file may name"))
    patience_s: FloatProperty(name="Patience", default=_DEFAULTS["patience_s"], min=0.0,
                              update=_refreshed, unit='TIME_ABSOLUTE',
                              description="Seconds that a render waits for a server that is gone")
    cache_mb: IntProperty(name="Memory", default=_DEFAULTS["cache_mb"], min=16, max=1 << 20,
                          update=_refreshed, description="Megabytes of surfaces that are kept")

    def draw(self, _context):
        for name in _DEFAULTS:
            self.layout.prop(self, name)


def refresh():
    """Copies the values, since threads may not ask Blender for them. Main thread."""
    entry = bpy.context.preferences.addons.get(__package__)
    if entry and entry.preferences:  # not where a script registers the add-on
        _values.update((name, getattr(entry.preferences, name)) for name in _DEFAULTS)


def get(name):
    """A preference, as it was at the last refresh(). Any thread."""
    return _values[name]


def token():
    return get("token") or os.environ.get("LIQUIDBLEND_TOKEN", "")


def register():
    bpy.utils.register_class(LiquidPreferences)
    refresh()


def unregister():
    bpy.utils.unregister_class(LiquidPreferences)
