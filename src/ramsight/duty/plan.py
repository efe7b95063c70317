"""A duty move after move, as an operator works who watches the rod: each move ends about where it should."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ramsight.duty.profile import Duty, Profile, constant
from ramsight.errors import DescriptionError
from ramsight.plant.directional import DirectionalValve
from ramsight.plant.holding import Holding
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import RPM

LOAD_RAMP = 0.4  # s in which a load is put on
BEYOND = (
    0.1  # share of the stroke by which the command of a visit goes beyond the stop: what planning errs by, and more
)
_STILL = 0.6  # s of rest before and after a load is put on
_LIFTS = 1.2  # speed of a lift, at least, over the one that only makes up for what leaks


class Plan:
    """Moves, rests and loads, one after the other.

    The heights are estimates: what the pumps move less what leaks under the load. Oil that is compressed is left out.

    Args:
        unit: the unit that works, as it really is.
        load: at first [N], positive against lifting.
        oil_temperature: [K].
        start_position: of the piston [m].

    Attributes:
        time: when the plan ends so far [s].
        height: of the rod above the lowered end [m], about.
        load: on the rods now [N].
        temperature: of the oil [K].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> plan = Plan(build(machine.load_machine("mining-loader").unit("boom"), "boom"), 200e3, 313.15, 0.1)
        >>> plan.rest(1.0)
        >>> plan.go(0.5, 100.0, ramp=0.5)
        >>> round(plan.height, 3), round(plan.duty().duration, 1)
        (0.5, 34.4)
    """

    def __init__(self, unit: HydraulicUnit, load: float, oil_temperature: float, start_position: float) -> None:
        self.unit, self.load, self.time = unit, load, 0.0
        self.height = start_position if unit.lift_sign > 0.0 else unit.cylinder.stroke - start_position
        self._start, self.temperature, self._holding = start_position, oil_temperature, Holding(unit)
        self._speeds, self._loads = [(0.0, 0.0)], [(0.0, load)]

    @property
    def leakage(self) -> float:
        """Motor speed that only makes up for what leaks under the load, positive where it lifts [rad/s]."""
        return float(self._holding.leakage(self.load, self.temperature))

    def rest(self, duration: float) -> None:
        """Let the motor stand for a time [s]; where the pump holds the load it sinks."""
        self._corner(duration, 0.0)
        if not self._holding.stands:
            self._moved(-self.leakage * duration)

    def put_on(self, load: float) -> None:
        """Put another load [N] on at rest; the same load takes no time."""
        if load == self.load:
            return
        self.rest(_STILL)
        self._loads += [(self.time, self.load), (self.time + LOAD_RAMP, load)]
        self.load = load
        self.rest(LOAD_RAMP + _STILL)

    def turn(self, speed: float, hold: float, *, ramp: float) -> None:
        """Turn the motor.

        Args:
            speed: [rad/s], positive lifts.
            hold: time at that speed [s].
            ramp: time of each speed ramp [s].
        """
        for span, level in ((ramp, speed), (hold, speed), (ramp, 0.0)):
            self._corner(span, level)
        moved = speed * (hold + ramp) - self.leakage * (hold + 2.0 * ramp)
        stands = self._holding.stands and speed > 0.0 and moved < 0.0
        self._moved(0.0 if stands else moved)

    def go(self, height: float, speed: float, *, ramp: float) -> None:
        """Bring the rod to a height.

        Args:
            height: above the lowered end [m].
            speed: of the motor, a magnitude [rad/s]; a short way is gone more slowly.
            ramp: time of each speed ramp [s].

        Raises:
            DescriptionError: all that the pumps deliver at this speed leaks away under the load.
        """
        angle = (height - self.height) / self._holding.travel_per_radian(self.load)
        leakage = self.leakage
        wanted = angle + 2.0 * leakage * ramp  # what the ramps have to turn if there is nothing between them
        signed = math.copysign(speed, wanted)
        if angle > 0.0 and speed < _LIFTS * leakage:
            raise DescriptionError(
                f"does not lift {self.load / 1e3:.4g} kN: the pumps leak as much as they deliver",
                key="speed",
                value=f"{speed / RPM:.4g} rpm",
                allowed=f"{_LIFTS * leakage / RPM:.4g} rpm and more",
            )
        if abs(wanted) <= speed * ramp:
            self.turn(wanted / ramp, 0.0, ramp=ramp)
        else:
            self.turn(signed, (wanted - signed * ramp) / (signed - leakage), ramp=ramp)

    def visit(self, *, raised: bool, speed: float, ramp: float) -> None:
        """Go to an end stop and press on it.

        Args:
            raised: to the upper end, else the lower one.
            speed: as `go`'s.
            ramp: as `go`'s.
        """
        stroke = self.unit.cylinder.stroke
        self.go((1.0 + BEYOND) * stroke if raised else -BEYOND * stroke, speed, ramp=ramp)
        self.height = stroke if raised else 0.0

    def duty(self) -> Duty:
        """The plan as a duty."""
        time, speed = zip(*self._speeds, strict=True)
        load_time, load = zip(*self._loads, strict=True)
        signed = [self.unit.lift_sign * value for value in speed]
        duty = Duty(Profile(time, signed), Profile(load_time, load), constant(self.temperature), self._start)
        return as_driven(self.unit, duty)

    def _corner(self, span: float, speed: float) -> None:
        if span > 0.0:
            self.time += span
            self._speeds.append((self.time, speed))

    def _moved(self, angle: float) -> None:
        self.height += angle * self._holding.travel_per_radian(self.load)


def as_driven(unit: HydraulicUnit, duty: Duty) -> Duty:
    """A duty as a unit's motor turns it: forward only where a directional valve is commanded."""
    for part in unit.parts():
        if isinstance(part, DirectionalValve) and part.name not in duty.commands:
            duty = one_way(duty, part.name)
    return duty


def one_way(duty: Duty, valve: str) -> Duty:
    """The same moves by a motor that only turns forward.

    Args:
        duty: whose motor speed changes its sign at rest only, positive extending.
        valve: the part that is commanded: 1 where the duty extends, -1 where it retracts, before each move.

    Raises:
        ValueError: the speed passes through zero between two corners.

    Example:
        >>> from ramsight.duty.profile import constant
        >>> speed = Profile([0, 1, 2, 3, 4, 5], [0, 0, 100, 0, 0, -50])
        >>> forward = one_way(Duty(speed, constant(0.0), constant(313.15), 0.1), "valve")
        >>> forward.motor_speed.value.tolist(), forward.commanded("valve", [0.0, 1.5, 4.5]).tolist()
        ([0.0, 0.0, 100.0, 0.0, 0.0, 50.0], [1.0, 1.0, -1.0])
    """
    time, value = duty.motor_speed.time, duty.motor_speed.value
    if np.any(value[1:] * value[:-1] < 0.0):
        raise ValueError("the speed changes its sign between two corners; put one at zero")
    way = np.sign(np.concatenate([value[1:] + value[:-1], value[-1:]]))
    known = np.flatnonzero(way)
    at, ways = time[known], way[known]
    changes = np.concatenate([[True], ways[1:] != ways[:-1]]) if len(known) else np.zeros(0, dtype=bool)
    at, ways = at[changes], ways[changes]
    if len(at):  # the first way holds from the beginning
        at[0] = min(float(at[0]), 0.0)
    commands = {valve: Profile(at, ways) if len(at) else Profile([0.0], [1.0])}
    return replace(duty, motor_speed=Profile(time, np.abs(value)), commands={**duty.commands, **commands})
