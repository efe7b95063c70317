"""The page's end of a machine that runs in a process of its own, and how many visitors may have one at a time."""

from __future__ import annotations

import asyncio
import multiprocessing
import threading
import time
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from ramsight.studio.spawned import Spawned, taken

if TYPE_CHECKING:  # what takes a while to load is loaded once a machine's process is on its way
    from ramsight.machine.description import Machine
    from ramsight.studio.draft import Problem
    from ramsight.studio.worker import Frame

STANDS = 2.0  # s without a word, after which a process stands; it speaks twice a second at least
_WAITING = 4  # frames that wait for a page; older ones are dropped, as of a page that is too slow


class Session:
    """One machine that runs for one page.

    Args:
        machine: a description, or a catalogue name.
        waits: whether its time stands until `go_on`: nobody looks yet.

    Attributes:
        about: name, units and strokes; None until it is ready.
        making: what is being compiled for it, in words; "" as long as nothing is.
        ended: why it has ended, in words; "" while it has not.
        wrong: what of its description cannot run, where that is why it has ended.
        refused: why it did not do the last thing that it could not do; "" at first.
        saved: by unit, a run that was asked for and has come as a ZIP file, or why there is none.
        dropped: frames that the page was too slow for.
    """

    def __init__(self, machine: Machine | str, *, waits: bool = False) -> None:
        self._pipe, other = multiprocessing.get_context("spawn").Pipe()
        self._process = Spawned(_run, other, machine, name="ramsight-rig")
        other.close()
        self._helpers = _helped(machine)
        self.about: dict[str, Any] | None = None
        self.making, self.ended, self.refused, self.dropped = "", "", "", 0
        self.wrong: Problem | None = None
        self.saved: dict[str, bytes | str] = {}
        self._frames: deque[Frame] = deque()
        self._heard = time.monotonic()
        self._lock, self._closed = threading.Lock(), False
        threading.Thread(target=self._listen, daemon=True, name="ramsight-listen").start()
        if waits:
            self.say("factor", 0.0)

    def go_on(self) -> None:
        """Let its time go on."""
        self.say("factor", 1.0)

    @property
    def process(self) -> int | None:
        """Number of the process."""
        return self._process.number

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return self._process.alive

    @property
    def over(self) -> bool:
        """Whether it has ended, or was closed."""
        return bool(self.ended) or self._closed

    @property
    def stands(self) -> bool:
        """Whether a process that was ready says nothing more: it is stopped, or the computer has no time for it."""
        return self.about is not None and not self.over and time.monotonic() - self._heard > STANDS

    def say(self, *command: Any) -> None:
        """Send a command to the machine; one that comes too late, or while it stands, is forgotten."""
        stands = self.stands and command[0] != "stop"  # nobody empties the pipe, and a full one would stop the server
        with self._lock:
            if not self._closed and not stands:
                try:
                    self._pipe.send(command)
                except OSError:
                    self._closed = True

    def frames(self) -> list[Frame]:
        """What has come since the last call."""
        return taken(self._frames)

    def close(self) -> None:
        """Stop the machine and end its process."""
        self.say("stop")
        with self._lock:
            self._closed = True
        self._process.end(ask=False)
        self._end_helpers()
        self._pipe.close()

    def _listen(self) -> None:
        take: dict[str, Callable[[Any], None]] = {
            "making": self._made,
            "ready": self._ready,
            "frame": self._frame,
            "ended": self._ended,
            "refused": self._refused,
            "saved": self._saved,
            "alive": lambda _: None,
        }
        try:
            while True:
                kind, value = self._pipe.recv()
                self._heard = time.monotonic()
                take[kind](value)
        except (EOFError, OSError):
            if not self.ended and not self._closed:
                self.ended = "the machine's process has ended"

    def _made(self, text: str) -> None:
        self.making = text

    def _ready(self, about: dict[str, Any]) -> None:
        self._end_helpers()
        self.about = about

    def _end_helpers(self) -> None:
        for one in self._helpers:
            one.end()

    def _frame(self, frame: Frame) -> None:
        """Let a frame wait; the marks of one that is dropped for it come with it."""
        while len(self._frames) >= _WAITING:
            try:
                gone = self._frames.popleft()
            except IndexError:  # the page has just taken them
                break
            self.dropped += 1
            if gone.begun == frame.begun:
                frame.marks = [*gone.marks, *frame.marks]
        self._frames.append(frame)

    def _refused(self, text: str) -> None:
        self.refused = text

    def _saved(self, run: tuple[str, bytes | str]) -> None:
        unit, what = run
        self.saved[unit] = what

    def _ended(self, said: tuple[str, Problem | None]) -> None:
        self.ended, self.wrong = said


def _run(pipe: Connection, machine: Machine | str) -> None:
    from ramsight.studio.worker import run

    run(pipe, machine)


def _helped(machine: Machine | str) -> list[Spawned]:
    """Processes that compile beside a machine's own, if anything has to be compiled."""
    if isinstance(machine, str):
        return []
    from ramsight.studio.first_start import help_making, helpers, is_made

    return [] if is_made(machine) else [Spawned(help_making, machine, name="ramsight-helper") for _ in range(helpers())]


MOST = 8
"""Visitors, if nothing else is said: about a gigabyte of their machines."""


class Visitors:
    """Counts them.

    Example:
        >>> visitors = Visitors(1)
        >>> visitors.come(), visitors.come(), visitors.go(), visitors.come()
        (True, False, None, True)
    """

    def __init__(self, most: int) -> None:
        self.most, self.there = most, 0

    def come(self) -> bool:
        """Let one in, if there is room; whether there was."""
        if self.there >= self.most:
            return False
        self.there += 1
        return True

    def go(self) -> None:
        """One who was let in has gone."""
        self.there -= 1

    @property
    def full(self) -> str:
        """What is said to those who are not let in."""
        return (
            f"This studio has as many visitors as it lets in at a time ({self.most}): close another page of it, wait"
            " until somebody goes, or begin it with more (--visitors). Then load this page again."
        )


class Place:
    """The place of one visitor who was let in: another one gets it once his machine's process has ended.

    Attributes:
        session: his machine; None before it is started.
        changing: is held while a machine is started or takes another one's place.
    """

    def __init__(self, visitors: Visitors) -> None:
        self._visitors = visitors
        self.session: Session | None = None
        self.changing = asyncio.Lock()

    async def leave(self) -> None:
        """End the machine, beside the server's loop, and free the place."""
        async with self.changing:
            if self.session is not None:
                await asyncio.to_thread(self.session.close)
        self._visitors.go()
