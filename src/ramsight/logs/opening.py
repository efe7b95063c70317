"""A log of any kind as pieces of a drive log: one clock, SI units, bounded memory."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ramsight.argument_kinds import by_kind
from ramsight.arrays import Array
from ramsight.errors import DescriptionError, LogError, MissingColumnError
from ramsight.logs.align import Aligner, Block, Resampler, Switch
from ramsight.logs.channel_map import check_whole, known_map
from ramsight.logs.channels import (
    DC_CURRENT,
    DC_POWER,
    DC_VOLTAGE,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    OIL_TEMPERATURE,
    POSITION,
    READINGS,
    REFERENCE,
    TIME,
    Channel,
    as_signals,
    column_of,
    is_command,
)
from ramsight.logs.clock_watch import ClockWatch, warn_of_watched
from ramsight.logs.csv_table import check_columns
from ramsight.logs.lines import Advance, inspect_command
from ramsight.logs.mapped import FURTHER, MEASURED, ChannelMap, Mapped, standard_map, to_si_of
from ramsight.logs.source import Source, TableSource
from ramsight.logs.source_by_suffix import open_frames, open_source
from ramsight.signals import Dataset, Signal, Signals
from ramsight.units import FREEZING

if TYPE_CHECKING:
    from ramsight.logs.counter import Unwrapped

SAMPLES = 1 << 16
"""Samples of a piece."""

COLDEST, HOTTEST = 213.15, 473.15
"""Range of oil temperatures [K]: if half a log is beyond it, it has another unit."""

_NAMES = {"speed": MOTOR_SPEED.name, "torque": MOTOR_TORQUE.name, "temperature": OIL_TEMPERATURE.name}
_DRIVEN = ("speed", "torque")
_DRIVE = (MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE, REFERENCE)
_READINGS = frozenset(one.name for one in READINGS)


@by_kind
def open_log(
    path: str | Path,
    channel_map: ChannelMap | str | Path | None = None,
    *,
    samples: int = SAMPLES,
    advance: Advance | None = None,
) -> Iterator[Dataset]:
    r"""A drive log piece by piece, from a file of any kind that ramsight reads, by its suffix.

    The pieces follow one another; together they are what `read_log` gives at once. A sensor that tracks them
    one after the other states what it says of the whole.

    Args:
        path: the file; docs/reference/log-formats.md has all formats.
        channel_map: which of its channels are what, or the file that states so; None for a table whose columns are
            called ``time_s``, ``motor_speed_rpm``, ``motor_torque_nm``, ``oil_temperature_c`` and perhaps
            ``reference_m``.
        samples: of each piece but the last.
        advance: is passed the share of the file that was read since the last call.

    Returns:
        The pieces in order, each read when it is asked for; what is wrong with the name, the map or the columns is said
        at once. Over ``time`` [s]: ``motor_speed`` [rad/s], ``motor_torque`` [N m], ``oil_temperature`` [K], NaN where
        the log has no number, and ``reference`` [m] if there are any, NaN where none is known; commands to parts, and
        ``link_angle`` [rad], ``pressure_a`` and ``pressure_b`` [Pa] where the log has them. Time is as in the file:
        it may repeat or jump.

    Raises:
        LogError: the file cannot be read, or is no log at all; with the place.
        MissingColumnError: it has no map, and other columns than a log without one.
        UnknownNameError: the map names a channel that is not there.
        DescriptionError: the map states what cannot be.

    Example:
        >>> import pathlib, tempfile
        >>> text = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n0.00,1500,12.5,40.0\n0.02,,12.5,40.0\n"
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "log.csv"
        ...     _ = file.write_text(text)
        ...     pieces = list(open_log(file, samples=1))
        >>> [piece.motor_speed.values.round(2).tolist() for piece in pieces]
        [[157.08], [nan]]
    """
    pieces = open_signals(path, channel_map, samples=samples, advance=advance)
    return (piece.dataset() for piece in pieces)


def open_signals(
    path: str | Path,
    channel_map: ChannelMap | str | Path | None = None,
    *,
    samples: int = SAMPLES,
    advance: Advance | None = None,
) -> Iterator[Signals]:
    """The same pieces as columns; arguments and errors as `open_log`."""
    if not isinstance(path, str | os.PathLike):
        raise DescriptionError("is no path", key="path", value=path, allowed="text, or a pathlib.Path")
    known = known_map(channel_map)
    if known is not None:
        check_whole(known)
    source = open_source(path, known, advance)
    if known is None:
        names = [one.name for one in source.offered()]
        _check_standard(source, names)
        known = standard_map(names)
        if isinstance(source, TableSource):
            source.time = known.time
    pieces = _regular(_pieces(source, known), samples)
    oil = known.roles["temperature"].channel
    return _as_signals(pieces, source.file, oil, is_clock_watched=source.has_clock_watched)


def _check_standard(source: Source, names: list[str]) -> None:
    try:
        clock = [TIME] if isinstance(source, TableSource) else []
        check_columns(names, [*clock, *(channel.column for channel in _DRIVE[:3])], source.file)
    except LogError as error:
        if source.has_frames:
            next(open_frames(source.path))  # a file that holds none lacks no map
            raise LogError(
                "holds CAN frames; without a channel map their meaning is unknown:"
                f" {inspect_command(source.file)} writes one",
                file=source.file,
            ) from None
        what_next = f"a channel map says which is which: {inspect_command(source.file)} writes one"
        if isinstance(error, MissingColumnError):
            raise MissingColumnError(
                file=source.file, missing=error.missing, found=error.found, what_next=what_next
            ) from None
        raise


def read_measured(path: str | Path, channel_map: ChannelMap | str | Path, *, advance: Advance | None = None) -> Dataset:
    """What a log holds beside what a drive reports, as a Dataset; arguments and errors as `measured_signals`."""
    return measured_signals(path, channel_map, advance=advance).dataset()


def measured_signals(
    path: str | Path, channel_map: ChannelMap | str | Path, *, advance: Advance | None = None
) -> Signals:
    """What a log holds beside what a drive reports: the channels that its map names under `measured`.

    For identification and judgement; a sensor's log, from `open_log`, never has them. Where the map has a curve of the
    position's sensor, the position is that of the piston, not what was read.

    Args:
        channel_map: with `measured.position`, `measured.pressure_a` or `measured.pressure_b`.

    Returns:
        Over the same ``time`` [s] as the log: ``position`` [m], ``pressure_a``, ``pressure_b`` [Pa], as far as named;
        NaN where there is no number.

    Raises:
        LogError, UnknownNameError, DescriptionError: as `open_log`; or the map names nothing measured.
    """
    known = known_map(channel_map)
    if not known.measured:
        raise DescriptionError("names nothing measured", file=known.file, key="measured", allowed=", ".join(MEASURED))
    source = open_source(path, known, advance)
    pieces = list(_pieces(source, known, known.measured))
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in ("time", *known.measured)}
    if known.curve is not None and POSITION.name in columns:
        columns[POSITION.name] = known.curve.position(columns[POSITION.name])
    channels = [replace(MEASURED[name], column=name, factor=1.0, offset=0.0) for name in known.measured]
    return as_signals(columns | {TIME: columns["time"]}, channels)


def _pieces(
    source: Source, known: ChannelMap, measured: Mapping[str, Mapped] | None = None
) -> Iterator[dict[str, Array]]:
    """Columns of the log in SI, at the map's period if it has one; with what was measured only if it is asked for."""
    unwrapped, counted = None, known.angle
    if counted is not None:
        from ramsight.logs.counter import Unwrapped

        beside = None if counted.speed is None else _converter(source, known, counted.speed, "speed")
        unwrapped = Unwrapped(source.file, known.roles["speed"].channel, counted, known.roles["speed"].scale, beside)
    columns = _columns(source, known, measured or {}, unwrapped)
    if known.period is None:
        yield from columns
        return
    commands = frozenset(column_of(name) for name in known.commands)
    resampler = Resampler(known.period, source.file, None if unwrapped is None else unwrapped.unknown, commands)
    for block in columns:
        made = resampler.push(block)
        if len(made["time"]):
            yield made


