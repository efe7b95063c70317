"""What a weighing is: a lift by the described machine, its mass by the scale, and why it may be bad; its machine."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ramsight.arrays import Array
from ramsight.plant.linked import LinkedMachine
from ramsight.tool.force_balance import Balance, balance
from ramsight.tool.load_chart import LoadChart, LoadStatus
from ramsight.tool.unit_tracks import Others, Rods


class Quality(Enum):
    """Whether a weighing is good; the text of a bad one says why."""

    GOOD = "good"
    TOO_SHORT = "too short: lift steadily for 3 s"
    TOO_FAST = "moved too fast: the speed changed; lift steadily for 3 s"
    DIGGING = "load changing: still digging"
    SPILLED = "spilled: the mass fell within the lift"
    UNKNOWN_POSITION = "position not known: give --start or --beside, or visit an end stop"


@dataclass(frozen=True)
class Moment:
    """Largest load moment of a motion over the rated one."""

    per_mass: float  # [1/kg]
    own_std: float  # deviation of the share that is this lift's own [1]
    covered: bool  # whether the load chart has all of its reach


@dataclass(frozen=True, eq=False)
class Plain:
    """A lift by the described machine alone."""

    time: float  # middle of its window [s]
    duration: float  # of steady motion [s]
    upwards: bool  # whether it lifts
    mass: float  # [kg]; NaN where there is none
    row: Array  # change of the mass by each term of the scale
    own_std: float  # deviation that is this lift's own: noise, positions, inclination, what no lift repeats [kg]
    others: Array  # positions of the other cylinders [m]
    quality: Quality  # whether it is good
    moment: Moment | None = None  # over the rated one; None without a load chart that has a place of it


@dataclass(frozen=True, eq=False)
class Weighing:
    """A weighing."""

    time: float  # middle of its window [s]
    duration: float  # of steady motion [s]
    cycle: int  # which it is of; a cycle begins with the first lift after lowering
    direction: str  # up, down, or both where up and down of one load are averaged
    # mass, std: [kg]; NaN where there is none
    mass: float
    std: float
    # low, high: the 95 % band [kg]
    low: float
    high: float
    quality: Quality  # whether it is good, or why it is not
    row: Array = field(repr=False)  # change of the mass by each term of the scale, which other weighings share
    own_std: float  # deviation that is its own [kg]
    # rated_share, rated_share_std: largest load moment of the motion over the rated one [1]; NaN where unknown
    rated_share: float = math.nan
    rated_share_std: float = math.nan
    exceeded_probability: float = math.nan  # that the rated load was exceeded [1]; NaN where unknown
    rated_status: LoadStatus = LoadStatus.UNKNOWN  # within, near, exceeded or unknown

    @property
    def is_good(self) -> bool:
        """Whether its mass may be used."""
        return self.quality is Quality.GOOD


@dataclass(frozen=True)
class Scene:
    """What a log is weighed with."""

    machine: LinkedMachine  # with its mechanism
    unit: str  # the unit that lifts
    others: Others  # the units beside it
    inclination: float = 0.0  # of the machine, its front up [rad]
    chart: LoadChart | None = None  # what may be lifted

    @property
    def rated(self) -> float:
        """Rated payload [kg]."""
        return self.machine.mechanism.rated_payload

    @property
    def other_strokes(self) -> Array:
        """Strokes of the other cylinders [m]."""
        return np.array([one.cylinder.stroke for one in self.machine.units if one.name != self.unit])

    @property
    def weight(self) -> float:
        """Force of the unit's rods without payload, in mid-stroke [N]."""
        middle = np.array([[0.5 * one.cylinder.stroke for one in self.machine.units]])
        still = Rods(middle, np.zeros_like(middle), np.zeros_like(middle))
        return float(self.balance(still, still.velocity).bodies[0])

    def balance(self, rods: Rods, acceleration: Array, tilt: float = 0.0) -> Balance:
        """The force balance, in the direction of the unit's load."""
        found = balance(
            self.machine.mechanism, self.unit, rods.position, rods.velocity, acceleration, self.inclination + tilt
        )
        sign = self.machine.unit(self.unit).lift_sign
        return Balance(*(sign * one for one in vars(found).values()))
