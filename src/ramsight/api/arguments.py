"""What a caller passes: files, Datasets and data frames as logs, paths; each refused in one line."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ramsight.api.columns import in_si
from ramsight.argument_kinds import check_path
from ramsight.errors import DescriptionError, LogError, MissingColumnError
from ramsight.logs import read_log, read_truth
from ramsight.logs.channel_map import AnyMap, known_map
from ramsight.logs.data_frame import arrow_table, is_data_frame
from ramsight.optional import needing
from ramsight.sensor.inputs.sample import REPORTED

if TYPE_CHECKING:
    import xarray

_LOG = "a file, a Dataset over time, or a DataFrame"


def log_argument(log: Any, channel_map: AnyMap | None = None, *, strict: bool = False) -> Any:
    """A drive log as an argument, whole: of a file, a Dataset, or a pandas or polars DataFrame.

    Args:
        log: what was passed. A DataFrame has the columns of a CSV log (``time_s``, ``motor_speed_rpm``, ...), or those
            that the map names.
        channel_map: of a file or a DataFrame.
        strict: refuse a file with faults.

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


def path_argument(path: Any, name: str) -> Path:
    """A path as an argument.

    Raises:
        DescriptionError: it is none.
    """
    if isinstance(path, str | os.PathLike):
        check_path(path, name)
        return Path(path)
    raise DescriptionError("is no path", key=name, value=path, allowed="text, or a pathlib.Path")


def checked(passed: Any, name: str, needed: Iterable[str] = REPORTED) -> xarray.Dataset:
    """A Dataset that has what is needed of it, as numbers in SI.

    Args:
        passed: an argument.
        name: of the argument, for messages.
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


def truth_argument(truth: Any) -> str | Path | xarray.Dataset | None:
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


def truth_of(truth: Any) -> xarray.Dataset:
    """The true position, from a file or as it is passed.

    Raises:
        LogError: the file cannot be read, or a variable is absent.
        DescriptionError: it is neither file nor Dataset nor DataFrame.
    """
    known = truth_argument(truth)
    return read_truth(known) if isinstance(known, str | Path) else checked(known, "truth", ("time", "position"))
