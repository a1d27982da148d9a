"""What a frame is asked for with: the same request has the same surface. Needs no Blender."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Origin:
    """Where frames come from."""

    kind: str  # 'SERVER', 'FILE' or 'BAKE'
    place: str  # HOST:PORT[,..], the path of a family's file, or a baked folder
    family: str = ""  # of a server
    version: int = 0  # of a server's family; 0: the published one
    tls: bool = False
    tls_ca: str = ""


@dataclasses.dataclass(frozen=True)
class Request:
    origin: Origin
    time_s: float  # of a baked folder: the frame of the scene
    weights: tuple = ()
    parameters: tuple = ()  # (name, value) pairs; weights are empty then
    level_of_detail: int = 0
    smoothing_passes: int = 0
    velocities: bool = True
    rest_positions: bool = False
    normals: bool = False
    up: str = "z"
    velocity_scale: float = 1.0
    fps: float = 0.0  # of the scene; of a baked folder alone
