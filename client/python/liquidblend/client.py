"""Clients of a server."""

from __future__ import annotations

import ctypes
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Union

from . import _native
from ._calls import Caller, ClientHandle, Path, Weights, doubles, encode, encode_optional
from ._calls import encode_path, invoke, make_some, parameters_of, parse, parse_names, texts
from ._calls import weights_of
from ._closing import Closing
from .connection import Connection
from .errors import invalid_argument
from .family import Correspondence, Family, Grade, OptionValue, Up, family_of, id_of, option_text
from .frame import Frame, SurfaceOptions
from .jobs import Job, state_of
from .stream import Stream


def _connect(options: _native.ConnectOptions) -> ClientHandle:
    caller = Caller()

    def connect() -> ClientHandle:
        out = ctypes.c_void_p()
        invoke("lb_client_connect", ctypes.byref(options), ctypes.byref(out))
        assert out.value is not None
        return ClientHandle(out.value, caller)

    return caller(connect)


def _json_of(text: _native.Handle) -> bytes:
    found: bytes = _native.function("lb_text_get")(text.pointer)
    return found


class Client(Closing):
    """A connection to servers, until ``close()`` or the end of a ``with`` block.

    Methods raise ``liquidblend.Error``: the server's errors with their reasons, Unavailable if none
    can be reached. Names may be given with or without their collection ("drops", "families/drops").
    Threads: all methods are safe. Ctrl-C ends every call that waits.
    """

    def __init__(
        self,
        target: Optional[str] = None,
        *,
        token: Optional[str] = None,
        tls: bool = False,
        tls_ca: Optional[Path] = None,
        tls_cert: Optional[Path] = None,
        tls_key: Optional[Path] = None,
        tls_server_name: Optional[str] = None,
        connect_timeout: Optional[float] = None,
        call_timeout: Optional[float] = None,
        patience: Optional[float] = None,
        traceparent: Optional[str] = None,
    ) -> None:
        """Connects, and waits until a server answers. ``Connection`` says what the options are."""
        self.connection = Connection(
            target, token, tls, tls_ca, tls_cert, tls_key, tls_server_name, connect_timeout,
            call_timeout, patience, traceparent
        )
        options = self.connection.to_native()
        self._opened: Optional[ClientHandle] = _connect(options)

    def close(self) -> None:
        """Ends the connection once no call, stream or job uses it. Frames stay."""
        self._opened = None

    # ---- families and animations

    def families(self) -> List[str]:
        """The ids of all families."""
        return self._ids("lb_client_list_families")

    def animations(self) -> List[str]:
        """The ids of all animations."""
        return self._ids("lb_client_list_animations")

    def family(self, name: str, version: int = 0) -> Family:
        """A version of a family; 0: the published one."""
        return self._family("lb_client_get_family", name, version)

    def animation(self, name: str) -> Dict[str, Any]:
        """What the server says of an animation (liquidblend.v1.Animation as JSON)."""
        client, text = self._handle, encode(name, "name")
        handle = client.interruptible(
            lambda: make_some("lb_client_get_animation", "lb_text_free", client.pointer, text)
        )
        return parse(_json_of(handle), dict)

    def rollback_family(self, name: str, version: int) -> Family:
        """Publishes a kept version again, as the newest one, which it returns."""
        return self._family("lb_client_rollback_family", name, version)

    def delete_family(self, name: str) -> None:
        """Deletes all its versions."""
        client, text = self._handle, encode(name, "name")
        client.interruptible(lambda: invoke("lb_client_delete_family", client.pointer, text))

    def delete_animation(self, name: str) -> None:
        """Deletes it, unless a family has it."""
        client, text = self._handle, encode(name, "name")
        client.interruptible(lambda: invoke("lb_client_delete_animation", client.pointer, text))

    def download(self, name: str, path: Path, version: int = 0) -> None:
        """Downloads the file of a family, or of "animations/NAME"; it is whole, or missing.

        A ``Player`` plays a family's file without a server.
        """
        client, to = self._handle, encode_path(path, "path")
        resource = encode(name if "/" in name else f"families/{name}", "name")
        client.interruptible(
            lambda: invoke("lb_client_download", client.pointer, resource, version, to)
        )

    # ---- jobs

    def operations(self) -> List[str]:
        """The names of all jobs: "operations/{id}"."""
        return self._names("lb_client_list_operations")

    def job(self, name: str) -> Job:
        """A job that somebody has started."""
        return self._job("lb_client_get_operation", encode(name, "name"))

    def import_animation(
        self,
        animation: str,
        directory: Path,
        *,
        pattern: Optional[str] = None,
        frames_per_second: float = 0.0,
        vertex_scale: float = 0.0,
        velocity_scale: float = 0.0,
        voxel_size: float = 0.0,
        up: Up = Up.UNKNOWN,
        allow_gaps: bool = False,
        priority: int = 0,
    ) -> Job:
        """Uploads the frames of a directory on this machine, and starts their import.

          pattern            chooses frames by their names, as "foam.*"; None: all
          frames_per_second  this and the next three: 0: as meta.json says
          vertex_scale       metres per unit of the files' positions
          velocity_scale     metres per second per unit of the files' velocities
          voxel_size         metres, of Mantaflow
          allow_gaps         frame numbers may be missing
          priority           -100 to 100; larger ones are worked on first
        """
        request = _native.ImportRequest(
            animation=encode(animation, "animation"),
            directory=encode_path(directory, "directory"),
            pattern=encode_optional(pattern, "pattern"),
            frames_per_second=frames_per_second,
            vertex_scale=vertex_scale,
            velocity_scale=velocity_scale,
            voxel_size_m=voxel_size,
            up=int(up),
            allow_gaps=int(allow_gaps),
            priority=priority,
        )
        return self._job("lb_client_import", ctypes.byref(request))

    def register(
        self,
        family: str,
        source: str,
        targets: Union[str, Sequence[str]],
        *,
        correspondences: Iterable[Correspondence] = (),
        parameters: Optional[Mapping[str, Sequence[float]]] = None,
        options: Optional[Mapping[str, OptionValue]] = None,
        required_grade: Grade = Grade.UNKNOWN,
        replace: bool = False,
        refine: bool = False,
        priority: int = 0,
    ) -> Job:
        """Starts a registration of a source and its targets, animations.

          parameters      of a parameter space: by name, the values of the source and each target
          options         by name, as docs/registration-options.md has them: {"max_iterations": 5}
          required_grade  GOOD or DOUBTFUL: publish only if no target is worse; the job fails with
                          the reason VERDICT_TOO_LOW otherwise
          replace         publish a new version of a family that exists
          refine          go on from the newest version, with these correspondences
          priority        -100 to 100; larger ones are worked on first
        """
        names = [targets] if isinstance(targets, str) else list(targets)
        request = _native.RegisterRequest(
            family=encode(family, "family"),
            source=encode(source, "source"),
            refine=int(refine),
            replace=int(replace),
            required_grade=int(required_grade),
            priority=priority,
            **_counted("targets", texts(names, "targets")),
            **_counted("correspondences", _correspondences(correspondences)),
            **_space(parameters or {}, 1 + len(names)),
            **_counted("options", _options(options or {})),
        )
        return self._job("lb_client_register", ctypes.byref(request))

    # ---- frames

    def frame(
        self,
        family: str,
        weights: Optional[Weights] = None,
        time: float = 0.0,
        *,
        parameters: Optional[Mapping[str, float]] = None,
        extrapolate: bool = False,
        version: int = 0,
        normals: bool = False,
        velocities: bool = False,
        rest_positions: bool = False,
        level_of_detail: int = 0,
        smoothing_passes: int = 0,
        smoothing_strength: float = 0.0,
        laplacian: bool = False,
        temporal_smoothing: float = 0.0,
        position_bits: int = 14,
    ) -> Frame:
        """The surface at one time, in seconds since the first frame.

          weights      one per target, or a number for one; -1 to 2; the source gets 1 - their sum
          parameters   instead of weights: a point in the family's parameter space
          extrapolate  parameters outside of the family's points are no error
          version      0: the newest
        ``SurfaceOptions`` says what the others are.
        """
        surface = SurfaceOptions(
            normals, velocities, rest_positions, level_of_detail, smoothing_passes,
            smoothing_strength, laplacian, temporal_smoothing, position_bits
        )
        request = _native.FrameRequest(
            family=encode(family, "family"),
            version=version,
            time_s=time,
            surface=ctypes.pointer(surface.to_native()),
            **_blend(weights, parameters, extrapolate),
        )
        return Frame(self._frame(request), surface.attributes)

    def stream(
        self,
        family: str,
        weights: Optional[Weights] = None,
        *,
        parameters: Optional[Mapping[str, float]] = None,
        extrapolate: bool = False,
        version: int = 0,
        time: float = 0.0,
        rate: float = 1.0,
        frames_per_second: float = 0.0,
        loop: bool = False,
        live: bool = False,
        adapts_detail: bool = False,
        normals: bool = False,
        velocities: bool = False,
        rest_positions: bool = False,
        level_of_detail: int = 0,
        smoothing_passes: int = 0,
        smoothing_strength: float = 0.0,
        laplacian: bool = False,
        temporal_smoothing: float = 0.0,
        position_bits: int = 14,
    ) -> Stream:
        """An iterator of frames: the one at ``time``, then ``rate / frames_per_second`` later each.

          weights            of all frames, or parameters, as of ``frame()``
          rate               seconds of the animation per second; negative: backwards
          frames_per_second  0: the family's
          loop               start again at the end, without end
          live               False: every frame, as fast as they are made and read; True: at their
                             time of the server's clock, without those that would be late
          adapts_detail      of a live one: coarser frames while the connection is too slow
        The others are those of ``frame()``. Errors come with the first frame.
        """
        if rate == 0.0:
            raise invalid_argument("rate is 0; the time would stand still")
        surface = SurfaceOptions(
            normals, velocities, rest_positions, level_of_detail, smoothing_passes,
            smoothing_strength, laplacian, temporal_smoothing, position_bits
        )
        request = _native.StreamRequest(
            family=encode(family, "family"),
            version=version,
            surface=ctypes.pointer(surface.to_native()),
            time_s=time,
            rate=rate,
            frames_per_second=frames_per_second,
            loop=int(loop),
            live=int(live),
            adapts_detail=int(adapts_detail),
            **_blend(weights, parameters, extrapolate),
        )
        return Stream(self._handle, request, surface.attributes)

    # ---- inside

    @property
    def _handle(self) -> ClientHandle:
        handle = self._opened
        if handle is None:
            raise ValueError("the client is closed")
        return handle

    def _names(self, function: str) -> List[str]:
        client = self._handle
        handle = client.interruptible(
            lambda: make_some(function, "lb_text_free", client.pointer)
        )
        return parse_names(_json_of(handle))

    def _ids(self, function: str) -> List[str]:
        return [id_of(name) for name in self._names(function)]

    def _family(self, function: str, name: str, version: int) -> Family:
        client, text = self._handle, encode(name, "name")
        handle = client.interruptible(
            lambda: make_some(function, "lb_family_free", client.pointer, text, version)
        )
        return family_of("lb_family_describe", handle)

    def _frame(self, request: _native.FrameRequest) -> _native.Handle:
        client = self._handle
        return client.interruptible(
            lambda: make_some(
                "lb_client_get_frame", "lb_frame_free", client.pointer, ctypes.byref(request)
            )
        )

    def _job(self, function: str, argument: Any) -> Job:
        client = self._handle
        handle = client.interruptible(
            lambda: make_some(function, "lb_operation_free", client.pointer, argument)
        )
        return Job(client, state_of(handle))


