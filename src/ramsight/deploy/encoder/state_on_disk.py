"""The sensor's state on the disk, by a thread if the disk is slow; what fails is remembered and can be tried again."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ramsight.errors import OutputError
from ramsight.output import HeldError
from ramsight.sensor.persistence import StateError, StateFile, forgotten
from ramsight.sensor.virtual_sensor import IS_REFERENCED, VirtualSensor

_PATIENCE = 10.0  # s for a disk when the encoder ends


class Persistence:
    """Saves a sensor's state in a `StateFile`.

    Args:
        path: the file; made by `resume`.
        sensor: whose state it is; this one is resumed, and a copy of it is saved from.
        aside: whether saving is left to a thread, so that a slow disk delays nothing.

    The file is this encoder's alone until `close`, or until its program ends.

    Raises:
        HeldError: another program has the file.

    Attributes:
        failure: why the last save failed; empty if it did not.
    """

    def __init__(self, path: str | Path, sensor: VirtualSensor, *, aside: bool = False, instance: str = "") -> None:
        self.path, self._sensor = Path(path), sensor
        self._copy = replace(sensor)
        self._file = StateFile(path, self._copy, instance)
        try:
            self._file.hold()
        except HeldError:
            raise
        except OutputError:  # a disk that fails now is tried again with every save, and then that says so
            pass
        self._lock, self._changed = threading.Lock(), threading.Condition()
        self._wanted: dict[str, float] | None = None
        self._waiting: dict[str, float] | None = None
        self._closed, self._busy, self.failure = False, False, ""
        self._thread = threading.Thread(target=self._work, name="persistence", daemon=True) if aside else None
        if self._thread is not None:
            self._thread.start()

    def resume(self) -> bool:
        """Give the sensor the stored state, or make the file; False if it was damaged, or is another machine's."""
        try:
            there = self.path.stat().st_size > 0
        except OSError:
            there = False
        try:
            resumed = self._file.resume()
            self._sensor.state = self._copy.state
        except StateError:
            self._sensor.start(None)
            return False
        if not there:
            self.save_now(self._sensor.state)
        return not resumed.older and (resumed.found or not there)

    def take_position_off(self) -> bool:
        """Mark the position in the file as unknown; on return it is, or False is returned."""
        return self.save_now(forgotten(self._sensor, self._sensor.state))

    @property
    def is_pending(self) -> bool:
        """Whether something is being saved, or waits for it."""
        with self._changed:
            return self._waiting is not None or self._busy

    def save(self, state: Mapping[str, float]) -> None:
        """Save a state soon; only the newest of several that wait is saved."""
        self._wanted = dict(state)
        if self._thread is None:
            self._save(self._wanted)
            return
        with self._changed:
            self._waiting = self._wanted
            self._changed.notify()

    def save_now(self, state: Mapping[str, float]) -> bool:
        """Save a state; on return it is on the disk, or False is returned."""
        self._wanted = dict(state)
        with self._changed:
            self._waiting = None
        return self._save(self._wanted)

    def retry(self) -> None:
        """Save again what could not be saved."""
        if self._wanted is not None:
            self.save(self._wanted)

    def close(self) -> None:
        """Save what waits, and end the thread; a disk that does not answer is not waited for any longer."""
        if self._thread is not None:
            with self._changed:
                self._closed = True
                self._changed.notify()
            self._thread.join(_PATIENCE)
            if self._thread.is_alive():  # it may still write
                return
        self._file.release()

    def _save(self, state: dict[str, float]) -> bool:
        with self._lock:
            if state is not self._wanted:  # a newer one has come meanwhile, and is saved already or soon
                return True
            try:
                self._copy.state = state
                self._file.save()
            except (OutputError, StateError, ValueError) as error:
                self.failure = str(error)
                if state[IS_REFERENCED] < 0.5:  # the piston moves: a position on the disk must not come back
                    self._file.discard()
                return False
        self.failure = ""
        return True

    def _work(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                while self._waiting is None and not self._closed:
                    self._changed.wait()
                state, self._waiting = self._waiting, None
                if state is None:
                    return
                self._busy = True
            self._save(state)
