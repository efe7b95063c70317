"""How a cylinder is driven; what follows from the unit is worked out."""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.control import thresholds
from ramsight.control.trajectory import Limits
from ramsight.plant.unit import HydraulicUnit


@dataclass(frozen=True)
class Tuning:
    """How a cylinder is driven; reasons of the defaults stand in `ramsight.control.thresholds`.

    Args:
        gain: velocity per error of the position [1/s].
        creeping: least velocity of a lift behind a valve [m/s].
        opening: least motor speed of lowering, over the one at which the valve begins to open [1].
        settling: time at rest after which the target is looked at again [s].
        tolerance: error there from which the move is repeated [m].
        tries: largest number of such repeats.
        dead_band: error at rest that a pump which holds the load does not correct [m].
        motor_acceleration: largest that is asked for [rad/s2].
        slowed: share of the speed while sensor or drive are uncertain [1].
        homing_share: velocity near and on the way to an unknown end stop, over the largest [1].
        contact_time: standstill after which a rod counts as on the stop [s].
        pressing: time for which the cylinder then presses on the stop [s].
        pressing_share: load with which it presses where the pump holds the load, over that at relief pressure [1].
        leak_test_time: of a leak test [s].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> f"{1e3 * Tuning.following_error_limit(Limits.of(boom)):.0f} mm, {Tuning.leak_test_share(boom):.3f}"
        '42 mm, 0.584'
    """

    gain: float = thresholds.POSITION_GAIN
    creeping: float = thresholds.CREEPING_SPEED
    opening: float = thresholds.OPENING_RATIO
    settling: float = thresholds.SETTLE_TIME
    tolerance: float = thresholds.TARGET_TOLERANCE
    tries: int = int(thresholds.LANDING_TRIES)
    dead_band: float = thresholds.DEAD_BAND
    motor_acceleration: float = thresholds.MOTOR_ACCELERATION
    slowed: float = thresholds.UNCERTAIN_SPEED_SHARE
    homing_share: float = thresholds.HOMING_SPEED_SHARE
    contact_time: float = thresholds.CONTACT_TIME
    pressing: float = thresholds.PRESSING_TIME
    pressing_share: float = thresholds.PRESSING_SHARE
    leak_test_time: float = thresholds.LEAK_TEST_TIME

    @staticmethod
    def following_error_limit(limits: Limits) -> float:
        """Largest distance between trajectory and estimate [m]: a sensor's first error, and `FOLLOWING_TIME` of way."""
        return limits.landing_zone + thresholds.FOLLOWING_TIME * limits.speed

    @staticmethod
    def leak_test_share(unit: HydraulicUnit) -> float:
        """Motor speed of a leak test over the one at which the rod would begin to lift [1]."""
        return max(1.0 - thresholds.LEAK_TEST_SIGMAS * unit.assumptions.machine.leak, thresholds.LEAK_TEST_LEAST)
