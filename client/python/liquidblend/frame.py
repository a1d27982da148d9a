"""Frames: the liquid's surface at one time, as numpy arrays on the library's own memory."""

from __future__ import annotations

import ctypes
import pathlib
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._calls import Path
from .ply import ply_bytes

Floats = NDArray[np.float32]
Indices = NDArray[np.uint32]
Vector = Tuple[float, float, float]

_ATTRIBUTES = (
    ("positions", ("x", "y", "z")),
    ("normals", ("nx", "ny", "nz")),
    ("velocities", ("vx", "vy", "vz")),
    ("rest_positions", ("rest_x", "rest_y", "rest_z", "rest_t")),
)


class _Memory:
    """Part of a frame's memory. An array of numpy's keeps it, and it keeps the frame."""

    def __init__(
        self, handle: _native.Handle, address: int, shape: Tuple[int, int], dtype: str
    ) -> None:
        self._handle = handle
        self.__array_interface__: Dict[str, Any] = {
            "version": 3,
            "data": (address, True),  # read-only
            "shape": shape,
            "typestr": dtype,
        }


def _view(
    handle: _native.Handle, address: Optional[int], shape: Tuple[int, int], dtype: str
) -> NDArray[Any]:
    if address is None or shape[0] == 0:
        empty = np.empty((0, shape[1]), dtype)
        empty.flags.writeable = False
        return empty
    return np.asarray(_Memory(handle, address, shape, dtype))


def _attribute(
    handle: _native.Handle, address: Optional[int], shape: Tuple[int, int], is_wanted: bool
) -> Optional[Floats]:
    return _view(handle, address, shape, "=f4") if is_wanted else None


class Frame:
    """The surface at one time.

    The arrays are read-only views of the library's memory, which stays as long as any of them does,
    also after the client or player is closed. ``array.copy()`` makes one that may be changed.
    Threads: safe, a frame never changes.
    """

    positions: Floats
    """(n, 3): metres."""
    triangles: Indices
    """(m, 3): vertices, counter-clockwise seen from outside."""
    normals: Optional[Floats]
    """(n, 3): unit length, outward; None if not asked for."""
    velocities: Optional[Floats]
    """(n, 3): metres per second of the animation; None if not asked for."""
    rest_positions: Optional[Floats]
    """(n, 4): place (x, y, z) and time in the source, the same for a place of the liquid at any
    weights; None if not asked for."""
    time: float
    weights: Tuple[float, ...]
    """That were used."""
    version: int
    """Of the family; 0: not known (a file)."""
    bounds: Tuple[Vector, Vector]
    """Least and largest x, y, z of the vertices."""
    level_of_detail: int
    extrapolated: bool
    """The parameters lie outside of the family's points."""
    clamped: bool
    """Other weights than asked for: a falling part would not fall."""
    velocity_scale: float
    """What velocities are to be multiplied by on a player's screen: its rate, 0 while it is paused;
    else 1."""

    def __init__(self, handle: _native.Handle, attributes: int) -> None:
        """Made by clients, streams and players."""
        info = _native.FrameInfo()
        _native.function("lb_frame_describe")(handle.pointer, ctypes.byref(info))
        n = int(info.num_vertices)
        self._handle = handle
        self.positions = _view(handle, info.positions, (n, 3), "=f4")
        self.triangles = _view(handle, info.triangles, (int(info.num_triangles), 3), "=u4")
        self.normals = _attribute(handle, info.normals, (n, 3), attributes & _native.NORMALS > 0)
        self.velocities = _attribute(
            handle, info.velocities, (n, 3), attributes & _native.VELOCITIES > 0
        )
        self.rest_positions = _attribute(
            handle, info.rest_positions, (n, 4), attributes & _native.REST_POSITIONS > 0
        )
        self.time = info.time_s
        self.weights = tuple(info.weights[: info.num_weights])
        self.version = info.version
        self.bounds = (_native.vector(info.bounds_min), _native.vector(info.bounds_max))
        self.level_of_detail = info.level_of_detail
        self.extrapolated = bool(info.extrapolated)
        self.clamped = bool(info.clamped)
        self.velocity_scale = info.velocity_scale

    def __repr__(self) -> str:
        return (
            f"<liquidblend.Frame at {self.time:g} s: {len(self.positions)} vertices, "
            f"{len(self.triangles)} triangles>"
        )

    def to_ply(self) -> bytes:
        """The frame as a binary PLY file, with all attributes that it has."""
        attributes = [(getattr(self, name), columns) for name, columns in _ATTRIBUTES]
        return ply_bytes([a for a in attributes if a[0] is not None], self.triangles)

    def write_ply(self, path: Path) -> None:
        """Writes the file that ``to_ply()`` makes."""
        pathlib.Path(path).write_bytes(self.to_ply())


@dataclass(frozen=True)
class SurfaceOptions:
    """What is made of the surface. The defaults leave the slice as it is."""

    normals: bool = False
    velocities: bool = False
    rest_positions: bool = False
    level_of_detail: int = 0
    """0: the finest."""
    smoothing_passes: int = 0
    """0 to 32; evens out triangles."""
    smoothing_strength: float = 0.0
    """How far a pass goes, up to 1; 0: 0.5."""
    laplacian: bool = False
    """The passes are the paper's, which shrink small parts."""
    temporal_smoothing: float = 0.0
    """0 to 1; against flicker."""
    position_bits: int = 14
    """8 to 20 (a player's: to 16); of the grid that positions are rounded to."""

    @property
    def attributes(self) -> int:
        return (
            (_native.NORMALS if self.normals else 0)
            | (_native.VELOCITIES if self.velocities else 0)
            | (_native.REST_POSITIONS if self.rest_positions else 0)
        )

    def to_native(self) -> _native.Surface:
        return _native.Surface(
            attributes=self.attributes,
            level_of_detail=self.level_of_detail,
            smoothing_passes=self.smoothing_passes,
            smoothing_strength=self.smoothing_strength,
            laplacian=int(self.laplacian),
            temporal_smoothing=self.temporal_smoothing,
            position_bits=self.position_bits,
        )
