"""Drive logs: motor speed, torque and oil temperature as a drive reports them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import LogError, OutputError
from ramsight.logs.channels import MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE, REFERENCE, TIME, as_dataset
from ramsight.logs.lines import file_name
from ramsight.logs.table import FIRST_ROW, check_increasing, read_columns
from ramsight.output import write_table

if TYPE_CHECKING:
    import xarray

CHANNELS = (MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE)
COLDEST_C, HOTTEST_C = -60.0, 200.0
"""Range of oil temperatures [°C]: beyond it a log has another unit, or its sensor is broken."""


def read_drive_log(path: str | Path) -> xarray.Dataset:
    r"""The drive log in a CSV file, or in one compressed with gzip if its name ends in ``.gz``.

    The file has the columns ``time_s``, ``motor_speed_rpm``, ``motor_torque_nm`` and ``oil_temperature_c``,
    and perhaps ``reference_m``, in any order. Every other column is ignored, a position above all.

    Args:
        path: the file.

    Returns:
        Over ``time`` [s], as in the file and increasing: ``motor_speed`` [rad/s], ``motor_torque`` [N m],
        ``oil_temperature`` [K] and, if the file has it, ``reference`` [m], NaN wherever its cell is empty.

    Raises:
        MissingColumnError: a column is absent.
        LogError: the file cannot be read, or what it says cannot be; with line and column.

    Example:
        >>> import pathlib, tempfile
        >>> text = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n0.00,1500,12.5,40.0\n"
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "log.csv"
        ...     _ = file.write_text(text)
        ...     log = read_drive_log(file)
        >>> round(float(log.motor_speed[0]), 3), log.motor_speed.attrs["units"]
        (157.08, 'rad/s')
    """
    columns = read_columns(
        path,
        needed=[TIME, *(channel.column for channel in CHANNELS)],
        optional=[REFERENCE.column],
        gaps=[REFERENCE.column],
    )
    file = file_name(path)
    check_increasing(columns[TIME], TIME, file)
    _check_temperature(columns[OIL_TEMPERATURE.column], file)
    return as_dataset(columns, [*CHANNELS, REFERENCE])


def write_drive_log(log: xarray.Dataset, path: str | Path) -> None:
    """A drive log as a CSV file that `read_drive_log` reads, compressed with gzip if it is named so.

    Only what a drive log has is written, so a whole simulated run may be given. Values keep 12 digits,
    times 15.

    Args:
        log: over ``time`` [s], increasing: ``motor_speed`` [rad/s], ``motor_torque`` [N m],
            ``oil_temperature`` [K] and perhaps ``reference`` [m], NaN where there is none.
        path: the file, ``.csv`` or ``.csv.gz``.

    Raises:
        OutputError: a variable is absent, a value could not be read back, or the file cannot be written.

    Example:
        >>> import pathlib, tempfile
        >>> import xarray
        >>> log = xarray.Dataset(
        ...     {
        ...         "motor_speed": ("time", [157.07963267948966]),
        ...         "motor_torque": ("time", [12.5]),
        ...         "oil_temperature": ("time", [313.15]),
        ...     },
        ...     coords={"time": [0.0]},
        ... )
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "log.csv"
        ...     write_drive_log(log, file)
        ...     print(file.read_text(), end="")
        time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c
        0,1500,12.5,40
    """
    file = file_name(path)
    needed = ["time", *(channel.name for channel in CHANNELS)]
    missing = [name for name in needed if name not in log.variables]
    if missing:
        raise OutputError(f"{file}: a drive log needs {', '.join(needed)}; missing {', '.join(missing)}")
    for name in [*needed, REFERENCE.name]:
        if name in log.variables and log[name].dims != ("time",):
            raise OutputError(f"{file}: {name} of a drive log runs over time alone, not over {log[name].dims}")
    columns = {TIME: np.asarray(log["time"].values, dtype=np.float64)}
    for channel in (*CHANNELS, REFERENCE):
        if channel.name in log.variables:
            values = np.asarray(log[channel.name].values, dtype=np.float64)
            columns[channel.column] = channel.from_si(values)
    _check_writable(columns, file)
    write_table(columns, path, formats={name: "%.15g" if name == TIME else "%.12g" for name in columns})


def _check_temperature(cells: NDArray[np.float64], file: str) -> None:
    absurd = np.flatnonzero((cells < COLDEST_C) | (cells > HOTTEST_C))
    if absurd.size:
        row = int(absurd[0])
        raise LogError(
            f"is {cells[row]:g} °C; a drive log's oil is between {COLDEST_C:g} and {HOTTEST_C:g} °C:"
            " is the column in another unit?",
            file=file,
            line=FIRST_ROW + row,
            column=OIL_TEMPERATURE.column,
        )


def _check_writable(columns: dict[str, NDArray[np.float64]], file: str) -> None:
    """Refuse what `read_drive_log` would refuse: such a file would be of no use."""
    for name, cells in columns.items():
        bad = np.isinf(cells) if name == REFERENCE.column else ~np.isfinite(cells)
        if bad.any():
            raise OutputError(f"{file}: {name} of sample {int(np.argmax(bad))} is not finite")
    try:
        if not columns[TIME].size:
            raise LogError("has no samples", file=file)
        check_increasing(columns[TIME], TIME, file)
        _check_temperature(columns[OIL_TEMPERATURE.column], file)
    except LogError as error:
        raise OutputError(str(error)) from None
