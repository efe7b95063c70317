"""A progress bar for work that takes long enough to want one."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import rich.progress

PATIENCE = 1.0
"""Seconds of work before a bar appears."""


class Progress:
    """How far some work has come; made by `progress`.

    The bar appears by itself after `PATIENCE`, whatever has been said of the work by then: what takes long is often the
    first part of it.
    """

    def __init__(self, total: float, text: str) -> None:
        self.total, self.text, self.done = total, text, 0.0
        self._begun = time.monotonic()
        self._bar: rich.progress.Progress | None = None
        self._task: rich.progress.TaskID | None = None
        self._opening = threading.Lock()
        self._wanted = sys.stderr is not None and sys.stderr.isatty()
        self._timer = threading.Timer(PATIENCE, self._open)
        self._timer.daemon = True
        if self._wanted:
            self._timer.start()

    def advance(self, amount: float = 1.0) -> None:
        """Say that so much more of the total is done.

        Args:
            amount: how much, in the units of the total.
        """
        self.done += amount
        if self._bar is None and self._wanted and time.monotonic() - self._begun >= PATIENCE:
            self._open()
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=self.done)

    def close(self) -> None:
        """Take the bar away; it does not come back."""
        self._timer.cancel()
        with self._opening:
            self._wanted = False
            if self._bar is not None:
                self._bar.stop()
                self._bar = None

    def _open(self) -> None:
        import rich.console
        import rich.progress

        with self._opening:
            if not self._wanted or self._bar is not None:
                return
            bar = rich.progress.Progress(console=rich.console.Console(stderr=True), transient=True)
            self._task = bar.add_task(self.text, total=self.total)
            bar.update(self._task, completed=self.done)
            bar.start()
            self._bar = bar


@contextmanager
def progress(total: float, text: str) -> Iterator[Progress]:
    """A progress bar on the terminal: on stderr, after a second of work, gone at the end.

    Where stderr is no terminal, or the work is done within the second, nothing is printed.

    Args:
        total: the whole of the work, in any unit (runs, samples, seconds).
        text: what the work is.

    Yields:
        The bar; call its ``advance(n)`` as the work goes on.

    Example:
        >>> with progress(3, "runs") as bar:
        ...     for _ in range(3):
        ...         bar.advance()
        >>> bar.done
        3.0
    """
    bar = Progress(total, text)
    try:
        yield bar
    finally:
        bar.close()
