"""From a drive log to a position: logs, sensors, tracks, and how good a track is."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ramsight.api.arguments import path_argument, pieces_argument, truth_argument
from ramsight.api.following import Quantity, availability_of, follow, start_of, true_position
from ramsight.api.live_sensor import Sensor
from ramsight.argument_kinds import by_kind
from ramsight.calibration.sensors import sensor_for as make_sensor
from ramsight.errors import DescriptionError
from ramsight.logs.channel_map import AnyMap, known_map
from ramsight.plant.build import AnyUnit, build
from ramsight.sensor.inputs.sample import REPORTED
from ramsight.sensor.thresholds import START_STD
from ramsight.signals import Dataset
from ramsight.tracking.availability import TIME_TO_ALERT
from ramsight.tracking.track_errors import judged


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
    true = true_position(truth_argument(truth), log, channel_map, built)
    available = availability_of(built, alarm_limit, time_to_alert)
    done = follow(
        built,
        pieces_argument(log, channel_map),
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
