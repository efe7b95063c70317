"""From a drive log to a position: logs, sensors, tracks, and how good a track is."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.api.arguments import checked, log_argument, path_argument, truth_argument
from ramsight.api.live_sensor import Sensor
from ramsight.argument_kinds import by_kind
from ramsight.calibration.sensors import sensor_for as make_sensor
from ramsight.errors import DescriptionError, LogWarning
from ramsight.logs.channel_map import AnyMap, known_map
from ramsight.logs.data_frame import is_data_frame
from ramsight.logs.opening import open_signals
from ramsight.optional import needing
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.unit import HydraulicUnit
from ramsight.progress import progress as progress_bar
from ramsight.sensor.inputs.sample import REPORTED
from ramsight.sensor.persistence import StateFile, said
from ramsight.sensor.thresholds import START_STD
from ramsight.signals import Dataset, Signals
from ramsight.tracking.availability import LONGEST_ALERT, TIME_TO_ALERT, Availability
from ramsight.tracking.credible import known_position
from ramsight.tracking.pieces import TABLE, Pieces, track_pieces
from ramsight.tracking.position_errors import judged
from ramsight.tracking.watched import Watch, contradicted
from ramsight.units import argument, format_si

if TYPE_CHECKING:
    from ramsight.hindsight.looking_back import LookedBack
    from ramsight.sensor.virtual_sensor import VirtualSensor
    from ramsight.tool.tool_track import ToolPoint
    from ramsight.tracking.pieces import Follower

Quantity = float | str
_NO_FILE = "log"  # what messages call a log that is no file


@by_kind
def sensor_for(machine: AnyUnit, kind: str | Path = "kalman", *, unit: str | None = None) -> Sensor:
    """A virtual sensor: `start` it, then give it samples (`step`) or a log (`track`).

    Args:
        machine: the unit it watches, or what `build` makes one of.
        kind: ``kalman``, which finds the position by itself; ``balance``; ``table``, which some hundred simulated
            runs calibrate first, once: it is kept; or a sensor file of `ramsight calibrate`.
        unit: name of the unit, if the machine has several.

    Returns:
        The sensor. Its `start(position)` [m] and `step(time, motor_speed, motor_torque, oil_temperature)` [s, rad/s,
        N m, K] take SI numbers or text with a unit, `track(log)` takes a log, and `step` gives an `Estimate` (position
        and position_std [m], velocity [m/s], load [N]); `start` raises `StartError` for a position outside the stroke.

    Raises:
        UnknownNameError: no such machine, unit or sensor.
        RamsightError: the sensor file cannot be used, or was made for another unit.

    Example:
        >>> import ramsight
        >>> sensor = ramsight.sensor_for("mining-loader", unit="boom")
        >>> sensor.start(position="100 mm")
        >>> now = sensor.step(time=0.0, motor_speed=0.0, motor_torque=0.0, oil_temperature=313.15)
        >>> now.position, now.status is ramsight.Status.REFERENCE_DUE  # an entered position may be wrong
        (0.1, True)
    """
    return Sensor.of(make_sensor(build(machine, unit), _kind(kind)))


def _kind(kind: str | Path) -> str:
    """A kind of sensor, or its file, as an argument."""
    return str(path_argument(kind, "sensor"))


@by_kind
def track(
    machine: AnyUnit,
    log: str | Path | Dataset | Iterable[Dataset],
    start: Quantity | None = None,
    truth: str | Path | Dataset | None = None,
    *,
    unit: str | None = None,
    start_std: Quantity = START_STD,
    sensor: str = "kalman",
    channel_map: AnyMap | None = None,
    state: str | Path | None = None,
    alarm_limit: Quantity | None = None,
    time_to_alert: Quantity = TIME_TO_ALERT,
    hindsight: bool = False,
    progress: bool = False,
) -> Dataset:
    """Where the piston was, from the log of a motor drive; and how wrong that is, where the truth is known.

    All of the track is in memory. Where a log is too long for that, take `sensor_for(...).track` for each piece of
    `open_log`: a sensor goes on where the last piece ended.

    Args:
        machine: the unit that the drive turns, or what `build` makes one of.
        log: a file or a DataFrame (as `read_log` takes), a log, or its pieces in order.
        start: piston position at the first sample [m], or ``"120 mm"``; None if unknown: the kalman sensor is
            not referenced until it meets an end stop or a reference, the others cannot work.
        truth: true position, to judge the track by: a file with ``time_s`` and ``position_m``, or a Dataset with
            `position` [m] over `time` [s], for example of `simulate`. None: what the map names as
            ``measured.position`` of the log itself, if it does.
        unit: name of the unit, if the machine has several.
        start_std: standard deviation of `start` [m].
        sensor: as `sensor_for`'s kind.
        channel_map: of a file, as `read_log`'s.
        state: resume the sensor from this file if it is there, unless a start is passed; keep its state in it at the
            end. For kalman.
        alarm_limit: error that the position must not have for what it is used for [m], or ``"10 mm"``.
        time_to_alert: for which that may be unsure before it is an alert [s], or ``"0.2 s"``.
        hindsight: say where the piston was by all that the log says, what comes later included, and not as a live
            sensor would have. For kalman.
        progress: show a bar on a terminal if it takes long.

    Returns:
        Over `time` [s], shape (samples,): `position` and `position_std` [m], NaN while the sensor is not referenced,
        `velocity` [m/s], `load` [N], `status` (numbers of `Status`), what else the sensor reports, and the log itself.
        With a truth also `true_position` [m] and `error` [m], NaN where either is unknown, and in the attributes
        `error_largest`, `error_p95` and `error_final`, magnitudes in m, over the `error_samples` samples whose status
        is not invalid, and `invalid_largest` over the `invalid_samples` others. Where the log cannot be this machine's,
        `mistake` says what is most likely wrong, and a position that was said is invalid if that is sure. With an alarm
        limit, the attributes `available`, the share of the samples whose bound is within it, `alerts`, how often it was
        not for longer than the time to alert, and `longest_alert` [s]. In hindsight also what the live sensor said,
        `live_position`, `live_position_std` and so on, and `nis`, the normalised innovation squared of each measurement
        of the place [1]; with a truth the attributes `live_error_largest` and `live_error_p95` [m].

    Raises:
        DescriptionError: a quantity cannot be read or is outside the stroke; names argument, value and range. Or
            hindsight is asked of another sensor than kalman.
        UnknownNameError: no such machine, unit or sensor.
        StartError: the sensor needs the piston's position at the start.
        LogError: log or truth cannot be read, or lack a variable.
        ComparisonError: log and truth have no time in common.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", unit="boom")
        >>> run = ramsight.simulate(boom, load="441 kN", start="120 mm")
        >>> track = ramsight.track(boom, ramsight.drive_report(run), start="120 mm", truth=run)
        >>> bool(track.attrs["error_largest"] < 1e-3), track["error"].attrs["units"]
        (True, 'm')
    """
    from ramsight.output.notebook import ShownDataset

    built = build(machine, unit)
    position, std = start_of(built, start, start_std)
    channel_map = known_map(channel_map)
    true = known_position(truth_argument(truth), log, channel_map, built)
    available = availability_of(built, alarm_limit, time_to_alert)
    done = follow(
        built,
        log,
        channel_map,
        sensor=_kind(sensor),
        start=position,
        start_std=std,
        state=None if state is None else path_argument(state, "state"),
        keep_track=True,
        keep_log=True,
        all_of_it=True,
        available=available,
        hindsight=hindsight,
        progress=progress,
    )
    if done.track is None or done.log is None:
        raise DescriptionError("has no samples", key="log")
    log_kept = done.log.dataset()
    reported = {name: log_kept[name] for name in (*REPORTED[1:], "reference") if name in log_kept}
    whole = done.track.dataset().assign(reported)
    whole.attrs |= {"kind": "track", "unit": built.name}
    if done.mistake:
        whole.attrs["mistake"] = done.mistake
    if available is not None:
        found = {"available": available.share, "alerts": available.alerts, "longest_alert": available.longest}
        whole.attrs |= found
    return ShownDataset.of(whole if true is None else judged(whole, true))


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
    log: str | Path | Dataset | Iterable[Dataset],
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
        log: a file, a log or its pieces; warned of what cannot be this machine's.
        start: [m]; None if unknown.
        start_std: its standard deviation [m].
        state: file to resume from without a start, and to keep the state in; this call's alone until it returns.
        hindsight: whether all of the log says where the piston was, and not what came before.
    """
    if hindsight and sensor != "kalman":
        raise DescriptionError("has no hypotheses to look back at", key="sensor", value=sensor, allowed="kalman")
    virtual = _sensor_of(unit, sensor, progress=progress)
    kept = None if state is None else StateFile(Path(state), virtual, unit.name)

    def begin(say: Callable[[str], object]) -> None:
        if kept is not None and start is None:
            say(said(kept.resume(), kept.path))
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
        pieces, file = _pieces(log, channel_map, tells)
        watch = Watch(unit, file, channel_map)
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
            again = _pieces(log, channel_map, None)[0] if passed is None else passed
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
        return make_sensor(unit, kind)
    from ramsight.calibration.movement import RUNS

    with progress_bar(RUNS, "calibrating the table") as bar:
        return make_sensor(unit, kind, advance=bar.advance)


def _remembered(pieces: Iterable[Signals], passed: list[Signals]) -> Iterator[Signals]:
    """The pieces as they come, kept for a second time."""
    for piece in pieces:
        passed.append(piece)
        yield piece


def _pieces(
    log: str | Path | Dataset | Iterable[Dataset], channel_map: AnyMap | None, advance: Callable[[float], object] | None
) -> tuple[Iterable[Signals], str | Path]:
    """The pieces of a log, and the file that warnings name."""
    if isinstance(log, str | Path):
        return open_signals(log, channel_map, advance=advance), log
    with needing("datasets"):
        import xarray

    if is_data_frame(log):
        return (Signals.of(log_argument(one, channel_map)) for one in (log,)), _NO_FILE
    if not isinstance(log, Iterable):
        checked(log, _NO_FILE)
    pieces = log if isinstance(log, Iterable) and not isinstance(log, xarray.Dataset) else [log]
    return (Signals.of(checked(piece, _NO_FILE)) for piece in pieces), _NO_FILE


__all__ = ["availability_of", "follow", "sensor_for", "start_of", "track"]
