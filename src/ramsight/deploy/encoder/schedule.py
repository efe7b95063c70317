"""What the node sends by itself: its heartbeat and its PDOs, each on a grid of its own."""

from __future__ import annotations

from collections.abc import Set

from ramsight.deploy.encoder.objects import SHORTEST_HEARTBEAT
from ramsight.deploy.encoder.pdo import Tpdo
from ramsight.deploy.encoder.server import OPERATIONAL, TOO_LOW, Node
from ramsight.deploy.encoder.ticks import Ticks

HEARTBEAT = 0x700
TIMERS = (0x1800, 0x6200)
"""1800h:05 and 6200h are one timer."""
PDOS = (0x1800, 0x1801, 0x1A00, 0x1A01)


class Schedule:
    """Sends heartbeat and transmit PDOs when they are due."""

    def __init__(self, node: Node, taken: Set[int]) -> None:
        self._node = node
        self._tpdos = (Tpdo(node, 0, taken), Tpdo(node, 1, taken))
        self._heartbeat = Ticks()

    @property
    def due(self) -> float:
        """When something is due next [s]."""
        return min(self._heartbeat.due, *(tpdo.due for tpdo in self._tpdos))

    def start(self, now: float) -> None:
        """Begin after a boot."""
        self._restart_heartbeat(now)
        self.restart_pdos(now)

    def restart_pdos(self, now: float) -> None:
        """Begin the PDOs again, as the NMT state and their settings now have it."""
        is_running = self._node.state == OPERATIONAL
        for tpdo in self._tpdos:
            tpdo.restart(now, is_running)
            if is_running:
                tpdo.tick(now)

    def tick(self, now: float) -> None:
        """Send what is due by now."""
        if self._heartbeat.take(now):
            self._node.wire.send_message(HEARTBEAT + self._node.id, bytes([self._node.state]))
        if self._node.state == OPERATIONAL:
            for tpdo in self._tpdos:
                tpdo.tick(now)

    def sync(self) -> None:
        """Send what goes with this SYNC."""
        for tpdo in self._tpdos:
            tpdo.sync()

    def check(self, index: int, subindex: int, value: int) -> None:
        """Refuse settings of a PDO that cannot be, or not now."""
        self._tpdos[index & 1].check(index, subindex, value)

    def refusal(self, index: int, subindex: int, value: int) -> int:
        """The abort code for a setting that can never be; 0 if it can."""
        if index == 0x1017 and 0 < value < SHORTEST_HEARTBEAT:
            return TOO_LOW
        return self._tpdos[index & 1].refusal(subindex, value) if index in (0x1800, 0x1801) else 0

    def written(self, now: float, index: int) -> None:
        """Follow an object whose new value is stored."""
        if index in TIMERS:
            self.link_timers(index)
        if index in (*TIMERS, 0x1801):
            self.restart_pdos(now)
        elif index == 0x1017:
            self._restart_heartbeat(now)

    def link_timers(self, by: int) -> None:
        """Let the other one of `TIMERS` be what this one is."""
        if by == 0x6200:
            self._node.set(0x1800, 5, self._node.get(0x6200))
        else:
            self._node.set(0x6200, 0, self._node.get(0x1800, 5))

    def _restart_heartbeat(self, now: float) -> None:
        self._heartbeat.start(now, self._node.get(0x1017) * 1e-3, at_once=False)
