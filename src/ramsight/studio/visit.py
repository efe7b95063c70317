"""What the tabs of one visitor share: the machine that he works with, as he has described it last."""

from __future__ import annotations

import tempfile
from collections.abc import Awaitable, Callable
from pathlib import Path

from ramsight.machine.description import Machine
from ramsight.studio.draft import Problem


class Visit:
    """One visitor: his machine, and a folder of his own as long as his page is open.

    Args:
        history: store of histories that is shown, or None.

    Attributes:
        run_live: lets a machine run on the first tab; why it cannot, or None.
    """

    def __init__(self, machine: Machine, history: str | None = None) -> None:
        self.machine, self.history = machine, history
        self.run_live: Callable[[Machine], Awaitable[Problem | None]] | None = None
        self._folder = tempfile.TemporaryDirectory(prefix="ramsight-studio-")
        self._callbacks: list[Callable[[Machine], None]] = []
        self._ends: list[Callable[[], None]] = []

    @property
    def folder(self) -> Path:
        """Folder of this visitor."""
        return Path(self._folder.name)

    def on_machine(self, tell: Callable[[Machine], None]) -> None:
        """Register a callback for a change of the machine."""
        self._callbacks.append(tell)

    def use(self, machine: Machine) -> None:
        """Work with another machine from now on."""
        self.machine = machine
        for tell in self._callbacks:
            tell(machine)

    def on_end(self, end: Callable[[], None]) -> None:
        """Have something done when the page is gone, before its folder is thrown away."""
        self._ends.append(end)

    def end(self) -> None:
        """End what runs for the visitor, and throw the folder away."""
        for end in self._ends:
            end()
        self._folder.cleanup()
