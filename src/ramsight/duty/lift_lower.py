"""The paper's work cycle: lift at constant speed, stop, lower at constant speed, stop."""

from __future__ import annotations

from collections.abc import Sequence

from ramsight.duty.plan import Plan
from ramsight.duty.profile import Duty
from ramsight.plant.unit import HydraulicUnit

RAMP = 0.8  # s, [D] the ramp that explains the paper's errors
SPEED = 157.07963267948966  # rad/s = 1500 rpm, near the pumps' nominal 1450 rpm
_BEFORE, _REST = 1.0, 1.5  # s
_LONGEST_HOLD = 6.4  # s; makes the boom's cycle 20 s long
_SHARE_OF_STROKE = 0.45  # how far a move may go without leakage
START = 0.2  # share of the stroke above the lowered end


def lift_lower(
    unit: HydraulicUnit,
    load: float | Sequence[float],
    oil_temperature: float,
    *,
    motor_speed: float = SPEED,
    ramp: float = RAMP,
    hold: float | None = None,
    start_position: float | None = None,
    cycles: int = 1,
    visits: int = 0,
) -> Duty:
    """One or more lift-lower cycles, under one load or under several in turn.

    Args:
        unit: the unit that works.
        load: [N], positive against lifting; of several the cycles are made under each, and it changes at rest.
        oil_temperature: [K].
        motor_speed: magnitude of the constant speed [rad/s].
        ramp: time of each speed ramp [s].
        hold: time at constant speed [s]; by default what moves the rod by at most 45 % of its stroke, 6.4 s at most.
        start_position: [m]; by default a fifth of the stroke above the lowered end.
        cycles: how many under each load.
        visits: so many end stops are visited first, the lower one and the upper one in turn.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> [round(lift_lower(boom, load, 313.15).duration, 1) for load in (441e3, [441e3, 129e3])]
        [20.0, 40.6]
    """
    stroke = unit.cylinder.stroke
    loads = [float(load)] if isinstance(load, int | float) else [float(one) for one in load]
    start = above_lowered_end(unit, START) if start_position is None else start_position
    if hold is None:
        hold = min(_LONGEST_HOLD, max(0.0, _SHARE_OF_STROKE * stroke / (motor_speed * unit.travel_per_radian) - ramp))
    plan = Plan(unit, loads[0], oil_temperature, start)
    first = plan.height
    plan.rest(_BEFORE)
    for number in range(visits):
        plan.visit(raised=number % 2 == 1, speed=motor_speed, ramp=ramp)
        plan.rest(_REST)
    if visits:
        plan.go(first, motor_speed, ramp=ramp)
        plan.rest(_REST)
    for one in loads:
        plan.put_on(one)
        for _ in range(cycles):
            for way in (1.0, -1.0):
                plan.turn(way * motor_speed, hold, ramp=ramp)
                plan.rest(_REST)
    return plan.duty()


def above_lowered_end(unit: HydraulicUnit, share: float) -> float:
    """A position [m], as a share of the stroke above the lowered end."""
    stroke = unit.cylinder.stroke
    return share * stroke if unit.lift_sign > 0.0 else (1.0 - share) * stroke
