"""What a battery gives, from a table of its own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.logs.channels import Channel, as_dataset
from ramsight.logs.csv_table import read_timed

if TYPE_CHECKING:
    import xarray

BATTERY = (
    Channel("battery_voltage_v", "battery_voltage", "V", "voltage of the battery"),
    Channel("battery_current_a", "battery_current", "A", "current that the battery gives"),
)
"""Channels of a battery."""


def read_battery(path: str | Path) -> xarray.Dataset:
    r"""Voltage and current of a battery from a CSV file, or from one compressed with gzip if its name ends in ``.gz``.

    Args:
        path: the file, with the columns ``time_s``, ``battery_voltage_v`` and ``battery_current_a``.

    Returns:
        Over ``time`` [s], increasing: ``battery_voltage`` [V] and ``battery_current`` [A], positive where it gives.

    Raises:
        MissingColumnError: a column is absent.
        LogError: the file cannot be read, or what it says cannot be; with line and column.

    Example:
        >>> import pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "battery.csv"
        ...     _ = file.write_text("time_s,battery_voltage_v,battery_current_a\n0.0,96,12\n0.1,95,-3\n")
        ...     found = read_battery(file)
        >>> found.battery_current.values.tolist()
        [12.0, -3.0]
    """
    return as_dataset(read_timed(path, [one.column for one in BATTERY]), BATTERY)
