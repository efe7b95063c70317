"""What a channel map states: which channels are what, and what their numbers mean."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ramsight.arrays import Array
from ramsight.errors import DescriptionError
from ramsight.logs.channels import (
    DC_POWER,
    LINK,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    OIL_TEMPERATURE,
    POSITION,
    PRESSURE_A,
    PRESSURE_B,
    REFERENCE,
    TIME,
    is_command,
    part_of,
)
from ramsight.logs.channels import FURTHER as FURTHER_CHANNELS
from ramsight.logs.header import CsvForm
from ramsight.units import parse


@dataclass(frozen=True)
class SensorCurve:
    """What a position sensor reads too much, linear between some of its readings, constant beyond them.

    Example:
        >>> curve = SensorCurve((0.0, 0.1, 0.2), (0.0, 0.001, 0.0))
        >>> curve.position([0.05, 0.1]).round(6).tolist()
        [0.0495, 0.099]
        >>> curve.reading(curve.position(0.17)).round(12).item()
        0.17
    """

    at: tuple[float, ...]  # readings [m], increasing
    excess: tuple[float, ...]  # of the reading over the position there [m]

    @property
    def is_unique(self) -> bool:
        """Whether each position has one reading, and a larger one reads more."""
        at, excess = np.array(self.at), np.array(self.excess)
        return bool((np.diff(at) > 0.0).all() and (np.diff(at - excess) > 0.0).all())

    def position(self, reading: ArrayLike) -> Array:
        """Where the piston is [m], of what is read [m]."""
        read = np.asarray(reading, dtype=np.float64)
        return np.asarray(read - np.interp(read, self.at, self.excess))

    def reading(self, position: ArrayLike) -> Array:
        """What is read [m], where the piston is [m]."""
        at, excess = np.array(self.at), np.array(self.excess)
        true = np.asarray(position, dtype=np.float64)
        return np.asarray(true + np.interp(true, at - excess, excess))


ROLES = {"speed": MOTOR_SPEED, "torque": MOTOR_TORQUE, "temperature": OIL_TEMPERATURE}
"""Tables of a map, and what each becomes in the log."""

INSTEAD = {"angle": "speed", "current": "torque"}
"""Tables of a map that stand in the place of another: a shaft's angle of its speed, a motor's current of its torque."""

MEASURED = {"position": POSITION, "pressure_a": PRESSURE_A, "pressure_b": PRESSURE_B}
"""What a map may name beside what a drive reports, under `measured`: for identification and judgement only."""

FURTHER = {channel.name: channel for channel in FURTHER_CHANNELS}
"""Tables of a map, and columns of a log, that a sensor takes where its machine declares them."""

LINKED = {channel.name: channel for channel in LINK}
"""Tables of a map, both or none, whose product is the power of the DC link."""

SI = {
    "speed": "rad/s", "torque": "N m", "temperature": "K", "reference": "m", "angle": "rad",
    "current": "A", "command": "1", "position": "m", "pressure_a": "Pa", "pressure_b": "Pa",
    "dc_voltage": "V", "dc_current": "A", **{one.name: one.units for one in FURTHER_CHANNELS},
}  # fmt: skip

USUAL_HOLD = 0.5  # s
HOLD = {"speed": 0.5, "torque": 0.5, "temperature": 60.0, "reference": 0.5, "motor_temperature": 60.0}
"""How long a value holds without a new one [s], unless the map states otherwise: a drive reports every few
milliseconds, and oil does not change its temperature within a minute."""


ENABLED_MASK, ENABLED = 0x6F, 0x27
"""Bits of the state word 6041h that state what the drive does, and theirs where its operation is enabled (CiA 402)."""


@dataclass(frozen=True)
class Mapped:
    """One source channel and what its numbers mean: ``sign * (scale * number + offset)`` in ``unit``."""

    channel: str  # its name in the file, "" for a constant
    unit: str | None = None  # of the number after scale and offset; None takes the file's
    sign: float = 1.0  # 1 or -1
    scale: float = 1.0  # factor
    offset: float = 0.0  # in `unit`
    rated: float | None = None  # what 100 % is, in SI, where `unit` is percent or permille
    hold: float = 0.5  # how long a value holds [s]
    constant: float | None = None  # the value in SI where there is no channel
    noise: float = 0.0  # of the torque from one frame to the next, standard deviation [N m]; 0 if none is declared


@dataclass(frozen=True)
class Timed:
    """The clock of a table, of groups or of messages: ``sign * (scale * number + offset)`` in ``unit``."""

    channel: str = ""  # its name in the file, "" where rows have a period and no clock
    unit: str | None = None  # of the number after scale and offset; None takes the file's, or goes by its size
    date: str | None = None  # column of dates beside a clock that is a time of day
    week: str | None = None  # column of weeks beside a clock that is a time of the week, as GPS counts it
    period: float | None = None  # from row to row where there is no channel, else of one number of it [s]
    sign: float = 1.0  # 1, or -1 for a clock that counts down
    scale: float = 1.0
    offset: float = 0.0  # in `unit`

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that it is read from."""
        return tuple(name for name in (self.week, self.date, self.channel) if name)


