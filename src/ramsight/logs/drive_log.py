"""Drive logs: motor speed, torque and oil temperature as a drive reports them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.argument_kinds import by_kind, check_path
from ramsight.arrays import Array
from ramsight.errors import DescriptionError, LogError, OutputError
from ramsight.logs.channel_map import AnyMap
from ramsight.logs.channels import (
    DRIVE_LOG,
    FURTHER,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    OIL_TEMPERATURE,
    PRESSURES,
    REFERENCE,
    TIME,
    is_command,
)
from ramsight.logs.data_frame import as_file, is_data_frame
from ramsight.logs.lines import Advance, file_name
from ramsight.logs.opening import check_temperature, open_signals
from ramsight.output import open_table
from ramsight.signals import Dataset, Samples, Signals, joined

CHANNELS = (MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE)
_UNITS = {
    TIME: "s", MOTOR_SPEED.column: "rpm", MOTOR_TORQUE.column: "Nm", OIL_TEMPERATURE.column: "degC",
    REFERENCE.column: "m",
}  # fmt: skip


@by_kind
def read_log(
    log: Any, channel_map: AnyMap | None = None, *, strict: bool = False, advance: Advance | None = None
) -> Dataset:
    r"""A drive log, whole, from a file of any kind that ramsight reads; `open_log` reads it piece by piece.

    Without a map, the columns are called ``time_s``, ``motor_speed_rpm``, ``motor_torque_nm``, ``oil_temperature_c``
    and perhaps ``reference_m``, in any order. Every other one is ignored, a position above all.

    Args:
        log: the file, by its suffix (docs/reference/log-formats.md has all formats); or a pandas or polars DataFrame
            with such columns.
        channel_map: which of its channels are what, or the TOML file that states so.
        strict: refuse a log with faults, for work that needs one without: values that are missing, time that does
            not increase. A sensor does not need that, it states which samples are bad.
        advance: is passed the share of the file that was read since the last call.

    Returns:
        Over `time` [s], as in the file, shape (samples,): `motor_speed` [rad/s], `motor_torque` [N m],
        `oil_temperature` [K], NaN where the log has no number, and, if the file has it, `reference` [m].

    Raises:
        MissingColumnError: a column is absent.
        LogError: the file cannot be read, or what it says cannot be; with line and column.
        UnknownNameError: the map names a channel that is not there.
        DescriptionError: the map states what cannot be, or the log is neither path nor DataFrame.

    Example:
        >>> import pathlib, ramsight, tempfile
        >>> text = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n0.00,1500,12.5,40.0\n"
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "log.csv"
        ...     _ = file.write_text(text)
        ...     log = ramsight.read_log(file)
        >>> round(float(log.motor_speed[0]), 3), log.motor_speed.attrs["units"], float(log["oil_temperature"][0])
        (157.08, 'rad/s', 313.15)
    """
    if is_data_frame(log):
        with as_file(log) as file:
            return read_log(file, channel_map, strict=strict, advance=advance)
    if not isinstance(log, str | os.PathLike):
        raise DescriptionError("is no log", key="log", value=log, allowed="a file, or a DataFrame")
    check_path(log, "log")
    return read_signals(Path(log), channel_map, strict=strict, advance=advance).dataset()


def read_signals(
    path: Path, channel_map: AnyMap | None = None, *, strict: bool = False, advance: Advance | None = None
) -> Signals:
    """A drive log of a file, whole, as columns; arguments and errors as `read_log`."""
    read = joined(list(open_signals(path, channel_map, advance=advance)))
    if strict:
        _check_faultless(read, file_name(path))
    return read


def write_log(log: Samples, path: str | Path) -> None:
    """A drive log as a file that `read_log` reads, in the format that its suffix says.

    Only what a drive log has is written, so a whole simulated run may be passed. In CSV values keep 12 digits, times
    15, and NaN is an empty cell.

    Args:
        log: a Dataset or columns over ``time`` [s]: ``motor_speed`` [rad/s], ``motor_torque`` [N m],
            ``oil_temperature`` [K] and perhaps ``reference`` [m], ``link_angle`` [rad], ``shaft_angle`` [rad],
            ``dc_power`` [W], and of a drive's report ``pressure_a`` and ``pressure_b`` [Pa], NaN where there is none.
        path: the file, ``.csv``, ``.csv.gz``, ``.parquet``, ``.mf4`` or ``.mcap``.

    Raises:
        OutputError: a variable is absent, the log could not be read back, or the file cannot be written.

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
        ...     write_log(log, file)
        ...     print(file.read_text(), end="")
        time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c
        0,1500,12.5,40
    """
    file = file_name(path)
    needed = ["time", *(channel.name for channel in CHANNELS)]
    missing = [name for name in needed if name not in log]
    if missing:
        raise OutputError(f"{file}: a drive log needs {', '.join(needed)}; missing {', '.join(missing)}")
    # A simulated run has pressures that no drive reports.
    reported = log.attrs.get("kind") == DRIVE_LOG
    further = [one for one in (REFERENCE, *FURTHER) if reported or one not in PRESSURES]
    if not isinstance(log, Signals):
        for name in [*needed, *(one.name for one in further)]:
            if name in log.variables and log[name].dims != ("time",):
                raise OutputError(f"{file}: {name} of a drive log runs over time alone, not over {log[name].dims}")
    columns = {TIME: np.asarray(log["time"].values, dtype=np.float64)}
    for channel in (*CHANNELS, *further):
        if channel.name in log:
            columns[channel.column] = channel.from_si(_finite(log[channel.name].values))
    names = map(str, log.names if isinstance(log, Signals) else log.data_vars)
    commands = [name for name in names if is_command(name)]
    columns |= {name: _finite(log[name].values) for name in commands}
    if not np.isfinite(columns[TIME]).any():
        raise OutputError(f"{file}: has no samples")
    try:
        check_temperature(_finite(log[OIL_TEMPERATURE.name].values), file, OIL_TEMPERATURE.column)
    except LogError as error:
        raise OutputError(str(error)) from None
    formats = {name: "%.15g" if name == TIME else "%.12g" for name in columns}
    with open_table(path, formats=formats, units=_UNITS | dict.fromkeys(commands, "1")) as table:
        table.append(columns)


def _finite(values: Array) -> Array:
    numbers = np.asarray(values, dtype=np.float64)
    return np.where(np.isfinite(numbers), numbers, np.nan)


def _check_faultless(log: Signals, file: str) -> None:
    """Reject a log with missing values, or with time that does not increase."""
    time = log["time"].values
    for name in ("time", *(channel.name for channel in CHANNELS)):
        bad = ~np.isfinite(log[name].values)
        if bad.any():
            sample = int(np.argmax(bad))
            raise LogError(f"is missing in sample {sample + 1}, at {time[sample]:g} s", file=file, column=name)
    stuck = np.flatnonzero(time[1:] <= time[:-1])
    if stuck.size:
        sample = int(stuck[0]) + 1
        now, before = float(time[sample]), float(time[sample - 1])
        what = "does not increase" if now == before else "goes backwards"
        raise LogError(f"time {what} in sample {sample + 1}: {now!r} after {before!r}", file=file)
