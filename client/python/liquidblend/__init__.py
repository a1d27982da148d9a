"""liquidblend: blends of liquid simulations as numpy arrays.

    import liquidblend

    with liquidblend.connect("127.0.0.1:50051") as client:
        frame = client.frame("two_drops", weights=0.5, time=0.8)
        print(frame.positions.shape, frame.triangles.shape)

docs/python.md has an overview. The package is pure Python on libliquidblend.so.1. It looks for that
at the path in LIQUIDBLEND_LIBRARY, beside the package, and where the system looks for libraries.
Its only state is that library, which the first call loads.
"""

from . import _native
from .client import Client, connect
from .connection import Connection
from .errors import Aborted, AlreadyExists, Cancelled, DataLoss, DeadlineExceeded, Error
from .errors import FailedPrecondition, Internal, InvalidArgument, NotFound, OutOfRange
from .errors import PermissionDenied, ResourceExhausted, Status, Unauthenticated, Unavailable
from .errors import Unimplemented
from .family import Correspondence, CorrespondenceKind, Family, Grade, Up
from .frame import Frame, SurfaceOptions
from .jobs import Job, JobState
from .player import Player, PlayerStatistics, Transport
from .stream import Stream

__version__ = "0.3.0"


def library_version() -> str:
    """The version of libliquidblend.so.1, such as "0.3.0"."""
    number = int(_native.function("lb_version")())
    return f"{number // 1000000}.{number // 1000 % 1000}.{number % 1000}"


__all__ = [
    "Aborted",
    "AlreadyExists",
    "Cancelled",
    "Client",
    "Connection",
    "Correspondence",
    "CorrespondenceKind",
    "DataLoss",
    "DeadlineExceeded",
    "Error",
    "FailedPrecondition",
    "Family",
    "Frame",
    "Grade",
    "Internal",
    "InvalidArgument",
    "Job",
    "JobState",
    "NotFound",
    "OutOfRange",
    "PermissionDenied",
    "Player",
    "PlayerStatistics",
    "ResourceExhausted",
    "Status",
    "Stream",
    "SurfaceOptions",
    "Transport",
    "Unauthenticated",
    "Unavailable",
    "Unimplemented",
    "Up",
    "connect",
    "library_version",
]
