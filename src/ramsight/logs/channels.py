"""What a column of a log means: each one declared once, for reading and for writing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.signals import Signal, Signals
from ramsight.units import FREEZING, RPM

TIME = "time_s"
_COMMAND = "_command"


@dataclass(frozen=True)
class Channel:
    """A column of a log and the variable that it becomes: ``value = factor * cell + offset``."""

    column: str  # name in the file's header, its unit last
    name: str  # name in the `Dataset`
    units: str  # SI unit in the `Dataset`
    long_name: str  # the quantity in words
    factor: float = 1.0
    offset: float = 0.0  # SI value of the file's zero

    def to_si(self, cells: Array) -> Array:
        """Values in SI units from the file's.

        Args:
            cells: values in the file's unit, any shape.

        Returns:
            Values in SI units, the same shape.

        Example:
            >>> MOTOR_SPEED.to_si(np.array([1500.0])).round(3).tolist()
            [157.08]
        """
        return cells * self.factor + self.offset

    def from_si(self, values: Array) -> Array:
        """Values in the file's unit from SI units, rounded to 1e-9 to shed what the conversion adds.

        Args:
            values: values in SI units, any shape.

        Returns:
            Values in the file's unit, the same shape.

        Example:
            >>> OIL_TEMPERATURE.from_si(np.array([312.95])).tolist()
            [39.8]
        """
        return np.asarray(np.round((values - self.offset) / self.factor, 9), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Further(Channel):
    """A column that a sensor takes where its machine declares it: the one place that says so.

    Channel maps, logs, inputs of the sensor and of what is exported, the simulated report, the table of faults and the
    advice of a commissioning follow from it.
    """

    declared: str  # table of the assumptions that declares it, where its `std` is above zero
    is_reading: bool = False  # whether it is an occasional reading of the position; else it has a law of its own
    advice: str = ""  # what to add to a machine, as a commissioning says it; "" for nothing


MOTOR_SPEED = Channel("motor_speed_rpm", "motor_speed", "rad/s", "motor speed, extension positive", factor=RPM)
MOTOR_TORQUE = Channel(
    "motor_torque_nm", "motor_torque", "N m", "motor torque, positive when driving towards extension"
)
OIL_TEMPERATURE = Channel("oil_temperature_c", "oil_temperature", "K", "oil temperature", offset=FREEZING)
REFERENCE = Channel("reference_m", "reference", "m", "position that a reference switch reports, NaN elsewhere")
POSITION = Channel("position_m", "position", "m", "piston position, 0 = fully retracted")
PRESSURE_A = Further("pressure_a_pa", "pressure_a", "Pa", "absolute pressure in chamber A", declared="pressure")
PRESSURE_B = Further("pressure_b_pa", "pressure_b", "Pa", "absolute pressure in chamber B", declared="pressure")
LINK_ANGLE = Further(
    "link_angle_deg",
    "link_angle",
    "rad",
    "angle of the body that the cylinder turns, against what it hangs on, 0 as drawn",
    factor=math.pi / 180.0,
    declared="link_angle",
    advice="an inclinometer on the body that the cylinder turns",
)
SHAFT_ANGLE = Further(
    "shaft_angle_deg",
    "shaft_angle",
    "rad",
    "angle that the drive's counter says of the shaft, without jumps, growing where speed is positive",
    factor=math.pi / 180.0,
    declared="shaft",
)
DC_POWER = Further(
    "dc_power_w",
    "dc_power",
    "W",
    "power that the drive takes from its DC link, negative where it gives",
    declared="power",
)
DC_VOLTAGE = Channel("dc_voltage_v", "dc_voltage", "V", "voltage of the drive's DC link")
DC_CURRENT = Channel("dc_current_a", "dc_current", "A", "current that the drive takes from its DC link")
MOTOR_TEMPERATURE = Further(
    "motor_temperature_c",
    "motor_temperature",
    "K",
    "temperature of the motor, as its drive reports it",
    offset=FREEZING,
    declared="motor_temperature",
)
ABSOLUTE_POSITION = Further(
    "absolute_position_m",
    "absolute_position",
    "m",
    "position of an occasional absolute sensor, 0 = fully retracted, NaN where it gives none",
    declared="absolute_position",
    is_reading=True,
    advice="an occasional absolute position: a draw wire, a laser, a camera, a scale that somebody reads",
)
PRESSURES = (PRESSURE_A, PRESSURE_B)
FURTHER = (*PRESSURES, LINK_ANGLE, SHAFT_ANGLE, DC_POWER, MOTOR_TEMPERATURE, ABSOLUTE_POSITION)
"""What a sensor takes beside a drive's report where its machine declares it."""
READINGS = tuple(one for one in FURTHER if one.is_reading)
"""Those of which a value counts once, at its sample."""
LINK = (DC_VOLTAGE, DC_CURRENT)
"""What the power of the DC link is made of where a drive does not report it itself."""
DRIVE_LOG = "drive log"
"""Kind of a `Dataset` that is what a drive reports and nothing else, in its attributes."""


def column_of(part: str) -> str:
    """Name of the command to a part in runs and logs."""
    return f"{part}{_COMMAND}"


def is_command(column: str) -> bool:
    """Whether a column of a run or log is a command to a part."""
    return column.endswith(_COMMAND)


def part_of(column: str) -> str:
    """The part whose command a column is.

    Example:
        >>> part_of(column_of("valve"))
        'valve'
    """
    return column.removesuffix(_COMMAND)


def as_signals(columns: Mapping[str, Array], channels: Sequence[Channel]) -> Signals:
    """The columns that are there, over time.

    Args:
        columns: column name to values, shape (n,); ``time_s`` [s] among them.
        channels: what the other columns mean; those absent from ``columns`` are left out.

    Returns:
        The variables in SI units over ``time`` [s], each with ``units`` and ``long_name``.
    """
    found = {"time": Signal(columns[TIME], {"units": "s", "long_name": "time"})}
    for channel in channels:
        if channel.column in columns:
            values = channel.to_si(columns[channel.column])
            found[channel.name] = Signal(values, {"units": channel.units, "long_name": channel.long_name})
    return Signals(found)
