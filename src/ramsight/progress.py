"""How far long work has come: a bar on a terminal, a line every ten seconds through a pipe."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    import rich.progress

PATIENCE = 1.0
"""Seconds of work before a bar appears."""
EVERY = 10.0
"""Seconds between two lines where there is no terminal."""

_silent = threading.Event()
_open: list[Progress] = []
_speaking: list[threading.Event] = []


class Progress:
    """How far some work has come; made by `progress`.

    The bar appears by itself after `PATIENCE`, the first line after `EVERY`, whatever has been said of the work by
    then: what takes long is often the first part of it.
    """

    def __init__(self, total: float, text: str) -> None:
        self.total, self.text, self.done = total, text, 0.0
        self._begun = time.monotonic()
        self._bar: rich.progress.Progress | None = None
        self._task: rich.progress.TaskID | None = None
        self._opening = threading.Lock()
        self._shown = sys.stderr is not None and sys.stderr.isatty() and not _silent.is_set()
        self._timer = threading.Timer(PATIENCE, self._open)
        self._timer.daemon = True
        if self._shown:
            self._timer.start()

    def advance(self, amount: float = 1.0) -> None:
        """Say that so much more of the total is done."""
        self.done += amount
        if self._bar is None and self._shown and time.monotonic() - self._begun >= PATIENCE:
            self._open()
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=self.done)

    @property
    def line(self) -> str:
        """How far it is, in a line: share done and time left where they are known, else the time so far."""
        took, share = time.monotonic() - self._begun, self.done / self.total if self.total > 0.0 else 0.0
        if not 0.0 < share <= 1.0:
            return f"{self.text}: {took:.0f} s so far"
        return f"{self.text}: {100 * share:.0f} % done, about {took * (1.0 / share - 1.0):.0f} s left"

    def close(self) -> None:
        """Take the bar away; it does not come back."""
        self._timer.cancel()
        with self._opening:
            self._shown = False
            if self._bar is not None:
                self._bar.stop()
                self._bar = None

    def _open(self) -> None:
        import rich.console
        import rich.progress

        with self._opening:
            if not self._shown or self._bar is not None:
                return
            bar = rich.progress.Progress(console=rich.console.Console(stderr=True), transient=True)
            self._task = bar.add_task(self.text, total=self.total)
            bar.update(self._task, completed=self.done)
            bar.start()
            self._bar = bar


@contextmanager
def progress(total: float, text: str) -> Iterator[Progress]:
    """A progress bar on the terminal: on stderr, after a second of work, gone at the end.

    Where stderr is no terminal, `spoken` says how far it is. Of work that is done within the second nothing is printed.

    Args:
        total: the whole of the work, in any unit (runs, samples, seconds); 0 if nobody knows.

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
    _open.append(bar)
    try:
        yield bar
    finally:
        _open.remove(bar)
        bar.close()


@contextmanager
def advancing(total: float, text: str, *, shown: bool) -> Iterator[Callable[[float], object]]:
    """What to call with each part of the work that is done: of a `progress`, or nothing where none is wanted.

    Through a pipe it says how far it is, if nobody does so already.

    Example:
        >>> with advancing(3, "runs", shown=False) as advance:
        ...     advance(1)
    """
    if not shown:
        yield lambda amount: None
        return
    with nullcontext() if _speaking else spoken(text), progress(total, text) as bar:
        yield bar.advance


@contextmanager
def spoken(text: str) -> Iterator[None]:
    """Say every `EVERY` seconds on stderr how far the work is, where that is no terminal.

    The innermost `progress` that is open is what is said; without one, that the work goes on.

    Args:
        text: what the work is called where nothing more is known of it.
    """
    stream, ended, begun = sys.stderr, threading.Event(), time.monotonic()
    if stream is None or stream.isatty():
        yield
        return

    def speak() -> None:
        while not ended.wait(EVERY):
            inner = _open[-1:]
            if not _silent.is_set():
                _say(stream, inner[0].line if inner else f"{text}: {time.monotonic() - begun:.0f} s so far")

    threading.Thread(target=speak, daemon=True).start()
    _speaking.append(ended)
    try:
        yield
    finally:
        _speaking.remove(ended)
        ended.set()


@contextmanager
def silent() -> Iterator[None]:
    """Say and show nothing of how far work is meanwhile.

    Example:
        >>> with silent(), progress(3, "runs") as bar:
        ...     bar.advance()
    """
    _silent.set()
    try:
        yield
    finally:
        _silent.clear()


def _say(stream: TextIO, line: str) -> None:
    """Print a line; a stream that is closed or full does not end the work."""
    try:
        print(line, file=stream, flush=True)
    except (OSError, ValueError):
        return
