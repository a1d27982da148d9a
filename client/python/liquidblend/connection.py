"""How servers are reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from . import _native
from ._calls import Path, encode_optional, encode_optional_path
from .errors import invalid_argument


@dataclass(frozen=True)
class Connection:
    """Servers of one store, and how to reach them. None is the default."""

    target: Optional[str] = None
    """HOST:PORT, or several, separated by commas, which are asked in turn; None: 127.0.0.1:50051"""
    token: Optional[str] = None
    """Sent with TLS, or on this machine, only."""
    tls: bool = False
    """With the system's authorities; also if one of the next three is given."""
    tls_ca: Optional[Path] = None
    """File of authorities trusted for the server."""
    tls_cert: Optional[Path] = None
    """File of a certificate to show, with its key."""
    tls_key: Optional[Path] = None
    tls_server_name: Optional[str] = None
    """That the server's certificate is for; None: the target's host."""
    connect_timeout: Optional[float] = None
    """Seconds, above 0; None: 5."""
    call_timeout: Optional[float] = None
    """Seconds of one attempt of a short call, above 0; None: 30."""
    patience: Optional[float] = None
    """Seconds that calls are tried again while no server can be reached; None: 30; 0: none."""
    traceparent: Optional[str] = None
    """Of the W3C's Trace Context: the trace that all calls belong to."""

    def __post_init__(self) -> None:
        for name in ("connect_timeout", "call_timeout"):
            seconds = getattr(self, name)
            if seconds is not None and seconds <= 0:
                raise invalid_argument(f"{name} is {seconds:g}; it is above 0, or None")

    def to_native(self) -> _native.ConnectOptions:
        patience = 0.0 if self.patience is None else self.patience
        if self.patience == 0.0:
            patience = -1.0  # which the C API takes for none
        return _native.ConnectOptions(
            target=encode_optional(self.target, "target"),
            token=encode_optional(self.token, "token"),
            tls=int(self.tls),
            tls_ca=encode_optional_path(self.tls_ca, "tls_ca"),
            tls_cert=encode_optional_path(self.tls_cert, "tls_cert"),
            tls_key=encode_optional_path(self.tls_key, "tls_key"),
            tls_server_name=encode_optional(self.tls_server_name, "tls_server_name"),
            connect_timeout_s=self.connect_timeout or 0.0,
            call_timeout_s=self.call_timeout or 0.0,
            patience_s=patience,
            traceparent=encode_optional(self.traceparent, "traceparent"),
        )
