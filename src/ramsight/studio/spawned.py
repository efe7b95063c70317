"""Processes that are spawned for a page: what they say is taken from a queue, and none outlives its purpose."""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, TypeVar

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
    """A process that runs a function; ended, it leaves no process and no file descriptor.

    Args:
        work: a function of a module.
        arguments: that can be sent to a process.
        name: of the process.

    Attributes:
        number: of the process.
    """

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
