"""What a caller passes: files, Datasets and data frames as logs, paths; each in SI, or refused in one line."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight.argument_kinds import check_path
from ramsight.errors import DescriptionError, LogError, MissingColumnError
from ramsight.logs import read_log, read_truth
from ramsight.logs.channel_map import AnyMap, known_map
from ramsight.logs.data_frame import arrow_table, is_data_frame
from ramsight.optional import needing
from ramsight.sensor.inputs.sample import REPORTED
from ramsight.signals import Dataset, Signals
from ramsight.units import name_of, si_unit, to_si

_LOG = "a file, a Dataset over time, or a DataFrame"


def log_argument(log: Any, channel_map: AnyMap | None = None, *, strict: bool = False) -> Any:
    """A drive log as an argument, whole: of a file, a Dataset, or a pandas or polars DataFrame.

    Args:
        log: what was passed. A DataFrame has the columns of a CSV log (``time_s``, ``motor_speed_rpm``, ...), or those
            that the map names.

    Returns:
        A Dataset with `motor_speed` [rad/s], `motor_torque` [N m] and `oil_temperature` [K] over `time` [s].

    Raises:
        DescriptionError: it is none of these.
        LogError: it cannot be read, or lacks a variable.
    """
    if isinstance(log, str | os.PathLike) or is_data_frame(log):
        return read_log(log, channel_map, strict=strict)
    known_map(channel_map)
    return checked(log, "log")


def pieces_argument(log: Any, channel_map: AnyMap | None = None) -> str | Path | Iterator[Signals]:
    """A drive log as an argument, in pieces: a file is read later, all else when a piece is asked for.

    Args:
        log: a file, a Dataset or a DataFrame as of `log_argument`, or Datasets in their order.
    """
    return log if isinstance(log, str | Path) else _signals(log, channel_map)


def _signals(log: Any, channel_map: AnyMap | None) -> Iterator[Signals]:
    with needing("datasets"):
        import xarray

    if is_data_frame(log):
        yield Signals.of(log_argument(log, channel_map))
        return
    whole = isinstance(log, xarray.Dataset) or not isinstance(log, Iterable)
    for piece in [log] if whole else log:
        yield Signals.of(checked(piece, "log"))


def path_argument(path: Any, name: str) -> Path:
    """A path as an argument.

    Raises:
        DescriptionError: it is none.
    """
    if isinstance(path, str | os.PathLike):
        check_path(path, name)
        return Path(path)
    raise DescriptionError("is no path", key=name, value=path, allowed="text, or a pathlib.Path")


def checked(passed: Any, name: str, needed: Iterable[str] = REPORTED) -> Dataset:
    """A Dataset that has what is needed of it, as numbers in SI.

    Args:
        needed: names of variables; by default those of a drive log.

    Raises:
        DescriptionError: it is none, a variable does not run over time alone, or has a unit of something else.
        LogError: a variable holds what is no number.
        MissingColumnError: a variable is absent.
    """
    with needing("datasets"):
        import xarray

    if not isinstance(passed, xarray.Dataset):
        raise DescriptionError("is no Dataset", key=name, value=passed, allowed=_LOG)
    needed = tuple(needed)
    missing = [one for one in needed if one not in passed.variables]
    if missing:
        raise MissingColumnError(file=name, missing=missing, found=[str(one) for one in passed.variables])
    for one in needed:
        if passed[one].dims != ("time",):
            raise DescriptionError(
                "does not run over time alone", key=f"{name}: {one}", value=passed[one].dims, allowed="time"
            )
    return in_si(passed, name, needed)


def truth_argument(truth: Any) -> str | Path | Dataset | None:
    """A true position as an argument: a file, which is read later, a DataFrame, or a Dataset.

    A DataFrame has the columns ``time_s`` and ``position_m``.

    Raises:
        DescriptionError: it is none of these.
        MissingColumnError: a variable is absent.
    """
    if truth is None or isinstance(truth, str | Path):
        return truth
    if not is_data_frame(truth):
        return checked(truth, "truth", ("time", "position"))
    import numpy as np

    with needing("datasets"):
        import xarray

    table = arrow_table(truth)
    missing = [one for one in ("time_s", "position_m") if one not in table.column_names]
    if missing:
        raise MissingColumnError(file="truth", missing=missing, found=table.column_names)
    try:
        time, position = (np.asarray(table[one].to_numpy(), dtype=np.float64) for one in ("time_s", "position_m"))
    except (TypeError, ValueError) as error:
        raise LogError(f"holds what is no number: {error}", file="truth") from None
    return xarray.Dataset({"position": ("time", position, {"units": "m"})}, coords={"time": time})


def truth_of(truth: Any) -> Dataset:
    """The true position, from a file or as it is passed.

    Raises:
        LogError: the file cannot be read, or a variable is absent.
        DescriptionError: it is neither file nor Dataset nor DataFrame.
    """
    known = truth_argument(truth)
    return read_truth(known) if isinstance(known, str | Path) else checked(known, "truth", ("time", "position"))


_SI = {
    "time": "s", "motor_speed": "rad/s", "motor_torque": "N m", "oil_temperature": "K", "reference": "m",
    "position": "m",
}  # fmt: skip
_TIMES = "mM"  # NumPy's kinds of durations and dates


def in_si(passed: Dataset, name: str, needed: Iterable[str]) -> Dataset:
    """A Dataset with its variables over time as numbers in SI; others stay as they are.

    Raises:
        DescriptionError: a needed variable has a unit of something else.
        LogError: it holds what is no number.
    """
    times: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for variable in (one for one in passed.variables if passed[one].dims == ("time",)):
        column = str(variable)
        values = passed[column].values
        wanted = column in set(needed)
        numbers = _numbers(values, name, column) if wanted or values.dtype.kind in _TIMES else values
        found = _converted(numbers, passed[column].attrs.get("units"), f"{name}: {column}", _SI.get(column), wanted)
        if found is not values:
            unit = _SI.get(column) or si_unit(passed[column].attrs.get("units", "1"))
            place = times if column == "time" else others
            place[column] = ("time", found, {**passed[column].attrs, "units": unit})
    return passed.assign_coords(times).assign(others) if times or others else passed


def _numbers(values: NDArray[Any], name: str, column: str) -> NDArray[Any]:
    """Values as numbers: durations in seconds, dates in seconds since the first."""
    kind = values.dtype.kind
    if kind in _TIMES:
        since = values - values[0] if kind == "M" and values.size else values
        seconds = since / np.timedelta64(1, "ns") * 1e-9
        return np.where(np.isnat(values), np.nan, seconds)
    if kind in "fiub":
        return values
    try:
        if kind == "O":
            return values.astype(np.float64)
    except (TypeError, ValueError):
        pass
    raise LogError(f"holds what is no number ({values.dtype})", file=name, column=column)


def _converted(values: NDArray[Any], unit: object, key: str, si: str | None, wanted: bool) -> NDArray[Any]:
    """Values in SI, by the unit that they say they have."""
    if not isinstance(unit, str) or unit == si:
        return values
    try:
        same = si_unit(unit)
        known = si is None or same == si
    except ValueError:
        known = False
    if not known:
        if wanted and si is not None:
            raise DescriptionError(f"has another unit; expected {name_of(si)}", key=key, value=unit)
        return values
    offset = to_si(0.0, unit)
    factor = to_si(1.0, unit) - offset
    return values if (factor, offset) == (1.0, 0.0) else values * factor + offset
