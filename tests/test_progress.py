"""A bar is there after a second of work, whatever the work says of itself, and gone at the end."""

import io
import re
import subprocess
import sys
import threading
import time

import pytest

from ramsight import progress as module
from ramsight.progress import advancing, progress, spoken

from .waiting import wait_for


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
    wait_for(lambda: words in terminal.getvalue())
    return True


def test_a_bar_appears_though_the_work_has_said_nothing_yet(monkeypatch):
    terminal = looked_at(monkeypatch)
    with progress(4, "digging") as bar:
        assert seen(terminal, "digging")
        bar.advance(3)
        assert seen(terminal, "75%")
    said = terminal.getvalue()
    bar.advance()
    assert (bar.done, terminal.getvalue()) == (4, said), "nothing is shown after the work"


def test_a_bar_goes_when_the_work_fails(monkeypatch):
    terminal = looked_at(monkeypatch)
    with pytest.raises(ZeroDivisionError), progress(2, "digging") as bar:  # noqa: PT012
        assert seen(terminal, "digging")
        raise ZeroDivisionError
    assert bar._bar is None


def test_a_bar_does_not_load_rich_before_it_shows():
    code = (
        "import sys\nfrom ramsight.progress import progress\n"
        "with progress(1, 'x') as bar:\n    bar.advance()\n"
        "assert 'rich' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


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


class Closed(io.StringIO):
    def write(self, text):
        raise BrokenPipeError


def piped(monkeypatch, stream=None):
    """A pipe in the place of stderr, and little patience."""
    monkeypatch.setattr(module, "EVERY", 0.05)
    monkeypatch.setattr("sys.stderr", stream or io.StringIO())
    return sys.stderr


def test_a_pipe_gets_lines_with_the_share_done_and_the_time_left(monkeypatch):
    pipe = piped(monkeypatch)
    with spoken("ramsight dig"), progress(4, "digging") as bar:
        assert seen(pipe, "digging: 0 s so far\n")
        bar.advance(1)
        assert seen(pipe, "digging: 25 % done, about ")
    said = pipe.getvalue()
    assert re.fullmatch(r"(digging: (0 s so far|25 % done, about \d+ s left)\n)+", said), said
    time.sleep(0.15)
    assert pipe.getvalue() == said, "nothing is said after the work"


def test_work_that_says_nothing_of_itself_is_said_to_go_on(monkeypatch):
    pipe = piped(monkeypatch)
    with spoken("ramsight dig"):
        assert seen(pipe, "ramsight dig: 0 s so far\n")


def test_a_terminal_gets_no_lines_and_a_closed_pipe_does_not_end_the_work(monkeypatch):
    terminal = looked_at(monkeypatch)
    monkeypatch.setattr(module, "EVERY", 0.02)
    with spoken("ramsight dig"):
        time.sleep(0.1)
    assert terminal.getvalue() == ""
    piped(monkeypatch, Closed())
    with spoken("ramsight dig"):
        time.sleep(0.12)
    with spoken("ramsight dig"):
        time.sleep(0.12)


def test_the_time_left_follows_from_the_share_done(monkeypatch):
    clock = iter([0.0, 30.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    bar = module.Progress(8, "digging")
    bar.done = 6.0
    assert bar.line == "digging: 75 % done, about 10 s left"


def test_a_function_that_shows_its_progress_speaks_through_a_pipe_and_only_once(monkeypatch):
    pipe = piped(monkeypatch)
    with advancing(4, "digging", shown=True) as advance:
        advance(2)
        assert seen(pipe, "digging: 50 % done, about ")
    quiet = piped(monkeypatch)
    with advancing(4, "digging", shown=False) as advance:
        advance(2)
        time.sleep(0.15)
    assert quiet.getvalue() == ""
    begun = threading.active_count()
    with spoken("ramsight dig"), advancing(4, "digging", shown=True):
        assert threading.active_count() == begun + 1, "one speaks"
