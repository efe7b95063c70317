"""A sensor's state over a power loss: two slots in one file, each with a checksum, written in turn.

A save overwrites the older slot, so that whatever happens meanwhile leaves the newer one whole. A slot that was torn
is noticed by its checksum. The other one then gives what the sensor has learned of the machine, but not where the
piston is: it may have moved since.
"""

from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ramsight.errors import OutputError, RamsightError
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import IS_REFERENCED, VirtualSensor

FORMAT = 1
_MAGIC = b"ramsight state\n\0"
_HEAD = struct.Struct("<16sHxxI32sQ")  # magic, format, number of values, identity, sequence
_DIGEST = 32
SETTLING = 2.0  # s for which a piston may have gone on after its state was saved
WHERE = (
    *("position", "shown_position", IS_REFERENCED, "at_low", "at_top", "from_stop", "disputed", "slid"),
    *("covariance_00", "covariance_01", "covariance_02", "covariance_03"),
)
"""The states that say where the piston is; the others know the machine."""


class StateError(RamsightError):
    """A state file that cannot be used; the text says why and what to do."""


@dataclass(frozen=True)
class Resumed:
    """What became of a state file.

    Attributes:
        found: whether there was a state to resume.
        older: whether the newest state was damaged, so that an older one had to do.
    """

    found: bool
    older: bool


class StateFile:
    """Keeps one sensor's state in a file.

    Args:
        path: the file; made by the first `save`.
        sensor: whose state it keeps.

    Raises:
        StateError: the sensor finds no position by itself, so there is nothing worth keeping.

    Example:
        >>> import tempfile
        >>> from ramsight import machine
        >>> from ramsight.plant.ddh import build
        >>> from ramsight.sensor.kalman import kalman
        >>> boom = kalman(build("boom", machine.load("mining-loader").unit("boom")))
        >>> boom.start(0.25)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     StateFile(f"{folder}/boom.state", boom).save()
        ...     boom.start(None)
        ...     StateFile(f"{folder}/boom.state", boom).resume().found, boom.state["position"]
        (True, 0.25)
    """

    def __init__(self, path: str | Path, sensor: VirtualSensor) -> None:
        if IS_REFERENCED not in sensor.recursion.state:
            raise StateError(f"the {sensor.kind} sensor has no state worth keeping; the kalman sensor has")
        self.path, self._sensor = Path(path), sensor
        self._names = sensor.recursion.state
        self._values = struct.Struct(f"<{len(self._names)}d")
        self._slot = _HEAD.size + self._values.size + _DIGEST
        identity = "\n".join((sensor.kind, *self._names, *sensor.recursion.parameters))
        self._identity = hashlib.sha256(identity.encode() + sensor.parameters.tobytes()).digest()

    def save(self) -> None:
        """Keep the sensor's state; on return it is on the disk.

        Raises:
            OutputError: the file cannot be written.
        """
        slots = self._read()
        newest = max((sequence for sequence, _ in slots.values()), default=0)
        place = next((k for k in (0, 1) if k not in slots), None)
        if place is None:
            place = min(slots, key=lambda k: slots[k][0])
        content = self._packed(newest + 1, self._sensor.state)
        try:
            with open(os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644), "r+b") as file:
                file.seek(place * self._slot)
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise OutputError(f"{self.path}: {error.strerror or error}") from error

    def resume(self) -> Resumed:
        """Give the sensor the newest state that is whole; without one it is not referenced.

        A position that was saved while the piston moved is resumed as less certain. If the newest state is damaged
        the older one gives the machine's factors, and the sensor is not referenced.

        Raises:
            StateError: the file was written by a newer version, or for another sensor or machine.
        """
        slots = self._read(refuse=True)
        self._sensor.start(None)
        if not slots:
            return Resumed(found=False, older=False)
        newest = max(slots, key=lambda k: slots[k][0])
        older = len(slots) < 2 and self._torn()
        self._sensor.state = self._awake(slots[newest][1], older)
        return Resumed(found=True, older=older)

    def _awake(self, state: dict[str, float], older: bool) -> dict[str, float]:
        """A saved state as it is after a while of which nothing is known; time begins anew."""
        std = state["covariance_00"] ** 0.5 + abs(state["velocity"]) * SETTLING
        state |= {"started": 0.0, "clocked": 0.0, "covariance_00": std**2}
        return forgotten(self._sensor, state) if older else state

    def _packed(self, sequence: int, state: Mapping[str, float]) -> bytes:
        values = self._values.pack(*(state[name] for name in self._names))
        head = _HEAD.pack(_MAGIC, FORMAT, len(self._names), self._identity, sequence)
        return head + values + hashlib.sha256(head + values).digest()

    def _bytes(self) -> bytes:
        try:
            return self.path.read_bytes()
        except FileNotFoundError:
            return b""
        except OSError as error:
            raise StateError(f"{self.path}: {error.strerror or error}") from error

    def _torn(self) -> bool:
        """Whether there was a second slot that cannot be read."""
        return len(self._bytes()) > self._slot

    def _read(self, *, refuse: bool = False) -> dict[int, tuple[int, dict[str, float]]]:
        """The whole slots by their place: sequence and state."""
        content = self._bytes()
        found = {}
        for place in (0, 1):
            slot = content[place * self._slot : (place + 1) * self._slot]
            if len(slot) < _HEAD.size or not slot.startswith(_MAGIC):
                continue
            _, version, count, identity, sequence = _HEAD.unpack_from(slot)
            whole = len(slot) == self._slot and hashlib.sha256(slot[:-_DIGEST]).digest() == slot[-_DIGEST:]
            if refuse and version > FORMAT:
                raise StateError(
                    f"{self.path}: format {version} is newer than this ramsight knows ({FORMAT}); update it"
                )
            if refuse and (count != len(self._names) or (whole and identity != self._identity)):
                raise StateError(
                    f"{self.path}: the state of another sensor or machine; delete it, or give another file"
                )
            if whole and version == FORMAT and identity == self._identity:
                values = self._values.unpack_from(slot, _HEAD.size)
                found[place] = (sequence, dict(zip(self._names, values, strict=True)))
        return found


def forgotten(sensor: VirtualSensor, state: Mapping[str, float]) -> dict[str, float]:
    """A state that knows the machine as before, but not where the piston is."""
    fresh = dict(zip(sensor.recursion.state, sensor.initial.tolist(), strict=True))
    return {**state, **{name: fresh[name] for name in WHERE}}


def said(resumed: Resumed, path: Path) -> str:
    """What to tell of a resumption."""
    if not resumed.found:
        return f"{path}: no state to resume; {Status.NOT_REFERENCED.text} until a reference comes"
    if resumed.older:
        return f"{path}: the newest state is damaged; what was learned of the machine is resumed, its position is not"
    return f"{path}: resumed"
