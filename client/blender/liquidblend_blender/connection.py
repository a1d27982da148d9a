"""All that the add-on asks of the Python package `liquidblend`: frames, facts, jobs. It is imported
by the first call that needs it, since a baked folder plays without it."""

import dataclasses
import importlib
import os
import sys
import threading
from typing import List, Tuple

from . import bake_files, preferences, surface
from .request import Origin

_VENDOR = os.path.join(os.path.dirname(os.path.abspath(__file__)), "vendor")
_WEIGHT_RANGE = (-1.0, 2.0)  # a server takes no others

_lock = threading.RLock()
_clients = {}
_players = {}
_indices = {}


def package():
    """The package: the one in the add-on's zip, or else one that Python finds.

    Raises ImportError if there is none; the library is looked for by the first call.
    """
    library = preferences.get("library")
    if library:
        os.environ.setdefault("LIQUIDBLEND_LIBRARY", library)
    if os.path.isdir(_VENDOR) and _VENDOR not in sys.path:
        sys.path.insert(0, _VENDOR)
    return importlib.import_module("liquidblend")


@dataclasses.dataclass(frozen=True)
class Facts:
    """Of a family."""

    up: str
    duration_s: float
    frames_per_second: float
    num_levels: int
    controls: List[Tuple]  # as settings.set_controls() takes them


@dataclasses.dataclass(frozen=True)
class Registration:
    family: str
    source: str
    targets: List[str]
    correspondences: List[dict]
    mode: str  # 'NEW', 'REPLACE' or 'REFINE'


def disconnect():
    """Forgets clients, players and indices. Those in use live until their call is done."""
    with _lock:
        for kept in (_clients, _players, _indices):
            kept.clear()


def server_origin(server, tls=False, tls_ca=""):
    return Origin('SERVER', server, tls=tls, tls_ca=tls_ca)
