"""What the drive's frames say, by a channel map: whole samples, and what of them tells whether they are alive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ramsight.control.repeats import repeats_in_a_row
from ramsight.deploy.encoder.frame import EXTENDED, Frame
from ramsight.deploy.encoder.liveness import LATE, USUAL_PERIOD, Report
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.logs.align import Samples, Switch
from ramsight.logs.can_field import Field
from ramsight.logs.can_pdo import pdo_fields
from ramsight.logs.channels import DC_CURRENT, DC_POWER, DC_VOLTAGE
from ramsight.logs.mapped import HOLD, ChannelMap, Mapped, Pdo, to_si_of

WRITTEN = "2100h"
"""The channel of the oil temperature that somebody writes into the encoder's own object."""
OTHER = "position"
"""The measured quantity of a map that a real position sensor reports; the virtual one never sees it."""
TORQUES = ("6077h", "4602h:0Ch")
USUAL = ("606Ch", "6077h")
"""What a CiA 402 drive reports: velocity [1/min] and torque [per mille of 6076h]."""


@dataclass(frozen=True)
class Sample:
    """A whole sample of the drive."""

    time: float  # [s], by the encoder's clock
    motor_speed: float  # [rad/s]
    motor_torque: float  # [N m]
    oil_temperature: float  # [K]; NaN if unknown
    reference: float = math.nan  # position known at this sample [m]; NaN if none is
    # further: what else the map names [SI], by its name; NaN if it is too old
    further: Mapping[str, float] = field(default_factory=dict)


def drive_map(
    drive_node: int, objects: Sequence[str] = USUAL, rated_torque: float | None = None, file: str | None = None
) -> ChannelMap:
    """The map of a drive that reports everything in its first TPDO, with the oil temperature written by somebody.

    Args:
        objects: what is mapped into 180h + node, in order; 606Ch [1/min] and 6077h or 4602h:0Ch are taken.
        rated_torque: 6076h [N m], which 6077h counts in per mille of.

    Raises:
        DescriptionError: velocity or torque is not among the objects, or the rated torque is missing.

    Example:
        >>> drive_map(5, ["606Ch", "4602h:0Ch"]).roles["torque"].channel
        '4602h:0Ch'
    """
    pdo = Pdo(0x180 + drive_node, tuple(objects))
    names = {one.name for one in pdo_fields(ChannelMap(file=file, pdos=(pdo,)))[pdo.cob_id]}
    torque = next((name for name in TORQUES if name in names), None)
    if "606Ch" not in names or torque is None:
        raise DescriptionError(
            "velocity and torque are needed", file=file, key="--objects", value=", ".join(objects),
            allowed=f"606Ch and {' or '.join(TORQUES)}; anything else by --map",
        )  # fmt: skip
    if torque == "6077h" and rated_torque is None:
        raise DescriptionError(
            "6077h counts in per mille of the motor's rated torque (6076h)", file=file, key="--rated-torque",
            allowed='for example "35 N m"',
        )  # fmt: skip
    roles = {
        "speed": Mapped("606Ch", "rpm"),
        "torque": Mapped(torque, rated=rated_torque) if torque == "6077h" else Mapped(torque),
        "temperature": Mapped(WRITTEN, "degC", hold=HOLD["temperature"]),
    }
    return ChannelMap(file=file, roles=roles, pdos=(pdo,))


@dataclass
class _Channel:
    """The newest value of one channel."""

    mapped: Mapped
    factor: float
    offset: float
    value: float = math.nan
    at: float = -math.inf  # s, by the encoder's clock
    sent: float = math.nan  # s, when its frame was sent
    fresh: bool = False

    def take(self, number: float, sent: float, now: float) -> None:
        mapped = self.mapped
        raw = mapped.sign * (mapped.scale * number + mapped.offset)
        self.value, self.at, self.sent, self.fresh = self.factor * raw + self.offset, now, sent, True


@dataclass
class _Reference:
    channel: _Channel
    switch: Switch | None
    order: float = 0.0
    pending: float = field(default=math.nan)

    def take(self) -> None:
        self.order += 1.0
        here = Samples(np.array([self.order]), np.array([self.channel.sent]), np.array([self.channel.value]))
        found = here if self.switch is None else self.switch.events(here)
        if len(found):
            self.pending = float(found.value[0])


