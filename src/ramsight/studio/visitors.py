"""How many visitors a studio has at a time: each has a process of his own, of some 140 MiB."""

from __future__ import annotations

MOST = 8
"""Visitors, if nothing else is said: about a gigabyte of their machines."""


class Visitors:
    """Counts them.

    Args:
        most: that are let in.

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
