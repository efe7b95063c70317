"""How many visitors a studio has at a time: each has a process of his own, of some 140 MiB."""

from __future__ import annotations

import asyncio

from ramsight.studio.session import Session

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
