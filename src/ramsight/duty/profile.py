"""Quantities over time as straight lines between corners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ramsight.argument_kinds import check_kind, whole_argument
from ramsight.arrays import Array
from ramsight.engine.run import Segments
from ramsight.errors import DescriptionError, LogError, UnknownNameError
from ramsight.logs.channels import MOTOR_SPEED, OIL_TEMPERATURE, TIME, Channel
from ramsight.logs.csv_table import FIRST_ROW, read_timed
from ramsight.logs.lines import file_name
from ramsight.plant.circuit import WARMING, command_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import argument

_NUMBERS = "fiu"  # NumPy's kinds of real numbers
_MOST_TIMES = 1_000_000  # that a duty is repeated
_TEMPERATURE_STEP = 0.05  # K; a changing oil temperature is held over pieces no coarser than this


@dataclass(frozen=True)
class Profile:
    """A quantity that runs straight from corner to corner and stays at its last value.

    Args:
        time: corners [s], strictly increasing, shape (n,).
        value: value at each corner [SI], shape (n,).

    Raises:
        DescriptionError: they are no numbers, are not equally many, or time does not increase.

    Example:
        >>> ramp = Profile([0.0, 2.0], [0.0, 10.0])
        >>> float(ramp(1.5)), float(ramp(9.0))
        (7.5, 10.0)
    """

    time: Array
    value: Array

    def __init__(self, time: ArrayLike, value: ArrayLike) -> None:
        object.__setattr__(self, "time", np.atleast_1d(_numbers(time, "time")))
        object.__setattr__(self, "value", np.atleast_1d(_numbers(value, "value")))
        if self.time.ndim != 1 or self.time.shape != self.value.shape or not self.time.size:
            found = f"{self.time.shape} and {self.value.shape}"
            raise DescriptionError("must be equally long lists", key="time and value", value=found)
        for name, corners in (("time", self.time), ("value", self.value)):
            if not np.all(np.isfinite(corners)):
                raise DescriptionError("must be finite", key=name, value=corners)
        if np.any(np.diff(self.time) <= 0.0):
            raise DescriptionError("must increase from corner to corner", key="time", value=self.time)

    def __call__(self, time: ArrayLike) -> Array:
        """Value at times [s]."""
        return np.asarray(np.interp(_numbers(time, "time"), self.time, self.value))


def _numbers(passed: ArrayLike, name: str) -> Array:
    """An argument as an array.

    Raises:
        DescriptionError: it holds what is no number, or one that no float holds.
    """
    try:
        found = np.asarray(passed)
        if found.dtype.kind in _NUMBERS:
            return found.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise DescriptionError("holds what is no number", key=name, value=passed, allowed="a number, or a list of numbers")


def constant(value: float) -> Profile:
    """A quantity that does not change."""
    return Profile([0.0], [value])


@dataclass(frozen=True)
class Duty:
    """What a unit is asked to do.

    Args:
        motor_speed: command to the drive [rad/s]; positive extends.
        load: force on the piston [N]; positive works against lifting.
        oil_temperature: [K].
        start_position: of the piston [m].
        end: when the duty ends [s]; by default at the last corner of the speed.
        commands: to parts that are commanded, by their names, each held from corner to corner, -1 to 1 [1].

    Example:
        >>> import ramsight
        >>> speed = ramsight.Profile([0.0, 1.0, 5.0], [0.0, 100.0, 100.0])  # s, rad/s
        >>> load, oil = ramsight.Profile([0.0], [200e3]), ramsight.Profile([0.0], [313.15])  # N, K
        >>> duty = ramsight.Duty(speed, load, oil, start_position=0.1)  # m
        >>> duty.duration, float(duty.motor_speed(0.5))
        (5.0, 50.0)
    """

    motor_speed: Profile
    load: Profile
    oil_temperature: Profile
    start_position: float
    end: float | None = None
    commands: Mapping[str, Profile] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Read and check what was passed.

        Raises:
            DescriptionError: a profile or a quantity is none.
        """
        check_kind(self.commands, "commands", (Mapping,))
        profiles = {"motor_speed": self.motor_speed, "load": self.load, "oil_temperature": self.oil_temperature}
        for name, profile in (*profiles.items(), *self.commands.items()):
            check_kind(profile, name, (Profile,))
        start = argument(self.start_position, "m", "start_position", least="-1 km", most="1 km")
        object.__setattr__(self, "start_position", start)
        if self.end is not None:
            object.__setattr__(self, "end", argument(self.end, "s", "end", least="0 s", most="1e6 s"))

    @property
    def duration(self) -> float:
        """Length of the duty [s]."""
        return float(self.motor_speed.time[-1]) if self.end is None else self.end

    def repeated(self, times: int) -> Duty:
        """The same duty several times in a row; loads and temperatures repeat with it."""
        whole_argument(times, "times", 1, _MOST_TIMES)
        period = self.duration
        return Duty(
            _repeat(self.motor_speed, period, times),
            _repeat(self.load, period, times),
            _repeat(self.oil_temperature, period, times),
            self.start_position,
            end=period * times,
            commands={name: _repeat_held(profile, period, times) for name, profile in self.commands.items()},
        )

    def corners(self) -> Array:
        """Times at which an input bends or the held temperature steps [s], from 0 to the end."""
        steps = (profile.time for profile in self.commands.values())
        bends = (self.motor_speed.time, self.load.time, held_corners(self.oil_temperature), *steps)
        return all_corners(bends, self.duration)

    def commanded(self, name: str, time: ArrayLike) -> Array:
        """What a part is commanded to, -1 to 1 [1], at times [s]."""
        if str(name) not in self.commands:
            raise UnknownNameError("command", str(name), self.commands)
        profile = self.commands[str(name)]
        place = np.searchsorted(profile.time, _numbers(time, "time"), side="right") - 1
        return np.asarray(profile.value[np.maximum(place, 0)])

    def segments(self, parameters: Array, names: Sequence[str]) -> Segments:
        """The duty as the engine's segments.

        Args:
            parameters: of the model, in SI units, shape (parameters,).
            names: of the parameters; the oil's temperature and the parts' commands are among them.
        """
        corner = self.corners()
        inputs = np.column_stack([self.motor_speed(corner), self.load(corner)])
        slope = np.diff(inputs, axis=0) / np.diff(corner)[:, None]
        middle = 0.5 * (corner[:-1] + corner[1:])
        steps = {"oil_temperature": self.oil_temperature(middle)}
        if WARMING in names:
            steps[WARMING] = rates(self.oil_temperature, corner)
        steps |= {command_of(name): self.commanded(name, middle) for name in self.commands}
        held = parameters[None].copy()
        if any(np.ptp(values) > 0.0 for values in steps.values()):
            held = np.repeat(held, len(middle), axis=0)
        for name, values in steps.items():
            held[:, names.index(name)] = values[: len(held)]
        return Segments(corner[:-1], corner[1:], np.ascontiguousarray(inputs[:-1]), slope, held)


