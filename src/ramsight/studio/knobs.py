"""What a visitor sets on a machine that runs: knobs that are turned, faults and sensors that are switched."""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.units import FREEZING

FAULTS = {
    "temperature": "temperature lost", "torque": "torque frozen", "speed": "speed reads 3 % too much",
    "power": "power cut", "obstacle": "an obstacle, 20 mm further out",
}  # fmt: skip
"""Faults that can be switched on, and what they are."""
LIE = 0.02  # m, by which a faulty limit switch is off
WRONG_START, UNSURE = 0.03, 0.02
"""By how much a wrong start is off, and the standard deviation that it is given with [m]."""
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
    """What can be turned while the machine runs; the machine's own state is hidden from the sensors."""

    load: float = 0.5  # of a unit alone over its largest named one; of a mechanism its payload over the rated one [1]
    oil_temperature: float = 313.15  # that the oil is brought to [K]; from then on losses warm it and the air cools it
    ambient: float = 293.15  # temperature of the air [K]
    # leak, displacement, stiffness, friction: factors on the data sheet, as `AsBuilt` has them [1]
    leak: float = 1.0
    displacement: float = 1.0
    stiffness: float = 1.0
    friction: float = 1.0
    torque_gain: float = 1.0  # reported torque over the true one [1]
    # by which the motor's magnets are warmer than for what the drive knows its torque constant [K]
    magnets: float = 0.0
    torque_step: float = 0.0  # in which the torque is reported [N m]
    report_delay: float = 0.0  # of speed and torque [s]
    temperature_offset: float = 0.0  # by which the thermometer reads too much [K]


@dataclass(frozen=True)
class Knob:
    """A slider of the page."""

    name: str  # as `Knobs` has it
    words: str
    unit: str
    # least, most, first, step: its range, the value that it begins with and what a key moves it by, in that unit
    least: float
    most: float
    first: float
    step: float
    factor: float = 1.0
    offset: float = 0.0

    def si(self, shown: float) -> float:
        """What a value of the slider is in SI."""
        return shown * self.factor + self.offset

    def shown(self, si: float) -> float:
        """What the slider shows of a value in SI.

        Example:
            >>> KNOBS[1].name, KNOBS[1].shown(313.15)
            ('oil_temperature', 40.0)
        """
        return round((si - self.offset) / self.factor, 4)


KNOBS = (
    Knob("load", "load", "% of the largest", 0.0, 120.0, 50.0, 5.0, factor=0.01),
    Knob("oil_temperature", "oil temperature, brought to", "°C", 0.0, 80.0, 40.0, 1.0, offset=FREEZING),
    Knob("ambient", "ambient temperature", "°C", -20.0, 50.0, 20.0, 1.0, offset=FREEZING),
    Knob("leak", "leakage", "× data sheet", 0.5, 3.0, 1.0, 0.05),
    Knob("displacement", "displacement", "× data sheet", 0.97, 1.03, 1.0, 0.001),
    Knob("stiffness", "stiffness", "× data sheet", 0.5, 1.5, 1.0, 0.05),
    Knob("friction", "friction", "× data sheet", 0.5, 3.0, 1.0, 0.05),
    Knob("torque_gain", "reported torque", "× true", 0.9, 1.1, 1.0, 0.01),
    Knob("magnets", "motor temperature rise", "K", 0.0, 100.0, 0.0, 5.0),
    Knob("torque_step", "resolution of the torque", "N m", 0.0, 2.0, 0.0, 0.1),
    Knob("report_delay", "delay of the report", "ms", 0.0, 100.0, 0.0, 10.0, factor=1e-3),
    Knob("temperature_offset", "thermometer offset", "K", -10.0, 10.0, 0.0, 0.5),
)
"""What can be turned."""