def _counted(name: str, values: Any) -> Dict[str, Any]:
    """The members of a request that are an array and its length."""
    return {f"num_{name}": len(values), name: values}


def _correspondences(pairs: Iterable[Correspondence]) -> Any:
    natives = [pair.to_native() for pair in pairs]
    return (_native.Correspondence * len(natives))(*natives)


def _options(options: Mapping[str, OptionValue]) -> Any:
    natives = [
        _native.Option(encode(name, "options"), encode(option_text(value), "options"))
        for name, value in options.items()
    ]
    return (_native.Option * len(natives))(*natives)


def _space(space: Mapping[str, Sequence[float]], count: int) -> Dict[str, Any]:
    """The members of a request that are a parameter space of `count` animations."""
    points = doubles(_points(space, count))
    return {**_counted("parameters", texts(space, "parameters")), "points": points}


def _points(space: Mapping[str, Sequence[float]], count: int) -> List[float]:
    """The points of the source and each target, one after the other."""
    for name, values in space.items():
        if len(values) != count:
            raise invalid_argument(
                f"parameter {name} has {len(values)} values for {count} animations (the source and "
                "each target)"
            )
    return [values[n] for n in range(count) for values in space.values()]


def _blend(
    weights: Optional[Weights], parameters: Optional[Mapping[str, float]], extrapolate: bool
) -> Dict[str, Any]:
    """The members of a request that say what is blended."""
    return {
        **_counted("weights", doubles(weights_of(weights))),
        **_counted("parameters", parameters_of(parameters)),
        "extrapolate": int(extrapolate),
    }


connect = Client
