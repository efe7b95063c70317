"""A small OPC UA server beside the encoder: position, what it is worth, and nothing that can be written."""

from __future__ import annotations

import multiprocessing
import time
from contextlib import suppress
from dataclasses import asdict
from types import TracebackType
from typing import Any, Self

from ramsight.deploy.encoder.encoder import Encoder
from ramsight.deploy.encoder.quality import STALE, WAITING, said_by
from ramsight.deploy.opcua_process import PERIOD, READY, Serving, serve
from ramsight.errors import DescriptionError, RamsightError
from ramsight.optional import check_extra

_OLD = 1.0  # s without a word of the encoder, after which nothing is good any more
_START = 30.0  # s, in which a server has to have begun
_END = 2.0  # s, in which it has to have ended


class OpcuaError(RamsightError):
    """A server that cannot be started."""


def address_of(words: str) -> tuple[str, int]:
    """Host and port as an option has them.

    Raises:
        DescriptionError: they cannot be read.

    Example:
        >>> address_of("127.0.0.1:4840"), address_of("4840")
        (('127.0.0.1', 4840), ('127.0.0.1', 4840))
    """
    host, _, port = words.strip().rpartition(":")
    if not (port.isascii() and port.isdigit() and len(port) <= 5) or not 0 < int(port) < 1 << 16:
        raise DescriptionError("is no address", key="--opcua", value=words, allowed="a port, or '127.0.0.1:4840'")
    return host or "127.0.0.1", int(port)


class OpcuaServer:
    """Offers what an encoder reports, in a process of its own, so that no client delays a frame.

    Anybody who reaches the address may read and nobody may write; there is no encryption, so it stays on this machine
    (127.0.0.1) unless another address is asked for. So many clients at a time, and so many new ones a second, are
    taken (`ramsight.deploy.opcua_process`).

    Args:
        encoder: whose position it is.
        name: of its object, the unit's.
        host, port: where it is found.
        old: for how long a word of the encoder is good [s].

    Raises:
        OpcuaError: it cannot be started there.
        MissingPackageError: asyncua is not installed.
    """

    def __init__(
        self, encoder: Encoder, name: str, host: str = "127.0.0.1", port: int = 4840, *, old: float = _OLD
    ) -> None:
        check_extra("opcua")
        what = Serving(host, port, name, WAITING, STALE, old)
        self.endpoint, self._encoder = what.endpoint, encoder
        self._newest: dict[str, Any] | None = None
        self._next, self._is_waited_for = -1.0, False
        context = multiprocessing.get_context("spawn")
        self._pipe, self._others = context.Pipe()
        self._process = context.Process(target=serve, args=(self._others, what), name="opcua", daemon=True)

    def __enter__(self) -> Self:
        self._process.start()
        self._others.close()
        said: object = "it does not start"
        with suppress(EOFError, OSError):
            if self._pipe.poll(_START):
                said = self._pipe.recv()
        if said != READY:
            self._end()
            raise OpcuaError(f"{self.endpoint}: cannot be served: {said}")
        self._send()
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._end()

    def take(self) -> None:
        """Take over what the encoder reports, if it is time to; called by the loop that runs the encoder."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + PERIOD
            self._newest = asdict(said_by(self._encoder))
            if self._process.pid is not None:
                self._send()

    def _send(self) -> None:
        """Hand on the newest word, unless the last one still waits to be taken: a pipe that is full is waited for."""
        with suppress(EOFError, OSError):  # a server that has ended: the encoder goes on without
            if self._is_waited_for and self._pipe.poll():
                self._pipe.recv()
                self._is_waited_for = False
            if self._newest is not None and not self._is_waited_for:
                self._pipe.send(self._newest)
                self._newest, self._is_waited_for = None, True

    def _end(self) -> None:
        self._pipe.close()
        self._process.join(_END)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
