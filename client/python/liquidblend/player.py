"""Players: frames for a loop that must not wait."""

from __future__ import annotations

import ctypes
import enum
import time as clock
from dataclasses import dataclass
from typing import Callable, List, Mapping, Optional

from . import _native
from ._calls import Caller, Path, Weights, doubles, encode_optional, encode_optional_path
from ._calls import invoke, make_some, parameters_of, weights_of
from ._closing import Closing
from .connection import Connection
from .errors import Status, status_of
from .family import Family, family_of
from .frame import Frame, SurfaceOptions


class Transport(enum.IntEnum):
    """Way of frames to the player."""

    AUTOMATIC = 0
    """MESHOPT; DRACO where the network is too slow."""
    MESHOPT = 1
    """Decodes fast."""
    DRACO = 2
    """Has the fewest bytes."""


@dataclass(frozen=True)
class PlayerStatistics:
    num_shown: int
    """Frames that became due and were there."""
    num_missed: int
    """Moments of the screen that passed without one while it played."""
    num_stale: int
    """Of the shown: with weights from before a change."""
    num_received: int
    num_bytes: int
    wait_ms: float
    """A frame, on average: for the server ..."""
    decode_ms: float
    """... and decoding it, or making it of a file."""
    latency_ms: float
    """From asking for a frame to having it, at present."""
    level_of_detail: int
    transport: Transport
    status: Status
    """Of the newest failure; OK since a frame has come."""