@dataclass(frozen=True)
class Counted:
    """A shaft's angle in place of its speed."""

    per_turn: float  # numbers a turn, after scale and offset
    # modulus: numbers until it begins again, after scale and offset; infinity if it never does, None if that is to be
    # seen from the numbers
    modulus: float | None = None
    fastest: float | None = None  # that the shaft turns [rad/s]; None where the map states none
    speed: Mapped | None = None  # a channel of the speed beside it, which says which turn it was; None without one


@dataclass(frozen=True)
class Motor:
    """A motor's current in place of its torque: k i (1 - abs(i)/i_s)."""

    torque_constant: float  # k, torque per unit of the current [N m]
    # saturation: i_s, in the current's unit, at which a linear loss of torque by saturation would take all; None for
    # a motor without
    saturation: float | None = None

    def torque(self, current: Array) -> Array:
        """Torque [N m] of a current in its unit."""
        lost = 0.0 if self.saturation is None else np.abs(current) / self.saturation
        return np.asarray(self.torque_constant * current * (1.0 - lost))


@dataclass(frozen=True)
class Commanded:
    """The command to a part of the circuit, for example a directional valve: -1 to 1."""

    mapped: Mapped  # the channel
    least: float = 0.0  # a command smaller than this is none, and the last one holds


@dataclass(frozen=True)
class Referenced:
    """A channel that states where the piston is."""

    mapped: Mapped  # the channel: positions in its unit, or a switch if there is a `position`
    position: float | None = None  # where the piston is when the switch changes [m]
    edge: str = "rising"  # which change it is: ``rising``, ``falling`` or ``both``


@dataclass(frozen=True)
class Sequence:
    """A number of the drive's frame that goes on with each of them."""

    channel: str
    modulus: int  # numbers until it begins again; 2 is a toggle bit
    of_sync: bool = False  # whether it is the counter of the SYNC that the frame answers, rather than the drive's own


@dataclass(frozen=True)
class Pdo:
    """A CANopen process data object."""

    cob_id: int  # identifier of its frames
    objects: tuple[str, ...]  # what is mapped into it, end to end: ``606Ch``, ``4602h:0Ch``, ``2010h:01 INT16``