def rates(profile: Profile, corner: Array) -> Array:
    """How fast a quantity changes from corner to corner [its unit per second], shape (corners - 1,)."""
    return np.asarray(np.diff(profile(corner)) / np.diff(corner))


def held_corners(temperature: Profile) -> Array:
    """Times at which a changing temperature, held over pieces, steps [s]."""
    time, value = temperature.time, temperature.value
    pieces = [time]
    for t0, t1, v0, v1 in zip(time[:-1], time[1:], value[:-1], value[1:], strict=True):
        pieces.append(np.linspace(t0, t1, int(np.ceil(abs(v1 - v0) / _TEMPERATURE_STEP)) + 1))
    return np.concatenate(pieces)


def all_corners(bends: Sequence[Array], duration: float) -> Array:
    """All these times [s], each once, from 0 to the duration."""
    times = np.unique(np.concatenate([[0.0, duration], *bends]))
    times = times[(times >= 0.0) & (times <= duration)]
    keep = np.concatenate([[True], np.diff(times) > 1e-9])
    keep[-1] = True
    return np.asarray(times[keep])


def _repeat(profile: Profile, period: float, times: int) -> Profile:
    corner = np.unique(np.concatenate([[0.0, period], profile.time[(profile.time > 0) & (profile.time < period)]]))
    value = profile(corner)
    if value[0] != value[-1]:
        raise ValueError("a duty can be repeated only if it ends with the values it began with")
    time = np.concatenate([corner[:-1] + k * period for k in range(times)] + [[times * period]])
    return Profile(time, np.concatenate([np.tile(value[:-1], times), value[-1:]]))


