"""The numbers of a control, each with its reason; what follows from the unit is worked out."""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.control.trajectory import Limits
from ramsight.plant.unit import HydraulicUnit

# A pump that leaks less than it is taken for reaches the load's pressure sooner: 2.6 standard deviations, one leak test
# in two hundred.
_SURELY_BELOW, _LEAST_LEAK_TEST = 2.6, 0.2


@dataclass(frozen=True)
class Tuning:
    """How a cylinder is driven.

    Args:
        gain: velocity per error of the position [1/s]. A sensor's steps of 0.1 mm then ask for 0.15 mm/s, which no
            motor shows; 0.2 s of latency would bear 2.6 /s with a phase margin of 60 degrees.
        creeping: least velocity of a lift behind a valve [m/s]. Slower, the pump's leakage, known to a sixth, could be
            more than what is asked for, and the valve would stay shut.
        opening: least motor speed of lowering, over the one at which the valve begins to open [1]. It is open at twice
            that speed; a quarter more for the speed's error.
        settling: time at rest after which the target is looked at again [s]: two swings of a full chamber, at 5 Hz.
        renewing: error there from which it is sought anew [m]: above the sensor's noise, a quarter of the 2 mm that
            are asked of a machine as on its data sheet.
        tries: so many times; each leaves a fraction of the error, and a sensor that wanders is not followed for ever.
        dead_band: error at rest that a pump which holds the load leaves alone [m]: the sensor's noise at rest.
        motor_acceleration: largest that is asked for [rad/s2]: to the highest speed in the 0.7 s of the paper's ramps,
            with a quarter of the torque that the loader's motors have left at relief pressure.
        slowed: share of the speed while sensor or drive are not sure [1]: the way to standstill is a quarter.
        homing_share: velocity near and on the way to an unknown end stop, over the largest [1]: the way that a piston
            goes on after the contact is a tenth.
        surely: how long a rod stands until it is taken to be on the stop [s]: a chamber at 5 Hz has swung out.
        pressing: how long the cylinder then presses on the stop [s]: until the sensor has taken a contact for one.
        pressing_share: how hard where the pump holds the load, over the load at relief pressure [1]: more than
            friction (a twentieth), less than what opens a relief valve.
        leak_test_time: how long a leak test takes [s]: 400 torques, whose noise of 0.5 N m leaves 0.03 N m.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build_unit
        >>> boom = build_unit("boom", machine.load("mining-loader").unit("boom"))
        >>> f"{1e3 * Tuning.following(Limits.of(boom)):.0f} mm, {Tuning.leak_test_share(boom):.3f}"
        '42 mm, 0.584'
    """

    gain: float = 1.5
    creeping: float = 1e-3
    opening: float = 2.5
    settling: float = 0.4
    renewing: float = 0.5e-3
    tries: int = 5
    dead_band: float = 0.2e-3
    motor_acceleration: float = 600.0
    slowed: float = 0.5
    homing_share: float = 0.3
    surely: float = 0.5
    pressing: float = 3.0
    pressing_share: float = 0.25
    leak_test_time: float = 8.0

    @staticmethod
    def following(limits: Limits) -> float:
        """Largest distance between trajectory and estimate [m]: a sensor's first error, and half a second of way."""
        return limits.landing_zone + 0.5 * limits.speed

    @staticmethod
    def leak_test_share(unit: HydraulicUnit) -> float:
        """Motor speed of a leak test over the one at which the rod would begin to lift [1]."""
        return max(1.0 - _SURELY_BELOW * unit.assumptions.machine.leak, _LEAST_LEAK_TEST)
