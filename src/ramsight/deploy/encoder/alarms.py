"""What can be wrong, and how a CiA 406 encoder reports it: alarms, warnings, emergencies, error register."""

from __future__ import annotations

import math
from collections.abc import Iterable, Set
from enum import Enum

from ramsight.deploy.encoder.server import OPERATIONAL, PRE_OPERATIONAL, Node
from ramsight.sensor.status import Status

POSITION_ERROR = 1 << 0
DATA_DAMAGED = 1 << 12
CANNOT_SAVE = 1 << 13
CONTRADICTED = 1 << 14
_FAST, _INPUT, _NEVER = 1 << 0, 1 << 2, 1 << 5
_DUE, _EDGE, _COLD, _MISSED = 1 << 12, 1 << 13, 1 << 14, 1 << 15
_ANY, _WARMTH, _BUS, _PROFILE, _DEVICE = 1, 1 << 3, 1 << 4, 1 << 5, 1 << 7


class Fault(Enum):
    """A condition of the encoder. Several may hold at once.

    Attributes:
        alarm: bits of 6503h; any of them makes the position invalid.
        warning: bits of 6505h.
        emcy: emergency code, 0 for none.
        register: bits of 1001h.
        ne107: its state by NAMUR NE 107: F failure, C function check, S out of specification, M maintenance.
        text: what it is.
    """

    NOT_REFERENCED = (POSITION_ERROR, _NEVER, 0x0000, 0, "C", "not referenced since power-up")
    REFERENCE_DUE = (0, _DUE, 0x0000, 0, "M", "uncertainty above its warning limit, or oil gone another way")
    LIMITS = (0, _EDGE, 0x0000, 0, "S", "near relief pressure, cavitation, or outside the calibrated range")
    OVERSPEED = (0, _FAST | _EDGE, 0x0000, 0, "S", "motor faster than it may turn")
    GAP = (0, _MISSED, 0x0000, 0, "S", "samples of the drive were missing")
    TEMPERATURE = (0, _COLD, 0x4200, _WARMTH, "S", "oil temperature missing or implausible; the last good one is used")
    TOO_UNCERTAIN = (POSITION_ERROR, 0, 0xFF01, _DEVICE, "F", "uncertainty above its limit, or outside the stroke")
    REFUSED = (POSITION_ERROR, 0, 0xFF02, _DEVICE, "F", "a reference (preset, switch, stop) contradicts the position")
    IMPLAUSIBLE = (POSITION_ERROR, 0, 0xFF03, _DEVICE, "F", "torque or speed implausible or contradicted, time frozen")
    ONE_OF_TWO = (0, _INPUT, 0xFF04, _DEVICE, "M", "speed or counter of the shaft is wrong; the other one is used")
    APART = (
        POSITION_ERROR | CONTRADICTED, 0, 0xFF05, _DEVICE, "F",
        "a real sensor and this one are apart, and nothing tells which is wrong",
    )  # fmt: skip
    OTHER_WRONG = (0, _INPUT, 0xFF06, _DEVICE, "M", "the real sensor is wrong or silent")
    VIRTUAL_WRONG = (
        POSITION_ERROR | CONTRADICTED, 0, 0xFF07, _DEVICE, "F",
        "a real sensor is elsewhere, and this one says itself that it may be wrong",
    )  # fmt: skip
    SECOND_NODE = (
        POSITION_ERROR, _INPUT, 0xFF08, _BUS, "F",
        "another node with the drive's identifier; the position is forgotten",
    )  # fmt: skip
    STALE = (POSITION_ERROR, _INPUT, 0xFF09, _BUS, "F", "the drive's data repeat, or are late")
    DISABLED = (POSITION_ERROR, 0, 0xFF0A, _DEVICE, "C", "the drive is not enabled (6041h), and its torque is none")
    DRIVE_SILENT = (POSITION_ERROR, _INPUT, 0x8250, _BUS, "F", "drive silent for longer than object 2002h allows")
    DRIVE_GONE = (
        POSITION_ERROR, _INPUT, 0x8130, _BUS, "F",
        "the drive's heartbeat (1016h) is missing, or says that it is not operational",
    )  # fmt: skip
    SHORT = (0, 0, 0x8210, _BUS, "S", "a PDO of the drive is shorter than what is mapped")
    STATE_DAMAGED = (
        POSITION_ERROR | DATA_DAMAGED, 0, 0x6300, _PROFILE, "F",
        "stored state damaged, or another machine's",
    )  # fmt: skip
    PARAMETERS_DAMAGED = (
        POSITION_ERROR | DATA_DAMAGED, 0, 0x6300, _PROFILE, "F",
        "stored parameters damaged; defaults",
    )  # fmt: skip
    NOT_SAVED = (
        POSITION_ERROR | CANNOT_SAVE, 0, 0x5500, _DEVICE, "F",
        "the state cannot be saved: disk full, read-only or slow",
    )  # fmt: skip
    INTERNAL = (POSITION_ERROR, 0, 0x6100, _DEVICE, "F", "a value of the sensor is no number; restart the encoder")

    def __init__(self, alarm: int, warning: int, emcy: int, register: int, ne107: str, text: str) -> None:
        self.alarm, self.warning, self.emcy, self.register = alarm, warning, emcy, register
        self.ne107, self.text = ne107, text


