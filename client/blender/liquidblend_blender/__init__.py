"""Liquids of liquidblend in Blender: docs/blender.md."""

bl_info = {
    "name": "liquidblend",
    "description": "Blends of liquid simulations, from a server, a file or a bake",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Liquid",
    "category": "Object",
}

from . import (handlers, operators, pair_operators, panel, preferences,  # noqa: E402
               settings, tasks)

_MODULES = (preferences, settings, operators, pair_operators, panel, handlers)


def register():
    for module in _MODULES:
        module.register()


def unregister():
    tasks.unregister()
    for module in reversed(_MODULES):
        module.unregister()
