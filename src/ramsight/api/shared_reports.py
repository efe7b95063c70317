"""Two units of one machine: what their drives report of the oil and of the voltage that they share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ramsight.api.arguments import checked
from ramsight.argument_kinds import by_kind
from ramsight.arrays import Array, true_intervals
from ramsight.errors import DescriptionError, LogError
from ramsight.logs.channels import DC_VOLTAGE, OIL_TEMPERATURE
from ramsight.optional import needing
from ramsight.signals import Dataset
from ramsight.tracking.sharing import OIL, SHARED, VOLTAGE, Agreement, Allowed, Shared


@dataclass(frozen=True)
class SharedChecks:
    """What two units say of what they share."""

    # checks: over the first log's `time` [s], of each quantity that both have: `NAME_apart` and `NAME_allowed`, sums
    # of the difference and what they may be [unit of the quantity times s], and `NAME_alarm`
    checks: Dataset
    # first, second: both logs; where a thermometer reports nothing, `oil_temperature` is the other unit's
    first: Dataset
    second: Dataset

    @property
    def looked_at(self) -> list[Shared]:
        """The quantities that both logs have, and that are compared."""
        return [one for one in SHARED if f"{one.name}_alarm" in self.checks]

    @property
    def alerts(self) -> list[tuple[float, float, str]]:
        """From when, until when [s], and of what, of each stretch in which they contradict each other."""
        time = self.checks["time"].values
        found = [
            (float(time[a]), float(time[b - 1]), one.name)
            for one in self.looked_at
            for a, b in true_intervals(self.checks[f"{one.name}_alarm"].values)
        ]
        return sorted(found)

    @property
    def text(self) -> str:
        """A line for each quantity, and for each alert."""
        lines = []
        for one in SHARED:
            alarm = self.checks.get(f"{one.name}_alarm")
            said = "not in both" if alarm is None else "contradicts" if bool(alarm.any()) else "agrees"
            lines.append(f"{one.name} ({one.signals}): {said}")
        return "\n".join([*lines, *(f"  {a:.2f} s to {b:.2f} s: {what} contradicts" for a, b, what in self.alerts)])


@by_kind
def check_shared(first: Dataset, second: Dataset, *, allowed: Mapping[str, Allowed] | None = None) -> SharedChecks:
    """Hold against each other what the drives of two units say of their common oil and voltage.

    What both logs have is looked at: `oil_temperature` [K] and `dc_voltage` [V]. The logs have one clock.

    Args:
        first: a drive's log over `time` [s], as `ramsight.read_log` or `drive_report` give it.
        second: the other drive's.
        allowed: by how much reports may differ, by the quantity's name, in place of what is usual.

    Returns:
        Sums, bounds and alarms of each quantity, and both logs with a temperature wherever one of them has one.

    Raises:
        DescriptionError: a name in `allowed` is of no quantity.
        MissingColumnError: a log has no time.
        LogError: the logs have no time in common, or nothing else.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", unit="boom")
        >>> log = ramsight.drive_report(ramsight.simulate(boom, load="200 kN"))
        >>> wrong = log.assign(oil_temperature=log["oil_temperature"] + 40.0)
        >>> [name for _, _, name in ramsight.check_shared(log, wrong).alerts]
        ['oil_temperature']
    """
    passed = dict(allowed or {})
    names = {one.name for one in SHARED}
    if strange := passed.keys() - names:
        raise DescriptionError(
            "is no such quantity", key="allowed", value=min(strange), allowed=", ".join(sorted(names))
        )
    one, two = checked(first, "first", ("time",)), checked(second, "second", ("time",))
    time = np.asarray(one["time"].values, float)
    pairs = _pairs(one, two)
    if not pairs:
        raise LogError("has nothing that the first log has, too", file="the second log")
    columns = {}
    for shared, (here, there) in pairs.items():
        if not np.any(np.isfinite(here) & np.isfinite(there)):
            raise LogError(f"has no {shared.name} at the times of the first log's", file="the second log")
        rows = np.column_stack([time, here, there])
        apart, may, alarm = Agreement(shared, passed.get(shared.name)).replay(rows).T
        units = {"units": f"{shared.unit} s"}
        columns[f"{shared.name}_apart"] = ("time", apart, units)
        columns[f"{shared.name}_allowed"] = ("time", may, units)
        columns[f"{shared.name}_alarm"] = (
            "time",
            alarm > 0.0,
            {"long_name": f"{shared.signals} contradict each other"},
        )
    with needing("datasets"):
        import xarray

    checks = xarray.Dataset(columns, coords={"time": ("time", time, {"units": "s"})})
    return SharedChecks(checks, _filled(one, two), _filled(two, one))


def _pairs(one: Dataset, two: Dataset) -> dict[Shared, tuple[Array, Array]]:
    """What both say of each quantity, at the first log's times."""
    time = one["time"].values
    found = {}
    for shared, name in ((OIL, OIL_TEMPERATURE.name), (VOLTAGE, DC_VOLTAGE.name)):
        if name in one and name in two:
            found[shared] = (np.asarray(one[name].values, float), _at(time, two, two[name].values))
    return found


def _at(time: Array, log: Dataset, values: Array) -> Array:
    """Values of a log at other times; NaN beyond its own, and beside a value that is none."""
    own = np.asarray(log["time"].values, float)
    return np.asarray(np.interp(time, own, np.asarray(values, float), left=np.nan, right=np.nan))


def _filled(log: Dataset, other: Dataset) -> Dataset:
    """A log with the other's temperature where it has none."""
    name = OIL_TEMPERATURE.name
    if name not in other:
        return log
    theirs = _at(log["time"].values, other, other[name].values)
    own = np.asarray(log[name].values, float) if name in log else np.full(len(theirs), np.nan)
    return log.assign({name: ("time", np.where(np.isfinite(own), own, theirs), other[name].attrs)})
