"""A transmit PDO: its settings, what it holds, and when it is due."""

from __future__ import annotations

from collections.abc import Set

from ramsight.deploy.encoder.objects import BITS, ENTRIES
from ramsight.deploy.encoder.server import INVALID, NOT_MAPPABLE, TOO_LONG, Node, refuse
from ramsight.deploy.encoder.ticks import Ticks

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