OF_STATUS = {
    Status.REFERENCE_DUE: Fault.REFERENCE_DUE,
    Status.POSITION_LOST: Fault.REFERENCE_DUE,
    Status.FAULT_PASSED: Fault.REFERENCE_DUE,
    Status.SPEED_WRONG: Fault.ONE_OF_TWO,
    Status.COUNTER_WRONG: Fault.ONE_OF_TWO,
    Status.OUTSIDE_TORQUE: Fault.LIMITS,
    Status.OUTSIDE_TEMPERATURE: Fault.LIMITS,
    Status.NEAR_RELIEF: Fault.LIMITS,
    Status.CAVITATION: Fault.LIMITS,
    Status.OUTSIDE_SPEED: Fault.OVERSPEED,
    Status.TEMPERATURE_LOST: Fault.TEMPERATURE,
    Status.INPUT_GAP: Fault.GAP,
    Status.REFERENCE_REFUSED: Fault.REFUSED,
    Status.NOT_REFERENCED: Fault.NOT_REFERENCED,
    Status.TOO_UNCERTAIN: Fault.TOO_UNCERTAIN,
    Status.OUTSIDE_STROKE: Fault.TOO_UNCERTAIN,
    Status.IMPLAUSIBLE_TORQUE: Fault.IMPLAUSIBLE,
    Status.IMPLAUSIBLE_SPEED: Fault.IMPLAUSIBLE,
    Status.INPUT_STUCK: Fault.IMPLAUSIBLE,
    Status.TIME_FROZEN: Fault.IMPLAUSIBLE,
    Status.INPUT_LOST: Fault.IMPLAUSIBLE,
    Status.SPEED_CONTRADICTED: Fault.IMPLAUSIBLE,
    Status.TORQUE_CONTRADICTED: Fault.IMPLAUSIBLE,
    Status.SIGN_CONTRADICTED: Fault.IMPLAUSIBLE,
    Status.STATE_INVALID: Fault.INTERNAL,
}
"""The fault behind each status of the sensor."""

ALARMS = POSITION_ERROR | DATA_DAMAGED | CANNOT_SAVE | CONTRADICTED
WARNINGS = _FAST | _INPUT | _NEVER | _DUE | _EDGE | _COLD | _MISSED


def alarms(faults: Iterable[Fault]) -> int:
    """Object 6503h: the alarms of these faults together.

    Example:
        >>> hex(alarms([Fault.STATE_DAMAGED, Fault.GAP]))
        '0x1001'
    """
    return _together(fault.alarm for fault in faults)


def warnings(faults: Iterable[Fault]) -> int:
    """Object 6505h: the warnings of these faults together."""
    return _together(fault.warning for fault in faults)


def register(faults: Iterable[Fault]) -> int:
    """1001h: bit 0 whenever there is an error that an emergency tells of.

    Example:
        >>> register([Fault.NOT_REFERENCED]), register([Fault.DRIVE_SILENT])
        (0, 17)
    """
    bits = _together(fault.register for fault in faults)
    return bits | _ANY if bits else 0


def _together(words: Iterable[int]) -> int:
    found = 0
    for word in words:
        found |= word
    return found


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
