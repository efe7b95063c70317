"""Processes that are spawned for a page: what they say is taken from a queue, and none outlives its purpose."""

from __future__ import annotations

from collections import deque
from multiprocessing.process import BaseProcess
from typing import TypeVar

_PATIENCE = 2.0  # s, until a process that does not stop is ended

Said = TypeVar("Said")


def taken(queue: deque[Said]) -> list[Said]:
    """All that is in a queue, which a thread may still be filling."""
    found = []
    while queue:
        found.append(queue.popleft())
    return found


def end(process: BaseProcess) -> None:
    """Wait for a process that was asked to stop, and end it if it does not."""
    process.join(_PATIENCE)
    if process.is_alive():
        process.kill()
        process.join()
