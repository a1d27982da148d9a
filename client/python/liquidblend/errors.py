"""Errors: one class for each code of the C API, which are those of gRPC."""

from __future__ import annotations

import enum
from typing import Any, Dict, Tuple, Type

from . import _native


class Status(enum.IntEnum):
    OK = 0
    CANCELLED = 1
    UNKNOWN = 2
    INVALID_ARGUMENT = 3
    DEADLINE_EXCEEDED = 4
    NOT_FOUND = 5
    ALREADY_EXISTS = 6
    PERMISSION_DENIED = 7
    RESOURCE_EXHAUSTED = 8
    FAILED_PRECONDITION = 9
    ABORTED = 10
    OUT_OF_RANGE = 11
    UNIMPLEMENTED = 12
    INTERNAL = 13
    UNAVAILABLE = 14
    DATA_LOSS = 15
    UNAUTHENTICATED = 16


class Error(Exception):
    """What the library or a server says is wrong. The class follows from the code."""

    code: Status
    """The code."""
    reason: str
    """For programs, as servers give it: "VERDICT_TOO_LOW", or the code's name where that says it
    all; "" if no server has said it."""
    message: str
    """For people; it may change."""

    def __init__(self, code: Status, message: str, reason: str = "") -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.code.name}: {self.message}"

    def __reduce__(self) -> Tuple[Any, ...]:
        return (type(self), (self.code, self.message, self.reason))


class Cancelled(Error):
    """Somebody cancelled it."""


class InvalidArgument(Error, ValueError):
    """A value that is never right; the message names it."""


class DeadlineExceeded(Error, TimeoutError):
    """It took too long."""


class NotFound(Error):
    """There is nothing of that name."""


class AlreadyExists(Error):
    """There is something of that name already."""


class PermissionDenied(Error):
    """The token does not allow it."""


class ResourceExhausted(Error):
    """No memory, or a limit of the server's."""


class FailedPrecondition(Error):
    """Not in the present state, such as deleting what something else needs."""


class Aborted(Error):
    """Something else came between."""


class OutOfRange(Error, ValueError):
    """A time or a point outside of what the family has."""


class Unimplemented(Error):
    """The server does not have that."""


class Internal(Error):
    """A fault of the server or of the library."""


class Unavailable(Error):
    """No server can be reached."""


class DataLoss(Error):
    """Damaged bytes."""


class Unauthenticated(Error):
    """No token, or a wrong one."""


_CLASSES: Dict[Status, Type[Error]] = {
    Status.CANCELLED: Cancelled,
    Status.INVALID_ARGUMENT: InvalidArgument,
    Status.DEADLINE_EXCEEDED: DeadlineExceeded,
    Status.NOT_FOUND: NotFound,
    Status.ALREADY_EXISTS: AlreadyExists,
    Status.PERMISSION_DENIED: PermissionDenied,
    Status.RESOURCE_EXHAUSTED: ResourceExhausted,
    Status.FAILED_PRECONDITION: FailedPrecondition,
    Status.ABORTED: Aborted,
    Status.OUT_OF_RANGE: OutOfRange,
    Status.UNIMPLEMENTED: Unimplemented,
    Status.INTERNAL: Internal,
    Status.UNAVAILABLE: Unavailable,
    Status.DATA_LOSS: DataLoss,
    Status.UNAUTHENTICATED: Unauthenticated,
}


def status_of(code: int) -> Status:
    try:
        return Status(code)
    except ValueError:
        return Status.UNKNOWN


def invalid_argument(message: str) -> Error:
    """What is wrong with an argument that the library cannot be given."""
    return InvalidArgument(Status.INVALID_ARGUMENT, message)


def make_error(code: int, message: str, reason: str = "") -> Error:
    status = status_of(code)
    return _CLASSES.get(status, Error)(status, message, reason)


def check(code: int) -> None:
    """Raises what the last call of this thread that failed says, if `code` is an error."""
    if code == Status.OK:
        return
    message = _native.text_of(_native.function("lb_last_error")())
    reason = _native.text_of(_native.function("lb_last_error_reason")())
    raise make_error(code, message, reason)
