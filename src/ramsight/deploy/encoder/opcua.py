"""A small OPC UA server beside the encoder: position, what it is worth, and nothing that can be written."""

from __future__ import annotations

import math
import multiprocessing
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import Any, Self

from ramsight.deploy.encoder.alarms import Fault
from ramsight.deploy.encoder.encoder import Encoder
from ramsight.deploy.opcua_process import PERIOD, READY, Serving, serve
from ramsight.errors import DescriptionError, RamsightError
from ramsight.optional import check_extra

GOOD = "Good"
WAITING = "BadWaitingForInitialData"
STALE = "BadNoCommunication"
_BAD = "Bad"

QUALITY = {
    Fault.NOT_REFERENCED: WAITING,
    Fault.REFERENCE_DUE: "UncertainSensorNotAccurate",
    Fault.LIMITS: "UncertainEngineeringUnitsExceeded",
    Fault.OVERSPEED: "UncertainEngineeringUnitsExceeded",
    Fault.GAP: "UncertainSensorNotAccurate",
    Fault.TEMPERATURE: "UncertainSubNormal",
    Fault.TOO_UNCERTAIN: "BadSensorFailure",
    Fault.REFUSED: "BadSensorFailure",
    Fault.IMPLAUSIBLE: "BadSensorFailure",
    Fault.ONE_OF_TWO: "UncertainSubNormal",
    Fault.APART: "BadSensorFailure",
    Fault.OTHER_WRONG: "UncertainSubNormal",
    Fault.VIRTUAL_WRONG: "BadSensorFailure",
    Fault.SECOND_NODE: "BadConfigurationError",
    Fault.DRIVE_SILENT: STALE,
    Fault.DRIVE_GONE: STALE,
    Fault.STALE: STALE,
    Fault.DISABLED: "BadDeviceFailure",
    Fault.SHORT: "UncertainSubNormal",
    Fault.STATE_DAMAGED: "BadConfigurationError",
    Fault.PARAMETERS_DAMAGED: "BadConfigurationError",
    Fault.NOT_SAVED: "BadDeviceFailure",
    Fault.INTERNAL: "BadDeviceFailure",
}
"""OPC UA's status code for each fault: Bad where the fault makes the position invalid, Uncertain elsewhere."""


@dataclass(frozen=True)
class Said:
    """What an encoder reports at one time."""

    quality: str  # name of OPC UA's status code for the numbers
    # position, velocity, std, bound: [m], [m/s], [m], [m]; NaN while the quality is bad
    position: float
    velocity: float
    std: float
    bound: float
    status: int  # number of the sensor's status; 255 before the first sample
    text: str  # what is wrong in words, or the position
    referenced: bool  # whether a reference has come since power-up


def said_by(encoder: Encoder) -> Said:
    """What an encoder reports now."""
    found = quality_of(encoder.faults, valid=encoder.valid)
    numbers = encoder.position, encoder.velocity, encoder.std, encoder.bound
    if found.startswith(_BAD):
        numbers = (math.nan,) * 4
    return Said(found, *numbers, encoder.status, encoder.said, encoder.referenced)


def quality_of(faults: frozenset[Fault], *, valid: bool) -> str:
    """The worst quality of some faults.

    Args:
        valid: whether the position is; where it is not, the quality is bad whatever the faults.

    Example:
        >>> quality_of(frozenset(), valid=True), quality_of(frozenset({Fault.GAP}), valid=True)
        ('Good', 'UncertainSensorNotAccurate')
        >>> quality_of(frozenset({Fault.GAP, Fault.REFUSED}), valid=False), quality_of(frozenset(), valid=False)
        ('BadSensorFailure', 'BadWaitingForInitialData')
    """
    found = [QUALITY[fault] for fault in Fault if fault in faults]
    bad = [one for one in found if one.startswith(_BAD)]
    if bad or not valid:
        return bad[0] if bad else WAITING
    return found[0] if found else GOOD


_OLD = 1.0  # s without a word of the encoder, after which nothing is good any more
_START = 30.0  # s, in which a server has to have begun
_END = 2.0  # s, in which it has to have ended


class OpcuaError(RamsightError):
    """A server that cannot be started."""


def address_of(words: str) -> tuple[str, int]:
    """Host and port as an option has them.

    Raises:
        DescriptionError: they cannot be read.

    Example:
        >>> address_of("127.0.0.1:4840"), address_of("4840")
        (('127.0.0.1', 4840), ('127.0.0.1', 4840))
    """
    host, _, port = words.strip().rpartition(":")
    if not (port.isascii() and port.isdigit() and len(port) <= 5) or not 0 < int(port) < 1 << 16:
        raise DescriptionError("is no address", key="--opcua", value=words, allowed="a port, or '127.0.0.1:4840'")
    return host or "127.0.0.1", int(port)


class OpcuaServer:
    """Offers what an encoder reports, in a process of its own, so that no client delays a frame.

    Anybody who reaches the address may read and nobody may write; there is no encryption, so it stays on this machine
    (127.0.0.1) unless another address is asked for. So many clients at a time, and so many new ones a second, are
    taken (`ramsight.deploy.opcua_process`).

    Args:
        encoder: whose position it is.
        name: of its object, the unit's.
        host, port: where it is found.
        old: for how long a word of the encoder is good [s].

    Raises:
        OpcuaError: it cannot be started there.
        MissingPackageError: asyncua is not installed.
    """

    def __init__(
        self, encoder: Encoder, name: str, host: str = "127.0.0.1", port: int = 4840, *, old: float = _OLD
    ) -> None:
        check_extra("opcua")
        what = Serving(host, port, name, WAITING, STALE, old)
        self.endpoint, self._encoder = what.endpoint, encoder
        self._newest: dict[str, Any] | None = None
        self._next, self._is_waited_for = -1.0, False
        context = multiprocessing.get_context("spawn")
        self._pipe, self._others = context.Pipe()
        self._process = context.Process(target=serve, args=(self._others, what), name="opcua", daemon=True)

    def __enter__(self) -> Self:
        self._process.start()
        self._others.close()
        said: object = "it does not start"
        with suppress(EOFError, OSError):
            if self._pipe.poll(_START):
                said = self._pipe.recv()
        if said != READY:
            self._end()
            raise OpcuaError(f"{self.endpoint}: cannot be served: {said}")
        self._send()
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._end()

    def take(self) -> None:
        """Take over what the encoder reports, if it is time to; called by the loop that runs the encoder."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + PERIOD
            self._newest = asdict(said_by(self._encoder))
            if self._process.pid is not None:
                self._send()

    def _send(self) -> None:
        """Hand on the newest word, unless the last one still waits to be taken: a pipe that is full is waited for."""
        with suppress(EOFError, OSError):  # a server that has ended: the encoder goes on without
            if self._is_waited_for and self._pipe.poll():
                self._pipe.recv()
                self._is_waited_for = False
            if self._newest is not None and not self._is_waited_for:
                self._pipe.send(self._newest)
                self._newest, self._is_waited_for = None, True

    def _end(self) -> None:
        self._pipe.close()
        self._process.join(_END)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
