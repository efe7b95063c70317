"""The variables of a Dataset as numbers in SI: times as seconds, and whatever unit a variable says it has."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import DescriptionError, LogError
from ramsight.units import name_of, si_unit, to_si

if TYPE_CHECKING:
    import xarray

_SI = {
    "time": "s",
    "motor_speed": "rad/s",
    "motor_torque": "N m",
    "oil_temperature": "K",
    "reference": "m",
    "position": "m",
}
_TIMES = "mM"  # NumPy's kinds of durations and dates


def in_si(passed: xarray.Dataset, name: str, needed: Iterable[str]) -> xarray.Dataset:
    """A Dataset with its variables over time as numbers in SI; others stay as they are.

    Args:
        passed: the Dataset.
        name: of the argument, for messages.
        needed: variables that have to be numbers.

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
