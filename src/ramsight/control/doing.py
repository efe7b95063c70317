"""What all activities of a cylinder have in common: they are entered, stepped, and left for another."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from ramsight.control.activity import Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.judging import Trust
from ramsight.control.watch import Verdict
from ramsight.sensor.virtual_sensor import Estimate


@dataclass(frozen=True)
class Now:
    """What an activity decides by.

    Attributes:
        estimate: the sensor's, its position with the way that was commanded and is in no report yet.
        trust: what may be done with it.
        verdict: what the drive is doing.
        speed: commanded until now [rad/s].
    """

    estimate: Estimate
    trust: Trust
    verdict: Verdict
    speed: float


@dataclass(frozen=True)
class Wish:
    """What an activity asks for.

    Attributes:
        speed: of the motor [rad/s]; the control keeps it within acceleration and largest speed.
        event: that ends the activity, if any.
        reason: of a failure.
    """

    speed: float
    event: Event | None = None
    reason: str = ""


class Doing(ABC):
    """An activity with its own state.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
    """

    activity: ClassVar[Activity]
    #: whether it asks for no position, because it looks for one or only keeps a load up
    without_position = False
    #: whether a motor may stand at its torque limit
    may_stall = False

    def __init__(self, by: Actuation) -> None:
        self.by = by

    def enter(self, now: Now) -> None:
        """Begin, at the first sample; most activities begin with what they were made of."""
        return

    @abstractmethod
    def step(self, now: Now) -> Wish:
        """At every sample, the first included."""

    def leave(self, event: Event) -> Doing:
        """What an event of its own leads to.

        Raises:
            ValueError: the activity has no such event.
        """
        raise ValueError(f"{self.activity.value}: nothing follows {event.value!r}")

    def slope(self) -> float:
        """Largest change of the motor's speed [rad/s2]."""
        return self.by.slope
