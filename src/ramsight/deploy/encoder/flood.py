"""Log lines of the bus libraries, limited in rate: a flood of frames is no flood of lines."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_AT_ONCE = 3  # lines of one kind
_EVERY = 10.0  # s between lines of one kind after that
_KINDS = 64  # that are remembered


class Limit(logging.Filter):
    """Lets the first lines of a kind through, then one every ten seconds with the number of those held back.

    A kind is a logger, a level and a message before its values are filled in.

    Args:
        clock: [s], runs only forward.

    Example:
        >>> limit = Limit(clock=lambda: 0.0)
        >>> line = logging.makeLogRecord({"name": "can", "msg": "frame lost"})
        >>> sum(limit.filter(line) for _ in range(1000))
        3
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._seen: dict[tuple[str, int, str], tuple[int, float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a line is let through."""
        kind = (record.name, record.levelno, str(record.msg)[:80])
        now = self._clock()
        if kind not in self._seen and len(self._seen) >= _KINDS:
            kind = ("", 0, "")  # messages that are all different are one kind, too
        passed, last, held = self._seen.get(kind, (0, now, 0))
        if passed >= _AT_ONCE and now - last < _EVERY:
            self._seen[kind] = (passed, last, held + 1)
            return False
        self._seen[kind] = (passed + 1, now, 0)
        if held:
            record.msg, record.args = f"{record.getMessage()} (and {held} more since the last such line)", ()
        return True


@contextmanager
def limited_log_lines() -> Iterator[None]:
    """Warnings of all loggers go to standard error, limited in rate, until the block ends."""
    handler = logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    handler.addFilter(Limit())
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
