"""Runs of one duty laid over each other: on one clock, with their bands, their differences, and readings at instants.

The first run is the one that the others are held against. Their bands overlap where neither position rules the other
out: 0 is then between the lowest and the highest difference that the bands allow.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.sensor.virtual_sensor import HIGHEST, LOWEST
from ramsight.signals import Samples, Signals
from ramsight.tracking.end_visits import visits
from ramsight.tracking.pieces import Gaps
from ramsight.tracking.track_errors import ComparisonError

ALIGNMENTS = {"start": "the first sample", "reference": "the first end or reference"}
"""What is at 0 s of every run, by the word for it."""
SHOWN = 3
"""How many readings there are, at the largest differences, where none are asked for."""
_APART = 0.05  # of the duration, between two of these


@dataclass(frozen=True)
class Reading:
    """What runs say at an instant."""

    time: float  # of the sample [s], by the clock that they have in common
    position: list[float]  # of each run [m]; NaN where it is unknown
    # low, high: ends of their 95 % bands [m]
    low: list[float]
    high: list[float]
    difference: list[float]  # of each run but the first from the first [m]
    overlap: list[bool | None]  # whether the bands of these and of the first overlap; None where one has none


@dataclass(frozen=True)
class Overlay:
    """Runs on the first one's samples, as far as the clocks have them in common."""

    names: tuple[str, ...]  # of the runs
    align: str  # what is at 0 s, a word of `ALIGNMENTS`
    begins: tuple[float, ...]  # where 0 s is on the clock of each run's log [s]
    time: Array  # shape (samples,) [s]
    # position, low, high: of each run, and the ends of its 95 % band, shape (runs, samples) [m]
    position: Array
    low: Array
    high: Array
    # at: instants that readings are asked for at [s]; the largest differences if there are none
    at: tuple[float, ...] = field(default=())

    @property
    def difference(self) -> Array:
        """Of each run but the first from the first, shape (runs - 1, samples) [m]."""
        off: Array = self.position[1:] - self.position[0]
        return off

    @property
    def difference_low(self) -> Array:
        """The lowest difference that the bands allow [m]."""
        off: Array = self.low[1:] - self.high[0]
        return off

    @property
    def difference_high(self) -> Array:
        """The highest one [m]."""
        off: Array = self.high[1:] - self.low[0]
        return off

    @property
    def overlap(self) -> Array:
        """1 where the bands overlap, 0 where they do not, NaN where one has none, shape (runs - 1, samples)."""
        low, high = self.difference_low, self.difference_high
        overlap: Array = np.where(np.isfinite(low + high), (low <= 0.0) & (high >= 0.0), np.nan)
        return overlap

    @cached_property
    def readings(self) -> list[Reading]:
        """At the instants that are asked for, or at the largest differences, in order of time."""
        places = [self._place(one) for one in self.at] or sorted(self._largest())
        overlap = self.overlap
        return [
            Reading(
                time=float(self.time[k]),
                position=self.position[:, k].tolist(),
                low=self.low[:, k].tolist(),
                high=self.high[:, k].tolist(),
                difference=self.difference[:, k].tolist(),
                overlap=[None if np.isnan(one) else bool(one) for one in overlap[:, k]],
            )
            for k in places
        ]

    def _place(self, at: float) -> int:
        """The sample nearest to an instant [s]."""
        return int(np.argmin(np.abs(self.time - at)))

    def _largest(self) -> Iterator[int]:
        """Places of the largest differences, each far from the others."""
        size = np.nan_to_num(np.abs(self.difference), nan=-1.0).max(axis=0)
        apart = _APART * (self.time[-1] - self.time[0])
        for _ in range(SHOWN):
            place = int(np.argmax(size))
            if size[place] <= 0.0:
                return
            yield place
            size[np.abs(self.time - self.time[place]) <= apart] = -1.0

    @property
    def figures(self) -> dict[str, Any]:
        """What is at 0 s, of each run but the first what it differs by [m], and the readings."""
        compared = []
        for name, off, overlap in zip(self.names[1:], np.abs(self.difference), self.overlap, strict=True):
            there, banded = off[np.isfinite(off)], overlap[np.isfinite(overlap)]
            rms, most = (float(np.sqrt(np.mean(there**2))), float(there.max())) if len(there) else (np.nan, np.nan)
            share = float(banded.mean()) if len(banded) else np.nan
            compared.append({"run": name, "rms": rms, "largest": most, "overlap": share})
        return {
            "align": self.align,
            "runs": [{"run": name, "begins": begins} for name, begins in zip(self.names, self.begins, strict=True)],
            "samples": len(self.time),
            "differences": compared,
            "readings": self.readings,
        }

    @property
    def text(self) -> str:
        """It in a few lines."""
        seconds = self.time[-1] - self.time[0]
        lines = [f"{len(self.names)} runs over {seconds:.1f} s in common; 0 s is {ALIGNMENTS[self.align]} of each"]
        for name, begins, at in zip(self.names, self.begins, self.position[:, self._place(0.0)], strict=True):
            lines.append(f"  {name}: at its {begins:.2f} s, " + ("unknown" if np.isnan(at) else f"{1e3 * at:.1f} mm"))
        for one in self.figures["differences"]:
            if np.isnan(one["rms"]):
                lines.append(f"{one['run']} less {self.names[0]}: unknown; nowhere both have a position")
                continue
            said = f"{one['run']} less {self.names[0]}: {1e3 * one['rms']:.2f} mm RMS"
            share = "" if np.isnan(one["overlap"]) else f"; the bands overlap in {100 * one['overlap']:.1f} % of it"
            lines.append(f"{said}, {1e3 * one['largest']:.2f} mm at most{share}")
        return "\n".join([*lines, *(line for one in self.readings for line in self._said(one))])

    def _said(self, one: Reading) -> Iterator[str]:
        """Lines on a reading."""
        yield f"at {one.time:.2f} s"
        for k, name in enumerate(self.names):
            if np.isnan(one.position[k]):
                yield f"  {name}: position unknown"
                continue
            said = f"  {name}: {1e3 * one.position[k]:.1f} mm"
            if np.isfinite(one.low[k]):
                said += f" ({1e3 * one.low[k]:.1f} to {1e3 * one.high[k]:.1f} mm)"
            if k > 0 and np.isfinite(one.difference[k - 1]):
                said += f", {1e3 * one.difference[k - 1]:+.1f} mm"
            if k > 0 and (overlap := one.overlap[k - 1]) is not None:
                said += ", the bands overlap" if overlap else ", the bands do not overlap"
            yield said


