"""A sensor's state over a power loss: two slots in one file, each with a checksum, written in turn.

A save overwrites the older slot, so that the newer one is whole whatever happens meanwhile. Both slots exist from the
first save on, and their numbers follow each other. A position is resumed only where that is so: a slot that is torn,
erased or missing may have been the newer one, and then the piston may have moved since the other. Such a file gives
what the sensor has learned of the machine, and no position.

A file belongs to one cylinder. Its identity has an instance beside the machine's numbers, because two cylinders of a
machine may have the same, and a random number that is made with the file, so that slots of two files are no pair. One
program at a time may use it.
"""

from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from ramsight.errors import OutputError, RamsightError
from ramsight.output import Exclusive, HeldError, flush_folder
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import REST_TIME
from ramsight.sensor.virtual_sensor import IS_REFERENCED, REFERENCED_NOW, VARIANCE, VirtualSensor, impossible

FORMAT = 4
STARTED, CLOCKED, VELOCITY = "intake.started", "intake.clocked", "report.velocity"
"""States that a resumed sensor begins again with, and the one that shows how far a moving rod may have gone."""
_MAGIC = b"ramsight state\n\0"
_HEAD = struct.Struct("<16sHxxI32sQ16s")  # magic, format, number of values, identity, number of the save, file
_RANDOM = 16  # bytes
_DIGEST = 32


@dataclass(frozen=True)
class Slot:
    """A slot that is whole."""

    number: int  # of the save
    made: bytes  # random number of the file
    state: dict[str, float]  # of the sensor


Slots = dict[int, Slot]


class StateError(RamsightError):
    """A state file that cannot be used; the text says why and what to do."""


@dataclass(frozen=True)
class Resumed:
    """What became of a state file."""

    found: bool  # whether there was a state to resume
    older: bool  # whether a slot is damaged or missing, so that the position of the other one could not be trusted


