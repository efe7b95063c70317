"""Records of a machine that runs: one of each hour of it, and one when it is switched off.

A sensor of its own, which begins with what the description says, follows each hour beside the one that says where the
piston is: so the records are as independent as those of logs. It works in pieces, in a thread that nobody waits for.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.calibration.sensors import sensor_for
from ramsight.errors import RamsightError
from ramsight.histories.from_log import Counted, record_of
from ramsight.histories.history_store import HistoryStore
from ramsight.histories.record import MachineKey, Record, description_digest
from ramsight.machine.description import Machine
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Signal, Signals
from ramsight.study.commissioning.kept_values import described_as

EVERY = 3600.0
"""Time of a record [s]: what is lost at most where a program is killed."""
_PAUSE = 5.0  # s between two pieces
_NAMES = ("time", "motor_speed", "motor_torque", "oil_temperature")


class Session:
    """What is followed of a machine that runs.

    Args:
        keep: is passed each record; one that it cannot keep is passed again later.
        every: time of a record [s].
        clock: seconds since 1970.

    Attributes:
        failure: why the last record could not be kept; empty if it could.
    """

    def __init__(
        self,
        unit: HydraulicUnit,
        keep: Callable[[Record], object],
        *,
        every: float = EVERY,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._unit, self._keep, self._every, self._clock = unit, keep, every, clock
        self._sensor = sensor_for(unit, "kalman")
        self._rows: deque[tuple[float, ...]] = deque()
        self._waiting: list[Record] = []
        self.failure = ""
        self._begin()

    def _begin(self) -> None:
        self._sensor.start(None)
        self._counted, self._begun = Counted(self._unit), self._clock()

    def take(self, at: float, motor_speed: float, motor_torque: float, oil_temperature: float) -> None:
        """Take a sample; it is worked on later.

        Args:
            at: by a clock that runs only forward [s].
            motor_speed: [rad/s].
            motor_torque: [N m].
            oil_temperature: [K]; NaN if unknown.
        """
        self._rows.append((at, motor_speed, motor_torque, oil_temperature))

    def work(self) -> None:
        """Follow what has been taken, and keep a record if its time is full."""
        rows = [self._rows.popleft() for _ in range(len(self._rows))]
        if rows:
            columns = zip(_NAMES, np.array(rows).T, strict=True)
            piece = Signals({name: Signal(np.ascontiguousarray(values)) for name, values in columns})
            self._counted.take(piece, self._sensor.followed(piece))
        if self._counted.passed.seconds >= self._every:
            self._finish()
        self._keep_all()

    def close(self) -> None:
        """Keep the record of what has been followed since the last one."""
        self._every = 0.0
        self.work()

    def _finish(self) -> None:
        if self._counted.samples:
            made = record_of(self._unit, self._sensor, self._counted, "encoder", (self._begun, "clock"))
            self._waiting.append(made)
        self._begin()

    def _keep_all(self) -> None:
        self.failure = ""
        while self._waiting:
            try:
                self._keep(self._waiting[0])
            except RamsightError as error:
                self.failure = str(error)
                return
            del self._waiting[0]


def session_for(store: str | Path, machine: Machine, name: str, unit: HydraulicUnit, serial: str) -> Session:
    """A session whose records go into a store.

    Args:
        store: as `HistoryStore` takes it; made if it is not there.
        serial: serial number of the machine; empty where there is one of its kind.

    Raises:
        HistoryError: it is no store, or the machine's records rest on another description.
    """
    key, digest = MachineKey(machine.name, name, serial), description_digest(machine, name)
    with HistoryStore(store, makes=True) as kept:
        place = kept.described(key, digest, described_as(machine))

    def keep(record: Record) -> None:
        with HistoryStore(store) as kept:
            kept.add(place, record)

    return Session(unit, keep)


def taking(session: Session | None) -> Callable[[Any], None]:
    """What passes each sample of an encoder on to a session; None for none."""
    if session is None:
        return lambda sample: None
    return lambda one: session.take(one.time, one.motor_speed, one.motor_torque, one.oil_temperature)


@contextmanager
def recorded(session: Session | None, pause: float = _PAUSE) -> Iterator[None]:
    """Within, a session works in a thread of its own; it is closed at the end.

    Args:
        session: None for none.
        pause: between two pieces [s].
    """
    if session is None:
        yield
        return
    over = threading.Event()

    def work() -> None:
        while not over.wait(pause):
            session.work()

    thread = threading.Thread(target=work, name="history", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        session.close()
