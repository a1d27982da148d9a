"""Baked folders: index.json and a file of arrays for each frame of a scene. Needs numpy alone, so
that a farm plays them without server or library."""

import json
import os
import re

import numpy as np

FORMAT = "liquidblend-bake"
VERSION = 1
_ARRAYS = ("positions", "triangles", "velocities", "normals", "rest_positions")


class BakeError(Exception):
    """A folder that cannot be written, or is no whole bake; the text names it."""


def _name_of(index):
    return f"frame_{index:06d}.npz"


def _is_ours(name):
    return re.fullmatch(r"(index\.json|frame_\d{6,}\.npz)(\.part)?", name) is not None


class BakeWriter:
    """Writes a folder. Arrays are in Blender's axes, velocities per second of the scene; the index
    comes last, so that a folder that has one is whole. Until then index.json.part marks the folder
    as a bake's."""

    def __init__(self, folder, frame_start, step, fps, about):
        self._folder = folder
        self._index = {"format": FORMAT, "version": VERSION, "fps": fps,
                       "frame_start": frame_start, "step": step, "frames": 0, "about": about}
        try:
            os.makedirs(folder, exist_ok=True)
        except OSError as error:
            raise BakeError(f"cannot make {folder}: {error.strerror}") from None
        names = self._names_of_earlier()
        self._write_part("index.json", lambda file: None)
        for name in sorted(names, reverse=True):  # index.json first
            if name != "index.json.part":
                os.remove(os.path.join(self._folder, name))

    def _names_of_earlier(self):
        """What an earlier bake left, which may be replaced, and nothing else may."""
        names = os.listdir(self._folder)
        others = [name for name in names if not _is_ours(name)]
        if names and not others and not {"index.json", "index.json.part"} & set(names):
            others = names
        if others:
            raise BakeError(f"{self._folder} holds {others[0]}, which is of no bake; "
                            "choose an empty folder")
        if "index.json" in names:
            read_index(self._folder)
        return names

    def add(self, surface):
        arrays = {name: getattr(surface, name) for name in _ARRAYS
                  if getattr(surface, name) is not None}
        if surface.rest_times is not None:
            arrays["rest_positions"] = np.column_stack([surface.rest_positions,
                                                        surface.rest_times])
        self._write(_name_of(self._index["frames"]), lambda file: np.savez(file, **arrays))
        self._index["frames"] += 1

    def finish(self):
        text = json.dumps(self._index, indent=1).encode()
        self._write("index.json", lambda file: file.write(text))

    def _write(self, name, write):
        part = self._write_part(name, write)
        try:
            os.replace(part, os.path.join(self._folder, name))
        except OSError as error:
            raise BakeError(f"cannot rename {part}: {error.strerror}") from None

    def _write_part(self, name, write):
        part = os.path.join(self._folder, name + ".part")
        try:
            with open(part, "wb") as file:
                write(file)
        except OSError as error:
            raise BakeError(f"cannot write {part}: {error.strerror}") from None
        return part


def read_index(folder):
    path = os.path.join(folder, "index.json")
    try:
        with open(path, encoding="utf-8") as file:
            index = json.load(file)
    except OSError as error:
        raise BakeError(f"no bake in {folder}: {error.strerror}: index.json") from None
    except ValueError as error:
        raise BakeError(f"{path} is no JSON: {error}") from None
    _check_index(path, index)
    return index


def _check_index(path, index):
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise BakeError(f"{path} is not of a bake")
    if index.get("version") != VERSION:
        raise BakeError(f"{path} has version {index.get('version')}, known is {VERSION}")
    for key in ("fps", "frame_start", "step", "frames"):
        if not isinstance(index.get(key), (int, float)):
            raise BakeError(f"{path} has no number {key}")
    if not index["step"] > 0 or not index["fps"] > 0 or index["frames"] < 1:
        raise BakeError(f"{path} has no frames, or a step or rate that is not above 0")


def _check_arrays(path, arrays):
    positions, triangles = arrays.get("positions"), arrays.get("triangles")
    if positions is None or triangles is None:
        raise BakeError(f"{path} lacks positions or triangles")
    if positions.ndim != 2 or positions.shape[1] != 3 or triangles.shape[1:] != (3,):
        raise BakeError(f"{path}: positions and triangles are not of three columns")
    if not np.issubdtype(triangles.dtype, np.integer):
        raise BakeError(f"{path}: triangles are not whole numbers")
    if triangles.size and not 0 <= int(triangles.min()) <= int(triangles.max()) < len(positions):
        raise BakeError(f"{path}: a triangle has a vertex that is not there")
    for name, width in (("velocities", 3), ("normals", 3), ("rest_positions", 4)):
        if name in arrays and arrays[name].shape != (len(positions), width):
            raise BakeError(f"{path}: {name} are of another number of vertices")


def read_frame(folder, index, frame):
    """The arrays at a frame of the scene, with a fraction. Outside of the bake its first and last
    frame stay. Between two baked frames the vertices of the nearer one move along their
    velocities; without velocities they stay."""
    place = (frame - index["frame_start"]) / index["step"]
    clamped = min(max(place, 0.0), index["frames"] - 1)
    at = int(np.floor(clamped + 0.5))
    path = os.path.join(folder, _name_of(at))
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in _ARRAYS if name in archive}
    except OSError as error:
        raise BakeError(f"cannot read {path}: {error.strerror or error}") from None
    except Exception as error:  # zipfile, zlib and numpy have many for a damaged archive
        raise BakeError(f"{path} is damaged: {error}") from None
    _check_arrays(path, arrays)
    return _moved(arrays, (clamped - at) * index["step"] / index["fps"], clamped == place)


def _moved(arrays, seconds, moves):
    velocities = arrays.get("velocities")
    if velocities is None:
        return arrays
    if not moves:
        arrays["velocities"] = np.zeros_like(velocities)
    elif seconds != 0.0:
        arrays["positions"] = arrays["positions"] + velocities * np.float32(seconds)
    return arrays
