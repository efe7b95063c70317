"""A first channel map for a log that was looked through, to be checked by a person."""

from __future__ import annotations

import math
import os
from pathlib import Path

from ramsight.log_formats import CAN
from ramsight.logs.can_origins import Origins
from ramsight.logs.channel_map import LONGEST
from ramsight.logs.clock import Clock
from ramsight.logs.drive_maps import FOLDER, known_by, recognised
from ramsight.logs.frames import EXTENDED
from ramsight.logs.guess import USUAL, celsius, is_share
from ramsight.logs.inspect import Channel, Inspection
from ramsight.logs.mapped import HOLD, Mapped
from ramsight.units import FREEZING

_SPARSE = 0.1  # share of empty cells from which they are no samples, rather than faults
_RATED = {"speed": "3000 rpm", "torque": "35 N m"}  # examples of what 100 % is
_ON_THE_PLATE = {"speed": "", "torque": ": object 6076h, or the motor's plate"}
_ON_CHANGE = 0.8  # share of the samples that a channel at a period has
_CHANGE_HOLD = 60.0  # s; for which a value holds at least that comes when it changes
_LATE_FEW = 1.5  # longest distances that it may be late
_LATE = 5.0  # usual distances of a channel's samples that it may be late


def map_text(found: Inspection, folder: Path | None = None) -> str:
    """A channel map in TOML for what was found, to be checked by a person."""
    lines = [
        f"# Channel map for {Path(found.file).name}: check signs (positive extends the rod), units and sources.",
        "# A value is sign * (scale * number + offset), in the unit; without them scale = 1 and offset = 0.",
        "",
    ]
    if not found.known.roles:
        names = [*(one.name for one in found.channels), *(() if found.clock is None else found.clock.timed.columns)]
        lines[2:2] = [
            f"# {known_by(one)}: perhaps a {one.title}; logs inspect --map {one.name} tries it"
            for one in recognised(found.frames, names)
        ]
    if found.clock is not None:
        lines += [_time_line(found.clock), ""]
    for role in ("speed", "torque", "temperature"):
        lines += [*_role_lines(found, role), ""]
    lines += _reference_lines(found)
    lines += _align_lines(found)
    lines += _csv_lines(found)
    lines += _can_lines(found, folder)
    return "\n".join(lines).rstrip() + "\n"


def _time_line(clock: Clock) -> str:
    timed = clock.timed
    if not timed.channel and timed.period is None:
        return (
            'time = { channel = "", unit = "s" }  # not found: name the column that is the clock, and its unit;'
            ' or how far rows are apart: time = { period = "20 ms" }'
        )
    columns = {"channel": timed.channel, "date": timed.date, "week": timed.week}
    said = [f"{key} = {_text(value)}" for key, value in columns.items() if value]
    if timed.period is not None:
        said.append(f'period = "{1e3 * timed.period:.12g} ms"')
    elif clock.is_asked and not clock.evidence:
        return f'# time = {{ {", ".join(said)}, period = "20 ms" }}  # needed: how far rows are apart; it numbers them'
    elif clock.is_asked:
        return f"# time = {{ {', '.join(said)}, unit = ... }}  # needed: {clock.evidence}"
    elif not clock.is_stamp:
        said.append(f"unit = {_text(timed.unit or 's')}")
    if (timed.sign, timed.scale, timed.offset) != (1.0, 1.0, 0.0):
        said += [f"sign = {timed.sign:g}", f"scale = {timed.scale!r}", f"offset = {timed.offset!r}"]
    return f"time = {{ {', '.join(said)} }}" + (f"  # {clock.evidence}" if clock.evidence else "")


def _role_lines(found: Inspection, role: str) -> list[str]:
    channel = found.of(role)
    said = found.known.roles.get(role)
    if channel is None and said is not None and said.constant is not None:
        return [f"[{role}]", f'constant = "{said.constant - FREEZING:g} degC"']
    if channel is None:
        lines = [f"[{role}]  # not found: name the channel", 'channel = ""', f'unit = "{USUAL[role]}"']
        if role == "temperature":
            return [
                "# [temperature]  # needed, and not found: name the channel,",
                '# channel = "..."',
                '# unit = "degC"',
                '# constant = "45 degC"  # or, where nobody measures it, say what it is: one of the two',
            ]
        return lines
    said = said or Mapped(channel.name)
    unit = said.unit or (celsius(channel.unit) if role == "temperature" else channel.unit)
    note = "" if unit else "  # the file does not say: check it"
    lines = [f"[{role}]", f"channel = {_text(channel.name)}", f"unit = {_text(unit or USUAL[role])}{note}"]
    if said.rated is not None:
        lines.append(f'rated = "{said.rated:.12g} {"N m" if role == "torque" else "rad/s"}"')
    elif is_share(unit):
        lines.append(f'# rated = "{_RATED[role]}"  # needed: what 100 % is{_ON_THE_PLATE[role]}')
    elif role == "torque" and not unit:
        lines.append('# rated = "35 N m"  # what 100 % is, if the unit is percent or permille of that (6077h)')
    lines.append(f"sign = {said.sign:g}")
    if said.scale != 1.0:
        lines.append(f"scale = {said.scale!r}")
    if said.offset:
        lines.append(f"offset = {said.offset!r}")
    late = _LATE / channel.rate if channel.rate > 0 else 0.0
    if comes_on_change(found, channel):
        long = max(_CHANGE_HOLD, math.ceil(max(map(covered, found.channels))), math.ceil(channel.distances.longest))
        return [*lines, f'hold = "{long:g} s"  # it comes when it changes, by its distances']
    if role != "temperature" and is_slow(found, channel):
        long = max(late, _LATE_FEW * channel.distances.longest)
        return [*lines, f'hold = "{long:.2g} s"  # it comes seldom, {channel.distances.longest:.2g} s apart at most']
    if said.hold != HOLD[role] and found.known.roles:
        lines.append(f'hold = "{said.hold:g} s"')
    elif late > HOLD[role]:
        lines.append(f'hold = "{late:.2g} s"  # it comes every {1.0 / channel.rate:.2g} s')
    return lines


