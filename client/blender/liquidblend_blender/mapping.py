"""Axes and times: from those of a family to those of a scene. Needs no Blender."""

import dataclasses

import numpy as np

# Rows: Blender's x, y and z (up) of a family whose upward direction is the key. All are rotations.
_ROWS = {
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "x": ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
}
UPS = tuple(_ROWS)


def rotation_of(up):
    """The 3x3 matrix that turns a family's axes to Blender's; "" is taken as z."""
    try:
        return np.array(_ROWS[up or "z"], np.float32)
    except KeyError:
        raise ValueError(f"no upward direction: {up!r}; one of {', '.join(UPS)}") from None


def to_scene_axes(vectors, up):
    """Vectors (n, 3) of a family in Blender's axes, as float32. The same array if z is up."""
    vectors = np.ascontiguousarray(vectors, np.float32)
    if (up or "z") == "z":
        return vectors
    return np.ascontiguousarray(vectors @ rotation_of(up).T)


def to_family_axes(vector, up):
    """A vector of Blender's axes in those of the family."""
    return tuple(float(x) for x in np.asarray(vector, float) @ rotation_of(up).astype(float))


@dataclasses.dataclass(frozen=True)
class TimeMapping:
    """Frames of a scene to seconds of a family."""

    fps: float
    start_frame: float
    speed: float  # seconds of the family per second of the scene
    offset_s: float  # time of the family at start_frame
    duration_s: float

    def unclamped(self, frame):
        return self.offset_s + (frame - self.start_frame) / self.fps * self.speed

    def time_of(self, frame):
        """Before its beginning and after its end the family stands still."""
        return min(max(self.unclamped(frame), 0.0), self.duration_s)

    def velocity_scale(self, frame):
        """What velocities are to be multiplied by to be those of the scene, per second."""
        return self.speed if 0.0 <= self.unclamped(frame) <= self.duration_s else 0.0


def scene_fps(scene):
    return scene.render.fps / scene.render.fps_base
