"""What the kalman sensor notices of faults in what the drive reports, and how soon.

Each fault is put into work days of machines drawn at random while the motor turns. It counts as noticed if, until ten
seconds after its end, a sample has a status that is not ok, and not what the same sample has without the fault. It did
harm unseen if for more than half a second together the sensor says ok while the position is wrong by more than 5 mm and
4 standard deviations.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import work_days
import xarray
from numpy.typing import NDArray

from ramsight.arrays import true_intervals
from ramsight.duty.faults import Fault, inject
from ramsight.engine.recursion import replay_many
from ramsight.sensor.report.detectors import CONTRADICTIONS
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import BOUND, VirtualSensor, log_inputs

Track = dict[str, NDArray[np.float64]]
"""Position and its deviation [m], status and bound [m], by the names of the sensor's outputs."""
_AFTER = 10.0  # s
SIGNALS: dict[str, dict[str, float]] = {
    "speed, torque, temperature": {},
    "+ counter": {"shaft.std": math.radians(0.05)},
    "+ DC power": {"power.std": 0.005},
    "+ counter and DC power": {"shaft.std": math.radians(0.05), "power.std": 0.005},
    "+ pressures": {"pressure.std": 1e5},
    "one load that is known to stay": {"machine.load_walk": 1e-4, "machine.unseen_load": 0.002},
}
"""What the sensor is given, or knows, beside what every drive reports."""
ELECTRICAL = ("shaft_angle", "dc_power")
_WRONG, _STDS, _LONG = 5e-3, 4.0, 0.5  # m, standard deviations, s
_OFFSETS = {"motor_speed": ("10 rad/s", 10.0), "motor_torque": ("10 N m", 10.0), "oil_temperature": ("15 K", 15.0)}
_TURNING = 20.0  # rad/s
_EARLIEST, _LATEST = 150.0, 40.0  # s after the start, before the end


def faults(at: float, log: xarray.Dataset) -> Iterator[tuple[str, str, Fault]]:
    """Every fault of the table that a log can have, from a time on [s]: input, what is wrong with it, and the fault."""
    for channel in (name for name in ELECTRICAL if name in log):
        yield channel, "NaN, 1 s", Fault("nan", at, at + 1.0, channel)
        yield channel, "stuck, 5 s", Fault("stuck", at, at + 5.0, channel)
        yield channel, "gain 1.3, 20 s", Fault("gain", at, at + 20.0, channel, 1.3)
        yield channel, "sign, 20 s", Fault("sign", at, at + 20.0, channel)
    for channel, (words, size) in _OFFSETS.items():
        yield channel, "NaN, 1 s", Fault("nan", at, at + 1.0, channel)
        yield channel, "stuck, 5 s", Fault("stuck", at, at + 5.0, channel)
        yield channel, f"offset {words}, 20 s", Fault("offset", at, at + 20.0, channel, size)
        yield channel, "gain 1.3, 20 s", Fault("gain", at, at + 20.0, channel, 1.3)
        yield channel, "sign, 20 s", Fault("sign", at, at + 20.0, channel)
    for words, length in (("10 ms", 0.01), ("50 ms", 0.05), ("0.2 s", 0.2), ("1 s", 1.0), ("5 s", 5.0)):
        yield "all", f"dropout {words}", Fault("dropout", at, at + length)
    yield "time", "jitter 15 ms, 20 s", Fault("jitter", at, at + 20.0, size=0.015)
    yield "time", "jitter 300 ms, 20 s", Fault("jitter", at, at + 20.0, size=0.3)
    yield "all", "reordering, 2 s", Fault("reordering", at, at + 2.0)
    yield "time", "frozen, 1 s", Fault("frozen", at, at + 1.0)
    yield "time", "jump by 10 s, 1 s", Fault("jump", at, at + 1.0, size=10.0)
    yield "time", "jump by −10 s, 1 s", Fault("jump", at, at + 1.0, size=-10.0)


def turning(log: xarray.Dataset, after: float, before: float) -> NDArray[np.float64]:
    """Times of samples between two [s] at which the motor turns."""
    time, speed = log["time"].values, log["motor_speed"].values
    return time[(np.abs(speed) > _TURNING) & (time > after) & (time < before)]