def _columns(
    source: Source, known: ChannelMap, measured: Mapping[str, Mapped], unwrapped: Unwrapped | None
) -> Iterator[dict[str, Array]]:
    """Columns of the log in SI, of any length each; with what was measured only if it is asked for."""
    held = _held_channels(known, measured)
    readings = {name: one for name, one in known.further.items() if name in _READINGS}
    roles = held | {name: (name, one) for name, one in readings.items()}
    to_si = {name: _converter(source, known, one, role) for name, (role, one) in roles.items()}
    references = {f"reference {k}": one for k, one in enumerate(known.references)}
    reference_si = {
        name: _converter(source, known, one.mapped, "reference") if one.position is None else (1.0, 0.0)
        for name, one in references.items()
    }
    switches = {name: Switch(one.position, one.edge) for name, one in references.items() if one.position is not None}
    events = {name: one.mapped for name, one in references.items()} | readings
    named = {name: one for name, (_, one) in held.items()}
    if unwrapped is not None:
        named |= unwrapped.named
    blocks = _by_name(source, named, events, switches)
    if unwrapped is not None:
        factor, offset = to_si.pop("speed")
        blocks = unwrapped.over(blocks, factor, offset)
        to_si["speed"] = (1.0, 0.0)
    blocks, base = _with_base(blocks, known.base)
    holds = {name: one.hold for name, (_, one) in held.items()}
    aligner = Aligner(base, holds, {name: one.hold for name, one in events.items()})
    constants = {_NAMES[role]: one.constant for role, one in known.roles.items() if not one.channel}
    least = {column_of(name): one.least for name, one in known.commands.items()}
    count, spans = 0, Spans()
    for block in blocks:
        spans.take(block)
        aligned = aligner.push(block)
        count += len(aligned["time"])
        columns = {"time": aligned["time"]}
        columns |= {_NAMES.get(name, name): aligned[name] * factor + offset for name, (factor, offset) in to_si.items()}
        columns |= {name: np.full(len(aligned["time"]), value) for name, value in constants.items()}
        if known.motor is not None:
            columns[MOTOR_TORQUE.name] = known.motor.torque(columns[MOTOR_TORQUE.name])
        if known.linked:
            columns[DC_POWER.name] = columns[DC_VOLTAGE.name] * columns.pop(DC_CURRENT.name)
        for name, value in least.items():  # commands that are none are left to whoever holds the last one
            columns[name] = np.asarray(np.where(np.abs(columns[name]) < value, np.nan, columns[name]))
        if references:
            columns[REFERENCE.name] = np.full(len(aligned["time"]), np.nan)
            for name, (factor, offset) in reference_si.items():
                said = np.isfinite(aligned[name])
                columns[REFERENCE.name][said] = aligned[name][said] * factor + offset
        yield columns
    if count and (apart := spans.apart(_DRIVEN)):
        raise LogError(f"has no samples{apart}", file=source.file)
    if not count:
        silent = [held[name][1].channel for name in aligner.silent]
        what = f"has no samples of {', '.join(silent)}" if silent else f"has no samples{spans.apart(_DRIVEN)}"
        raise LogError(f"{what}{source.missed(known)}", file=source.file)


