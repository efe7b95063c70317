"""A bar is there after a second of work, whatever the work says of itself, and gone at the end."""

import io
import sys
import time

from ramsight import progress as module
from ramsight.progress import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def looked_at(monkeypatch):
    """A terminal in the place of stderr, from within a test: pytest puts its own there before."""
    monkeypatch.setattr(module, "PATIENCE", 0.05)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stderr", Terminal())
    return sys.stderr


def seen(terminal, words):
    until = time.monotonic() + 5.0
    while words not in terminal.getvalue() and time.monotonic() < until:
        time.sleep(0.01)
    return words in terminal.getvalue()


def test_a_bar_appears_though_the_work_has_said_nothing_yet(monkeypatch):
    terminal = looked_at(monkeypatch)
    with progress(4, "digging") as bar:
        assert seen(terminal, "digging")
        bar.advance(3)
        assert seen(terminal, "75%")


def test_nothing_appears_where_the_work_was_short_or_nobody_looks(monkeypatch):
    terminal = looked_at(monkeypatch)
    with progress(4, "digging") as bar:
        bar.advance(4)
    time.sleep(0.1)
    assert terminal.getvalue() == ""
    pipe = io.StringIO()
    monkeypatch.setattr("sys.stderr", pipe)
    with progress(4, "digging"):
        time.sleep(0.1)
    assert pipe.getvalue() == ""
