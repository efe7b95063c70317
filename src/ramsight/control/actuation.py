"""What a motor speed does with a cylinder: velocity, leakage, valves that have to open, and what is on its way."""

from __future__ import annotations

import math

from ramsight.control.trajectory import Limits
from ramsight.control.tuning import Tuning
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.errors import DescriptionError
from ramsight.plant.holding import Holding
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit

_COLDEST, _HOTTEST = 243.15, 383.15  # K; a thermometer that says anything else is not believed
_WARMING = 5.0  # s, over which its noise is averaged
_REACHABLE = 0.9  # share of the highest motor speed for the trajectory; the rest is for corrections


class Actuation:
    """A unit's motor speeds, by its data sheet and what its sensor has learned.

    Args:
        unit: the unit's parts, as its data sheet has them.
        limits: what the cylinder may do.
        tuning: how it is driven.
        period: of the samples [s].
        response: how the drive is declared to follow.

    Raises:
        DescriptionError: the motor cannot turn as fast as a valve of the unit asks for before it opens.

    Attributes:
        holding: what holds the load at rest.
        leak: factor of the leakage that the sensor has learned [1].
        displacement: the same of the displacement [1].
        lag: by which reports are behind commands [s].
        slope: largest change of the motor's speed that is asked for [rad/s2].
    """

    def __init__(
        self,
        unit: HydraulicUnit,
        limits: Limits,
        tuning: Tuning,
        period: float = 0.02,
        response: DriveResponse = IDEAL,
    ) -> None:
        self.unit, self.limits, self.tuning, self.period = unit, limits, tuning, period
        self.lag, self.slope = response.lag, min(tuning.motor_acceleration, response.acceleration)
        self.holding = Holding(unit)
        self.leak = self.displacement = 1.0
        self._temperature = T40
        self._asked, self._leaks = (math.nan, math.nan), 0.0
        self._least_lowering = self._opens()

    def _opens(self) -> float:
        """Motor speed with which lowering begins [rad/s]."""
        least = self.tuning.opening * self.holding.opening_speed
        if least > self.unit.max_speed:
            names = ", ".join(valve.name for valve in self.holding.valves)
            raise DescriptionError(
                f"{names} would have to be opened by a motor that turns {least:g} rad/s, to lower a load",
                key=f"units.{self.unit.name}.drive.max_speed",
                value=f"{self.unit.max_speed:g} rad/s",
            )
        return least

    def warm(self, reported: float) -> None:
        """Take a thermometer's next value [K]."""
        if _COLDEST < reported < _HOTTEST:
            self._temperature += self.period / (_WARMING + self.period) * (reported - self._temperature)

    def leakage(self, load: float) -> float:
        """Motor speed that leakage takes under a load [N], positive where it turns the way that lifts [rad/s]."""
        if (load, self._temperature) != self._asked:  # asked for several times in a sample
            self._asked, self._leaks = (load, self._temperature), self.holding.leakage(load, self._temperature)
        return self.leak * self._leaks

    def turning(self, velocity: float, load: float) -> float:
        """The motor's speed [rad/s] for a velocity [m/s] under a load [N], what leaks included."""
        per_radian = self.holding.travel_per_radian(load) * self.displacement
        return velocity / per_radian + self.unit.lift_sign * self.leakage(load)

    def moving(self, pace: float, direction: float, load: float) -> float:
        """The same for a velocity `pace` [m/s], 0 or more, in a direction, as fast as valves have to open."""
        lift = self.unit.lift_sign
        if not self.holding.valves:
            return self.turning(direction * pace, load)
        if direction * lift > 0.0:
            return self.turning(lift * max(pace, self.tuning.creeping * self.displacement), load)
        return -lift * max(-lift * self.turning(direction * pace, load), self._least_lowering)

    def to_stand(self, speed: float, direction: float, load: float) -> float:
        """Way that the rod goes on [m] while the motor ramps down from a speed, and half a sample before that.

        The rod goes by what the motor turns beyond the leakage. It stands when nothing is left of that, or, lowered
        behind a valve, when the valve shuts: a motor that stands already.

        Args:
            speed: commanded now [rad/s].
            direction: of the rod, +1 or -1.
            load: [N].
        """
        leaks = -direction * self.unit.lift_sign * self.leakage(load)
        rate = max(direction * speed + leaks, 0.0)
        last = max(leaks, 0.0) if self.holding.valves and direction * self.unit.lift_sign < 0.0 else 0.0
        ramp = max(rate**2 - last**2, 0.0) / (2.0 * self.slope)
        return (ramp + 0.5 * rate * self.period) * self.holding.travel_per_radian(load) * self.displacement

    def reachable(self, load: float) -> float:
        """The velocity that the motor can give to a trajectory, with some left for corrections [m/s]."""
        most = _REACHABLE * self.unit.max_speed - abs(self.leakage(load))
        return max(most * self.holding.travel_per_radian(load), self.tuning.creeping)

    def on_its_way(self, angle: float, speed: float, load: float) -> float:
        """Way that the rod will go by an angle that was commanded and is in no report yet [m], less what leaks.

        Args:
            angle: [rad].
            speed: commanded now [rad/s].
            load: [N].
        """
        if self.lag == 0.0 or angle == 0.0:
            return 0.0
        time = abs(angle) / max(abs(speed), abs(angle) / self.lag)
        leaks = self.unit.lift_sign * self.leakage(load) * time if math.isfinite(load) else 0.0
        return (angle - leaks) * self.holding.travel_per_radian(load) * self.displacement