def laid_over(tracks: Mapping[str, Samples], align: str, stroke: float) -> Overlay:
    """Tracks on the clock of what they have in common.

    Args:
        tracks: by name, two at least; with `position` and its band [m] over `time` [s], and for the first end or
            reference with `mode`, `motor_speed` [rad/s] and perhaps `reference` [m].
        align: a word of `ALIGNMENTS`.
        stroke: of the cylinder [m].

    Raises:
        ComparisonError: a track meets neither end nor reference, or they have no time in common.
    """
    begins = {name: _begin(name, track, align, stroke) for name, track in tracks.items()}
    clocked = {name: _one_way(track, begins[name]) for name, track in tracks.items()}
    clocks = [columns[0] for columns in clocked.values()]
    from_, until = max(one[0] for one in clocks), min(one[-1] for one in clocks)
    time = clocks[0][(clocks[0] >= from_) & (clocks[0] <= until)]
    if len(time) < 2:
        raise ComparisonError(f"the runs have no time in common where 0 s is {ALIGNMENTS[align]} of each")
    columns = np.array([[np.interp(time, own, one) for one in rest] for own, *rest in clocked.values()])
    return Overlay(tuple(tracks), align, tuple(begins.values()), time, *np.moveaxis(columns, 1, 0))


def _begin(name: str, track: Samples, align: str, stroke: float) -> float:
    """When a run begins [s], by its own clock."""
    time = track["time"].values
    if align == "start":
        return float(time[0])
    seen = visits(track, stroke) if "mode" in track else []
    found = [one.begins for one in seen if one.where != "elsewhere" and np.isfinite(one.position)]
    if "reference" in track:
        found += time[np.isfinite(track["reference"].values)].tolist()
    if not found:
        raise ComparisonError(f"{name} meets neither an end nor a reference: align it by its start")
    return float(min(found))


def _one_way(track: Samples, begins: float) -> tuple[Array, Array, Array, Array]:
    """Time since 0 s, position and band of the samples later than all before them; NaN where there are none."""
    own = Signals.of(track)
    used = {name: own[name] for name in ("time", "position", "status", LOWEST, HIGHEST) if name in own}
    filled = Gaps().filled(Signals(used, own.attrs))
    time = filled["time"].values
    later = time > np.maximum.accumulate(np.concatenate([[-np.inf], time[:-1]]))
    position = filled["position"].values
    low, high = (filled[end].values if end in filled else np.full(len(time), np.nan) for end in (LOWEST, HIGHEST))
    return time[later] - begins, position[later], low[later], high[later]