def _repeat_held(profile: Profile, period: float, times: int) -> Profile:
    inside = profile.time < period
    time = np.concatenate([profile.time[inside] + k * period for k in range(times)])
    return Profile(time, np.tile(profile.value[inside], times))


def trapezoid_moves(moves: Sequence[tuple[float, float]], *, ramp: float, before: float, rest: float) -> Profile:
    """A speed command of moves with ramps and rests between them.

    Args:
        moves: (speed [rad/s], time at that speed [s]) of each move.
        ramp: time of each ramp [s].
        before: rest before the first move [s].
        rest: rest after each move [s].
    """
    time, value = ([0.0, before], [0.0, 0.0]) if before > 0.0 else ([0.0], [0.0])
    for speed, hold in moves:
        for span, level in ((ramp, speed), (hold, speed), (ramp, 0.0), (rest, 0.0)):
            if span > 0.0:
                time.append(time[-1] + span)
                value.append(level)
    return Profile(time, value)


LOAD = Channel("load_kn", "load", "N", "load force, positive against lifting", factor=1e3)
_ROUNDED = 1e-9  # share by which a speed may pass the highest, which was written in another unit


def read_duty(path: str | Path, unit: HydraulicUnit, oil_temperature: float, start_position: float) -> Duty:
    r"""A duty from a CSV file, or from one compressed with gzip if its name ends in ``.gz``.

    The file has the columns ``time_s``, ``motor_speed_rpm`` and ``load_kn``, and perhaps ``oil_temperature_c``, in any
    order; others are ignored. Between rows all of them run straight.

    Args:
        path: the file.
        unit: the unit that works.
        oil_temperature: [K], where the file has none.
        start_position: [m].

    Raises:
        MissingColumnError: a column is absent.
        LogError: the file cannot be read, time does not begin at 0 or does not increase, or a speed is above the
            unit's highest; with line and column.

    Example:
        >>> import pathlib, tempfile
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "duty.csv"
        ...     _ = file.write_text("time_s,motor_speed_rpm,load_kn\n0,0,129\n1,1500,129\n5,1500,129\n6,0,129\n")
        ...     duty = read_duty(file, boom, 313.15, 0.1)
        >>> duty.duration, float(duty.load(3.0)), round(float(duty.motor_speed(3.0)), 1)
        (6.0, 129000.0, 157.1)
    """
    file = file_name(path)
    columns = read_timed(path, [MOTOR_SPEED.column, LOAD.column], [OIL_TEMPERATURE.column])
    time, speed = columns[TIME], MOTOR_SPEED.to_si(columns[MOTOR_SPEED.column])
    if time[0] != 0.0 or len(time) < 2:
        raise LogError("a duty begins at 0 s and has two rows and more", file=file, line=FIRST_ROW, column=TIME)
    beyond = np.flatnonzero(np.abs(speed) > (1.0 + _ROUNDED) * unit.max_speed)
    if beyond.size:
        most, row = f"{MOTOR_SPEED.from_si(np.array([unit.max_speed]))[0]:.6g} rpm", int(beyond[0])
        text = f"is beyond the drive's highest speed, {most}"
        raise LogError(text, file=file, line=FIRST_ROW + row, column=MOTOR_SPEED.column)
    warmth = constant(oil_temperature)
    if OIL_TEMPERATURE.column in columns:
        warmth = Profile(time, OIL_TEMPERATURE.to_si(columns[OIL_TEMPERATURE.column]))
    return Duty(Profile(time, speed), Profile(time, LOAD.to_si(columns[LOAD.column])), warmth, start_position)
