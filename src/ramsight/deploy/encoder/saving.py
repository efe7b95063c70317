"""When the encoder saves the sensor's state, so that a power loss never makes a wrong position look right.

While the piston moves the file states what the sensor has learned, but not where the piston is; that is saved once it
has come to rest.
"""

from __future__ import annotations

import math

from ramsight.deploy.encoder.state_on_disk import Persistence
from ramsight.sensor.persistence import forgotten
from ramsight.sensor.thresholds import CREEP_VELOCITY, MOTOR_TURNS, REST_TIME, SAVE_CHANGE, START_STD
from ramsight.sensor.virtual_sensor import Estimate, VirtualSensor, impossible

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
