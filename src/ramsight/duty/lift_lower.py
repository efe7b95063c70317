"""The paper's work cycle: lift at constant speed, stop, lower at constant speed, stop."""

from __future__ import annotations

from ramsight.duty.profile import Duty, constant, trapezoid_moves
from ramsight.plant.unit import HydraulicUnit

RAMP = 0.8  # s, [D] the ramp that explains the paper's errors
SPEED = 157.07963267948966  # rad/s = 1500 rpm, near the pumps' nominal 1450 rpm
_BEFORE, _REST = 1.0, 1.5  # s
_LONGEST_HOLD = 6.4  # s; makes the boom's cycle 20 s long
_SHARE_OF_STROKE = 0.45  # how far a move may go without leakage


def lift_lower(
    unit: HydraulicUnit,
    load: float,
    oil_temperature: float,
    *,
    motor_speed: float = SPEED,
    ramp: float = RAMP,
    hold: float | None = None,
    start_position: float | None = None,
    cycles: int = 1,
) -> Duty:
    """One or more lift-lower cycles.

    Args:
        unit: the unit that works.
        load: [N], positive against lifting.
        oil_temperature: [K].
        motor_speed: magnitude of the constant speed [rad/s].
        ramp: time of each speed ramp [s].
        hold: time at constant speed [s]; by default what moves the rod by at most 45 % of its stroke, 6.4 s at most.
        start_position: [m]; by default a fifth of the stroke above the lowered end.
        cycles: how many.
    """
    stroke = unit.cylinder.stroke
    if hold is None:
        hold = min(_LONGEST_HOLD, max(0.0, _SHARE_OF_STROKE * stroke / (motor_speed * unit.travel_per_radian) - ramp))
    up = motor_speed * unit.lift_sign
    lowered = 0.0 if unit.lift_sign > 0 else stroke
    start = lowered + 0.2 * stroke * unit.lift_sign if start_position is None else start_position
    moves = [(up, hold), (-up, hold)] * cycles
    speed = trapezoid_moves(moves, ramp=ramp, before=_BEFORE, rest=_REST)
    return Duty(speed, constant(load), constant(oil_temperature), start)
