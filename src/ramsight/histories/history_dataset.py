"""A machine's history as a Dataset, and as rows of a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.histories.assessed import Assessed
from ramsight.histories.forecast import FOLLOWED
from ramsight.optional import needing
from ramsight.signals import Dataset

_DATES = ("limit_low", "limit_date", "limit_high")
_OF_LOG = {
    "duration": ("s", "of the log"),
    "worked": ("s", "time in which the motor turned"),
    "oil_low": ("K", "lowest oil temperature"),
    "oil_mean": ("K", "mean oil temperature"),
    "oil_high": ("K", "highest oil temperature"),
    "references": ("1", "ends and switches that were met"),
    "available": ("1", "share of the samples whose position may be used"),
    "consistency": ("1", "mean of the last squared innovations over their variances"),
}


def dataset_of(one: Assessed) -> Dataset:
    """The Dataset of `ramsight.history`."""
    with needing("datasets"):
        import xarray

    records, names = one.history.records, list(FOLLOWED)
    time = np.array([record.begun for record in records])
    over = {
        name: (("time", "quantity"), _over(one, name, time, names))
        for name in ("value", "value_std", "trend", "trend_std")
    }
    of_log = {
        name: ("time", np.array([getattr(record, name) for record in records]), {"units": units, "long_name": words})
        for name, (units, words) in _OF_LOG.items()
    }
    trends = [one.quantities.get(name) for name in names]
    dates = [(math.nan,) * 3 if trend is None else trend.forecast.dates for trend in trends]
    over_quantity: dict[str, Any] = {
        name: ("quantity", _dates([date[k] for date in dates])) for k, name in enumerate(_DATES)
    }
    over_quantity["limit"] = "quantity", [math.nan if trend is None else trend.followed.limit for trend in trends]
    reasons = ["no log says anything of it" if trend is None else trend.forecast.reason for trend in trends]
    over_quantity["reason"] = "quantity", reasons
    coordinates = {"time": _dates(time.tolist()), "quantity": names}
    made = xarray.Dataset({**of_log, **over, **over_quantity}, coords=coordinates)
    for name in (*over, "limit"):
        made[name].attrs |= {"units": "1", "long_name": name.replace("_", " ")}
    key = one.history.kept.key
    causes = "; ".join(cause.text for cause in one.causes if cause.probability >= 0.01)
    made.attrs |= {
        "machine": key.machine,
        "unit": key.unit,
        "serial": key.serial,
        "state": one.state.value,
        "causes": causes,
    }
    return made


def _dates(seconds: Sequence[float]) -> Any:
    """Seconds since 1970 as NumPy has dates; what is no date is none."""
    known = [round(1e9 * one) if math.isfinite(one) and abs(one) < 9e9 else None for one in seconds]
    return np.array([np.datetime64("NaT", "ns") if one is None else np.datetime64(one, "ns") for one in known])


def _over(one: Assessed, what: str, time: Array, names: Sequence[str]) -> Array:
    """Values over records and quantities; of a trend also where a log says nothing of it."""
    found = np.full((len(time), len(names)), np.nan)
    for column, name in enumerate(names):
        trend = one.quantities.get(name)
        if trend is None:
            continue
        if what.startswith("value"):
            for row, record in enumerate(one.history.records):
                evidence = (
                    record.quantities[name].evidence if name in record.quantities and not record.mistake else None
                )
                found[row, column] = math.nan if evidence is None else evidence[what == "value_std"]
            continue
        level, std = (
            np.interp(time, trend.time, part, left=np.nan, right=np.nan) for part in (trend.level, trend.level_std)
        )
        factor = np.exp(level) if trend.followed.is_factor else np.ones(len(time))
        middle = factor if trend.followed.is_factor else level
        found[:, column] = middle if what == "trend" else std * factor
    return found


def table_of(found: Sequence[Assessed]) -> dict[str, Any]:
    """All records as columns of a table: a row a log, two columns a quantity."""
    rows = [(one, record) for one in found for record in one.history.records]
    columns: dict[str, Any] = {
        "machine": [one.history.kept.key.machine for one, _ in rows],
        "unit": [one.history.kept.key.unit for one, _ in rows],
        "serial": [one.history.kept.key.serial for one, _ in rows],
        "file": [record.file for _, record in rows],
        "begun_s": [record.begun for _, record in rows],
    }
    for name, (units, _) in _OF_LOG.items():
        columns[name if units == "1" else f"{name}_{units.lower()}"] = [
            float(getattr(record, name)) for _, record in rows
        ]
    for name in FOLLOWED:
        said = [record.quantities[name].evidence if name in record.quantities else None for _, record in rows]
        columns[name] = [math.nan if one is None else one[0] for one in said]
        columns[f"{name}_std"] = [math.nan if one is None else one[1] for one in said]
    columns["mistake"] = [record.mistake for _, record in rows]
    return columns
