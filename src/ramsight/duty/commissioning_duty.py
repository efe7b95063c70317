"""Commissioning: what is done with a unit so that its leakage, its ends and its data sheet can be judged from a log.

The leak test is the one that `ramsight.calibration.leakage` evaluates: the motor turns slowly the lifting way, and the
piston stands. Where a valve holds the load it is the valve that keeps the oil away, below the speed that lifts; where
the pump holds the load the piston has to stand on its upper stop.
"""

from __future__ import annotations

from collections.abc import Sequence

from ramsight.duty.lift_lower import RAMP, SPEED, above_lowered_end
from ramsight.duty.plan import Plan
from ramsight.duty.profile import Duty
from ramsight.plant.holding import Holding
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

LOADS = (0.2, 0.4, 0.6)
"""Loads of a unit that nobody has named, as shares of the load at relief pressure."""

_LEAK_TEST = (0.4, 0.65)  # speeds, over the one that begins to lift; two, so that a slow lift is distinguished
_ON_STOP = (0.3, 0.7)  # pressures on a stop, as shares of what is left between the load's and the relief valve's
_TURNING = 8.0  # s of slow turning: some seconds until the manifold has its pressure, and some to average
_ON_STOP_TURNING = 30.0  # s; there the whole chamber has to get it
_SLOW_RAMP = 0.1  # s
_START = 0.15  # share of the stroke above the lowered end
_HALF_STROKE = 2.5  # s that half a stroke takes at least, so that short cylinders make moves that last
_SLOWER = 0.5  # of the second speed over the first
_SURELY_LIFTS = 2.2  # times what leaks at relief pressure; twice that is still looked at as a leak test
_BETWEEN = (0.3, 0.7)  # share of the stroke that loads are moved between
_REST = 2.0  # s
_VISITS = 3


def usual_speed(unit: HydraulicUnit) -> float:
    """The motor speed of usual moves [rad/s]: 1500 rpm, less where the cylinder is short or the motor slow."""
    longest = 0.5 * unit.cylinder.stroke / _HALF_STROKE / unit.travel_per_radian
    return float(min(SPEED, unit.max_speed, longest))


def usual_loads(unit: HydraulicUnit) -> tuple[float, ...]:
    """Loads [N] that a unit can lift, where nobody has named any."""
    return tuple(share * limits_of(unit).load for share in LOADS)


def leak_test_duty(
    unit: HydraulicUnit,
    loads: Sequence[float],
    oil_temperature: float,
    *,
    motor_speed: float | None = None,
    start_position: float | None = None,
) -> Duty:
    """A lift, slow turning at two speeds against what keeps the piston from moving, and back down.

    Args:
        unit: the unit, as it really is.
        loads: [N], positive against lifting; the greatest is tested with, on a stop the least one.
        oil_temperature: [K].
        motor_speed: of the moves, a magnitude [rad/s]; by default `usual_speed`.
        start_position: [m]; by default 15 % of the stroke above the lowered end.
    """
    plan = _begun(unit, _tested(unit, loads), oil_temperature, start_position)
    _leak_test(plan, usual_speed(unit) if motor_speed is None else motor_speed)
    return plan.duty()


def commissioning(
    unit: HydraulicUnit,
    loads: Sequence[float],
    oil_temperature: float,
    *,
    motor_speed: float | None = None,
    start_position: float | None = None,
) -> Duty:
    """A leak test, three visits to the end stops, each load lifted and lowered, fast and slowly, and a last visit.

    Args:
        unit: the unit, as it really is.
        loads: [N], positive against lifting.
        oil_temperature: [K].
        motor_speed: of the moves, a magnitude [rad/s]; by default `usual_speed`.
        start_position: [m]; by default 15 % of the stroke above the lowered end.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> 300.0 < commissioning(boom, usual_loads(boom), 313.15).duration < 600.0
        True
    """
    speed = usual_speed(unit) if motor_speed is None else motor_speed
    plan = _begun(unit, _tested(unit, loads), oil_temperature, start_position)
    _leak_test(plan, speed)
    for number in range(_VISITS):
        plan.visit(raised=number % 2 == 1, speed=speed, ramp=RAMP)
        plan.rest(_REST)
    stroke = unit.cylinder.stroke
    # A lift under any load, and no leak test.
    least = _SURELY_LIFTS * float(Holding(unit).leakage(limits_of(unit).load, oil_temperature))
    for load in sorted(loads, reverse=True):
        plan.put_on(load)
        for pace in (speed, _SLOWER * speed):
            for share in reversed(_BETWEEN):
                plan.go(share * stroke, max(pace, least), ramp=RAMP)
                plan.rest(_REST)
    # What was learned since the last stop is worth the more the better the position is known in the end.
    plan.visit(raised=False, speed=speed, ramp=RAMP)
    plan.rest(_REST)
    return plan.duty()


def _begun(unit: HydraulicUnit, load: float, oil_temperature: float, start_position: float | None) -> Plan:
    start = above_lowered_end(unit, _START) if start_position is None else start_position
    plan = Plan(unit, load, oil_temperature, start)
    plan.rest(_REST)
    return plan


def leak_test_speeds(unit: HydraulicUnit, loads: Sequence[float], oil_temperature: float) -> tuple[float, ...]:
    """Motor speeds of a leak test, magnitudes [rad/s].

    Args:
        loads: that it can be tested under [N].
        oil_temperature: [K].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> [round(speed * 30.0 / 3.14159) for speed in leak_test_speeds(boom, [441e3], 313.15)]
        [85, 138]
    """
    holding, load = Holding(unit), _tested(unit, loads)
    if holding.stands:
        return tuple(share * holding.leakage(load, oil_temperature) for share in _LEAK_TEST)
    left = limits_of(unit).load - load
    return tuple(holding.leakage(load + share * left, oil_temperature) for share in _ON_STOP)


def _tested(unit: HydraulicUnit, loads: Sequence[float]) -> float:
    """The load that leaves most room for pressures: below its own against a valve, above it on a stop."""
    return max(loads) if Holding(unit).stands else min(loads)


def _leak_test(plan: Plan, speed: float) -> None:
    """Lift, turn slowly where the piston stands, and go back."""
    holding = Holding(plan.unit)
    before, stroke = plan.height, plan.unit.cylinder.stroke
    if holding.stands:
        plan.go(_BETWEEN[1] * stroke, speed, ramp=RAMP)
    else:
        plan.visit(raised=True, speed=speed, ramp=RAMP)
    for slow in leak_test_speeds(plan.unit, (plan.load,), plan.temperature):
        if holding.stands:
            plan.rest(_REST)
        plan.turn(slow, _TURNING if holding.stands else _ON_STOP_TURNING, ramp=_SLOW_RAMP)
        plan.height = plan.height if holding.stands else stroke
    plan.rest(_REST)
    plan.go(before, speed, ramp=RAMP)
    plan.rest(_REST)
