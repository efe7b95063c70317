"""What a visitor sets on a machine that runs: knobs that are turned, faults and sensors that are switched."""

from __future__ import annotations

from dataclasses import dataclass

FAULTS = {
    "temperature": "temperature lost",
    "torque": "torque frozen",
    "speed": "speed reads 3 % too much",
    "power": "power cut",
    "obstacle": "an obstacle, 20 mm further out",
}
"""Faults that can be switched on, and what they are."""
LIE = 0.02  # m, by which a faulty limit switch is off
SECOND = "second"
"""A real position sensor beside the virtual ones, where the page names sensors."""
SENSORS = ("kalman", "balance")
"""Sensors that are on at first."""
KINDS = {
    "kalman": "kalman, the self-calibrating sensor",
    "balance": "balance, dead reckoning by the data sheet",
    "unreferenced": "kalman without references",
    "table": "table (calibrated when it is first switched on)",
}
"""Sensors that can be on, and what they are."""


@dataclass(frozen=True)
class Knobs:
    """What can be turned while the machine runs; the machine's own state is hidden from the sensors.

    Attributes:
        load: of a unit alone over its largest named one; of a mechanism its payload over the rated one [1].
        oil_temperature: that the oil is brought to [K]; from then on losses warm it and the air cools it.
        ambient: temperature of the air [K].
        leak, displacement, stiffness, friction: factors on the data sheet, as `AsBuilt` has them [1].
        torque_gain: reported torque over the true one [1].
        magnets: by which the motor's magnets are warmer than for what the drive knows its torque constant [K].
        torque_step: in which the torque is reported [N m].
        report_delay: of speed and torque [s].
        temperature_offset: by which the thermometer reads too much [K].
    """

    load: float = 0.5
    oil_temperature: float = 313.15
    ambient: float = 293.15
    leak: float = 1.0
    displacement: float = 1.0
    stiffness: float = 1.0
    friction: float = 1.0
    torque_gain: float = 1.0
    magnets: float = 0.0
    torque_step: float = 0.0
    report_delay: float = 0.0
    temperature_offset: float = 0.0
