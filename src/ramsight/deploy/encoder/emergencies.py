"""Emergencies: one for each change, never more often than the inhibit time allows, and none that is out of date."""

from __future__ import annotations

import math
from collections.abc import Set

from ramsight.deploy.encoder.alarms import Fault, alarms, register, warnings
from ramsight.deploy.encoder.server import OPERATIONAL, PRE_OPERATIONAL, Node

_REMEMBERED = 8


class Emergencies:
    """Tells the bus which faults come and go.

    Attributes:
        history: what 1003h holds: code, and the sensor's status above it; the newest first.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._reported: list[Fault] = []
        self._quiet_until = -math.inf
        self.history: list[int] = []

    def due(self, faults: Set[Fault]) -> float:
        """When the next one may go out [s]; infinite if there is nothing new, or the node has to be silent."""
        if self._node.state not in (PRE_OPERATIONAL, OPERATIONAL):
            return math.inf
        return self._quiet_until if {fault for fault in faults if fault.emcy} != set(self._reported) else math.inf

    def tell(self, now: float, faults: Set[Fault], status: int) -> None:
        """Send one if it is due: a new error, or code 0 when errors are over.

        Its last five bytes are the alarms, the warnings and the sensor's status.
        """
        if now < self.due(faults):
            return
        new = next((fault for fault in Fault if fault.emcy and fault in faults and fault not in self._reported), None)
        if new is None:
            self._reported = [fault for fault in self._reported if fault in faults]
        else:
            self._reported.append(new)
            self.history = [new.emcy | status << 16, *self.history][:_REMEMBERED]
        words = alarms(faults) | warnings(faults) << 16 | status << 32
        self._node.emergency(0 if new is None else new.emcy, register(faults), words.to_bytes(5, "little"))
        self._quiet_until = now + self._node.get(0x1015) * 1e-4

    def forget(self) -> None:
        """After a reset every condition that still holds is reported again."""
        self._reported.clear()
