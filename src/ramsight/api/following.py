"""A log followed by a sensor: what Python and the command line share of it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.calibration.sensors import sensor_for
from ramsight.errors import DescriptionError, LogWarning
from ramsight.logs.channel_map import AnyMap
from ramsight.logs.opening import open_signals
from ramsight.plant.unit import HydraulicUnit
from ramsight.progress import progress as progress_bar
from ramsight.signals import Dataset, Signals
from ramsight.tracking.availability import LONGEST_ALERT, Availability
from ramsight.tracking.pieces import TABLE, Pieces, track_pieces
from ramsight.tracking.watched import Watch, contradicted
from ramsight.units import argument, format_si

if TYPE_CHECKING:
    from ramsight.hindsight.looking_back import LookedBack
    from ramsight.sensor.persistence import StateFile
    from ramsight.sensor.virtual_sensor import VirtualSensor
    from ramsight.tool.tool_track import ToolPoint
    from ramsight.tracking.pieces import Follower

Quantity = float | str
NO_FILE = "log"
"""What messages call a log that is no file."""


def start_of(unit: HydraulicUnit, start: Quantity | None, start_std: Quantity) -> tuple[float | None, float]:
    """Where a piston is reported as at first, and the standard deviation of that [m].

    Args:
        start: [m], or text with a unit; None if unknown.
        start_std: its standard deviation [m], or text with a unit.

    Raises:
        DescriptionError: one of them cannot be read or is outside the stroke.
    """
    stroke = format_si(unit.cylinder.stroke, "mm")
    position = None if start is None else argument(start, "m", "start", least="0 mm", most=stroke)
    return position, argument(start_std, "m", "start_std", least="0.01 mm", most=stroke)


def availability_of(unit: HydraulicUnit, limit: Quantity | None, time_to_alert: Quantity) -> Availability | None:
    """What counts how much of the time a position may be used; None without an alarm limit.

    Args:
        limit: error that it must not have [m], or text with a unit.
        time_to_alert: for which that may be unsure [s], or text with a unit.

    Raises:
        DescriptionError: one of them cannot be read or is out of range.
    """
    if limit is None:
        return None
    stroke = format_si(unit.cylinder.stroke, "mm")
    allowed = argument(limit, "m", "alarm_limit", least="0.1 mm", most=stroke)
    waits = argument(time_to_alert, "s", "time_to_alert", least="0 s", most=format_si(LONGEST_ALERT, "s"))
    return Availability(allowed, waits)


def follow(
    unit: HydraulicUnit,
    log: str | Path | Iterable[Signals],
    channel_map: AnyMap | None = None,
    *,
    sensor: str,
    start: float | None,
    start_std: float,
    state: str | Path | None = None,
    out: str | Path | None = None,
    keep_track: bool = False,
    keep_log: bool = False,
    all_of_it: bool = False,
    more: tuple[str, ...] = (),
    available: Availability | None = None,
    hindsight: bool = False,
    both: bool = False,
    tool: ToolPoint | None = None,
    progress: bool = False,
    advance: Callable[[float], object] | None = None,
    say: Callable[[str], object] = lambda text: None,
) -> Pieces:
    """Make a sensor, start or resume it, track a log piece by piece, and keep the sensor's state.

    Of a log that contradicts the machine no state is kept, and what its track says of the position is invalid.

    Args:
        log: a file, or a log's pieces; warned of what cannot be this machine's.
        start: [m]; None if unknown.
        start_std: its standard deviation [m].
        state: file to resume from without a start, and to keep the state in; this call's alone until it returns.
        hindsight: whether all of the log says where the piston was, and not what came before.
    """
    if hindsight and sensor != "kalman":
        raise DescriptionError("has no hypotheses to look back at", key="sensor", value=sensor, allowed="kalman")
    virtual = _sensor_of(unit, sensor, progress=progress)
    kept = None if state is None else _state_file(Path(state), virtual, unit.name)

    def begin(say: Callable[[str], object]) -> None:
        if kept is not None and start is None:
            _resumed(kept, say)
        else:
            virtual.start(start, start_std)

    passed: list[Signals] | None = [] if hindsight or not isinstance(log, str | Path) else None
    with ExitStack() as stack:
        if kept is not None:
            stack.callback(kept.release)
            kept.hold()
        begin(say)
        bar = stack.enter_context(progress_bar(1.0, "tracking")) if progress else None
        tells = _parts_of(bar.advance if bar else advance, _ways(virtual, hindsight=hindsight))
        pieces = _opened(log, channel_map, tells)
        watch = Watch(unit, log if isinstance(log, str | Path) else NO_FILE, channel_map)
        seen = watch.over(pieces if passed is None else _remembered(pieces, passed))
        back = None
        if hindsight:
            names = None if all_of_it else (*TABLE, *more)
            if whole := list(seen):
                back = _looked_back(virtual, unit, whole, names, tells)
            seen = iter(whole)
        passes = partial(
            track_pieces, out=out, keep_track=keep_track, keep_log=keep_log, all_of_it=all_of_it, available=available,
            more=more if back is None else (*more, *back.further),
            beside=(*(() if tool is None else tool.columns), *(back.further if both and back is not None else ())),
        )  # fmt: skip

        def follower() -> Follower:
            plain = virtual if back is None else back.recalled()
            return plain if tool is None else tool.following(plain, unit.name)

        done = passes(follower(), seen)
        if (mistake := watch.mistake) is not None:  # known at the end alone: the track is made again, and says it
            begin(lambda text: None)
            if available is not None:
                available.clear()
            again = _opened(log, channel_map, None) if passed is None else passed
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", LogWarning)
                done = passes(follower(), again, said_of=lambda tracked: contradicted(tracked, mistake))
            if kept is not None:
                say(f"{kept.path}: left as it was, because the log contradicts the machine")
        elif kept is not None:
            kept.save()
    fits = "" if back is None or watch.mistake is not None else back.text
    summary = f"{done.summary}\n  {fits}" if fits else done.summary
    return replace(done, summary=summary, mistake=watch.last_word, is_contradicted=watch.mistake is not None)


def _opened(
    log: str | Path | Iterable[Signals], channel_map: AnyMap | None, advance: Callable[[float], object] | None
) -> Iterable[Signals]:
    """The pieces of a log."""
    return open_signals(log, channel_map, advance=advance) if isinstance(log, str | Path) else log


def _state_file(path: Path, virtual: VirtualSensor, name: str) -> StateFile:
    from ramsight.sensor.persistence import StateFile

    return StateFile(path, virtual, name)


def _resumed(kept: StateFile, say: Callable[[str], object]) -> None:
    from ramsight.sensor.persistence import said

    say(said(kept.resume(), kept.path))


def _ways(virtual: VirtualSensor, *, hindsight: bool) -> float:
    """How often a log is gone through at most."""
    if not hindsight:
        return 1.0
    from ramsight.hindsight.looking_back import ways_of

    return 1.0 + ways_of(virtual.state)


def _looked_back(
    virtual: VirtualSensor,
    unit: HydraulicUnit,
    pieces: list[Signals],
    names: tuple[str, ...] | None,
    advance: Callable[[float], object] | None,
) -> LookedBack:
    """All of a log, looked back at; the sensor goes on from its end."""
    from ramsight.hindsight.looking_back import looked_back
    from ramsight.hindsight.trace import Tracer

    back = looked_back(Tracer.of(unit), pieces, virtual.state, names=names, advance=advance)
    virtual.state = back.state
    return back


def _parts_of(advance: Callable[[float], object] | None, ways: float) -> Callable[[float], object] | None:
    """What takes shares of a way through a log, of which there are so many."""
    return None if advance is None else lambda share: advance(share / ways)


def _sensor_of(unit: HydraulicUnit, kind: str, *, progress: bool) -> VirtualSensor:
    """A sensor; a bar is shown where it takes runs to make one."""
    if kind != "table" or not progress:
        return sensor_for(unit, kind)
    from ramsight.calibration.movement import RUNS

    with progress_bar(RUNS, "calibrating the table") as bar:
        return sensor_for(unit, kind, advance=bar.advance)


def _remembered(pieces: Iterable[Signals], passed: list[Signals]) -> Iterator[Signals]:
    """The pieces as they come, kept for a second time."""
    for piece in pieces:
        passed.append(piece)
        yield piece


def true_position(
    truth: str | Path | Dataset | None, log: object, channel_map: AnyMap | None, unit: HydraulicUnit
) -> Signals | None:
    """The true position of a log where there can be any; as `ramsight.tracking.credible.known_position`."""
    if truth is None and channel_map is None:
        return None
    from ramsight.tracking.credible import known_position

    return known_position(truth, log, channel_map, unit)
