"""The position as the bus sees it: in steps, no faster than a piston, and a fault value while it is unknown."""

from __future__ import annotations

import math

_FASTEST = 1.1  # share of the velocity at the highest motor speed, as in the sensor


class Published:
    """Follows the sensor's position.

    Corrections that a stop or a switch brings are gone through at the fastest velocity of the piston, so that a
    controller never sees a jump; a preset, and the first valid position after none, are there at once.

    Args:
        max_velocity: of the piston [m/s].
    """

    def __init__(self, max_velocity: float) -> None:
        self._fastest = _FASTEST * max_velocity
        self._wanted = self._position = math.nan
        self._at = -math.inf
        self.valid = False

    @property
    def position(self) -> float:
        """The last valid position [m]; NaN if there never was one."""
        return self._position

    @property
    def behind(self) -> float:
        """How far it is from the sensor's position [m]."""
        gap = abs(self._wanted - self._position)
        return 0.0 if math.isnan(gap) else gap

    def set(self, now: float, position: float, valid: bool, *, at_once: bool = False) -> None:
        """The sensor's position [m] from now [s] on, and whether it is valid."""
        if valid:
            self._wanted = position
            if self.valid and not at_once:
                self.follow(now)
            else:
                self._position = position
            self._at = now
        self.valid = valid

    def follow(self, now: float) -> None:
        """Go on towards the sensor's position; what the piston may have gone since the last sample is at once."""
        if not self.valid or self._position == self._wanted:
            return
        reach = self._fastest * max(now - self._at, 0.0)
        self._position += min(max(self._wanted - self._position, -reach), reach)
        self._at = max(self._at, now)
