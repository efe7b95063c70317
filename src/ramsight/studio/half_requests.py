"""Connections that begin a request and do not end it: they are closed, so that nobody holds many of them open."""

from __future__ import annotations

import asyncio
from typing import Any

from ramsight.optional import needing
from ramsight.studio.guard import BODY_WITHIN

with needing("studio"):
    from uvicorn.protocols.http.auto import AutoHTTPProtocol

PATIENCE = BODY_WITHIN
"""For which the head of a request may be half there [s], as its body; a browser sends it at once."""

_Protocol: Any = AutoHTTPProtocol


class ClosingProtocol(_Protocol):  # type: ignore[misc]
    """HTTP as uvicorn speaks it, for connections whose next request is there in time."""

    _waits: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._look()

    def data_received(self, data: bytes) -> None:
        """Take what has come, and wait on if it is no whole head of a request."""
        super().data_received(data)
        self._look()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing more."""
        self._end()
        super().connection_lost(exc)

    def _look(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._end()
        elif self._waits is None:
            self._waits = self.loop.call_later(PATIENCE, self._close)

    def _end(self) -> None:
        if self._waits is not None:
            self._waits.cancel()
            self._waits = None

    def _close(self) -> None:
        self._waits = None
        is_asked = self.cycle is not None and not self.cycle.response_complete
        # A connection that has become a socket of a page has another protocol by now.
        if not is_asked and self.transport.get_protocol() is self and not self.transport.is_closing():
            self.transport.close()
