"""Calls of the C API from Python: texts, arrays, handles, and Ctrl-C."""

from __future__ import annotations

import ctypes
import json
import numbers
import os
import queue
import threading
from typing import Any, Callable, Generic, Iterable, List, Mapping, Optional, Sequence, Type
from typing import TypeVar, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from .errors import Status, check, invalid_argument, make_error

Result = TypeVar("Result")
_LONGEST_SLEEP = 0.1  # seconds
Weights = Union[float, Sequence[float], "np.number[Any]", NDArray[Any]]
Path = Union[str, "os.PathLike[str]"]


class _Call(Generic[Result]):
    """A call for another thread, and what came of it."""

    def __init__(self, function: Callable[[], Result]) -> None:
        self._function = function
        self._results: List[Result] = []
        self._failure: Optional[BaseException] = None
        self.is_done = False
        self._running = threading.Lock()
        self._running.acquire()

    def run(self) -> None:
        try:
            self._results.append(self._function())
        except BaseException as error:  # raised by the thread that waits
            self._failure = error
        finally:
            del self._function  # what it has is let go before the call returns
            self.is_done = True
            self._running.release()

    def wait(self) -> Result:
        # Ctrl-C ends this. A signal just before the thread sleeps does not wake it, hence the
        # timeout.
        while not self._running.acquire(timeout=_LONGEST_SLEEP):
            pass
        failure, self._failure = self._failure, None
        if failure is None:
            return self._results.pop()
        try:
            raise failure
        finally:
            del failure  # no cycle of error and frame, which would keep what the frame has


def _run_calls(calls: "queue.SimpleQueue[Optional[_Call[Any]]]") -> None:
    while True:
        call = calls.get()
        if call is None:
            return
        call.run()
        del call


class Caller:
    """Makes calls that may wait for a server, so that Ctrl-C ends the waiting at once.

    Python handles signals between instructions of the main thread, not within a call of C. So the
    main thread's calls are made on another thread. After Ctrl-C such a call goes on there until it
    ends by itself; what it gives is freed.
    """

    def __init__(self) -> None:
        # Queue of the thread that makes the calls; only the main thread uses it.
        self._calls: "Optional[queue.SimpleQueue[Optional[_Call[Any]]]]" = None

    def __call__(self, function: Callable[[], Result]) -> Result:
        if threading.current_thread() is not threading.main_thread():
            return function()
        call = _Call(function)
        try:
            self._start().put(call)
            return call.wait()
        except BaseException:
            if not call.is_done:  # Ctrl-C: that thread is busy with it
                self._leave()
            raise

    def _start(self) -> "queue.SimpleQueue[Optional[_Call[Any]]]":
        calls = self._calls
        if calls is None:
            calls = queue.SimpleQueue()
            threading.Thread(
                target=_run_calls, args=(calls,), name="liquidblend", daemon=True
            ).start()
            self._calls = calls  # now that there is a thread
        return calls

    def _leave(self) -> None:
        calls, self._calls = self._calls, None
        if calls is not None:
            calls.put(None)

    def __del__(self) -> None:
        self._leave()


class ClientHandle(_native.Handle):
    """A client, and the thread that makes its calls."""

    def __init__(self, pointer: int, caller: Caller) -> None:
        super().__init__(pointer, "lb_client_free")
        self.interruptible = caller


def invoke(name: str, *arguments: Any) -> None:
    """Calls a function that returns an lb_status; raises its error."""
    check(_native.function(name)(*arguments))


def make(name: str, free: str, *arguments: Any) -> Optional[_native.Handle]:
    """Calls a function that gives a handle by `out`. None: it gave NULL."""
    out = ctypes.c_void_p()
    invoke(name, *arguments, ctypes.byref(out))
    return None if out.value is None else _native.Handle(out.value, free)


def make_some(name: str, free: str, *arguments: Any) -> _native.Handle:
    handle = make(name, free, *arguments)
    assert handle is not None, f"{name} gave no handle"
    return handle


def parse(text: bytes, kind: Type[Result]) -> Result:
    """The value of a JSON text that the library has made of a server's words.

    Raises: DataLoss if it is no JSON, or of another kind.
    """
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise make_error(Status.DATA_LOSS, f"no JSON: {_native.printable(str(error))}") from None
    if not isinstance(value, kind):
        found = type(value).__name__
        raise make_error(Status.DATA_LOSS, f"JSON of a {found}, not of a {kind.__name__}")
    return value


def parse_names(text: bytes) -> List[str]:
    """The names of a JSON array, likewise."""
    names = parse(text, list)
    if not all(isinstance(name, str) for name in names):
        raise make_error(Status.DATA_LOSS, "JSON of a list that is not of names")
    return [_native.printable(name) for name in names]


def encode(text: str, name: str) -> bytes:
    """A text for C, where it would end at a NUL; `name` is the argument's."""
    return _without_nul(text.encode(), name)


def encode_optional(text: Optional[str], name: str) -> Optional[bytes]:
    return None if text is None else encode(text, name)


def encode_path(path: Path, name: str) -> bytes:
    return _without_nul(os.fsencode(path), name)


def encode_optional_path(path: Optional[Path], name: str) -> Optional[bytes]:
    return None if path is None else encode_path(path, name)


def _without_nul(encoded: bytes, name: str) -> bytes:
    if b"\0" in encoded:
        raise invalid_argument(f"{name} has a NUL character")
    return encoded


def doubles(values: Iterable[float]) -> Any:
    converted = [float(value) for value in values]
    return (ctypes.c_double * len(converted))(*converted)


def texts(values: Iterable[str], name: str) -> Any:
    encoded = [encode(value, name) for value in values]
    return (ctypes.c_char_p * len(encoded))(*encoded)


def weights_of(weights: Optional[Weights]) -> List[float]:
    """A weight for each target; a single number is that of a single target."""
    if weights is None:
        return []
    if isinstance(weights, (int, float, np.number, numbers.Real)):
        return [float(weights)]
    if isinstance(weights, np.ndarray):
        return [float(weight) for weight in np.atleast_1d(weights)]
    return [float(weight) for weight in weights]


def parameters_of(parameters: Optional[Mapping[str, float]]) -> Any:
    items = [] if parameters is None else list(parameters.items())
    values = [_native.Parameter(encode(name, "parameters"), float(value)) for name, value in items]
    return (_native.Parameter * len(values))(*values)
