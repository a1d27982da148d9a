"""Jobs: imports and registrations, which go on at the server."""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass
from typing import Callable, Iterator, Optional

from . import _native
from ._calls import ClientHandle, encode, invoke, make_some
from .errors import DeadlineExceeded, Status, make_error, status_of
from .family import Grade, grade_of, id_of

# Seconds between two questions for a job's state: short at first, since small jobs end soon.
_SHORTEST_PAUSE = 0.05
_LONGEST_PAUSE = 0.5
# Seconds that servers have at least to say that they serve what a job has made.
_SHORTEST_WATCH = 0.5


@dataclass(frozen=True)
class JobState:
    """What was known of a job at one time."""

    name: str
    """operations/{id}"""
    subject: str
    """The animation or family that it makes; "": not known."""
    stage: str
    fraction: float
    """Of the whole, 0 to 1."""
    seconds_elapsed: float
    seconds_left: Optional[float]
    """None: not known."""
    done: bool
    status: Status
    """Of what is done."""
    error: str
    reason: str
    """Of some failures, for programs: "VERDICT_TOO_LOW", say; "": none."""
    waiting_for: str
    """Why it is queued, if not for its turn alone."""
    version: int
    """That a registration has published; 0: none."""
    grade: Grade
    """Of that version, the worst of its targets."""


def state_of(handle: _native.Handle) -> JobState:
    info = _native.OperationInfo()
    _native.function("lb_operation_describe")(handle.pointer, ctypes.byref(info))
    return JobState(
        name=_native.text_of(info.name),
        subject=id_of(_native.text_of(info.subject)),
        stage=_native.text_of(info.stage),
        fraction=info.fraction,
        seconds_elapsed=info.seconds_elapsed,
        seconds_left=info.seconds_left or None,
        done=bool(info.done),
        status=status_of(info.status),
        error=_native.text_of(info.error),
        reason=_native.text_of(info.reason),
        waiting_for=_native.text_of(info.waiting_for),
        version=info.version,
        grade=grade_of(info.grade),
    )


def _shown(state: JobState) -> object:
    """What makes two states look different to a user."""
    return state.stage, round(state.fraction, 3), state.waiting_for, state.done


def _pauses(deadline: float) -> Iterator[float]:
    pause = _SHORTEST_PAUSE
    while time.monotonic() < deadline:
        yield max(0.0, min(pause, deadline - time.monotonic()))
        pause = min(1.5 * pause, _LONGEST_PAUSE)


class Job:
    """An import or a registration at the server, which goes on whether it is watched or not.

    Iterating gives its state each time that changes, the last one with ``done``.
    Threads: one at a time; ``cancel()`` is safe on any.
    """

    def __init__(self, client: ClientHandle, state: JobState) -> None:
        """Made by clients."""
        self._client = client
        self.state = state
        """As it was last seen."""

    @property
    def name(self) -> str:
        """operations/{id}, for ``Client.job()``."""
        return self.state.name

    def __repr__(self) -> str:
        stage = self.state.status.name if self.state.done else self.state.stage
        return f"<liquidblend.Job {self.name}: {stage}>"

    def poll(self) -> JobState:
        """Asks for its state."""
        name = encode(self.name, "name")
        handle = self._client.interruptible(
            lambda: make_some(
                "lb_client_get_operation", "lb_operation_free", self._client.pointer, name
            )
        )
        self.state = state_of(handle)
        return self.state

    def __iter__(self) -> Iterator[JobState]:
        return self._states(float("inf"))

    def wait(
        self,
        progress: Optional[Callable[[JobState], object]] = None,
        timeout: Optional[float] = None,
    ) -> JobState:
        """Waits until it is done. What it has made is then there at every server of the client.

        Ctrl-C, an exception of ``progress`` and the timeout end the waiting, not the job.
          progress  called on this thread each time the state changes; its exceptions are raised
          timeout   seconds; None: as long as it takes. A question that is under way then may take
                    the client's ``call_timeout``, and its ``patience`` with servers that are away;
                    of a job that is done, half a second at most
        Raises: the job's error, whose ``reason`` says why; DeadlineExceeded after the timeout;
        Unavailable if servers are away for longer than the client's patience.
        ``state.done`` tells then whether the job or its servers were waited for.
        """
        deadline = float("inf") if timeout is None else time.monotonic() + timeout
        for state in self._states(deadline):
            if progress is not None:
                progress(state)
        if not self.state.done:
            raise DeadlineExceeded(
                Status.DEADLINE_EXCEEDED, f"{self.name} is not done after {timeout:g} s"
            )
        if self.state.status != Status.OK:
            raise make_error(self.state.status, self.state.error, self.state.reason)
        try:
            self._await_servers(max(deadline - time.monotonic(), _SHORTEST_WATCH))
        except DeadlineExceeded as error:
            raise self._not_served(error) from None
        return self.state

    def cancel(self) -> None:
        """Asks the server to end it. It is done soon after, with the code CANCELLED."""
        name = encode(self.name, "name")
        self._client.interruptible(lambda: invoke("lb_client_cancel", self._client.pointer, name))

    def _states(self, deadline: float) -> Iterator[JobState]:
        state = self.poll()
        yield state
        pauses = _pauses(deadline)
        while not state.done:
            pause = next(pauses, None)
            if pause is None:
                return
            time.sleep(pause)
            last, state = state, self.poll()
            if _shown(state) != _shown(last):
                yield state

    def _await_servers(self, seconds: float) -> None:
        """A watch of what is done returns when each server has it."""
        function, name = "lb_client_watch_for", encode(self.name, "name")
        self._client.interruptible(
            lambda: make_some(
                function, "lb_operation_free", self._client.pointer, name, seconds, None, None
            )
        )

    def _not_served(self, error: DeadlineExceeded) -> DeadlineExceeded:
        state = self.state
        made = (
            f"published version {state.version} of {state.subject}"
            if state.version
            else f"made {state.subject or 'something'}"
        )
        return DeadlineExceeded(
            error.code,
            f"{state.name} has {made}, but not every server is known to serve it yet: "
            f"{error.message}",
            error.reason,
        )
