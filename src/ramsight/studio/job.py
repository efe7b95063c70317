"""Work that takes long, in a process of its own: it states how far it is, and can be stopped at any time.

Its process is spawned. One that is forked, as `nicegui.run.cpu_bound` does, holds copies of the
server's sockets: a connection that the server closes stays open, and the browser waits for an answer on it for ever.
"""

from __future__ import annotations

import multiprocessing
import threading
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from ramsight.errors import RamsightError
from ramsight.studio.spawned import Spawned, taken

Say = Callable[[str, Any], None]
News = tuple[str, Any]


class Job:
    """One piece of work.

    Args:
        work: a function of a module; it gets `say(what, value)`, with which it reports its progress, and the
            arguments. A `RamsightError` is said as ``error``, in words.
        arguments: that can be sent to a process.
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