class StateFile:
    """One sensor's state in a file.

    What is saved is valid at the next `resume`. A program that follows a running machine has to save again, or
    call `forget_position`, before the piston moves; the encoder does (docs/explanation/power-loss.md).

    Args:
        path: the file; made by the first `save`, or by `hold`.
        instance: which of several machines or cylinders with the same numbers it is, for example the unit's name.

    Raises:
        StateError: the sensor finds no position by itself, so there is nothing worth saving.

    Example:
        >>> import tempfile
        >>> from ramsight import machine
        >>> from ramsight.plant.ddh import build_ddh
        >>> from ramsight.sensor.kalman import kalman
        >>> boom = kalman(build_ddh("boom", machine.load_machine("mining-loader").unit("boom")))
        >>> boom.start(0.25)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     StateFile(f"{folder}/boom.state", boom).save()
        ...     boom.start(None)
        ...     StateFile(f"{folder}/boom.state", boom).resume().found, boom.state["position"]
        (True, 0.25)
    """

    def __init__(self, path: str | Path, sensor: VirtualSensor, instance: str = "") -> None:
        if IS_REFERENCED not in sensor.recursion.state:
            raise StateError(f"the {sensor.kind} sensor has no state worth saving; the kalman sensor has")
        self.path, self._sensor = Path(path), sensor
        self._names = sensor.recursion.state
        self._values = struct.Struct(f"<{len(self._names)}d")
        self._slot = _HEAD.size + self._values.size + _DIGEST
        identity = "\n".join((sensor.kind, *self._names, *sensor.recursion.parameters))
        which = hashlib.sha256(instance.encode()).digest()
        self._identity = hashlib.sha256(identity.encode() + sensor.parameters.tobytes() + which).digest()
        self._made = b""
        self._exclusive, self._holds = Exclusive(self.path), False

    def hold(self) -> None:
        """Have the file alone until `release`, or until this program ends, however it does.

        Raises:
            HeldError: another program has it.
            OutputError: the file cannot be made or locked; `save` tries that again.
        """
        self._holds = True
        self._exclusive.take()

    def release(self) -> None:
        """Let other programs have the file."""
        self._holds = False
        self._exclusive.release()

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Have the file while something is done with it."""
        self._exclusive.take()
        try:
            yield
        finally:
            if not self._holds:
                self._exclusive.release()

    def save(self) -> None:
        """Save the sensor's state; on return it is on the disk.

        Raises:
            OutputError: the file cannot be written, or another program has it.
        """
        self._save(self._sensor.state)

    def forget_position(self) -> None:
        """Save what the sensor has learned, but not where the piston is; on return that is on the disk.

        Raises:
            OutputError: the file cannot be written, or another program has it.
        """
        self._save(forgotten(self._sensor, self._sensor.state))

    def discard(self) -> None:
        """Remove a file that cannot be written, if that at least is possible: its content may no longer hold.

        What another program has stays as it is.
        """
        try:
            self._exclusive.take()
        except HeldError:
            return
        except OutputError:
            pass
        with suppress(OSError):
            self.path.unlink()
            flush_folder(self.path.parent)
        self._exclusive.release()

    def resume(self) -> Resumed:
        """Give the sensor the newest state; without one it is not referenced.

        A position that was saved while the piston moved is resumed as less certain. If one of the two slots is
        damaged or missing, the other gives what was learned of the machine, and the sensor is not referenced.

        Raises:
            StateError: the file was written by a newer version, or for another sensor, machine or instance.
            HeldError: another program has it.
        """
        content = self._content()
        slots = self._whole(content)
        self._sensor.start(None)
        if not slots:
            self._reject(content)
            return Resumed(found=False, older=False)
        newest = max(slots.values(), key=lambda slot: slot.number)
        older = not _complete(slots)
        self._made = newest.made
        self._sensor.state = self._awake(newest.state, older)
        return Resumed(found=True, older=older)

    def _save(self, state: Mapping[str, float]) -> None:
        """Write a state into the older slot; where a slot is missing, damaged or of another file, into that one."""
        with self._alone():
            self._write(state)

    def _write(self, state: Mapping[str, float]) -> None:
        slots = self._whole(self._bytes())
        if not self._made:
            newest = max(slots.values(), key=lambda slot: slot.number, default=None)
            self._made = os.urandom(_RANDOM) if newest is None else newest.made
        slots = {place: slot for place, slot in slots.items() if slot.made == self._made}
        number = max((slot.number for slot in slots.values()), default=0)
        writes: list[tuple[int, Mapping[str, float]]] = [(place, state) for place in (0, 1) if place not in slots]
        if not writes:
            writes = [(min(slots, key=lambda place: slots[place].number), state)]
        if len(writes) == 2:  # the first of all: until both slots are there, neither has a position
            writes[0] = (0, forgotten(self._sensor, state))
        try:
            with open(os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644), "r+b") as file:
                for place, values in writes:
                    number += 1
                    file.seek(place * self._slot)
                    file.write(self._packed(number, values))
                    file.flush()
                    os.fsync(file.fileno())
        except OSError as error:
            raise OutputError(f"{self.path}: the state cannot be saved: {error.strerror or error}") from error

    def _awake(self, state: dict[str, float], older: bool) -> dict[str, float]:
        """A saved state as it is after a while of which nothing is known; time begins again."""
        std = state[VARIANCE] ** 0.5 + abs(state[VELOCITY]) * 2.0 * REST_TIME
        state |= {STARTED: 0.0, CLOCKED: 0.0, VARIANCE: std**2, REFERENCED_NOW: 0.0}
        return forgotten(self._sensor, state) if older else state

    def _packed(self, number: int, state: Mapping[str, float]) -> bytes:
        values = self._values.pack(*(state[name] for name in self._names))
        head = _HEAD.pack(_MAGIC, FORMAT, len(self._names), self._identity, number, self._made)
        return head + values + hashlib.sha256(head + values).digest()

    def _content(self) -> bytes:
        """The file as nobody writes it meanwhile; one that is not there is not made."""
        if self._exclusive.is_held or not self.path.exists():
            return self._bytes()
        try:
            with self._alone():
                return self._bytes()
        except HeldError:
            raise
        except OutputError:  # a file that cannot be locked cannot be read either, and that says why
            return self._bytes()

    def _bytes(self) -> bytes:
        try:
            return self.path.read_bytes()
        except FileNotFoundError:
            return b""
        except OSError as error:
            raise StateError(f"{self.path}: {error.strerror or error}") from error

    def _at(self, content: bytes, place: int) -> bytes:
        return content[place * self._slot : (place + 1) * self._slot]

    def _whole(self, content: bytes) -> Slots:
        """The slots that are whole, of this sensor and machine, and possible; by their place."""
        found = {}
        for place in (0, 1):
            slot = self._at(content, place)
            if len(slot) < self._slot or hashlib.sha256(slot[:-_DIGEST]).digest() != slot[-_DIGEST:]:
                continue
            magic, version, count, identity, number, made = _HEAD.unpack_from(slot)
            if (magic, version, count, identity) != (_MAGIC, FORMAT, len(self._names), self._identity):
                continue
            state = dict(zip(self._names, self._values.unpack_from(slot, _HEAD.size), strict=True))
            if not impossible(self._sensor, state):
                found[place] = Slot(number, made, state)
        return found

    def _reject(self, content: bytes) -> None:
        """Raise if a file without a usable slot is somebody else's rather than damaged."""
        for start in (0, self._slot):
            slot = content[start:]
            if len(slot) < _HEAD.size or not slot.startswith(_MAGIC):
                continue
            _, version, count, identity, *_ = _HEAD.unpack_from(slot)
            if version > FORMAT:
                raise StateError(
                    f"{self.path}: format {version} is newer than this ramsight knows ({FORMAT}); update it"
                )
            if version < FORMAT:  # it had no instance: it says of no cylinder that it is this one's
                continue
            end = _HEAD.size + 8 * count
            whole = hashlib.sha256(slot[:end]).digest() == slot[end : end + _DIGEST]
            if whole and (count != len(self._names) or identity != self._identity):
                raise StateError(
                    f"{self.path}: the state of another sensor or machine, or of another unit or node of it; "
                    "delete it, or give another file"
                )


def _complete(slots: Slots) -> bool:
    """Whether both slots are there, of one file, and one was saved just after the other."""
    return len(slots) == 2 and slots[0].made == slots[1].made and abs(slots[0].number - slots[1].number) == 1


def forgotten(sensor: VirtualSensor, state: Mapping[str, float]) -> dict[str, float]:
    """A state that knows the machine as before, but not where the piston is."""
    fresh = dict(zip(sensor.recursion.state, sensor.initial.tolist(), strict=True))
    known = {**fresh, **{name: state[name] for name in sensor.learned}}
    return fresh if impossible(sensor, known) else known


def said(resumed: Resumed, path: Path) -> str:
    """What to report of a resumption."""
    if not resumed.found:
        return f"{path}: no state to resume; {Status.NOT_REFERENCED.text} until a reference comes"
    if resumed.older:
        return f"{path}: the newest state is damaged; what was learned of the machine is resumed, its position is not"
    return f"{path}: resumed"
