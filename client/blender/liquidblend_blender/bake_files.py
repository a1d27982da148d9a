"""Baked folders: index.json and a file of arrays for each frame of a scene. Needs numpy alone, so
that a farm plays them without server or library."""

import contextlib
import json
import os
import re
import uuid

import numpy as np

FORMAT = "liquidblend-bake"
VERSION = 1
_ARRAYS = ("positions", "triangles", "velocities", "normals", "rest_positions")


class BakeError(Exception):
    """A folder that cannot be written, or is no whole bake; the text names it."""


@contextlib.contextmanager
def _told(what):
    try:
        yield
    except OSError as error:
        raise BakeError(f"{what}: {error.strerror or error}") from None


def _name_of(index):
    return f"frame_{index:06d}.npz"


def _is_ours(name):
    return re.fullmatch(r"(index\.json|frame_\d{6,}\.npz)(\.part)?", name) is not None


def is_same_folder(a, b):
    return os.path.normcase(os.path.realpath(a)) == os.path.normcase(os.path.realpath(b))


class BakeWriter:
    """Writes a folder. Arrays are in Blender's axes, velocities per second of the scene.

    Until finish() all files end with .part, so that an earlier bake of the object plays on. The
    index comes last, so that a folder that has one is whole. Until then index.json.part marks the
    folder as a bake's, and says of which one that is under way.
    """

    def __init__(self, folder, frame_start, step, fps, about):
        self._folder = folder
        self._index = {"format": FORMAT, "version": VERSION, "fps": fps,
                       "frame_start": frame_start, "step": step, "frames": 0, "about": about}
        self._mark = uuid.uuid4().bytes
        self._is_open = True
        with _told(f"cannot make {folder}"):
            os.makedirs(folder, exist_ok=True)
        names = self._names_of_earlier()
        is_whole = "index.json" in names
        if is_whole:
            self._check_object(read_index(folder))
        self._write_part("index.json", lambda file: file.write(self._mark))
        # Leftovers of an interrupted bake: without an index its frames are of no use.
        self._remove(name for name in names if name.endswith(".part") or not is_whole)

    def _names_of_earlier(self):
        """What an earlier bake left, which may be replaced, and nothing else may."""
        names = os.listdir(self._folder)
        others = [name for name in names if not _is_ours(name)]
        if names and not others and not {"index.json", "index.json.part"} & set(names):
            others = names
        if others:
            raise BakeError(f"{self._folder} holds {others[0]}, which is of no bake; "
                            "choose an empty folder")
        return names

    def _check_object(self, earlier):
        about = earlier.get("about")
        before = about.get("object") if isinstance(about, dict) else None
        now = self._index["about"].get("object")
        if before and now and before != now:
            raise BakeError(f"{self._folder} holds the bake of the object {before}, not of {now}: "
                            "choose another folder. If the object was renamed, or nothing needs "
                            "that bake any more, delete the folder first")

    def add(self, surface):
        arrays = {name: getattr(surface, name) for name in _ARRAYS
                  if getattr(surface, name) is not None}
        if surface.rest_times is not None:
            arrays["rest_positions"] = np.column_stack([surface.rest_positions,
                                                        surface.rest_times])
        self._check_mark()
        self._write_part(_name_of(self._index["frames"]), lambda file: np.savez(file, **arrays))
        self._index["frames"] += 1

    def finish(self):
        """Puts the bake in the place of an earlier one. If that is interrupted, the folder has no
        index and is no bake."""
        self._check_mark()
        text = json.dumps(self._index, indent=1).encode()
        self._write_part("index.json", lambda file: file.write(text))
        self._is_open = False
        earlier = [name for name in self._our_names() if not name.endswith(".part")]
        self._remove(sorted(earlier, reverse=True))  # index.json first
        for frame in range(self._index["frames"]):
            self._rename_part(_name_of(frame))
        self._rename_part("index.json")

    def close(self):
        """Removes what was written, unless finish() was called: an earlier bake stays as it was."""
        if not self._is_open:
            return
        self._is_open = False
        try:
            self._check_mark()
            self._remove(name for name in self._our_names() if name.endswith(".part"))
            os.remove(os.path.join(self._folder, "index.json.part"))
        except (BakeError, OSError):
            pass  # the next bake removes it

    def _check_mark(self):
        path = os.path.join(self._folder, "index.json.part")
        with _told(f"cannot read {path}"), open(path, "rb") as file:
            mark = file.read()
        if mark != self._mark:
            raise BakeError(f"another bake into {self._folder} has begun")

    def _our_names(self):
        return [name for name in os.listdir(self._folder) if _is_ours(name)]

    def _remove(self, names):
        """Removes files, but not the mark."""
        for name in names:
            path = os.path.join(self._folder, name)
            with _told(f"cannot remove {path}"):
                if name != "index.json.part":
                    os.remove(path)

    def _rename_part(self, name):
        path = os.path.join(self._folder, name)
        with _told(f"cannot rename {path}.part"):
            os.replace(path + ".part", path)

    def _write_part(self, name, write):
        part = os.path.join(self._folder, name + ".part")
        with _told(f"cannot write {part}"), open(part, "wb") as file:
            write(file)


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
