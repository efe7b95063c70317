"""The position as the bus sees it: in steps, no faster than a piston, and a fault value while it is unknown."""

from __future__ import annotations

import math

from ramsight.deploy.encoder.objects import LEAST, MOST
from ramsight.deploy.encoder.server import Node
from ramsight.sensor.virtual_sensor import Estimate

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


BY_6005, DOWNWARDS = 1 << 2, 1 << 3
"""Bits of 6000h: steps of 6005h rather than 6501h; extending counts down."""
_NO_SPEED = (1 << 15) - 1


def whole(value: float, low: int, high: int) -> int:
    """A number as a whole one within limits.

    Example:
        >>> whole(2.6, -5, 5), whole(1e9, -5, 5)
        (3, 5)
    """
    return round(min(max(value, low), high))


def counted(value: float, bits: int = 32) -> int:
    """A number as an unsigned one, whose largest stands for what is unknown.

    Example:
        >>> counted(2.6), counted(math.nan) == counted(1e12) == 0xFFFF_FFFF, counted(1e9, bits=16) == 0xFFFF
        (3, True, True)
    """
    unknown = (1 << bits) - 1
    return unknown if math.isnan(value) else whole(value, 0, unknown)


class Scale:
    """The node's values in steps.

    Args:
        stroke: [m].
    """

    def __init__(self, node: Node, stroke: float, published: Published) -> None:
        self._node, self._stroke, self._published = node, stroke, published

    def steps(self, length: float) -> int:
        """A length [m] in steps."""
        return whole(length / self._step, LEAST, MOST)

    def metres(self, steps: int) -> float:
        """The position [m] that a number of steps means."""
        return self._turned(steps * self._step)

    @property
    def position(self) -> int:
        """6004h: the position, or what 2000h wants while it is invalid."""
        position, valid = self._published.position, self._published.valid
        if not valid and (self._node.get(0x2000) or math.isnan(position)):
            return self._node.get(0x2001)
        return self.steps(self._turned(position))

    def elsewhere(self, position: float) -> int:
        """A position by another sensor [m] in steps; the largest number where it says none."""
        return self.steps(self._turned(position)) if math.isfinite(position) else MOST

    def is_plausible(self, steps: int) -> bool:
        """Whether a number of steps could be taken for a position, or for one not far from the stroke, in any steps."""
        finest = round(self._stroke / (self._node.get(0x6501) * 1e-9))
        return -finest <= steps <= 2 * finest

    def speed(self, estimate: Estimate | None) -> int:
        """6030h; 7FFFh, or 0 where the position is held, while it is invalid."""
        if estimate is None or not self._published.valid:
            return _NO_SPEED if self._node.get(0x2000) else 0
        velocity = -estimate.velocity if self._is_downwards else estimate.velocity
        return whole(velocity / (self._node.get(0x6005, 2) * 1e-5), -(1 << 15), _NO_SPEED)

    @property
    def area(self) -> int:
        """6400h: whether the position is outside the work area; 0 while it is invalid."""
        if not self._published.valid:
            return 0
        above = self.position > self._node.get(0x6402, 1)
        below = self.position < self._node.get(0x6401, 1)
        return (above or below) | above << 1 | below << 2

    @property
    def _step(self) -> float:
        fine = not self._node.get(0x6000) & BY_6005
        return (self._node.get(0x6501) if fine else self._node.get(0x6005, 1)) * 1e-9

    @property
    def _is_downwards(self) -> bool:
        return bool(self._node.get(0x6000) & DOWNWARDS)

    def _turned(self, position: float) -> float:
        return self._stroke - position if self._is_downwards else position
