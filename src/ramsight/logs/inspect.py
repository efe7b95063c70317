"""What is in a log: its channels with units, rates and ranges, and a first channel map."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ramsight.errors import LogError, warn_of_log
from ramsight.logs.align import Samples
from ramsight.logs.channel_map import HOLD, ChannelMap, Mapped, load_map
from ramsight.logs.clock import Clock, find_clock
from ramsight.logs.guess import USUAL, guess_form, guess_roles, is_share
from ramsight.logs.lines import Advance
from ramsight.logs.source import CAN, CSV, Offered, TableSource, open_source
from ramsight.logs.source_can import CanSource
from ramsight.logs.source_csv import CsvSource
from ramsight.logs.source_mdf import MdfSource
from ramsight.logs.source_parquet import ParquetSource

_SPARSE = 0.1  # share of empty cells from which they are no samples, rather than faults
_LATE = 5.0  # usual distances of a channel's samples that it may be late


@dataclass
class Channel:
    """A channel of a log and what was seen of it.

    Attributes:
        name: what a map calls it.
        unit: as the file says it, "" if it does not.
        note: group of an MDF file, kind of a text column.
        samples: that hold a number.
        missing: that hold none.
        least, most: range of the numbers.
        first, last: times of the first and the last sample [s].
        role: what it is proposed for, "" if nothing.
    """

    name: str
    unit: str
    note: str = ""
    samples: int = 0
    missing: int = 0
    least: float = np.nan
    most: float = np.nan
    first: float = np.nan
    last: float = np.nan
    role: str = ""

    @property
    def rate(self) -> float:
        """Samples per second [Hz], NaN if unknown."""
        span = self.last - self.first
        return (self.samples - 1) / span if self.samples > 1 and span > 0 else np.nan

    def count(self, samples: Samples) -> None:
        """Take more samples in."""
        known = np.isfinite(samples.value)
        self.missing += int(np.count_nonzero(~known))
        if not known.any():
            return
        values, times = samples.value[known], samples.time[known]
        self.samples += len(values)
        self.least = float(np.fmin(self.least, values.min()))
        self.most = float(np.fmax(self.most, values.max()))
        times = times[np.isfinite(times)]
        if times.size:
            self.first = float(np.fmin(self.first, times.min()))
            self.last = float(np.fmax(self.last, times.max()))


@dataclass
class Inspection:
    """What was found in a log.

    Attributes:
        file: its name.
        channels: all of them, the clock not among them.
        frames: of a CAN log, identifier (bit 31 set for an extended one) to how many frames and bytes.
        clock: of a table, its column and unit; both "" if none was found.
        known: the map that was looked through, with what could be guessed of the file's layout.
        clock_found: the clock of a table with all that was found of it.
    """

    file: str
    channels: list[Channel]
    frames: dict[int, tuple[int, int]] = field(default_factory=dict)
    clock: tuple[str, str] | None = None
    known: ChannelMap = field(default_factory=ChannelMap)
    clock_found: Clock | None = None

    def of(self, role: str) -> Channel | None:
        """The channel that is proposed for a role."""
        return next((one for one in self.channels if one.role == role), None)


def inspect_log(
    path: str | Path,
    channel_map: ChannelMap | str | Path | None = None,
    *,
    dbc: Sequence[Path] = (),
    advance: Advance | None = None,
) -> Inspection:
    """Look through a whole log.

    Args:
        path: the file, of any kind that ramsight reads.
        channel_map: what is known of it already: a CSV file's layout, a CAN log's DBC files and PDOs.
        dbc: further DBC files.
        advance: told the share of the file that was read since the last call.

    Raises:
        LogError: the file cannot be read.
    """
    known = load_map(channel_map) if isinstance(channel_map, str | Path) else channel_map or ChannelMap()
    known = replace(known, dbc=(*known.dbc, *dbc))
    if Path(path).name.lower().endswith(CSV) and channel_map is None:
        known = replace(known, form=guess_form(path))
    bad: dict[str, str] = {}
    while True:
        found, wrong = _look_through(path, known, bad, advance)
        if wrong is None or wrong.column is None or wrong.column in bad:
            break
        bad[wrong.column] = f"not read: {str(wrong).removeprefix(found.file)[2:]}"
    if wrong is not None:
        warn_of_log(f"only what stands before this is listed: {wrong}", file=found.file)
    roles = {role: one.channel for role, one in known.roles.items()} or guess_roles(
        [Offered(one.name, one.unit) for one in found.channels if one.samples]
    )
    for role, name in roles.items():
        for one in found.channels:
            if one.name == name and one.samples:
                one.role = role
    return found


def _look_through(
    path: str | Path, known: ChannelMap, bad: Mapping[str, str], advance: Advance | None
) -> tuple[Inspection, LogError | None]:
    """What is in a log but for some columns that cannot be read, and what else stopped the reading."""
    source = open_source(path, known, advance)
    if isinstance(source, MdfSource) and source.has_frames:
        source = CanSource(path, known, advance)
    clock = find_clock(source, known) if isinstance(source, TableSource) else None
    taken = () if clock is None else (clock.channel, clock.date)
    listed = [one for one in source.offered() if one.name not in taken]
    notes = source.notes([one.name for one in listed]) if isinstance(source, CsvSource) else {}
    channels = [Channel(one.name, one.unit, bad.get(one.name) or notes.get(one.name) or one.note) for one in listed]
    unread = {name for name, note in {**notes, **bad}.items() if note}
    if isinstance(source, ParquetSource):
        unread |= {one.name for one in listed if one.note}
    found = {one.name: one for one in channels if one.name not in unread}
    wrong = None
    try:
        for block in source.blocks(list(found)):
            for name, samples in block.items():
                found[name].count(samples)
    except LogError as error:
        wrong = error
    frames = source.seen if isinstance(source, CanSource) else {}
    if isinstance(source, CanSource) and wrong is not None and not frames:
        raise wrong
    said = None if clock is None else (clock.channel, clock.unit)
    return Inspection(source.file, channels, frames, said, known, clock), wrong


def map_text(found: Inspection, folder: Path | None = None) -> str:
    """A channel map in TOML for what was found, to be checked by a person.

    Args:
        found: by `inspect_log`.
        folder: where the map will stand; DBC files are named from there.
    """
    lines = [
        f"# Channel map for {Path(found.file).name}: check signs (positive extends the rod), units and sources.",
        "",
    ]
    if found.clock_found is not None:
        lines += [_time_line(found.clock_found), ""]
    for role in ("speed", "torque", "temperature"):
        lines += [*_role_lines(found, role), ""]
    lines += _reference_lines(found)
    lines += _align_lines(found)
    lines += _csv_lines(found)
    lines += _can_lines(found, folder)
    return "\n".join(lines).rstrip() + "\n"


def _time_line(clock: Clock) -> str:
    if not clock.channel:
        return 'time = { channel = "", unit = "s" }  # not found: name the column that is the clock, and its unit'
    date = "" if clock.date is None else f", date = {_text(clock.date)}"
    unit = "" if clock.is_stamp else f", unit = {_text(clock.unit)}"
    doubt = f"  # {clock.doubt}" if clock.doubt else ""
    return f"time = {{ channel = {_text(clock.channel)}{date}{unit} }}{doubt}"


def _role_lines(found: Inspection, role: str) -> list[str]:
    channel = found.of(role)
    said = found.known.roles.get(role)
    if channel is None and said is not None and said.constant is not None:
        return [f"[{role}]", f'constant = "{said.constant - 273.15:g} degC"']
    if channel is None:
        lines = [f"[{role}]  # not found: name the channel", 'channel = ""', f'unit = "{USUAL[role]}"']
        if role == "temperature":
            lines[0] = "[temperature]  # not found: name the channel, or live with a constant"
            lines[1:] = ['constant = "40 degC"']
        return lines
    said = said or Mapped(channel.name)
    unit = said.unit or channel.unit
    doubt = "" if unit else "  # the file does not say: check it"
    lines = [f"[{role}]", f"channel = {_text(channel.name)}", f"unit = {_text(unit or USUAL[role])}{doubt}"]
    if said.rated is not None:
        lines.append(f'rated = "{said.rated:.12g} {"N m" if role == "torque" else "rad/s"}"')
    elif is_share(unit):
        lines.append('# rated = "35 N m"  # say what 100 % is: object 6076h, or the motor\'s plate')
    lines.append(f"sign = {said.sign:g}")
    if said.scale != 1.0:
        lines.append(f"scale = {said.scale!r}")
    if said.offset:
        lines.append(f"offset = {said.offset!r}")
    late = _LATE / channel.rate if channel.rate > 0 else 0.0
    if said.hold != HOLD[role] and found.known.roles:
        lines.append(f'hold = "{said.hold:g} s"')
    elif late > HOLD[role]:
        lines.append(f'hold = "{late:.2g} s"  # it comes every {1.0 / channel.rate:.2g} s')
    return lines


def _reference_lines(found: Inspection) -> list[str]:
    channel = found.of("reference")
    if channel is not None:
        return ["[[reference]]", f"channel = {_text(channel.name)}", f"unit = {_text(channel.unit or 'm')}", ""]
    return [
        "# A switch that says where the piston is when it changes:",
        "# [[reference]]",
        '# channel = "..."',
        '# position = "790 mm"',
        '# edge = "rising"  # or falling, both',
        "",
    ]


def _align_lines(found: Inspection) -> list[str]:
    speed, torque = found.of("speed"), found.of("torque")
    lines = []
    if speed is not None and torque is not None:
        if found.clock is not None and any(one.missing > _SPARSE * one.samples for one in (speed, torque)):
            lines.append('empty = "no sample"  # each column has its own rate; "missing" if empty cells are faults')
        if speed.samples != torque.samples or found.clock is None:
            base = "speed" if speed.samples < torque.samples else "torque"
            lines.append(f'base = "{base}"  # the slower of the two is the clock of the log')
    return ["[align]", *lines, ""] if lines else []


def _csv_lines(found: Inspection) -> list[str]:
    form, lines = found.known.form, []
    if form.header_line != 1:
        lines.append(f"header_line = {form.header_line}")
    if form.separator is not None:
        lines.append(f"separator = {_text(form.separator)}")
    if form.first_row is not None:
        lines.append(f"first_row = {form.first_row}")
    if form.decimal is not None:
        lines.append(f"decimal = {_text(form.decimal)}")
    if form.encoding != "utf-8":
        lines.append(f"encoding = {_text(form.encoding)}")
    return ["[csv]", *lines, ""] if lines else []


def _can_lines(found: Inspection, folder: Path | None) -> list[str]:
    known = found.known
    if not known.is_can:
        if not found.frames and not found.file.lower().endswith(CAN):
            return []
        nodes = [key for key in found.frames if 0x181 <= key <= 0x57F]
        return [
            "[can]  # say what the frames mean: a DBC file, or CANopen mappings",
            '# dbc = "drive.dbc"',
            "# [[can.pdo]]",
            f"# cob_id = {hex(nodes[0]) if nodes else '0x181'}",
            '# objects = ["606Ch", "6077h"]  # mapped one after the other',
        ]
    lines = ["[can]"]
    names = [Path(os.path.relpath(path, folder or Path())).as_posix() for path in known.dbc]
    if names:
        lines.append(f"dbc = {_text(names[0]) if len(names) == 1 else '[' + ', '.join(map(_text, names)) + ']'}")
    if known.bus is not None:
        lines.append(f"bus = {known.bus}")
    for pdo in known.pdos:
        objects = ", ".join(_text(one) for one in pdo.objects)
        lines += ["", "[[can.pdo]]", f"cob_id = {hex(pdo.cob_id)}", f"objects = [{objects}]"]
    return lines


def _text(text: str) -> str:
    """A TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
    return f'"{escaped}"'