@dataclass(frozen=True)
class ChannelMap:
    """Everything that a map states; made by `load_map` or `standard_map`."""

    file: str | None = None  # where it was read, None for one made by the program
    time: Timed | None = None  # clock of a table, or of groups
    roles: Mapping[str, Mapped] = field(default_factory=dict)  # ``speed``, ``torque`` and ``temperature``
    references: tuple[Referenced, ...] = ()  # none or some
    base: str | None = None  # the role whose samples are the log's: ``speed`` or ``torque``; None takes the slower
    sparse: bool = False  # whether an empty cell of a table is no sample, rather than a missing value
    form: CsvForm = field(default_factory=CsvForm)  # layout of a CSV file
    dbc: tuple[Path, ...] = ()  # files that say what CAN frames mean
    pdos: tuple[Pdo, ...] = ()  # CANopen mappings that do
    bus: int | None = None  # the CAN channel to read; None reads all
    angle: Counted | None = None  # how the channel of the role ``speed`` counts, where it is an angle
    motor: Motor | None = None  # what the channel of the role ``torque`` is, where it is a current
    commands: Mapping[str, Commanded] = field(default_factory=dict)  # to parts of the circuit, by their names
    # further: what else a sensor may use, by their names in `FURTHER`
    further: Mapping[str, Mapped] = field(default_factory=dict)
    # measured: position and pressures, by their names in `MEASURED`; no sensor gets them
    measured: Mapping[str, Mapped] = field(default_factory=dict)
    # linked: voltage and current of the DC link, by their names in `LINKED`, or none; their product is the power
    linked: Mapping[str, Mapped] = field(default_factory=dict)
    period: float | None = None  # of the log's samples, if they are resampled [s]
    linearity: float = 0.0  # standard deviation of what the measured position's sensor reads beside a straight line [m]
    curve: SensorCurve | None = None  # that of the measured position's sensor, where it is known
    sources: tuple[int, ...] = ()  # J1939 addresses whose frames are read; none reads those of all
    # destinations: J1939 addresses to which frames are read, of groups that go to one; none reads those to all
    destinations: tuple[int, ...] = ()
    j1939: bool | None = None  # whether extended identifiers of DBC files are J1939 groups; None goes by the file
    sequence: Sequence | None = None  # number of the drive's frames, for an encoder; None where there is none
    state: str | None = None  # channel of the drive's state word 6041h, for an encoder; None where there is none

    @property
    def is_can(self) -> bool:
        """Whether it states what CAN frames mean."""
        return bool(self.dbc or self.pdos)


def standard_map(names: list[str]) -> ChannelMap:
    """The map of a log whose channels have ramsight's own names.

    Args:
        names: the file's channels; a reference, commands to parts, ``valve_command``, and what is in `FURTHER` or
            `LINKED` are mapped if among them.
    """
    roles = {
        "speed": Mapped(MOTOR_SPEED.column, "rpm", hold=HOLD["speed"]),
        "torque": Mapped(MOTOR_TORQUE.column, "N m", hold=HOLD["torque"]),
        "temperature": Mapped(OIL_TEMPERATURE.column, "degC", hold=HOLD["temperature"]),
    }
    references = (Referenced(Mapped(REFERENCE.column, "m")),) if REFERENCE.column in names else ()
    commands = {part_of(name): Commanded(Mapped(name, "1", hold=math.inf)) for name in names if is_command(name)}
    listed = {name: channel for name, channel in FURTHER.items() if channel.column in names}
    further = {
        name: Mapped(one.column, one.units, scale=one.factor, offset=one.offset, hold=HOLD.get(name, USUAL_HOLD))
        for name, one in listed.items()
    }
    pair = {name: Mapped(one.column, one.units) for name, one in LINKED.items() if one.column in names}
    linked = pair if len(pair) == len(LINKED) and DC_POWER.name not in further else {}
    return ChannelMap(
        time=Timed(TIME, "s"), roles=roles, references=references, commands=commands, further=further, linked=linked
    )


def to_si_of(
    unit: str, role: str, rated: float | None, *, file: str | None = None, key: str | None = None
) -> tuple[float, float]:
    """Factor and offset from a unit to SI.

    Args:
        unit: for example ``1/min``, ``degC``, ``percent``.
        role: a key of `SI`.
        rated: what 100 % is [SI], for a share.

    Raises:
        DescriptionError: the unit is no unit of this quantity, or a share of nothing.

    Example:
        >>> to_si_of("permille", "torque", 35.0)
        (0.035, 0.0)
        >>> to_si_of("degC", "temperature", None)
        (1.0, 273.15)
    """
    try:
        if rated is not None:
            return parse(f"1 {unit}", "1") * rated, 0.0
        if SI[role] == "K":
            offset = parse(f"0 {unit}", "K")
            return round(parse(f"1000 {unit}", "K") - offset, 9) / 1000.0, offset
        return parse(f"1 {unit}", SI[role]), 0.0
    except DescriptionError as error:
        hint = ""
        if rated is None and role in ("speed", "torque", "dc_current") and _is_share(unit):
            hint = "; a share needs what 100 % is: rated = ..."
        raise DescriptionError(f"{error.message}{hint}", file=file, key=key, value=unit) from None


def _is_share(unit: str) -> bool:
    try:
        parse(f"1 {unit}", "1")
    except DescriptionError:
        return False
    return True
