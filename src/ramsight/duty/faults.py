"""Faults of what a drive reports, put into a drive log: what a sensor has to notice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.signals import TIME, Dataset, Signals

CHANNELS = ("motor_speed", "motor_torque", "oil_temperature", "shaft_angle", "dc_power")
VALUE_KINDS = ("nan", "stuck", "offset", "gain", "sign")
TIME_KINDS = ("dropout", "jitter", "reordering", "frozen", "jump")
"""The kinds that change a channel's values, and those that change when samples come."""


@dataclass(frozen=True)
class Fault:
    """One fault."""

    # kind: ``nan``: no value. ``stuck``: the value of its first sample. ``offset``: plus `size`. ``gain``: times
    # `size`. ``sign``: the opposite. ``dropout``: samples are missing. ``jitter``: samples come up to `size` seconds
    # late, their times as they come. ``reordering``: neighbours change places, times with them. ``frozen``: time
    # stands still. ``jump``: time is `size` seconds ahead
    kind: str
    # start, end: when it is there [s]
    start: float
    end: float
    channel: str | None = None  # one of `CHANNELS`; kinds that change time have none
    size: float = 0.0  # in the channel's SI unit [1, s, rad/s, N m, K, rad or W]

    def __post_init__(self) -> None:
        if self.kind not in (*VALUE_KINDS, *TIME_KINDS):
            raise ValueError(f"no fault {self.kind!r}; there are {', '.join((*VALUE_KINDS, *TIME_KINDS))}")
        if (self.channel in CHANNELS) != (self.kind in VALUE_KINDS):
            raise ValueError(f"a {self.kind} fault of {self.channel!r}; channels are {', '.join(CHANNELS)}")


def inject(log: Dataset, fault: Fault, seed: int = 0) -> Dataset:
    """A copy of a drive log with a fault in it.

    Args:
        log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].
        fault: what to put in.
        seed: of the jitter.

    Example:
        >>> import numpy as np, xarray
        >>> speed = ("time", np.arange(4.0))
        >>> log = xarray.Dataset({"motor_speed": speed}, coords={"time": [0.0, 0.1, 0.2, 0.3]})
        >>> inject(log, Fault("stuck", 0.1, 0.2, "motor_speed"))["motor_speed"].values.tolist()
        [0.0, 1.0, 1.0, 3.0]
    """
    return faulty(Signals.of(log), fault, seed).dataset().copy(deep=True)  # its values are its own


def faulty(log: Signals, fault: Fault, seed: int = 0) -> Signals:
    """The same of a log that is columns; arguments as `inject`."""
    time = log["time"].values
    during = (time >= fault.start) & (time <= fault.end)
    if fault.kind in VALUE_KINDS:
        assert fault.channel is not None
        values = log[fault.channel].values.copy()
        values[during] = _changed(values[during], fault)
        return log.replaced({fault.channel: values})
    if fault.kind == "dropout":
        return log.rows(~during)
    if fault.kind == "reordering":
        places = np.arange(len(time))
        inside = np.flatnonzero(during)
        pairs = inside[: len(inside) // 2 * 2].reshape(-1, 2)
        places[pairs.ravel()] = pairs[:, ::-1].ravel()
        return log.rows(places)
    moved = time.copy()
    if fault.kind == "jitter":
        moved[during] += np.random.default_rng(seed).uniform(0.0, fault.size, int(during.sum()))
        moved = np.maximum.accumulate(moved)
    elif fault.kind == "frozen":
        moved[during] = time[np.argmax(during)]
    else:
        moved[during] += fault.size
    return log.replaced({TIME: moved})


def _changed(values: Array, fault: Fault) -> Array:
    if fault.kind == "nan":
        return np.full_like(values, np.nan)
    if fault.kind == "stuck":
        return np.full_like(values, values[0]) if len(values) else values
    if fault.kind == "offset":
        return values + fault.size
    return values * (fault.size if fault.kind == "gain" else -1.0)