class Listener:
    """Puts the drive's samples together.

    A sample is whole when speed and torque both have a new value, in one frame or in two; its time is the speed's.

    Raises:
        DescriptionError: the map states nothing of CAN frames, or what cannot be.
        UnknownNameError: a channel is in none of the frames.
    """

    def __init__(self, channel_map: ChannelMap) -> None:
        if not channel_map.is_can:
            raise DescriptionError("says nothing of CAN frames: [can] with pdo or dbc is needed", file=channel_map.file)
        self._fields, self._file = _fields(channel_map), channel_map.file
        roles = {**channel_map.roles, **channel_map.further, **channel_map.linked}
        self._linked = bool(channel_map.linked)
        self.channels = {role: self._channel(role, mapped, channel_map) for role, mapped in roles.items()}
        self._further = tuple(channel_map.further)
        self._references = [
            _Reference(
                self._channel("reference", one.mapped, channel_map, switch=one.position is not None),
                None if one.position is None else Switch(one.position, one.edge),
            )
            for one in channel_map.references
        ]
        position = channel_map.measured.get(OTHER)
        self._other = None if position is None else self._channel(OTHER, position, channel_map)
        self.sequence = channel_map.sequence
        self._number = None if self.sequence is None else _Channel(Mapped(self.sequence.channel), 1.0, 0.0)
        self._state = None if channel_map.state is None else _Channel(Mapped(channel_map.state), 1.0, 0.0)
        self._places = self._placed()
        temperature = self.channels["temperature"]
        if temperature.mapped.constant is not None:
            temperature.value, temperature.at = temperature.mapped.constant, math.inf
        self.written = temperature if temperature.mapped.channel == WRITTEN else None

        if self._number is not None:
            self._check_number(self._number)

    @property
    def identifiers(self) -> frozenset[int]:
        """The frames that it wants."""
        return frozenset(self._places)

    @property
    def periodic(self) -> frozenset[int]:
        """Those of them that the drive sends period after period: with speed, torque, or what is measured beside."""
        drive = [one for name, one in self.channels.items() if name != "temperature"]
        return frozenset(
            key
            for key, places in self._places.items()
            if any(taker is one for _, takers in places for taker in takers for one in drive)
        )

    @property
    def speed(self) -> float:
        """The newest speed [rad/s], if no sample has taken it yet; else NaN."""
        speed = self.channels["speed"]
        return speed.value if speed.fresh else math.nan

    def take(self, frame: Frame, sent: float, now: float) -> bool:
        """Take a frame.

        Args:
            sent: when it was sent, by the encoder's clock [s].
            now: the encoder's clock [s].

        Returns:
            Whether it is as long as its objects need; a shorter one is not used.
        """
        places = self._places[frame.cob_id]
        if any(one.length > len(frame.data) for one, _ in places):
            return False
        data = np.frombuffer(frame.data, dtype=np.uint8).reshape(1, -1)
        for one, takers in places:
            if not one.present(data)[0]:
                continue
            number = float(one.values(data)[0])
            for taker in takers:
                if isinstance(taker, _Reference):
                    taker.channel.take(number, sent, now)
                    taker.take()
                else:
                    taker.take(number, sent, now)
        return True

    @property
    def noise(self) -> float:
        """Declared noise of the torque from frame to frame, standard deviation [N m]; 0 if there is none."""
        return self.channels["torque"].mapped.noise

    @property
    def torque_step(self) -> float:
        """What the torque is rounded to [N m]; 0 if it is a floating number."""
        torque = self.channels["torque"]
        wire = self._named(torque.mapped.channel)
        return 0.0 if wire.floating else abs(torque.factor * torque.mapped.scale * wire.scale)

    def report(self, sample: Sample) -> Report:
        """What a sample that has just become whole says of itself."""
        number, state = (math.nan if one is None else one.value for one in (self._number, self._state))
        return Report(self.channels["torque"].sent, sample.motor_speed, sample.motor_torque, number, state)

    @property
    def has_state(self) -> bool:
        """Whether the map names the drive's state word."""
        return self._state is not None

    def _check_number(self, number: _Channel) -> None:
        """Refuse a sequence that stands in another frame than the torque."""
        torque = self.channels["torque"]
        together = [places for places in self._places.values() if any(number in takers for _, takers in places)]
        if not any(torque in takers for places in together for _, takers in places):
            raise DescriptionError(
                "is in another frame than the torque, and tells nothing of that one",
                file=self._file, key="sequence.channel", value=number.mapped.channel,
                allowed="a field of the torque's frame",
            )  # fmt: skip

    def write_temperature(self, value: float, now: float) -> None:
        """The oil temperature as somebody wrote it [°C]; NaN: unknown."""
        if self.written is not None:
            self.written.take(value, now, now)

    def temperature(self, now: float) -> float:
        """The oil temperature [K]; NaN if it is older than it may be."""
        return self._held("temperature", now)

    def _held(self, name: str, now: float) -> float:
        """The newest value of a channel [SI]; NaN if it is older than it may be."""
        held = self.channels[name]
        return held.value if now - held.at <= held.mapped.hold else math.nan

    @property
    def has_other(self) -> bool:
        """Whether the map names a real position sensor."""
        return self._other is not None

    def other(self, now: float) -> tuple[float, float]:
        """What the real sensor reports [m], and when it was sent [s]; no numbers if that is older than it may be."""
        other = self._other
        if other is None or now - other.at > other.mapped.hold:
            return math.nan, math.nan
        return other.value, other.sent

    def sample(self, now: float) -> Sample | None:
        """The sample that has just become whole, if one has."""
        speed, torque = self.channels["speed"], self.channels["torque"]
        if not (speed.fresh and torque.fresh):
            return None
        speed.fresh = torque.fresh = False
        further = {name: self._held(name, now) for name in self._further}
        if self._linked:
            further[DC_POWER.name] = self._held(DC_VOLTAGE.name, now) * self._held(DC_CURRENT.name, now)
        return Sample(speed.sent, speed.value, torque.value, self.temperature(now), self._reference(now), further)

    def _reference(self, now: float) -> float:
        """The newest position that waits for a sample."""
        waiting = [one for one in self._references if now - one.channel.at <= one.channel.mapped.hold]
        return next((one.pending for one in waiting if not math.isnan(one.pending)), math.nan)

    def referenced(self) -> None:
        """The sensor has had the references that waited; until then they go with every sample, while they hold."""
        for one in self._references:
            one.pending = math.nan

    def _channel(self, role: str, mapped: Mapped, channel_map: ChannelMap, switch: bool = False) -> _Channel:
        name = mapped.channel
        if switch:
            return _Channel(mapped, 1.0, 0.0)
        written = not name or name == WRITTEN
        unit = mapped.unit or ("degC" if written else self._named(name).unit)
        if not unit:
            raise DescriptionError("has no unit", file=channel_map.file, key=f"{role}.unit", allowed="1/min, N m, degC")
        rated = None if written else mapped.rated
        return _Channel(mapped, *to_si_of(unit, role, rated, file=channel_map.file, key=f"{role}.unit"))

    def _named(self, name: str) -> Field:
        names = {f"0x{key & ~EXTENDED:X}.{one.name}": one for key, of in self._fields.items() for one in of}
        short = [one for full, one in names.items() if name in (full, one.name, one.name.rpartition(".")[2])]
        if len(short) != 1:
            raise UnknownNameError("channel", name, names, where=self._file)
        return short[0]

    def _placed(self) -> dict[int, list[tuple[Field, list[_Channel | _Reference]]]]:
        """What each frame's fields go to."""
        beside = [one for one in (self._other, self._number, self._state) if one is not None]
        listed = [*self.channels.values(), *beside]
        wired = [one for one in listed if one.mapped.channel not in ("", WRITTEN)]
        takers: list[tuple[Field, _Channel | _Reference]] = [
            *((self._named(one.mapped.channel), one) for one in wired),
            *((self._named(one.channel.mapped.channel), one) for one in self._references),
        ]
        places: dict[int, list[tuple[Field, list[_Channel | _Reference]]]] = {}
        for key, of in self._fields.items():
            for one in of:
                wanting = [taker for wanted, taker in takers if wanted is one]
                if wanting:
                    places.setdefault(key, []).append((one, wanting))
        return places


