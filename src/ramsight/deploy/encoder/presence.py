"""Whether the drive is there: by its samples, and by its heartbeat where 1016h states that one is expected."""

from __future__ import annotations

import math

from ramsight.deploy.encoder.server import INVALID, OPERATIONAL, Node, refuse

_STATE = 0x7F  # bits of a heartbeat; the highest is that of the older node guarding


class Presence:
    """Watches the drive.

    Args:
        drive_node: the drive's node-ID; None has no heartbeat.

    Attributes:
        silent: no whole sample has come within 2002h.
        gone: the heartbeat has stopped, or says that the drive is not operational. One that never came is not missed.
    """

    def __init__(self, node: Node, drive_node: int | None) -> None:
        self._node, self._drive_node = node, drive_node
        self._sampled = self._alive = -math.inf
        self.silent = self.gone = self._idle = False

    @property
    def lost(self) -> bool:
        """Whether the drive is silent or gone."""
        return self.silent or self.gone

    def sampled(self, now: float) -> None:
        """A sample has come, or waiting for one begins [s]."""
        self._sampled, self.silent = now, False

    def alive(self, now: float, state: int) -> None:
        """A heartbeat has come [s], with the drive's NMT state. A drive sends process data in one state alone."""
        self._idle = state & _STATE != OPERATIONAL and self._is_watched
        self._alive, self.gone = now, self._idle

    def check(self, now: float) -> bool:
        """See what is missing by now [s]; whether that has changed."""
        before = self.silent, self.gone
        self.silent, self.gone = now >= self._silent_at, self._idle or now >= self._gone_at
        return before != (self.silent, self.gone)

    @property
    def due(self) -> float:
        """When something will be missing that is not yet [s]."""
        return min(math.inf if self.silent else self._silent_at, math.inf if self.gone else self._gone_at)

    def expect(self, value: int) -> None:
        """1016h is being written: refuse another node than the drive; wait for the first heartbeat."""
        if value & 0xFFFF and value >> 16 != self._drive_node:
            refuse(INVALID)
        self._alive, self.gone, self._idle = -math.inf, False, False

    @property
    def _silent_at(self) -> float:
        return self._sampled + self._node.get(0x2002) * 1e-3

    @property
    def _gone_at(self) -> float:
        watched = self._is_watched and math.isfinite(self._alive)
        return self._alive + (self._node.get(0x1016, 1) & 0xFFFF) * 1e-3 if watched else math.inf

    @property
    def _is_watched(self) -> bool:
        wanted = self._node.get(0x1016, 1)
        return bool(wanted & 0xFFFF) and wanted >> 16 == self._drive_node
