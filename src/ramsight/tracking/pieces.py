"""A long log tracked piece by piece: what comes out is written as it comes, and little of it is kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ramsight.output import open_dataset
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import BRIDGED_GAP
from ramsight.sensor.virtual_sensor import BOUND, HIGHEST, LIVE, LOWEST, REFERENCED_NOW, STATUS
from ramsight.signals import Samples, Signal, Signals, joined
from ramsight.tracking.availability import PassedTime

if TYPE_CHECKING:
    from ramsight.tracking.availability import Availability
    from ramsight.tracking.named_faults import FaultNames


@dataclass(frozen=True)
class Pieces:
    """What is left of a log that was tracked piece by piece."""

    summary: str  # a few lines on the track
    # position [m], position_std [m] and status over time, or all that the sensor reports, if it was kept
    track: Signals | None
    # motor_speed [rad/s], motor_torque [N m] and oil_temperature [K] over time, or all of it, if it was kept
    log: Signals | None
    mistake: str = ""  # what is most likely wrong with the log, in a line; empty where it fits the machine
    # whether that is sure, so that the track is invalid, and no state of the sensor is kept
    is_contradicted: bool = False
    has_position: bool = True  # whether any sample has a position
    figures: Mapping[str, Any] = field(default_factory=dict)


_TRACK = ("position", "position_std", "status")
_BAND = (LOWEST, HIGHEST)
_INTEGRITY = (*_BAND, BOUND, REFERENCED_NOW)
TABLE = (*_TRACK, *_INTEGRITY)
"""What a table of a track has, where the sensor says it."""
_DIAGNOSED = ("speed_gain_probability", "torque_gain_probability")  # said by a sensor that can name faults of inputs
_LOG = ("motor_speed", "motor_torque", "oil_temperature")


class Follower(Protocol):
    """What says where the piston was, piece by piece."""

    @property
    def outputs(self) -> Sequence[str]:
        """Names of what it says."""

    def followed(self, piece: Signals) -> Signals:
        """What it says of the next piece."""


def track_pieces(
    sensor: Follower,
    pieces: Iterable[Samples],
    out: str | Path | None = None,
    *,
    keep_track: bool = False,
    keep_log: bool = False,
    all_of_it: bool = False,
    more: tuple[str, ...] = (),
    beside: tuple[str, ...] = (),
    available: Availability | None = None,
    said_of: Callable[[Signals], Signals] = lambda tracked: tracked,
) -> Pieces:
    """Track a log piece by piece, and write the track.

    Args:
        sensor: started; goes on from piece to piece. Or what has looked back at all of them.
        pieces: of a drive log, in order, for example from `ramsight.logs.open_log` or `open_signals`.
        out: the track's file, with rows where the log has none for long. NetCDF and MCAP hold all that the sensor
            reports, a table (CSV, Parquet, MF4) position, its standard deviation, bound, status in words and whether a
            reference has come; None writes none.
        more: further variables that are kept of track and log, where they have them.
        available: counts how much of the time the position may be used, and is reported with the summary.
        said_of: what is to be said of a piece of the track in its place, as of one that the whole log contradicts.

    Raises:
        OutputError: the file cannot be written; then there is none.
    """
    texts = {int(status): status.text for status in Status}
    words = dict.fromkeys((STATUS, f"{LIVE}{STATUS}"), texts)
    tally, track, log = Tally(), *(_Kept(None if all_of_it else names, (*_BAND, *more)) for names in (_TRACK, _LOG))
    gaps = Gaps()
    table = tuple(name for name in (*TABLE, *beside) if name in sensor.outputs)
    with nullcontext() if out is None else open_dataset(out, variables=table, words=words) as writer:
        for piece in map(Signals.of, pieces):
            tracked = said_of(sensor.followed(piece))
            tally.append(tracked)
            if available is not None:
                available.append(tracked)
            filled = gaps.filled(tracked)
            if writer is not None:
                writer.append(filled)
            if keep_track:
                track.append(tracked)
            if keep_log:
                log.append(piece)
    lines = [tally.text, f"  {gaps.text}" if gaps.count else "", "" if available is None else available.text]
    summary = "\n".join(filter(None, lines))
    figures = {**tally.figures, "available": None if available is None else available.share}
    return Pieces(summary, track.whole(), log.whole(), has_position=tally.has_position, figures=figures)


class _Kept:
    """Some variables of many pieces, and `more` where they are there; or all."""

    def __init__(self, names: tuple[str, ...] | None, more: tuple[str, ...]) -> None:
        self._names, self._more = names, more
        self._parts: dict[str, list[NDArray[np.generic]]] = {}
        self._first: Signals | None = None

    def append(self, piece: Signals) -> None:
        """Keep the wanted signals of a piece."""
        if self._first is None:
            self._first, there = piece.rows([]), piece.names
            wanted = None if self._names is None else (*self._names, *(one for one in self._more if one in there))
            names = there if wanted is None else wanted
            self._parts = {name: [] for name in ("time", *names)}
        for name, parts in self._parts.items():
            parts.append(piece[name].values.copy())  # a view would hold all that the sensor reports

    def whole(self) -> Signals | None:
        """All pieces as one; None if there are none."""
        if self._first is None:
            return None
        columns = {}
        for name, parts in self._parts.items():
            columns[name] = Signal(np.concatenate(parts), self._first[name].attrs)
            parts.clear()
        return Signals(columns, self._first.attrs)


class Tally:
    """What is to be said of a track in the end, counted piece by piece.

    Attributes:
        has_position: whether any sample has a position.
    """

    def __init__(self) -> None:
        self._samples, self._sensor = 0, ""
        self._passed = PassedTime()
        self._position: list[float] = []
        self._counts: dict[int, int] = {}
        self._faults: FaultNames | None = None
        self.has_position = False

    def append(self, tracked: Samples) -> None:
        """Count the samples of a piece by their status."""
        time, position = tracked["time"].values, tracked["position"].values
        self._sensor, self._samples = tracked.attrs["sensor"], self._samples + len(time)
        self._passed.append(time)
        self._position = [*self._position[:1], float(position[0]), float(position[-1])]
        self.has_position = self.has_position or bool(np.isfinite(position).any())
        for code, count in zip(*np.unique(tracked["status"].values, return_counts=True), strict=True):
            self._counts[int(code)] = self._counts.get(int(code), 0) + int(count)
        if self._faults is None and any(name in tracked for name in _DIAGNOSED):
            from ramsight.tracking.named_faults import FaultNames

            self._faults = FaultNames()
        if self._faults is not None:
            self._faults.append(tracked)

    @property
    def figures(self) -> dict[str, Any]:
        """Sensor, samples, time that passed [s], positions [m], and the share of the samples with each status [1]."""
        shares = {Status(code).name.lower(): n / self._samples for code, n in sorted(self._counts.items())}
        first, last = (self._position[0], self._position[-1]) if self._position else (math.nan, math.nan)
        return {
            "sensor": self._sensor,
            "samples": self._samples,
            "duration": self._passed.seconds,
            "position_first": first,
            "position_last": last,
            "status": shares,
        }

    @property
    def text(self) -> str:
        """A line on the position, one on each status that is not ok, and one on each named fault of an input."""
        if not self._position:
            return "no samples"
        first, last = (_millimetres(self._position[k]) for k in (0, -1))
        lines = [
            f"{self._sensor} sensor: {self._samples} samples over {self._passed.seconds:.1f} s, "
            f"position {first} at first, {last} at last"
        ]
        for code, count in sorted(self._counts.items()):
            if code != Status.OK:
                lines.append(f"  {100 * count / self._samples:.1f} % of the samples {Status(code).text}")
        faults = [] if self._faults is None else self._faults.close()
        return "\n".join([*lines, *(f"  {one.text}" for one in faults)])


def _millimetres(position: float) -> str:
    return f"{1e3 * position:.1f} mm" if np.isfinite(position) else "unknown"


_PERIODS = 2.0  # a stretch takes two rows of its own, a period from either side


class Gaps:
    """Looks for stretches without rows, piece by piece.

    Attributes:
        longest: of them [s].
        at: when the longest begins [s].

    Example:
        >>> from ramsight.signals import Signal
        >>> gaps, time = Gaps(), np.array([0.0, 0.02, 30.02, 30.04])
        >>> columns = {"time": Signal(time), "position": Signal(np.ones(4)), "status": Signal(np.zeros(4, int))}
        >>> filled = gaps.filled(Signals(columns))
        >>> filled["time"].values.tolist(), [Status(code).name for code in filled["status"].values]
        ([0.0, 0.02, 0.04, 30.0, 30.02, 30.04], ['OK', 'OK', 'INPUT_LOST', 'INPUT_LOST', 'OK', 'OK'])
        >>> gaps.text
        'no rows for 30.0 s from 0.0 s on'
    """

    def __init__(self) -> None:
        self.count, self.longest, self.at = 0, 0.0, 0.0
        self._last: Signals | None = None
        self._period = 0.0

    def filled(self, tracked: Signals) -> Signals:
        """A piece of a track, with rows in the stretches that have none; positions and the like are NaN there.

        Args:
            tracked: with status over time [s].
        """
        time = tracked["time"].values
        if not len(time):
            return tracked
        before = self._last
        self._last = tracked.rows([-1])
        steps = np.diff(time)
        self._period = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else self._period
        places = np.flatnonzero(steps > max(BRIDGED_GAP, _PERIODS * self._period)) + 1
        parts = [self._stretch(tracked, int(place) - 1, float(time[place])) for place in places]
        cut = np.split(np.arange(len(time)), places)
        whole = [tracked.rows(slice(0, len(cut[0])))]
        for part, rows in zip(parts, cut[1:], strict=True):
            whole += [part, tracked.rows(slice(rows[0], rows[-1] + 1))]
        if before is not None and time[0] - before["time"].values[0] > max(BRIDGED_GAP, _PERIODS * self._period):
            whole.insert(0, self._stretch(before, 0, float(time[0])))
        return tracked if len(whole) == 1 else joined(whole)

    def _stretch(self, tracked: Signals, place: int, end: float) -> Signals:
        """Two rows after a sample, until the next one."""
        begin = float(tracked["time"].values[place])
        self.count += 1
        if end - begin > self.longest:
            self.longest, self.at = end - begin, begin
        rows = tracked.rows([place, place])
        unknown = {name: np.full(2, np.nan) for name, one in rows.columns.items() if one.values.dtype.kind == "f"}
        lost: NDArray[np.int_] = np.full(2, int(Status.INPUT_LOST), dtype=rows["status"].values.dtype)
        time = np.array([begin + self._period, end - self._period])
        return rows.replaced({**unknown, "status": lost, "time": time})

    @property
    def text(self) -> str:
        """What to say of them in one line; empty without any."""
        if not self.count:
            return ""
        if self.count == 1:
            return f"no rows for {self.longest:.1f} s from {self.at:.1f} s on"
        return f"{self.count} stretches without rows, the longest {self.longest:.1f} s from {self.at:.1f} s on"