def _fields(channel_map: ChannelMap) -> dict[int, list[Field]]:
    """Fields by identifier; copies, so that each is itself alone."""
    fields: dict[int, list[Field]] = {}
    for dbc in channel_map.dbc:
        from ramsight.logs.can_dbc import dbc_fields

        for key, of in dbc_fields(dbc)[0].items():
            fields.setdefault(key, []).extend(replace(one) for one in of)
    for cob_id, of in pdo_fields(channel_map).items():
        key = cob_id | (EXTENDED if cob_id > 0x7FF else 0)
        fields.setdefault(key, []).extend(replace(one) for one in of)
    return fields


Witness = tuple[str, bool, str]
"""What it is called, whether the bus has it, and what it tells or what is missing."""


def witnesses(channel_map: ChannelMap) -> list[Witness]:
    """What tells, and what the bus lacks.

    Raises:
        DescriptionError: the map is none of CAN frames.

    Example:
        >>> from ramsight.deploy.encoder.listening import drive_map
        >>> [(name, there) for name, there, _ in witnesses(drive_map(5, rated_torque=80.0))]
        [('sequence', False), ('noise', False), ('state', False), ('heartbeat', False)]
    """
    listener = Listener(channel_map)
    found = {"sequence": _sequence(listener), "noise": _noise(listener), "state": _state(listener)}
    return [*((name, there, words) for name, (there, words) in found.items()), _HEARTBEAT]


_LONGEST = 1.0  # s; what takes longer tells nothing in time
_HEARTBEAT = ("heartbeat", False, "no map states it: write the drive's node and its time into 1016h of the encoder")


def _sequence(listener: Listener) -> tuple[bool, str]:
    found = listener.sequence
    if found is None:
        return False, "[sequence] of the torque's frame, a counter, toggle bit or SYNC counter, tells late data"
    tells = "frozen frames" if found.modulus <= 2.0 * LATE else f"frozen frames, and those {LATE:g} periods late"
    return True, f"{found.channel} tells {tells}"


def _noise(listener: Listener) -> tuple[bool, str]:
    if not listener.noise:
        return False, 'noise = "0.5 N m" of [torque], if it has noise, tells frozen frames'
    enough = repeats_in_a_row(listener.noise, listener.torque_step or 1e-3 * listener.noise, USUAL_PERIOD)
    if enough * USUAL_PERIOD > _LONGEST:
        return False, f"{listener.noise:g} N m is too little to be seen in steps of {listener.torque_step:g} N m"
    return True, f"{enough:g} equal torques in a row are frozen"


def _state(listener: Listener) -> tuple[bool, str]:
    if not listener.has_state:
        return False, '[state] channel = "6041h" tells a drive that is not enabled'
    return True, "6041h tells a drive that is not enabled"