def tracks_of(sensor: VirtualSensor, days: Sequence[work_days.Day], logs: Sequence[xarray.Dataset]) -> list[Track]:
    """What a sensor makes of logs, several side by side; a log a day."""
    states = []
    for day in days:
        sensor.start(day.start)
        states.append(list(sensor.state.values()))
    kept = ("position", "position_std", "status", BOUND)
    inputs = [log_inputs(sensor, log) for log in logs]
    found = replay_many(sensor.recursion, inputs, sensor.parameters, np.array(states), kept)
    return [dict(zip(kept, columns.T, strict=True)) for columns in found]


def with_rows(day: work_days.Day, fault: Fault, seed: int) -> tuple[xarray.Dataset, NDArray[np.int64]]:
    """A day's log with a fault in it, and which of its samples are left."""
    marked = day.log.assign(sample=("time", np.arange(day.log.sizes["time"])))
    faulty = inject(marked, fault, seed)
    return faulty.drop_vars("sample"), faulty["sample"].values


def _judged(day: work_days.Day, clean: Track, track: Track, rows: NDArray[np.int64], fault: Fault) -> list[float]:
    """What a fault did.

    Whether it was noticed, after how long [s], whether it did harm unseen, the largest error [m], and how many samples
    are ok and beyond their bound.
    """
    time = day.log["time"].values[rows]
    window = (time >= fault.start - 1e-9) & (time <= fault.end + _AFTER)
    status, usual = track["status"], clean["status"][rows]
    noticed = window & (status >= Status.REFERENCE_DUE) & (status != usual) & (status != Status.NEAR_RELIEF)
    error = np.abs(track["position"] - day.position[rows])
    trusted = status == Status.OK
    wrong = window & trusted & (error > _WRONG) & (error > _STDS * track["position_std"])
    samples = round(_LONG / float(np.median(np.diff(day.log["time"].values))))
    runs = np.convolve(wrong.astype(float), np.ones(samples), "valid")
    delay = float(time[np.argmax(noticed)] - fault.start) if noticed.any() else np.nan
    beyond = window & trusted & (error > track[BOUND])
    harm = float((runs > samples - 0.5).any())
    return [float(noticed.any()), delay, harm, float(error[window].max()), float(beyond.sum())]


def study(machines: int, advance: Callable[[int], object], times: int = 4) -> dict[str, dict[str, Any]]:
    """By what the sensor is given: the fault table, a row a fault, and what it says of the same days without faults."""
    return {name: _given(keys, machines, times, advance, one_load="load" in name) for name, keys in SIGNALS.items()}


def _given(
    keys: dict[str, float], machines: int, times: int, advance: Callable[[int], object], *, one_load: bool
) -> dict[str, Any]:
    found: dict[tuple[str, str], list[list[float]]] = defaultdict(list)
    false, hours = 0, 0.0
    for sensor, day, seed in work_days.days(machines, keys, advance, one_load=one_load):
        (clean,) = tracks_of(sensor, [day], [day.log])
        time = day.log["time"].values
        false, hours = false + alarms(clean), hours + float(time[-1] - time[0]) / 3600.0
        random = np.random.default_rng(seed)
        injected = [
            one
            for at in random.choice(turning(day.log, _EARLIEST, time[-1] - _LATEST), times)
            for one in faults(float(at), day.log)
        ]
        logs = [with_rows(day, fault, seed) for _, _, fault in injected]
        tracks = tracks_of(sensor, [day] * len(logs), [log for log, _ in logs])
        for (channel, words, fault), (_, rows), track in zip(injected, logs, tracks, strict=True):
            found[channel, words].append(_judged(day, clean, track, rows, fault))
    table = [_row(*key, np.array(results)) for key, results in found.items()]
    return {"rows": table, "hours": hours, "contradictions_without_a_fault": false}


def alarms(track: Track) -> int:
    """How often a drive's report is said to contradict itself."""
    return len(true_intervals(np.isin(track["status"], CONTRADICTIONS)))


def _row(channel: str, words: str, values: np.ndarray) -> dict[str, float | str | None]:
    noticed = values[:, 0] > 0.5
    return {
        "input": channel,
        "fault": words,
        "injected": len(values),
        "noticed": float(noticed.mean()),
        "delay_s": float(np.median(values[noticed, 1])) if noticed.any() else None,
        "harm_unseen": float(values[:, 2].mean()),
        "error_median_mm": 1e3 * float(np.median(values[:, 3])),
        "beyond_bound_and_ok": float((values[:, 4] > 0.0).mean()),
    }
