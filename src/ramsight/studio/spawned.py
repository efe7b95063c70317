"""Processes that are spawned for a page, and long work in one: what they say is taken from a queue; none is left."""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from ramsight.errors import RamsightError

_PATIENCE = 2.0  # s, until a process that does not stop is ended
_LOOK = 0.02  # s, from one look at whether a process has ended to the next

Said = TypeVar("Said")


def taken(queue: deque[Said]) -> list[Said]:
    """All that is in a queue, which a thread may still be filling."""
    found = []
    while queue:
        found.append(queue.popleft())
    return found


class Spawned:
    """A process that runs a function; ended, it leaves no process and no file descriptor."""

    def __init__(self, work: Callable[..., None], *arguments: Any, name: str) -> None:
        self._process = multiprocessing.get_context("spawn").Process(
            target=work, args=arguments, daemon=True, name=name
        )
        self._process.start()
        self.number = self._process.pid
        self._lock, self._is_closed, self._code = threading.Lock(), False, 0

    @property
    def alive(self) -> bool:
        """Whether it is there."""
        with self._lock:
            return not self._is_closed and self._process.is_alive()

    def code(self) -> int | None:
        """Wait until it has ended; what it ended with. Others can end it meanwhile."""
        while self.alive:
            time.sleep(_LOOK)
        with self._lock:
            return self._code if self._is_closed else self._process.exitcode

    def end(self, *, ask: bool = True) -> None:
        """Wait for it to stop, and kill it if it does not.

        Args:
            ask: whether a signal asks it to; it has been asked otherwise if not.
        """
        with self._lock:
            if self._is_closed:
                return
            if ask:
                self._process.terminate()
            self._process.join(_PATIENCE)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()
            self._code, self._is_closed = self._process.exitcode or 0, True
            self._process.close()


# Work that takes long, in a process of its own: it states how far it is, and can be stopped at any time.
#
# Its process is spawned. One that is forked, as `nicegui.run.cpu_bound` does, holds copies of the
# server's sockets: a connection that the server closes stays open, and the browser waits for an answer on it for ever.

Say = Callable[[str, Any], None]
News = tuple[str, Any]


class Job:
    """One piece of work.

    Args:
        work: a function of a module; it gets `say(what, value)`, with which it reports its progress, and the
            arguments. A `RamsightError` is said as ``error``, in words.
    """

    def __init__(self, work: Callable[..., None], *arguments: Any) -> None:
        self._pipe, other = multiprocessing.get_context("spawn").Pipe(duplex=False)
        self._process = Spawned(_do, other, work, arguments, name="ramsight-job")
        other.close()
        self._news: deque[News] = deque()
        self._listener = threading.Thread(target=self._listen, daemon=True, name="ramsight-listen")
        self._listener.start()

    @property
    def alive(self) -> bool:
        """Whether it goes on, or has said something that nobody has heard yet."""
        return self._listener.is_alive() or bool(self._news)

    def news(self) -> list[News]:
        """What was said since the last call."""
        return taken(self._news)

    def stop(self) -> None:
        """End it, whatever it is doing."""
        self._process.end()

    def _listen(self) -> None:
        try:
            while True:
                self._news.append(self._pipe.recv())
        except (EOFError, OSError):
            if (code := self._process.code()) not in (0, -15):
                self._news.append(("error", f"the process has ended ({code})"))
        finally:
            self._pipe.close()


def _do(pipe: Connection, work: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    def say(what: str, value: Any) -> None:
        pipe.send((what, value))

    try:
        try:
            work(say, *arguments)
        except RamsightError as error:
            say("error", str(error))
    except (BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
        return
