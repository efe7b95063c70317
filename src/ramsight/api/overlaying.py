"""Runs of one duty laid over each other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from ramsight.api.tracking import Quantity, track
from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError
from ramsight.plant.build import AnyUnit, build
from ramsight.signals import Dataset, Samples
from ramsight.tracking.overlay import ALIGNMENTS, Overlay, laid_over
from ramsight.units import argument

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