class Player(Closing):
    """A family that plays: frames are got ahead, on threads of the library's, while weights, time
    and rate change. Of a server, or of a family's file without any.

    Threads: one at a time calls the methods; ``wait_exact()`` and ``statistics()`` are safe.
    """

    def __init__(
        self,
        options: _native.PlayerOptions,
        attributes: int,
        log: Optional[Callable[[str], object]] = None,
    ) -> None:
        """Use ``Player.open()``."""
        self._interruptible = Caller()
        self._attributes = attributes
        self._log = log
        self._messages: List[str] = []
        messages = self._messages
        # Python's own functions are called after the poll, so that their exceptions are raised.
        self._on_log = _native.LogFunction(
            lambda user, text: messages.append(_native.text_of(text))
        )
        if log is not None:
            options.log = self._on_log
        self._opened: Optional[_native.Handle] = self._interruptible(
            lambda: make_some("lb_player_open", "lb_player_free", ctypes.byref(options))
        )
        self._frame: Optional[Frame] = None
        self._frame_handle: Optional[_native.Handle] = None
        self.family: Family = family_of("lb_player_describe", self._handle)
        """What it plays."""

    @classmethod
    def open(
        cls,
        *,
        file: Optional[Path] = None,
        family: Optional[str] = None,
        connection: Optional[Connection] = None,
        version: int = 0,
        surface: SurfaceOptions = SurfaceOptions(),
        frames_per_second: float = 60.0,
        look_ahead: float = 0.5,
        num_threads: int = 0,
        fixed_detail: bool = False,
        transport: Transport = Transport.AUTOMATIC,
        log: Optional[Callable[[str], object]] = None,
    ) -> Player:
        """Opens a family, paused at its beginning with weights 0.

          file               of a family (``Client.download()``), or
          family             the id of one of the servers of ``connection``; None: the default's
          version            0: the published one; it stays the same while it plays
          frames_per_second  of the screen
          look_ahead         seconds that frames are got ahead; 0: not at all
          num_threads        0: 4
          fixed_detail       never coarser than the surface's level, whatever is missed
          log                gets a line when frames stop coming and when they come again, in poll()
        Raises: Error, such as NotFound; it waits for servers, or until the file is read.
        """
        options = _native.PlayerOptions(
            file=encode_optional_path(file, "file"),
            connect=ctypes.pointer((connection or Connection()).to_native()),
            family=encode_optional(family, "family"),
            version=version,
            surface=ctypes.pointer(surface.to_native()),
            frames_per_second=frames_per_second,
            look_ahead_s=look_ahead or -1.0,  # the C API's for none
            num_threads=num_threads,
            fixed_detail=int(fixed_detail),
            transport=int(transport),
        )
        return cls(options, surface.attributes, log)

    def close(self) -> None:
        """Ends it; waits for calls that are on their way, 5 s at most. Frames stay."""
        self._opened = self._frame_handle = self._frame = None

    def set_weights(self, weights: Weights, over: float = 0.0) -> None:
        """Sets a weight per target, linearly in ``over`` seconds from what they are now."""
        numbers = weights_of(weights)
        invoke(
            "lb_player_set_weights", self._handle.pointer, len(numbers), doubles(numbers), over
        )

    def set_parameters(
        self, parameters: Mapping[str, float], extrapolate: bool = False, over: float = 0.0
    ) -> None:
        """Sets the point in the family's parameter space, likewise."""
        values = parameters_of(parameters)
        invoke(
            "lb_player_set_parameters",
            self._handle.pointer,
            len(values),
            values,
            int(extrapolate),
            over,
        )

    def play(self) -> None:
        _native.function("lb_player_play")(self._handle.pointer)

    def pause(self) -> None:
        _native.function("lb_player_pause")(self._handle.pointer)

    def seek(self, time: float) -> None:
        """Goes to a time of the animation, in seconds."""
        invoke("lb_player_seek", self._handle.pointer, time)

    def set_rate(self, rate: float) -> None:
        """Sets the seconds of the animation per second; negative: backwards."""
        invoke("lb_player_set_rate", self._handle.pointer, rate)

    def set_loop(self, loop: bool) -> None:
        """Sets whether it starts again at the end."""
        _native.function("lb_player_set_loop")(self._handle.pointer, int(loop))

    def poll(self, now: Optional[float] = None) -> Optional[Frame]:
        """The newest frame that is due, which may be the same as before; None: none was there yet.

        It never waits.
          now  the program's clock: seconds from any origin, never back; None: time.monotonic()
        """
        moment = clock.monotonic() if now is None else now
        pointer = _native.function("lb_player_poll")(self._handle.pointer, moment)
        # Owned before the log is called, which may raise.
        polled = None if pointer is None else _native.Handle(pointer, "lb_frame_free")
        while self._messages and self._log is not None:
            self._log(self._messages.pop(0))
        if polled is None:
            return None
        last = self._frame_handle
        if self._frame is None or last is None or last.pointer != polled.pointer:
            self._frame_handle = polled
            self._frame = Frame(polled, self._attributes)
        return self._frame

    def wait_exact(self, time: float, patience: float = 30.0) -> Frame:
        """Waits for the frame of exactly this time and the weights that were set last: for renders.

        It tries again while no server can be reached.
        Raises: DeadlineExceeded after ``patience`` seconds and the attempt that is on its way then.
        """
        player = self._handle
        handle = self._interruptible(
            lambda: make_some(
                "lb_player_wait_exact", "lb_frame_free", player.pointer, time, patience
            )
        )
        return Frame(handle, self._attributes)

    def statistics(self) -> PlayerStatistics:
        info = _native.PlayerInfo()
        _native.function("lb_player_statistics")(self._handle.pointer, ctypes.byref(info))
        return PlayerStatistics(
            num_shown=info.num_shown,
            num_missed=info.num_missed,
            num_stale=info.num_stale,
            num_received=info.num_received,
            num_bytes=info.num_bytes,
            wait_ms=info.wait_ms,
            decode_ms=info.decode_ms,
            latency_ms=info.latency_ms,
            level_of_detail=info.level_of_detail,
            transport=Transport(info.transport),
            status=status_of(info.status),
        )

    @property
    def _handle(self) -> _native.Handle:
        handle = self._opened
        if handle is None:
            raise ValueError("the player is closed")
        return handle