class Spans:
    """From when to when the samples of each channel of a log go."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[float, float]] = {}

    def take(self, block: Block) -> None:
        """Take samples by channel."""
        for name, samples in block.items():
            times = samples.time[np.isfinite(samples.time)]
            if times.size:
                first, last = self._known.get(name, (np.inf, -np.inf))
                self._known[name] = min(first, float(times.min())), max(last, float(times.max()))

    def apart(self, names: tuple[str, str]) -> str:
        """That two channels have no time in common, and what each has; "" if they have one."""
        spans = [self._known.get(name) for name in names]
        one, other = spans
        if one is None or other is None or (one[0] <= other[1] and other[0] <= one[1]):
            return ""
        said = [
            f"{name} from {span[0]:.9g} s to {span[1]:.9g} s" for name, span in zip(names, (one, other), strict=True)
        ]
        return f": the clocks do not meet: {', '.join(said)}"


def _held_channels(known: ChannelMap, measured: Mapping[str, Mapped]) -> dict[str, tuple[str, Mapped]]:
    """What is held until its next sample comes, by role or by name: its role, with its unit, and its channel."""
    held = {role: (role, one) for role, one in known.roles.items() if one.channel}
    held |= {column_of(name): ("command", one.mapped) for name, one in known.commands.items()}
    return held | {
        name: (name, one)
        for name, one in [*known.further.items(), *known.linked.items(), *measured.items()]
        if name not in _READINGS
    }


def _converter(source: Source, known: ChannelMap, one: Mapped, role: str) -> tuple[float, float]:
    """Factor and offset from the file's number to SI, sign and scale among them."""
    source.check([one.channel])
    unit = one.unit if one.unit is not None else source.unit_of(one.channel)
    if not unit:
        raise LogError("has no unit in the file: the map has to say it", file=source.file, column=one.channel)
    factor, offset = to_si_of(unit, role, one.rated, file=known.file or source.file, key=f"{role}.unit")
    return one.sign * one.scale * factor, one.sign * one.offset * factor + offset


