"""What the node sends by itself: its heartbeat and its PDOs, each on a grid of its own."""

from __future__ import annotations

import math
from collections.abc import Set

from ramsight.deploy.encoder.objects import BITS, ENTRIES, SHORTEST_HEARTBEAT
from ramsight.deploy.encoder.server import INVALID, NOT_MAPPABLE, OPERATIONAL, TOO_LONG, TOO_LOW, Node, refuse

_EARLY = 1e-6  # s; rounding of clocks


class Ticks:
    """Times ``start + k * period``. After a delay the ones that are past count as one, and the grid stays.

    Example:
        >>> ticks = Ticks()
        >>> ticks.start(1.0, 0.5)
        >>> [ticks.take(now) for now in (1.0, 1.2, 1.5, 3.7, 3.9, 4.0)], ticks.due
        ([True, False, True, True, False, True], 4.5)
    """

    def __init__(self) -> None:
        self.due = math.inf
        self._start, self._period, self._count = 0.0, 0.0, 0

    def start(self, now: float, period: float, *, at_once: bool = True) -> None:
        """Begin; a period of 0 stops it [s]."""
        self._start, self._period, self._count = now, period, 0 if at_once else 1
        self.due = math.inf if period <= 0.0 else now + self._count * period

    def take(self, now: float) -> bool:
        """Whether it was due; if so it is due next at the first time of the grid after now."""
        if now < self.due - _EARLY:
            return False
        passed = math.floor((now - self._start) / self._period + _EARLY)
        self._count = max(self._count, passed) + 1
        self.due = self._start + self._count * self._period
        return True


_OFF, _WIDE = 1 << 31, 1 << 29
_ON_CHANGE, _SYNCHRONOUS, _BY_TIMER = 0, range(1, 241), (254, 255)
_RESTRICTED = (range(0x181), range(0x580, 0x680), range(0x6E0, 0x800))
"""Identifiers of other services of CiA 301: NMT, SYNC, emergencies, TIME, SDO, heartbeats and what is reserved."""


class Tpdo:
    """One of the node's transmit PDOs.

    Args:
        number: 0 for TPDO1.
    """

    def __init__(self, node: Node, number: int, taken: Set[int] = frozenset()) -> None:
        self._taken = taken
        self._node, self.settings, self.mapping = node, 0x1800 + number, 0x1A00 + number
        self._ticks = Ticks()
        self._syncs, self._last = 0, b""

    @property
    def due(self) -> float:
        """When its event timer is due [s]; infinite if it has none."""
        return self._ticks.due

    def restart(self, now: float, running: bool) -> None:
        """Begin its schedule again: at once, then every period."""
        timed = running and self._is_on and self._type in _BY_TIMER
        self._ticks.start(now, self._node.get(self.settings, 5) * 1e-3 if timed else 0.0)
        self._syncs, self._last = 0, b""

    def tick(self, now: float) -> None:
        """Send it if its time has come."""
        if self._ticks.take(now):
            self._send()

    def sync(self) -> None:
        """Send it if it goes with this SYNC."""
        if not self._is_on:
            return
        if self._type == _ON_CHANGE:
            if self._data() != self._last:
                self._send()
        elif self._type in _SYNCHRONOUS:
            self._syncs += 1
            if self._syncs >= self._type:
                self._syncs = 0
                self._send()

    def check(self, index: int, subindex: int, value: int) -> None:
        """Refuse settings that cannot be, or not now."""
        if index == self.settings and subindex == 1:
            now = self._node.get(self.settings, 1)
            if not value & _OFF and not now & _OFF and value & 0x7FF != now & 0x7FF:
                refuse(INVALID)
        elif index == self.mapping:
            if self._is_on:
                refuse(INVALID)
            if subindex == 0:
                self._check_length(value)
            elif self._node.get(self.mapping) != 0:
                refuse(INVALID)
            elif value:
                _check_mapped(value)

    def refusal(self, subindex: int, value: int) -> int:
        """The abort code for a setting that can never be; 0 if it can."""
        if subindex == 1:
            identifier, other = value & 0x7FF, self._node.get(self.settings ^ 1, 1)
            wrong = bool(value & (_WIDE | 0x1FFF_F800)) or identifier in self._taken
            wrong |= any(identifier in kept for kept in _RESTRICTED)
            wrong |= not (value | other) & _OFF and identifier == other & 0x7FF
            return INVALID if wrong else 0
        if subindex == 2 and value != _ON_CHANGE and value not in _SYNCHRONOUS and value not in _BY_TIMER:
            return INVALID
        return 0

    def _check_length(self, count: int) -> None:
        mapped = [self._node.get(self.mapping, k) for k in range(1, count + 1)]
        for one in mapped:
            _check_mapped(one)
        if sum(one & 0xFF for one in mapped) > 64:
            refuse(TOO_LONG)

    @property
    def _is_on(self) -> bool:
        return not self._node.get(self.settings, 1) & _OFF

    @property
    def _type(self) -> int:
        return self._node.get(self.settings, 2)

    def _data(self) -> bytes:
        count = self._node.get(self.mapping)
        mapped = (self._node.get(self.mapping, k) for k in range(1, count + 1))
        return b"".join(self._node.data(one >> 16, one >> 8 & 0xFF) for one in mapped)

    def _send(self) -> None:
        self._last = self._data()
        self._node.wire.send_message(self._node.get(self.settings, 1) & 0x7FF, self._last)


def _check_mapped(value: int) -> None:
    entry = ENTRIES.get((value >> 16, value >> 8 & 0xFF))
    if entry is None or not entry.mappable or BITS[entry.type] != value & 0xFF:
        refuse(NOT_MAPPABLE)


def pdo_identifiers(node: int | None) -> frozenset[int]:
    """The identifiers that a node's PDOs have by CiA 301, in either direction.

    Example:
        >>> [hex(one) for one in sorted(pdo_identifiers(5))][:3]
        ['0x185', '0x205', '0x285']
    """
    return frozenset() if node is None else frozenset(range(0x180 + node, 0x580, 0x80))


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
