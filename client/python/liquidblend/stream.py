"""Streams: frames of a family at many times, one after the other."""

from __future__ import annotations

import ctypes
from typing import Optional

from . import _native
from ._calls import ClientHandle, make, make_some
from ._closing import Closing
from .errors import Cancelled
from .frame import Frame


class Stream(Closing):
    """Frames that a server sends ahead of what is read; made by ``Client.stream()``.

    It is an iterator. It is closed at its end, by ``close()``, at the end of a ``with`` block, and
    when nothing refers to it any more, as after a loop that was left. Frames stay.
    Threads: one at a time reads; ``close()`` may be called by another, and ends a read that waits.
    """

    def __init__(
        self, client: ClientHandle, request: _native.StreamRequest, attributes: int
    ) -> None:
        """Made by clients."""
        self._client = client
        self._attributes = attributes
        # It waits while there is no connection.
        self._handle: Optional[_native.Handle] = client.interruptible(
            lambda: make_some(
                "lb_stream_open", "lb_stream_free", client.pointer, ctypes.byref(request)
            )
        )

    def __iter__(self) -> Stream:
        return self

    def __next__(self) -> Frame:
        """Waits for the next frame.

        Raises: the server's errors, Unavailable if the connection is lost; it has ended then.
        """
        if self._handle is None:
            raise StopIteration
        handle: _native.Handle = self._handle  # of the call, also once this is closed
        try:
            frame = self._client.interruptible(
                lambda: make("lb_stream_next", "lb_frame_free", handle.pointer)
            )
        except Cancelled:
            was_closed = self._handle is None  # by another thread
            self.close()
            if was_closed:
                raise StopIteration from None
            raise
        except BaseException:
            self.close()
            raise
        if frame is None:
            self.close()
            raise StopIteration
        return Frame(frame, self._attributes)

    def close(self) -> None:
        """Ends the stream at once; again: nothing."""
        handle, self._handle = self._handle, None
        if handle is not None:
            _native.function("lb_stream_cancel")(handle.pointer)

    @property
    def closed(self) -> bool:
        return self._handle is None