def _by_name(
    source: Source, held: dict[str, Mapped], happening: dict[str, Mapped], switches: dict[str, Switch]
) -> Iterator[Block]:
    """Blocks whose keys are roles, names and references in the place of the file's channels."""
    events = {name: one.channel for name, one in happening.items()}
    needed = [*(one.channel for one in held.values()), *events.values()]
    for block in source.blocks(list(dict.fromkeys(needed))):
        named = {name: block[one.channel] for name, one in held.items() if one.channel in block}
        for name, channel in events.items():
            if channel in block:
                named[name] = switches[name].events(block[channel]) if name in switches else block[channel]
        yield named


def _with_base(blocks: Iterator[Block], base: str | None) -> tuple[Iterator[Block], str]:
    """The blocks, and the base channel: the slower of speed and torque in the first that have both, else torque."""
    if base is not None:
        return blocks, base
    held: list[Block] = []
    counts = {"speed": 0, "torque": 0}
    for block in blocks:
        held.append(block)
        counts = {role: count + len(block.get(role, ())) for role, count in counts.items()}
        if all(counts.values()):
            break
    slower = "speed" if counts["speed"] < counts["torque"] else "torque"

    def again() -> Iterator[Block]:
        yield from held
        held.clear()
        yield from blocks

    return again(), slower


def _regular(columns: Iterator[dict[str, Array]], samples: int) -> Iterator[dict[str, Array]]:
    """The same columns in pieces of this many samples."""
    held: dict[str, Array] = {}
    for more in columns:
        held = {name: np.concatenate([held[name], column]) if held else column for name, column in more.items()}
        length = len(held["time"])
        full = length - length % samples
        for first in range(0, full, samples):
            yield {name: column[first : first + samples] for name, column in held.items()}
        held = {name: column[full:].copy() for name, column in held.items()}
    if held and len(held["time"]):
        yield held


def _as_signals(
    pieces: Iterator[dict[str, Array]], file: str, oil: str, *, is_clock_watched: bool
) -> Iterator[Signals]:
    timed, clock = False, None if is_clock_watched else ClockWatch()
    for number, columns in enumerate(pieces):
        if number == 0:
            check_temperature(columns[OIL_TEMPERATURE.name], file, oil)
        timed = timed or bool(np.isfinite(columns["time"]).any())
        if clock is not None:
            clock.take_all(columns["time"])
        time = {"time": Signal(columns["time"], {"units": "s", "long_name": "time"})}
        yield Signals(
            time
            | {
                channel.name: Signal(columns[channel.name], {"units": channel.units, "long_name": channel.long_name})
                for channel in (*_DRIVE, *_commanded(columns), *FURTHER.values(), DC_VOLTAGE)
                if channel.name in columns
            }
        )
    if not timed:
        raise LogError("has no time: not one sample has a number there", file=file)
    if clock is not None:
        warn_of_watched(file, [clock])


def _commanded(columns: dict[str, Array]) -> list[Channel]:
    """The commands among some columns."""
    return [Channel(name, name, "1", name.replace("_", " ")) for name in columns if is_command(name)]


def check_temperature(kelvin: Array, file: str, channel: str) -> None:
    """Refuse another unit than the one that was said; single readings that cannot be are the sensor's to judge.

    Args:
        kelvin: temperatures [K], shape (n,).

    Raises:
        LogError: half of them or more are beyond what oil can have.
    """
    known = kelvin[np.isfinite(kelvin)]
    absurd = known[(known < COLDEST) | (known > HOTTEST)]
    if absurd.size and 2 * absurd.size >= known.size:
        raise LogError(
            f"is {absurd[0] - FREEZING:g} °C; a drive log's oil is between {COLDEST - FREEZING:g} and"
            f" {HOTTEST - FREEZING:g} °C: is the column in another unit?",
            file=file,
            column=channel,
        )
