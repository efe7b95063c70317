"""A duty from a table: motor speed and load over time, as a person or another program wrote them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ramsight.duty.profile import Duty, Profile, constant
from ramsight.errors import LogError
from ramsight.logs.channels import MOTOR_SPEED, OIL_TEMPERATURE, TIME, Channel
from ramsight.logs.csv_table import FIRST_ROW, read_timed
from ramsight.logs.lines import file_name
from ramsight.plant.unit import HydraulicUnit

LOAD = Channel("load_kn", "load", "N", "load force, positive against lifting", factor=1e3)
_ROUNDED = 1e-9  # share by which a speed may pass the highest, which was written in another unit


def read_duty(path: str | Path, unit: HydraulicUnit, oil_temperature: float, start_position: float) -> Duty:
    r"""A duty from a CSV file, or from one compressed with gzip if its name ends in ``.gz``.

    The file has the columns ``time_s``, ``motor_speed_rpm`` and ``load_kn``, and perhaps ``oil_temperature_c``, in any
    order; others are ignored. Between rows all of them run straight.

    Args:
        path: the file.
        unit: the unit that works.
        oil_temperature: [K], where the file has none.
        start_position: [m].

    Raises:
        MissingColumnError: a column is absent.
        LogError: the file cannot be read, time does not begin at 0 or does not increase, or a speed is above the
            unit's highest; with line and column.

    Example:
        >>> import pathlib, tempfile
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "duty.csv"
        ...     _ = file.write_text("time_s,motor_speed_rpm,load_kn\n0,0,129\n1,1500,129\n5,1500,129\n6,0,129\n")
        ...     duty = read_duty(file, boom, 313.15, 0.1)
        >>> duty.duration, float(duty.load(3.0)), round(float(duty.motor_speed(3.0)), 1)
        (6.0, 129000.0, 157.1)
    """
    file = file_name(path)
    columns = read_timed(path, [MOTOR_SPEED.column, LOAD.column], [OIL_TEMPERATURE.column])
    time, speed = columns[TIME], MOTOR_SPEED.to_si(columns[MOTOR_SPEED.column])
    if time[0] != 0.0 or len(time) < 2:
        raise LogError("a duty begins at 0 s and has two rows and more", file=file, line=FIRST_ROW, column=TIME)
    beyond = np.flatnonzero(np.abs(speed) > (1.0 + _ROUNDED) * unit.max_speed)
    if beyond.size:
        most, row = f"{MOTOR_SPEED.from_si(np.array([unit.max_speed]))[0]:.6g} rpm", int(beyond[0])
        text = f"is beyond the drive's highest speed, {most}"
        raise LogError(text, file=file, line=FIRST_ROW + row, column=MOTOR_SPEED.column)
    warmth = constant(oil_temperature)
    if OIL_TEMPERATURE.column in columns:
        warmth = Profile(time, OIL_TEMPERATURE.to_si(columns[OIL_TEMPERATURE.column]))
    return Duty(Profile(time, speed), Profile(time, LOAD.to_si(columns[LOAD.column])), warmth, start_position)
