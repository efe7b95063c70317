"""Records added to a store: of logs that are found in folders, and of a machine while it runs.

What a store has is not followed again, so work that was stopped goes on where it stopped. Each record is on the disk
before the next one is written.

A sensor of its own, which begins with what the description says, follows each hour of a machine that runs beside the
one that says where the piston is: so the records are as independent as those of logs. It works in pieces, in a thread
that nobody waits for.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.calibration.sensors import sensor_for
from ramsight.errors import DescriptionError, RamsightError, one_line
from ramsight.histories.from_log import Counted, Following, file_digest, record_of, summary
from ramsight.histories.history_store import HistoryStore
from ramsight.histories.record import MachineKey, Record, description_digest
from ramsight.log_formats import FORMATS
from ramsight.machine.description import Machine
from ramsight.optional import needs
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Signal, Signals
from ramsight.study.commissioning.kept_values import described_as
from ramsight.system import processors

SUFFIXES = tuple(suffix for one in FORMATS for suffix in one.suffixes)
"""Of files that are taken for logs in a folder."""
_AHEAD = 3  # logs for each thread of a cluster: one that is followed, the others on their way


@dataclass(frozen=True)
class Added:
    """What became of logs."""

    records: tuple[Record, ...]  # of logs that were new
    known: tuple[Path, ...]  # files whose log has a record already
    refused: tuple[tuple[Path, str], ...]  # files that cannot be read, and why

    @property
    def text(self) -> str:
        """How many there are of each, in a line."""
        alien = sum(bool(one.mistake) for one in self.records)
        more = f" ({alien} of them cannot be this machine's)" if alien else ""
        return f"{len(self.records)} added{more}, {len(self.known)} known, {len(self.refused)} refused"


def logs_in(paths: Iterable[Path]) -> list[Path]:
    """The files among some paths, and those with a suffix of logs in the folders among them, by name.

    Raises:
        DescriptionError: one is not there, or there is no log at all.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += sorted(one for one in path.rglob("*") if one.is_file() and one.name.lower().endswith(SUFFIXES))
        elif path.is_file():
            found.append(path)
        else:
            raise DescriptionError("there is no such file or folder", key="log", value=str(path))
    if not found:
        raise DescriptionError("no log is there", key="log", allowed=f"files that end in {', '.join(SUFFIXES)}")
    return list(dict.fromkeys(found))


def add_logs(
    store: HistoryStore,
    place: int,
    following: Following,
    files: Sequence[Path],
    *,
    at: float | None = None,
    client: Any = None,
    threads: int | None = None,
    advance: Callable[[float], object] = lambda files: None,
    say: Callable[[str], object] = lambda text: None,
) -> Added:
    """Follow the logs that the store does not have, and keep their records.

    Args:
        at: when the log begins, of a single one [s since 1970].
    """
    records, known, refused = [], [], []

    def fresh() -> Iterator[tuple[Path, str]]:
        for path in files:
            try:
                digest = file_digest(path)
            except RamsightError as error:
                refused.append((path, str(error)))
                advance(1.0)
                continue
            if store.has_file(place, digest):
                known.append(path)
                advance(1.0)
            else:
                yield path, digest

    for path, outcome in _followed(following, fresh(), at, client, threads or processors()):
        if isinstance(outcome, str):
            refused.append((path, outcome))
        elif store.add(place, outcome):
            records.append(outcome)
            say(summary(outcome))
        else:
            known.append(path)
        advance(1.0)
    return Added(tuple(records), tuple(known), tuple(refused))


def _followed(
    following: Following, logs: Iterator[tuple[Path, str]], at: float | None, client: Any, threads: int
) -> Iterator[tuple[Path, Record | str]]:
    """Each log's record, or why there is none, as they are done."""
    if client is not None:
        yield from _on_cluster(client, following, logs, at)
        return
    with ThreadPoolExecutor(threads) as pool:
        while batch := list(islice(logs, _AHEAD * threads)):
            running = {pool.submit(outcome_of, following, path, at, digest): path for path, digest in batch}
            for done in as_completed(running):
                yield running[done], done.result()


def outcome_of(following: Following, path: Path, at: float | None, digest: str) -> Record | str:
    """The record of a log, or why there is none."""
    try:
        return following.record(path, at, digest)
    except RamsightError as error:
        return str(error)
    except OSError as error:
        return one_line(f"{path}: {error.strerror or error}")


def _on_cluster(
    client: Any, following: Following, logs: Iterator[tuple[Path, str]], at: float | None
) -> Iterator[tuple[Path, Record | str]]:
    """The same on Dask: workers read the files, so they have to reach them under the same names."""
    completed = needs("distributed", "cluster").as_completed
    order = (following.unit, following.channel_map)
    paths: dict[str, Path] = {}

    def submit(path: Path, digest: str) -> Any:
        future = client.submit(_task, order, path.absolute(), at, digest, pure=False)
        paths[future.key] = path
        return future

    threads = max(sum(client.nthreads().values()), 1)
    running = completed([submit(*one) for one in islice(logs, _AHEAD * threads)], loop=client.loop)
    for future in running:
        yield paths.pop(future.key), future.result()
        for one in islice(logs, 1):
            running.add(submit(*one))


def _task(order: tuple[Any, Any], path: Path, at: float | None, digest: str) -> Record | str:
    """What a worker of a cluster does."""
    return outcome_of(Following(*order), path, at, digest)


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
