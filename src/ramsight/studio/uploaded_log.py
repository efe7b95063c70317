"""An uploaded log, looked through, tracked and judged in processes; every answer is plain and names no folder."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.api.calibrating import identify, leak_test
from ramsight.api.commissioning import commission, report_of
from ramsight.api.following import follow, start_of
from ramsight.calibration.identify_report import summary as identified_summary
from ramsight.calibration.leakage import leak_test_summary
from ramsight.errors import LogError, LogWarning, RamsightError
from ramsight.logs import read_log, read_truth
from ramsight.logs.channel_map import load_map
from ramsight.logs.channels import POSITION, TIME
from ramsight.logs.clock import find_clock
from ramsight.logs.inspect import Channel, inspect_log
from ramsight.logs.mapped import ChannelMap, standard_map
from ramsight.logs.proposal import map_text
from ramsight.logs.source import TableSource
from ramsight.logs.source_by_suffix import open_source
from ramsight.logs.truth import truth_signals
from ramsight.machine.description import Machine
from ramsight.normal import TWO_SIDED_95
from ramsight.output.table_file import write_table
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import HIGHEST, LOWEST
from ramsight.signals import Dataset
from ramsight.studio.known import known_along
from ramsight.studio.spawned import Say
from ramsight.studio.thinning import keep
from ramsight.tracking.credible import truth_in
from ramsight.tracking.end_visits import visits
from ramsight.tracking.figures import tracked_figure, verbatim
from ramsight.tracking.track_errors import error_text, errors_of
from ramsight.units import parse

VIEW, TRACK, REPORT = "view", "track.csv", "report.html"
"""What is written into a log's folder: columns for the eye, the track, the commissioning's report."""
NOWHERE = (
    "The sensor has had no position in this log. Enter above where the piston was at first (for example 120 mm) and"
    " track again; or use a log that presses on an end stop for a second, or one with a channel of references. If the"
    " log has pressed on an end, the description may be wrong: let the report below judge it, and track with the"
    " description that it recommends."
)
"""What to do about a log in which a sensor was never referenced."""
FIGURES = ("track.png", "track.svg")
_POSITION = re.compile(r"pos|weg|hub|lage|stroke|travel|displ|course|carrera|corsa|true", re.IGNORECASE)
_LENGTHS = ("mm", "cm", "m")
_DRAWN = 20_000  # samples of a figure; of more every nth is drawn
_STEP = 0.01  # share of a log, from one word on how far it is to the next


@dataclass(frozen=True)
class Asked:
    """A log as a visitor asks about it."""

    machine: Machine
    unit: str
    file: str  # the log; what is written stands beside it
    truth: str | None = None  # file of the true position; None if there is none
    start: str = ""  # where the piston is at first, in words; "" if unknown
    sensor: str = "kalman"
    map_toml: str = ""  # the channel map; "" for a table with the usual columns
    hindsight: bool = False  # whether all of the log says where the piston was

    @property
    def folder(self) -> Path:
        """Folder that the log is in."""
        return Path(self.file).parent

    @property
    def channel_map(self) -> Path | None:
        """Its channel map as a file, rewritten."""
        if not self.map_toml:
            return None
        file = self.folder / "channels.toml"
        file.write_text(self.map_toml, encoding="utf-8", newline="\n")
        return file


def propose(say: Say, file: str) -> None:
    """Look through a log; says ``proposed``: its `channels` and the `map` that is proposed; or ``error``."""
    folder = Path(file).parent
    with _answering(folder, say) as tell:
        seen = inspect_log(file)
        channels = [
            {
                "name": one.name,
                "unit": one.unit,
                "samples": one.samples,
                "least": _plain(one.least),
                "most": _plain(one.most),
                "role": one.role,
            }
            for one in seen.channels
        ]
        tell("proposed", {"channels": channels, "map": map_text(seen)})


def look_at_truth(say: Say, file: str) -> None:
    """Read a file of the true position; says ``truth``: `said`, and the `file` to be used; or ``error``.

    A table with other columns than ours is rewritten with ours, in its place, where one of them alone is a length
    by its name and unit.
    """
    with _answering(Path(file).parent, say) as tell:
        try:
            known, of, taken = len(truth_signals(file)), "", Path(file)
        except LogError as wrong:
            seen = inspect_log(file)
            channel = position_of(seen.channels)
            if channel is None:
                raise wrong from None
            unit = channel.unit or unit_in(channel.name)
            known, taken = _rewritten(file, seen.known, channel.name, unit), Path(file).with_suffix(".csv")
            of = f", of {channel.name!r} in {unit}"
        said = f"{Path(file).name}: taken as the true position{of}, {known} samples"
        tell("truth", {"said": said, "file": taken.name})


def _rewritten(file: str, layout: ChannelMap, channel: str, unit: str) -> int:
    """Write one channel as a true position, as CSV in the file's place; how many samples that are.

    Raises:
        LogError: the file has no clock, or no number in the channel.
    """
    source = open_source(file, layout)
    if isinstance(source, TableSource) and find_clock(source, layout).is_asked:
        raise LogError("has no clock with a unit", file=source.file)
    blocks = [block[channel] for block in source.blocks([channel])]
    time, value = (np.concatenate([getattr(one, name) for one in blocks]) for name in ("time", "value"))
    is_known = np.isfinite(time) & np.isfinite(value)
    table = {TIME: time[is_known], POSITION.column: parse(f"1 {unit}", "m") * value[is_known]}
    path = Path(file).with_suffix(".csv")
    write_table(table, path)
    return len(truth_signals(path))


def position_of(channels: Sequence[Channel]) -> Channel | None:
    """The channel that is a position by its name and unit; None if none is, or several are.

    Example:
        >>> position_of([Channel("Druck [bar]", "bar"), Channel("Weg [mm]", "mm")]).name
        'Weg [mm]'
    """
    found = [one for one in channels if _POSITION.search(one.name) and (one.unit or unit_in(one.name)) in _LENGTHS]
    return found[0] if len(found) == 1 else None


def unit_in(name: str) -> str:
    """The unit in a name's brackets; "" if there is none.

    Example:
        >>> unit_in("Weg [mm]"), unit_in("Weg")
        ('mm', '')
    """
    found = re.search(r"[\[(](\w+)[\])]\s*$", name)
    return "" if found is None else found[1]


def track(say: Say, asked: Asked) -> None:
    """Track a log as `ramsight track` does.

    Says ``progress`` (a share), and in the end ``tracked``: `summary`, what the verb prints, `samples`, and
    `references` that were found, and `advice` where the sensor has had no position; ``known``, what a kalman sensor
    knew along the log (`known_along`); or ``error``. Writes the view, the track and its figures.
    """
    with _answering(asked.folder, say) as tell:
        unit = build(asked.machine, asked.unit)
        position, std = start_of(unit, asked.start or None, "1 mm")
        known, channel_map = _truth(asked), asked.channel_map
        done = follow(
            unit, asked.file, channel_map, sensor=asked.sensor, start=position, start_std=std,
            out=asked.folder / TRACK, keep_track=True, keep_log=True, more=("mode", "reference"),
            hindsight=asked.hindsight, both=True, advance=_shares(tell),
        )  # fmt: skip
        if done.track is None or done.log is None:
            tell("error", "the log has no samples")
            return
        tracked, log = done.track.dataset(), done.log.dataset()
        lines = [done.summary]
        if known is not None:
            lines.append(error_text(errors_of(tracked, known), len(done.track)))
        nowhere = bool((tracked["status"].values == int(Status.NOT_REFERENCED)).all())
        keep(asked.folder / VIEW, columns_of(tracked, known))
        found = references(log, tracked, known, unit.cylinder.stroke)
        said = {"summary": "\n".join(lines), "samples": len(done.track), "references": found}
        tell("tracked", said | {"advice": NOWHERE if nowhere else ""})
        if asked.sensor == "kalman":
            sensor = kalman(unit)
            sensor.start(position, std)
            tell("known", list(known_along(sensor, done.log, unit.cylinder.stroke)))
        _draw(asked, log, tracked, known)
        tell("drawn", list(FIGURES))


def find_leak(say: Say, asked: Asked) -> None:
    """Look for a leak test in a log; says ``leak test``, as the verb prints it, or ``error``."""
    with _answering(asked.folder, say) as tell:
        log = read_log(asked.file, asked.channel_map)
        tell("leak test", leak_test_summary(leak_test(asked.machine, log, unit=asked.unit)))


def find_factors(say: Say, asked: Asked) -> None:
    """Identify the machine by a log and its true position; says ``factors``, as the verb prints them, or ``error``."""
    with _answering(asked.folder, say) as tell:
        known = _truth(asked)
        if known is None:
            tell("error", "identified factors need the true position")
            return
        log = read_log(asked.file, asked.channel_map)
        tell("factors", identified_summary(identify(asked.machine, log, known, unit=asked.unit)))


def judge(say: Say, asked: Asked) -> None:
    """Judge a log as a commissioning; says ``report``, as the verb prints it, and writes the page; or ``error``."""
    with _answering(asked.folder, say) as tell:
        channel_map = asked.channel_map
        mapped = standard_map([]) if channel_map is None else load_map(channel_map)
        done = commission(asked.machine, asked.file, _truth(asked), unit=asked.unit, channel_map=channel_map)
        page = report_of(done, asked.machine, asked.unit, asked.file, asked.truth, mapped)
        (asked.folder / REPORT).write_text(page, encoding="utf-8", newline="\n")
        tell("report", done.text)


def columns_of(found: Dataset, known: Dataset | None) -> dict[str, Any]:
    """A track in mm: `position`, its band `low` to `high`, and with a truth `true` and `error`."""
    position = 1e3 * found["position"].values
    if LOWEST in found:
        low, high = (1e3 * found[end].values for end in (LOWEST, HIGHEST))
    else:
        half = 1e3 * TWO_SIDED_95 * found["position_std"].values
        low, high = position - half, position + half
    columns = {"position": position, "low": low, "high": high}
    if known is not None:
        at = known["time"].values
        true = 1e3 * np.interp(found["time"].values, at, known["position"].values, left=np.nan, right=np.nan)
        columns |= {"true": true, "error": position - true}
    return {"time": found["time"].values} | {name: values.astype(np.float32) for name, values in columns.items()}


def references(log: Dataset, found: Dataset, known: Dataset | None, stroke: float) -> list[dict[str, Any]]:
    """References of a log, in order: end stops that the sensor saw, and those that the log has.

    Args:
        log: with `motor_speed` [rad/s], and `reference` [m] if it has any.
        found: its track, with `mode` if the sensor reports one.
        stroke: of the cylinder [m].
    """
    rows = []
    if "mode" in found:
        driven = found.assign(motor_speed=("time", log["motor_speed"].values))
        rows = [(one.ends, f"end stop, {one.where}", one.position) for one in visits(driven, stroke)]
    if "reference" in log:
        at = np.flatnonzero(np.isfinite(log["reference"].values))
        first = at[np.insert(np.diff(at) > 1, 0, True)] if len(at) else at
        rows += [(float(log["time"][k]), "of the log", float(log["reference"][k])) for k in first]
    result = []
    for time, what, position in sorted(rows):
        row = {"time [s]": round(time, 2), "what": what, "position [mm]": _plain(1e3 * position)}
        if known is not None:
            true = np.interp(time, known["time"].values, known["position"].values, left=np.nan, right=np.nan)
            row["error [mm]"] = _plain(1e3 * (position - true))
        result.append(row)
    return result


def _draw(asked: Asked, log: Dataset, found: Dataset, known: Dataset | None) -> None:
    """The figures of the verb; of a long log every nth sample."""
    every = max(found.sizes["time"] // _DRAWN, 1)
    thin = {"time": slice(None, None, every)}
    if known is not None and every > 1:  # the truth at the samples that are drawn, so that errors stay what they are
        known = known.interp(time=found["time"].values[::every])
    title = verbatim(f"{asked.machine.title or asked.machine.name}, {asked.unit}: {Path(asked.file).name}")
    for name in FIGURES:
        tracked_figure(log.isel(thin), found.isel(thin), known, title, asked.folder / name)


def _truth(asked: Asked) -> Dataset | None:
    if asked.truth is not None:
        return read_truth(asked.truth)
    held = truth_in(asked.file, asked.channel_map)
    return None if held is None else held.dataset()


def _shares(say: Say) -> Callable[[float], None]:
    """Says how far a log is read, not for every piece of it."""
    done, said = 0.0, 0.0

    def advance(share: float) -> None:
        nonlocal done, said
        done += share
        if done >= said + _STEP:
            said = done
            say("progress", min(done, 1.0))

    return advance


def _plain(value: float) -> float | None:
    return round(float(value), 4) if np.isfinite(value) else None


@contextmanager
def _answering(folder: Path, say: Say) -> Iterator[Say]:
    """Say results, what was warned of in the end, or the error, in words that name no folder of the server."""

    def plain(text: object) -> str:
        words = str(text).replace(f"{folder}{os.sep}", "")
        return re.sub(rf"{re.escape(str(folder.parent))}[\\/](?:[\w-]+[\\/])?", "", words)

    def tell(what: str, value: Any) -> None:
        if isinstance(value, str):
            value = plain(value)
        elif isinstance(value, dict):
            value = {key: plain(one) if isinstance(one, str) else one for key, one in value.items()}
        say(what, value)

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", LogWarning)
        try:
            yield tell
        except RamsightError as error:
            tell("error", str(error))
    say("warnings", [plain(one.message) for one in said if issubclass(one.category, LogWarning)])
