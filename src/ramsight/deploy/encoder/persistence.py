"""The sensor's state on the disk, so written that a power loss never makes a wrong position look right.

While the piston moves the file says what the sensor has learned, but not where the piston is; that is written once it
has come to rest.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ramsight.errors import OutputError
from ramsight.sensor.persistence import StateError, StateFile
from ramsight.sensor.virtual_sensor import VirtualSensor


class Keeper:
    """Keeps a sensor's state in a `StateFile`.

    Args:
        path: the file; made by the first `keep`.
        sensor: whose state it is; this one is resumed, and a copy of it is saved from.
        aside: whether saving is left to a thread, so that a slow disk delays nothing.
    """

    def __init__(self, path: str | Path, sensor: VirtualSensor, *, aside: bool = False) -> None:
        self.path, self._sensor = Path(path), sensor
        self._copy = replace(sensor)
        self._file = StateFile(path, self._copy)
        self._lock, self._changed = threading.Lock(), threading.Condition()
        self._waiting: dict[str, float] | None = None
        self._closed, self.failure = False, ""
        self._thread = threading.Thread(target=self._work, name="keeper", daemon=True) if aside else None
        if self._thread is not None:
            self._thread.start()

    def resume(self) -> bool:
        """Give the sensor the stored state; False if it was damaged, or is another machine's."""
        self._sensor.start(None)
        try:
            resumed = StateFile(self.path, self._sensor).resume()
        except StateError:
            self._sensor.start(None)
            return False
        there = self.path.exists() and self.path.stat().st_size > 0
        return not resumed.older and (resumed.found or not there)

    def keep(self, state: Mapping[str, float]) -> None:
        """Save a state soon; only the newest of several that wait is saved."""
        if self._thread is None:
            self._save(dict(state))
            return
        with self._changed:
            self._waiting = dict(state)
            self._changed.notify()

    def keep_now(self, state: Mapping[str, float]) -> bool:
        """Save a state; on return it is on the disk, or False is returned."""
        with self._changed:
            self._waiting = None
        return self._save(dict(state))

    def close(self) -> None:
        """Save what waits, and end the thread."""
        if self._thread is not None:
            with self._changed:
                self._closed = True
                self._changed.notify()
            self._thread.join()

    def _save(self, state: dict[str, float]) -> bool:
        with self._lock:
            self._copy.state = state
            try:
                self._file.save()
            except OutputError as error:
                self.failure = str(error)
                return False
        return True

    def _work(self) -> None:
        while True:
            with self._changed:
                while self._waiting is None and not self._closed:
                    self._changed.wait()
                state, self._waiting = self._waiting, None
                if state is None:
                    return
            self._save(state)