def comes_on_change(found: Inspection, channel: Channel) -> bool:
    """Whether a channel comes when it changes: as near as those that come always, and much seldomer in all."""
    return channel.samples > 0 and covered(channel) < _ON_CHANGE * max(map(covered, found.channels))


def covered(channel: Channel) -> float:
    """How long the samples of a channel last, each for their usual distance [s]; what a pause takes is not in it."""
    return channel.samples / channel.rate if channel.rate > 0 else 0.0


def is_slow(found: Inspection, channel: Channel) -> bool:
    """Whether a channel comes so seldom that no sensor works with its rate, and another comes fast enough."""
    fastest = max((one.rate for one in found.channels if one.rate > 0), default=0.0)
    return channel.rate * LONGEST < 1.0 <= fastest * LONGEST


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
        changing = [one for one in (speed, torque) if comes_on_change(found, one) or is_slow(found, one)]
        is_sparse = found.clock is not None and any(one.missing > _SPARSE * one.samples for one in (speed, torque))
        if len(changing) == 1:
            base = "torque" if changing[0] is speed else "speed"
            sparse = ['empty = "no sample"  # an empty cell is no change'] if found.clock is not None else []
            return ["[align]", *sparse, f'base = "{base}"  # the other comes seldom, or when it changes', ""]
        if len(changing) == 2:
            lines.append("# speed and torque come when they change: log one of them at a period, it is the log's clock")
        if is_sparse:
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
        if not found.frames and not found.file.lower().endswith(CAN.suffixes):
            return []
        nodes = sorted({key & ~EXTENDED for key in found.frames if 0x181 <= key & ~EXTENDED <= 0x57F})
        senders = sorted({key & 0x7F for key in nodes if key & 0x7F})
        return [
            "[can]  # say what the frames mean: a DBC file, or CANopen mappings",
            '# dbc = "drive.dbc"',
            "# [[can.pdo]]",
            f"# cob_id = {hex(nodes[0]) if nodes else '0x181'}"
            + (f"  # 0x180 and the drive's node, one of {', '.join(map(str, senders))}" if len(senders) > 1 else ""),
            '# objects = ["606Ch", "6077h"]  # mapped one after the other',
        ]
    lines = ["[can]"]
    names = [path.name if path.parent == FOLDER else _from(path, folder or Path()) for path in known.dbc]
    if names:
        lines.append(f"dbc = {_text(names[0]) if len(names) == 1 else '[' + ', '.join(map(_text, names)) + ']'}")
    lines += _origin_lines(found)
    for pdo in known.pdos:
        objects = ", ".join(_text(one) for one in pdo.objects)
        lines += ["", "[[can.pdo]]", f"cob_id = {hex(pdo.cob_id)}", f"objects = [{objects}]"]
    return lines


def _from(path: Path, folder: Path) -> str:
    """How a file is named in a map that is in a folder."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive of Windows
        return path.absolute().as_posix()


def _origin_lines(found: Inspection) -> list[str]:
    """Which bus and which J1939 addresses are read; a line to be filled in where several send the same."""
    known, lines = found.known, []
    origins = found.origins or Origins(found.file)
    buses, sources = origins.buses, origins.sources
    if known.bus is not None:
        lines.append(f"bus = {known.bus}")
    elif buses:
        lines.append(f"# bus = {buses[0]}  # needed: which of {', '.join(map(str, buses))} is the drive's")
    if known.sources:
        named = ", ".join(f"0x{one:02X}" for one in known.sources)
        lines.append(f"source = {named if len(known.sources) == 1 else f'[{named}]'}")
    if sources:
        named = ", ".join(f"0x{one:02X}" for one in sources)
        read = ", ".join(f"0x{one:02X}" for one in (sources[0], *origins.others))
        lines.append(f"# source = [{read}]  # needed: J1939 addresses; the drive is one of {named}")
    if known.destinations:
        lines.append(f"destination = [{', '.join(f'0x{one:02X}' for one in known.destinations)}]")
    elif origins.destinations:
        named = ", ".join(f"0x{one:02X}" for one in origins.destinations)
        lines.append(f"# destination = 0x{origins.destinations[0]:02X}  # needed: frames go to {named}")
    if known.j1939 is not None:
        lines.append(f"j1939 = {str(known.j1939).lower()}")
    return lines


def _text(text: str) -> str:
    """A TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
    return f'"{escaped}"'
