"""Positions beside each other: another sensor's, and those of several runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.api.arguments import truth_of
from ramsight.api.following import Quantity
from ramsight.api.tracking import track
from ramsight.argument_kinds import by_kind
from ramsight.arrays import true_intervals
from ramsight.errors import DescriptionError, LogError
from ramsight.logs.channel_map import AnyMap
from ramsight.machine.assumption_description import SURE_START
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.unit import assuming
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.signals import Dataset, Samples
from ramsight.tracking import comparing
from ramsight.tracking.availability import LONGEST_ALERT, TIME_TO_ALERT
from ramsight.tracking.overlay import ALIGNMENTS, Overlay, laid_over
from ramsight.units import argument, format_si


@dataclass(frozen=True)
class Compared:
    """A log on which two sensors were compared."""

    # track: over `time` [s]: what `ramsight.track` gives, `other_position` [m] and `verdict` (numbers of `Verdict`)
    track: Dataset
    drift: comparing.Drift  # of the other sensor

    @property
    def alerts(self) -> list[tuple[float, float, comparing.Verdict]]:
        """From when, until when [s], and what, of each stretch in which they do not agree."""
        said, time = self.track["verdict"].values, self.track["time"].values
        found = ((time[a], time[b - 1], what) for what in comparing.ALERTS for a, b in true_intervals(said == what))
        return sorted((float(begins), float(ends), what) for begins, ends, what in found)

    @property
    def figures(self) -> dict[str, Any]:
        """Samples, the share of them with each verdict [1], alerts [s] and drift, by name."""
        said = self.track["verdict"].values
        return {
            "samples": len(said),
            "verdicts": {one.name.lower(): float(np.mean(said == one)) for one in comparing.Verdict},
            "alerts": [{"begins": a, "ends": b, "verdict": what} for a, b, what in self.alerts],
            "drift": self.drift,
        }

    @property
    def text(self) -> str:
        """The comparison in a few lines."""
        said, shares = self.track["verdict"].values, self.figures["verdicts"]
        lines = [
            f"{100.0 * share:.1f} % of {len(said)} samples: {one.text}"
            for one in comparing.Verdict
            if (share := shares[one.name.lower()]) > 0.0
        ]
        lines += [f"  {begins:.2f} s to {ends:.2f} s: {what.text}" for begins, ends, what in self.alerts]
        d = self.drift
        if np.isfinite(d.rate_std):
            lines.append(
                f"The other sensor reads {1e3 * d.offset:+.2f} mm at first, and {3.6e6 * d.rate:+.2f} mm/h more "
                f"(± {TWO_SIDED_95 * 3.6e6 * d.rate_std:.2f} mm/h)."
            )
        return "\n".join(lines)


@by_kind
def compare(
    machine: AnyUnit,
    log: str | Path | Dataset,
    other: str | Path | Dataset,
    *,
    unit: str | None = None,
    tolerance: Quantity = comparing.TOLERANCE,
    time_to_alert: Quantity = TIME_TO_ALERT,
    start: Quantity | None = None,
    channel_map: AnyMap | None = None,
    hindsight: bool = False,
    progress: bool = False,
) -> Compared:
    """Hold a real position sensor against the virtual one, in motion and at rest.

    Args:
        machine: the unit, or what `build` makes one of.
        log: of its drive, as `ramsight.track` takes it.
        other: what the real sensor reports: a file with ``time_s`` and ``position_m``, or a Dataset with `position` [m]
            over `time` [s]; NaN where it says nothing. The virtual sensor never sees it.
        unit: name of the unit, if the machine has several.
        tolerance: of the real sensor [m], above 0 and up to the stroke.
        time_to_alert: for which they have to be apart before one of them is reported as wrong [s], 0 to 1 min.
        start: position at the first sample [m], as `ramsight.track`'s; two sensors agree on it.
        channel_map: of a file.
        hindsight: judge by where the piston was by all of the log, and not by what a live virtual sensor knew: which of
            the two was wrong, and when, and not how soon it is found.
        progress: show a bar on a terminal if it takes long.

    Returns:
        The track with both positions and a verdict for each sample, alerts, and the real sensor's drift.

    Raises:
        DescriptionError: a quantity cannot be read or is out of range.
        UnknownNameError: no such machine or unit.
        LogError: log or positions cannot be read, or have no time in common.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", unit="boom")
        >>> run = ramsight.simulate(boom, load="200 kN", start="120 mm")
        >>> same = ramsight.compare(boom, ramsight.drive_report(run), run, start="120 mm")
        >>> same.alerts
        []
    """
    built = build(machine, unit)
    stroke = float(built.cylinder.stroke)
    allowed = argument(tolerance, "m", "tolerance", least="0.001 mm", most=format_si(stroke, "mm"))
    alert = argument(time_to_alert, "s", "time_to_alert", least="0 s", most=f"{LONGEST_ALERT:g} s")
    if start is not None:
        built = assuming(built, SURE_START)
    tracked = track(built, log, start, channel_map=channel_map, hindsight=hindsight, progress=progress)
    true = truth_of(other)
    time, known = tracked["time"].values, np.isfinite(true["time"].values)
    when, where = true["time"].values[known], true["position"].values[known]
    inside = (time >= when[0]) & (time <= when[-1]) if len(when) else np.zeros(len(time), bool)
    if not inside.any():
        raise LogError("has no time in common with the drive's log", file="the other sensor")
    tracked = tracked.isel(time=np.flatnonzero(inside))
    time = tracked["time"].values
    real = np.interp(time, when, np.where(np.isfinite(where), where, 0.0))
    gone = np.interp(time, when, (~np.isfinite(where)).astype(float)) > 0.0
    real = np.where(gone, np.nan, real)
    pair = comparing.Comparison.of(built, allowed, alert)
    position, status = np.nan_to_num(tracked["position"].values), tracked["status"].values.astype(np.int64)
    said = comparing.verdicts(pair, time, position, tracked[BOUND].values, status, real)
    good = (status == Status.OK) & np.isfinite(real) & (said == comparing.Verdict.AGREE)
    if not good.any():
        drift = comparing.Drift(float("nan"), float("nan"), float("nan"), 0)
    else:
        drift = comparing.drift_of(time[good], (real - position)[good], tracked["position_std"].values[good])
    meaning = "; ".join(f"{int(one)}: {one.text}" for one in comparing.Verdict)
    both = tracked.assign(
        other_position=("time", real, {"units": "m", "long_name": "position by the other sensor"}),
        verdict=("time", said, {"long_name": "what two sensors say together", "meaning": meaning}),
    )
    return Compared(both, drift)


MOST = 20
"""How many runs are laid over each other at most."""


@by_kind
def overlay(
    machine: AnyUnit,
    logs: Iterable[str | Path | Dataset],
    *,
    unit: str | None = None,
    align: str = "start",
    cursors: Iterable[Quantity] = (),
    **options: Any,
) -> Overlay:
    """Runs of one duty laid over each other: where they differ, by how much, and whether their bands overlap.

    Args:
        machine: the unit whose runs they are, or what `build` makes one of.
        logs: of its drive, 2 to 20, as `track` takes them; or tracks of `track`, of any sensor. Others are held
            against the first.
        unit: name of the unit, if the machine has several.
        align: what is at 0 s of each: ``start``, its first sample, or ``reference``, the first end that the sensor met,
            or the first reference that the log has.
        cursors: instants to read the runs at [s], or ``"12 s"``; none for the three largest differences.
        options: of `track`, for all logs: ``start``, ``sensor``, ``hindsight`` and so on.

    Returns:
        Positions and bands on the first run's samples, the differences, and readings.

    Raises:
        DescriptionError: there are too few or too many logs, or an argument is out of range.
        ComparisonError: a run meets neither end nor reference, or they have no time in common.
        RamsightError: a log cannot be tracked.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", unit="boom")
        >>> runs = [ramsight.simulate(boom, load=load, start="120 mm") for load in ("200 kN", "400 kN")]
        >>> found = ramsight.overlay(boom, map(ramsight.drive_report, runs), start="120 mm", cursors=["10 s"])
        >>> found.names, [round(1e3 * one) for one in found.readings[0].position]  # mm
        (('run 1', 'run 2'), [262, 252])
    """
    built, passed, instants = build(machine, unit), list(logs), list(cursors)
    if not 2 <= len(passed) <= MOST:
        raise DescriptionError("too few or too many runs", key="logs", value=len(passed), allowed=f"2 to {MOST}")
    if align not in ALIGNMENTS:
        raise DescriptionError("is not known", key="align", value=align, allowed=" or ".join(ALIGNMENTS))
    found: dict[str, Samples] = {}
    for name, log in zip(_names(passed), passed, strict=True):
        is_track = getattr(log, "attrs", {}).get("kind") == "track"
        found[name] = log if is_track and not isinstance(log, str | Path) else track(built, log, **options)
    runs = laid_over(found, align, float(built.cylinder.stroke))
    least, most = f"{runs.time[0]:.3f} s", f"{runs.time[-1]:.3f} s"
    return replace(runs, at=tuple(argument(one, "s", "cursors", least=least, most=most) for one in instants))


def _names(logs: list[Any]) -> list[str]:
    """Of runs: their files', the folder too where files have the same."""
    names = [one.name if isinstance(one, Path) else Path(one).name if isinstance(one, str) else "" for one in logs]
    often = Counter(names)
    return [
        f"run {k}" if not name else str(log) if often[name] > 1 else name
        for k, (name, log) in enumerate(zip(names, logs, strict=True), start=1)
    ]
