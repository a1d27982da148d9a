"""Families, and what a registration is asked for."""

from __future__ import annotations

import ctypes
import enum
from dataclasses import dataclass, field
from typing import Any, Dict, Tuple, Union

import numpy as np

from . import _native
from ._calls import parse

Vector = Tuple[float, float, float]
OptionValue = Union[bool, int, float, str, np.bool_, "np.number[Any]"]


class Up(enum.IntEnum):
    """Upward direction. UNKNOWN: z is assumed."""

    UNKNOWN = 0
    X = 1
    Y = 2
    Z = 3
    MINUS_X = 4
    MINUS_Y = 5
    MINUS_Z = 6


class Grade(enum.IntEnum):
    """Whether the blends of a registration can be trusted."""

    UNKNOWN = 0
    GOOD = 1
    DOUBTFUL = 2
    TOO_DIFFERENT = 3


class CorrespondenceKind(enum.IntEnum):
    POINT = 0
    """One point in space-time."""
    TRAJECTORY = 1
    """Followed through the velocities."""
    SPACE = 2
    """Pinned in space, free in time."""


@dataclass(frozen=True)
class Correspondence:
    """A pair of places in space-time that should, or must (hard), fall on each other."""

    source_position: Vector
    source_time: float
    target_position: Vector
    target_time: float
    target: int = 0
    """Index of the target."""
    kind: CorrespondenceKind = CorrespondenceKind.POINT
    hard: bool = False
    length: float = 0.0
    """Seconds, of a trajectory or a pin; 0: to the end."""

    def to_native(self) -> _native.Correspondence:
        return _native.Correspondence(
            target=self.target,
            kind=int(self.kind),
            hard=int(self.hard),
            source_position=tuple(self.source_position),
            source_time_s=self.source_time,
            target_position=tuple(self.target_position),
            target_time_s=self.target_time,
            length_s=self.length,
        )


@dataclass(frozen=True)
class Family:
    """One version of a family. Names are without their collection: "drops_a"."""

    name: str
    version: int
    """0: none is registered yet, or not known (a file)."""
    source: str
    """"" of a player's."""
    targets: Tuple[str, ...]
    """Blend weights are in this order."""
    duration: float
    """Seconds; times are in [0, duration]."""
    frames_per_second: float
    up: Up
    bounds: Tuple[Vector, Vector]
    """Of all blends."""
    levels: int
    """Of detail, with the finest."""
    parameters: Tuple[str, ...]
    """Names of the parameter space; none: weights only."""
    points: Tuple[Tuple[float, ...], ...]
    """Of the source and each target: a value for each parameter."""
    raw: Dict[str, Any] = field(repr=False)
    """All that the server says (liquidblend.v1.Family as JSON); {} of a player's."""


def family_of(describe: str, handle: _native.Handle) -> Family:
    """The family that lb_family_describe() or lb_player_describe() tells of."""
    info = _native.FamilyInfo()
    _native.function(describe)(handle.pointer, ctypes.byref(info))
    size = info.num_parameters
    count = 1 + info.num_targets if size > 0 else 0
    return Family(
        name=id_of(_native.text_of(info.name)),
        version=info.version,
        source=id_of(_native.text_of(info.source)),
        targets=tuple(id_of(_native.text_of(name)) for name in info.targets[: info.num_targets]),
        duration=info.duration_s,
        frames_per_second=info.frames_per_second,
        up=up_of(info.up),
        bounds=(_native.vector(info.bounds_min), _native.vector(info.bounds_max)),
        levels=info.num_levels,
        parameters=tuple(_native.text_of(name) for name in info.parameters[:size]),
        points=tuple(tuple(info.points[size * n : size * (n + 1)]) for n in range(count)),
        raw=parse(info.json or b"{}", dict),
    )


def up_of(number: int) -> Up:
    """UNKNOWN for what a newer library may say."""
    return Up(number) if number in Up.__members__.values() else Up.UNKNOWN


def grade_of(number: int) -> Grade:
    """Likewise."""
    return Grade(number) if number in Grade.__members__.values() else Grade.UNKNOWN


def id_of(name: str) -> str:
    """ "drops" of "families/drops"."""
    return name.rpartition("/")[2]


def option_text(value: OptionValue) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    return str(value)
