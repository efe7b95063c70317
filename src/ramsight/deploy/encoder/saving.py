"""The sensor's state on a disk, saved so that a power loss never makes a wrong position look right.

While the piston moves the file states what the sensor has learned, but not where the piston is; that is saved once it
has come to rest. A thread saves where the disk is slow; what fails is remembered and tried again.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ramsight.errors import OutputError
from ramsight.output import HeldError
from ramsight.sensor.persistence import StateError, StateFile, forgotten
from ramsight.sensor.thresholds import CREEP_VELOCITY, MOTOR_TURNS, REST_TIME, SAVE_CHANGE, START_STD
from ramsight.sensor.virtual_sensor import IS_REFERENCED, Estimate, VirtualSensor, impossible

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


_LATE = 2.0  # s after which a save that is not done counts as failed
_AGAIN = 1.0  # s from one attempt to the next


class Saving:
    """Watches for motion and rest, and for saves that fail.

    Args:
        file: where it is saved; None saves nothing, and the position is unknown at first.

    Attributes:
        damaged: the stored state was damaged, or another machine's.
        failed: the state cannot be saved, or not in time.
        moving: the piston moves, or has rested for less than a second.
    """

    def __init__(self, sensor: VirtualSensor, file: Persistence | None) -> None:
        self._sensor, self._file = sensor, file
        self._rested = self._asked = self._again = math.inf
        self._position = self._std = math.nan  # m, after the last sample
        self._saved, self._saved_std = math.nan, math.nan  # m, that the file has at rest
        self.moving = self._begun = False
        if file is None:
            sensor.start(None)
        self.damaged = file is not None and not file.resume()
        self.failed = bool(self.failure)

    @property
    def failure(self) -> str:
        """Why it fails, in words; empty if it does not."""
        return "" if self._file is None else self._file.failure

    @property
    def due(self) -> float:
        """When `check` has something to do next [s]."""
        if self.failed and not math.isfinite(self._again):
            return -math.inf
        late = math.inf if self.failed else self._asked + _LATE
        return min(self._again, late, math.inf if self.moving else self._rested)

    def begin(self) -> None:
        """Before the first sample: take a resumed position off the disk, or forget it if that cannot be done.

        From here on a disk that fails cannot bring it back. Until the drive reports the file stays as it is.
        """
        if self._begun or self._file is None:
            return
        self._begun = True
        if not self.damaged and not self._file.take_position_off():
            self._sensor.state = forgotten(self._sensor, self._sensor.state)

    def watch(self, now: float, motor_speed: float, estimate: Estimate) -> bool:
        """See whether the piston moves [s, rad/s]; whether a motion begins."""
        is_known = math.isfinite(estimate.position)
        self._position, self._std = estimate.position if is_known else math.inf, estimate.position_std
        begins = False
        if not abs(motor_speed) < MOTOR_TURNS or not abs(estimate.velocity) <= CREEP_VELOCITY:
            begins, self.moving = not self.moving, True
            self._rested = now + REST_TIME
        elif now >= self._rested or not math.isfinite(self._rested):
            self.moving = False
            if abs(self._position - self._saved) > SAVE_CHANGE or self._std > self._saved_std + START_STD:
                self._rested = now
        return begins

    def rests(self, now: float) -> bool:
        """Whether the piston has just been at rest for long enough to be saved [s]; true once."""
        if self.moving or now < self._rested:
            return False
        self._rested = math.inf
        return True

    def save(self, now: float) -> None:
        """Save the state soon [s]."""
        if self._file is not None:
            if not math.isfinite(self._asked):
                self._asked = now
            self._saved, self._saved_std = self._position, self._std
            self._file.save(self._state())

    def save_now(self) -> bool:
        """Save it before anything else happens; whether that went well."""
        return self._file is None or self._file.save_now(self._state())

    def forget(self) -> bool:
        """Let sensor and file forget the position; whether the file has."""
        without = self._sensor.state = forgotten(self._sensor, self._sensor.state)
        return self._file is None or self._file.save_now(without)

    def check(self, now: float) -> bool:
        """See whether saves go well, and try again what did not [s]; whether that has changed."""
        if self._file is None:
            return False
        pending = self._file.is_pending
        late = pending and now >= self._asked + _LATE
        if not pending:
            self._asked = math.inf
        before, self.failed = self.failed, bool(self._file.failure) or late
        if not self.failed:
            self._again = math.inf
        elif not math.isfinite(self._again):
            self._again = now + _AGAIN
        elif now >= self._again:
            self._again = now + _AGAIN
            if not pending:
                self._file.retry()
                self.failed = bool(self._file.failure)
        return self.failed != before

    def close(self) -> None:
        """Save what is still waiting, and close."""
        if self._file is not None:
            self._file.close()

    def _state(self) -> dict[str, float]:
        """The sensor's state; while the piston moves, without where it is."""
        state = self._sensor.state
        return forgotten(self._sensor, state) if self.moving or impossible(self._sensor, state) else state
