"""A channel map: which channels of a file are motor speed, motor torque, oil temperature and references.

It is a small TOML file; docs/how-to/channel-map.md shows one for each kind of log. `ramsight logs
inspect FILE --out map.toml` writes a first one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import overload

from ramsight import bounded_toml
from ramsight.errors import DescriptionError
from ramsight.logs.channels import DC_POWER, POSITION
from ramsight.logs.clock_units import is_time
from ramsight.logs.drive_maps import FOLDER, catalogued
from ramsight.logs.header import SEPARATORS, CsvForm
from ramsight.logs.lines import file_name
from ramsight.logs.map_keys import Keys
from ramsight.logs.mapped import (
    FURTHER,
    HOLD,
    INSTEAD,
    LINKED,
    MEASURED,
    ROLES,
    SI,
    USUAL_HOLD,
    ChannelMap,
    Commanded,
    Counted,
    Mapped,
    Motor,
    Pdo,
    Referenced,
    SensorCurve,
    Sequence,
    Timed,
    to_si_of,
)

SHORTEST, LONGEST, USUAL_PERIOD = 8e-3, 0.1, 0.02
"""Periods of samples that sensors work with, and one that drives usually have [s]."""

SHORTEST_ROW, LONGEST_ROW = 1e-6, 100.0
"""How far rows of a log may be apart [s]."""

MOST_NOISE = 1000.0  # N m; as much as tolerances of a description have
WORST_LINEARITY = 0.1  # m; a sensor that is bent by more measures something else

_PROPOSED = "'ramsight logs inspect' proposes one"
_WHERE = {
    "temperature": "name the oil's channel and its unit, or, where nobody measures it, say what it is:"
    ' temperature = {constant = "45 degC"}'
}

LARGEST_MODULUS = 1 << 32
LARGEST_ADDRESS = 0xFD  # of J1939: FEh is nobody's, FFh everybody's

EDGES = ("rising", "falling", "both")


AnyMap = ChannelMap | str | Path


@overload
def known_map(channel_map: AnyMap) -> ChannelMap: ...


@overload
def known_map(channel_map: AnyMap | None) -> ChannelMap | None: ...


def known_map(channel_map: AnyMap | None) -> ChannelMap | None:
    """A channel map as it is passed to a function: a map, the file of one, a name of the catalogue, or none.

    Raises:
        DescriptionError: it is none of these, or the file cannot be read.
    """
    if isinstance(channel_map, str | Path):
        of_catalogue = catalogued(channel_map)
        return load_map(channel_map) if of_catalogue is None else load_map(of_catalogue, is_whole=False)
    if channel_map is None or isinstance(channel_map, ChannelMap):
        return channel_map
    raise DescriptionError("is no channel map", key="channel_map", value=channel_map, allowed="a TOML file, or a map")


def load_map(path: str | Path, *, is_whole: bool = True) -> ChannelMap:
    r"""A channel map from its TOML file.

    Args:
        path: the file.
        is_whole: whether it has to state speed, torque and oil temperature; a map of the catalogue knows no oil.

    Raises:
        DescriptionError: it cannot be read, or states what cannot be; names file, key, value and what is allowed.

    Example:
        >>> import tempfile
        >>> text = '''
        ... time = {channel = "t", unit = "ms"}
        ... speed = {channel = "n", unit = "1/min"}
        ... torque = {channel = "M", unit = "percent", rated = "35 N m", sign = -1}
        ... temperature = {constant = "45 degC"}
        ... '''
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = Path(folder) / "map.toml"
        ...     _ = file.write_text(text)
        ...     found = load_map(file)
        >>> found.roles["torque"].rated, found.roles["temperature"].constant
        (35.0, 318.15)
    """
    file = file_name(path)
    try:
        if Path(path).is_fifo():
            raise DescriptionError("is not a regular file", file=file)
        with open(path, "rb") as content:
            table = bounded_toml.loads(content.read(bounded_toml.LARGEST + 1).decode("utf-8"))
    except (OSError, ValueError) as error:
        text = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        said = text if isinstance(error, OSError) else f"is no TOML file: {text}"
        raise DescriptionError(said, file=file) from None
    return _read_map(Keys(table, file), Path(path).parent, file, is_whole=is_whole)


def check_whole(known: ChannelMap) -> None:
    """Refuse a map that lacks a role, as those of the catalogue lack the oil.

    Raises:
        DescriptionError: names the table that is missing.
    """
    for role in ROLES:
        if role not in known.roles:
            raise DescriptionError(f"has no [{role}]; {_WHERE.get(role, _PROPOSED)}", file=known.file)


def _read_map(keys: Keys, folder: Path, file: str, *, is_whole: bool) -> ChannelMap:
    if keys.take("format", int, 1) != 1:
        raise keys.wrong("format", "is of a later ramsight", "1")
    clock = _timed(keys.table("time"))
    drive = keys.table("drive")
    if drive is not None:
        for key in ("title", "source", "tried"):
            drive.take(key, str, None)
        drive.take("columns", list, [])
        drive.end()
    roles, angle, motor = _roles(keys, file, is_whole=is_whole)
    if not (roles["speed"].channel and roles["torque"].channel):
        raise DescriptionError("speed and torque need a channel, a constant is none", file=file)
    references = tuple(_referenced(part) for part in keys.tables("reference"))
    align = keys.table("align") or Keys({}, file)
    base = align.choice("base", {"speed": "speed", "torque": "torque"}, None)
    empty = align.choice("empty", {"missing": False, "no sample": True}, False)
    period = align.quantity("period", "s")
    if period is not None and not SHORTEST <= period <= LONGEST:
        raise align.wrong("period", "is none that a sensor works with", f"{SHORTEST * 1e3:g} to {LONGEST * 1e3:g} ms")
    align.end()
    form = _form(keys.table("csv") or Keys({}, file))
    can = keys.table("can") or Keys({}, file)
    named = can.take("dbc", (str, list), [])
    dbc = tuple(_dbc(folder, str(name)) for name in ([named] if isinstance(named, str) else named))
    pdos = tuple(_pdo(part) for part in can.tables("pdo"))
    bus, j1939 = can.take("bus", int, None), can.flag("j1939")
    sources, destinations = _addresses(can, "source"), _addresses(can, "destination")
    can.end()
    commands = _commands(keys.table("command"))
    measured, linearity, curve = _measured(keys.table("measured"))
    tables = {name: keys.table(name) for name in FURTHER}
    further = {name: _mapped(table, name) for name, table in tables.items() if table is not None}
    linked = _linked(keys, further)
    sequence, state = _sequence(keys.table("sequence")), _state(keys.table("state"))
    keys.end()
    return ChannelMap(
        file, clock, roles, references, base, bool(empty), form, dbc, pdos, bus, angle, motor, commands, further,
        measured, linked, USUAL_PERIOD if angle is not None and period is None else period, linearity, curve,
        sources, destinations, j1939, sequence, state,
    )  # fmt: skip


def _dbc(folder: Path, name: str) -> Path:
    """A DBC file beside the map, or that of the catalogue by its name."""
    return FOLDER / name if not (folder / name).exists() and (FOLDER / name).exists() else folder / name


def _timed(keys: Keys | None) -> Timed | None:
    """The clock: a channel, a period of rows, or a channel of which each number is a period."""
    if keys is None:
        return None
    channel, date, week = (keys.take(key, str, None) or None for key in ("channel", "date", "week"))
    period, unit = keys.quantity("period", "s"), keys.take("unit", str, None)
    if channel is None and period is None:
        raise keys.wrong("channel", "a channel is needed, or how far rows are apart", 'period = "20 ms"')
    if period is not None and not SHORTEST_ROW <= period <= LONGEST_ROW:
        raise keys.wrong("period", "is no distance of rows", f"{SHORTEST_ROW * 1e6:g} us to {LONGEST_ROW:g} s")
    for other, one, words in (
        ("unit", unit, "the period says what a number is"),
        ("date", date, "rows at a period have no date"),
        ("week", week, "rows at a period have no week"),
    ):
        if period is not None and one is not None:
            raise keys.wrong(other, f"and period are two for one: {words}", "one of the two")
    if date is not None and week is not None:
        raise keys.wrong("week", "and date are two for one", "one of the two")
    if unit is not None and not is_time(unit):
        raise keys.wrong("unit", "is no unit of time", '"s", "ms", "us", "100 ns", "d", or several: "20 ms"')
    form = _numbers(keys)
    if channel is None and form != (1.0, 1.0, 0.0):
        raise keys.wrong("scale", "and offset and sign are for the numbers of a channel", "period alone")
    keys.end()
    return Timed(channel or "", unit, date, week, period, *form)


def _numbers(keys: Keys) -> tuple[float, float, float]:
    """Sign, scale and offset of a channel's numbers."""
    sign = keys.take("sign", (int, float), 1)
    if sign not in (1, -1):
        raise keys.wrong("sign", "is no sign", "1 or -1")
    scale, offset = keys.take("scale", (int, float), 1.0), keys.take("offset", (int, float), 0.0)
    if scale == 0:
        raise keys.wrong("scale", "makes everything 0", "a number other than 0")
    return float(sign), float(scale), float(offset)


def _sequence(keys: Keys | None) -> Sequence | None:
    """The number of the drive's frames."""
    if keys is None:
        return None
    channel, modulus = keys.take("channel", str, ""), keys.take("modulus", int, 256)
    of_sync = keys.choice("counts", {"frames": False, "sync": True}, False)
    if not channel:
        raise keys.wrong("channel", "a channel is needed", None)
    if not 2 <= modulus <= LARGEST_MODULUS:
        raise keys.wrong("modulus", "is none of a sequence", f"2 to {LARGEST_MODULUS}; 2 is a toggle bit")
    keys.end()
    return Sequence(channel, modulus, bool(of_sync))


def _state(keys: Keys | None) -> str | None:
    """The channel of the drive's state word."""
    if keys is None:
        return None
    channel = str(keys.take("channel", str, ""))
    if not channel:
        raise keys.wrong("channel", "a channel is needed", '"6041h"')
    keys.end()
    return channel


def _linked(keys: Keys, further: Mapping[str, Mapped]) -> dict[str, Mapped]:
    """Voltage and current of the DC link, of which a map names both, or the power, or nothing."""
    tables = {name: keys.table(name) for name in LINKED}
    found = {name: _mapped(table, name) for name, table in tables.items() if table is not None}
    if found and len(found) < len(LINKED):
        missing = next(name for name in LINKED if name not in found)
        raise keys.wrong(missing, "power needs voltage and current of the DC link", "both tables")
    if found and DC_POWER.name in further:
        raise keys.wrong(DC_POWER.name, "and voltage and current of the DC link are two for one", "one of the two")
    return found


def _roles(keys: Keys, file: str, *, is_whole: bool) -> tuple[dict[str, Mapped], Counted | None, Motor | None]:
    """The channels of speed, torque and temperature, and what stands in the place of the first two."""
    roles: dict[str, Mapped] = {}
    angle, motor = keys.table("angle"), keys.table("current")
    passed = {"speed": angle, "torque": motor}
    for role in ROLES:
        part = keys.table(role)
        if part is not None and passed.get(role) is not None and role != "speed":
            other = next(name for name, instead in INSTEAD.items() if instead == role)
            raise keys.wrong(role, f"and [{other}] are two for one", "one of the two")
        if part is None and passed.get(role) is None and is_whole:
            raise DescriptionError(f"has no [{role}]; {_WHERE.get(role, _PROPOSED)}", file=file)
        if part is not None:
            roles[role] = _mapped(part, role)
    counted = stands_for = None
    if angle is not None:
        counted, roles["speed"] = _counted(angle, roles.get("speed"))
    if motor is not None:
        stands_for, roles["torque"] = _motor(motor)
    return roles, counted, stands_for


def _counted(keys: Keys, speed: Mapped | None) -> tuple[Counted, Mapped]:
    """How an angle counts, with the speed beside it if there is one, and its channel."""
    per_turn = keys.take("per_turn", (int, float), None)
    if per_turn is None or per_turn <= 0:
        raise keys.wrong("per_turn", "the numbers of a turn are needed", "4096, 360, ...")
    modulus = keys.take("modulus", (int, float, str), None)
    if isinstance(modulus, str) and modulus != "never":
        raise keys.wrong("modulus", "is no number", 'numbers until it begins again, or "never"')
    if isinstance(modulus, (int, float)) and modulus < 3:
        raise keys.wrong("modulus", "is too small to say which way it counts", '3 or more, or "never"')
    begins = math.inf if modulus == "never" else None if modulus is None else float(modulus)
    fastest = keys.quantity("fastest", "rad/s")
    if fastest is not None and fastest <= 0.0:
        raise keys.wrong("fastest", "is no speed of a shaft that turns", '"1500 1/min" and such')
    return Counted(float(per_turn), begins, fastest, speed), replace(_mapped(keys, "angle"), unit="rad/s")


def _motor(keys: Keys) -> tuple[Motor, Mapped]:
    constant = keys.quantity("torque_constant", "N m")
    if constant is None or constant == 0.0:
        raise keys.wrong("torque_constant", "the torque of one unit of the current is needed", '"0.05 N m"')
    saturation = keys.take("saturation", (int, float), None)
    if saturation is not None and saturation <= 0:
        raise keys.wrong("saturation", "is a current beyond all that flow", "a number above 0")
    motor = Motor(constant, None if saturation is None else float(saturation))
    return motor, replace(_mapped(keys, "current"), unit="N m")


def _commands(keys: Keys | None) -> dict[str, Commanded]:
    """The channels that command parts of the circuit."""
    found: dict[str, Commanded] = {}
    if keys is None:
        return found
    for name in keys.names():
        part = keys.table(name)
        if part is not None:
            least = part.take("least", (int, float), 0.0)
            found[name] = Commanded(replace(_mapped(part, "command"), unit="1", hold=math.inf), float(least))
    return found


def _measured(keys: Keys | None) -> tuple[dict[str, Mapped], float, SensorCurve | None]:
    """The channels that only identification and judgement may see; linearity and curve of the position's sensor."""
    found: dict[str, Mapped] = {}
    linearity, curve = 0.0, None
    for name in MEASURED:
        part = None if keys is None else keys.table(name)
        if part is None:
            continue
        if name == POSITION.name:
            linearity, curve = _linearity(part), _curve(part.table("curve"))
        found[name] = _mapped(part, name)
    if keys is not None:
        keys.end()
    return found, linearity, curve


def _linearity(keys: Keys) -> float:
    linearity = keys.quantity("linearity", "m")
    if linearity is not None and not 0.0 <= linearity <= WORST_LINEARITY:
        raise keys.wrong("linearity", "is none of a position sensor", f"0 to {WORST_LINEARITY * 1e3:g} mm")
    return linearity or 0.0


def _curve(keys: Keys | None) -> SensorCurve | None:
    if keys is None:
        return None
    unit = keys.take("unit", str, "mm")
    factor, _ = to_si_of(unit, "position", None, file=keys.file, key=f"{keys.path}unit")
    columns = []
    for key in ("reading", "excess"):
        numbers = keys.take(key, list, [])
        if not all(isinstance(one, (int, float)) and math.isfinite(one) for one in numbers):
            raise keys.wrong(key, "has to be numbers", f"in {unit}")
        columns.append(tuple(factor * float(one) for one in numbers))
    keys.end()
    curve = SensorCurve(*columns)
    if len(curve.at) < 2 or len(curve.at) != len(curve.excess) or not curve.is_unique:
        allowed = "two or more, as many as of excess, and each position read once"
        raise keys.wrong("reading", "and excess make no curve of a sensor", allowed)
    return curve


def _mapped(keys: Keys, role: str, *, end: bool = True) -> Mapped:
    constant = keys.quantity("constant", SI[role]) if role == "temperature" else None
    channel = keys.take("channel", str, "")
    if bool(channel) == (constant is not None):
        other = " or a constant, one of the two" if role == "temperature" else ""
        raise keys.wrong("channel", f"a channel is needed{other}", None)
    noise = keys.quantity("noise", SI[role]) if role == "torque" else None
    if noise is not None and not 0.0 < noise <= MOST_NOISE:
        raise keys.wrong("noise", "is none of a torque", f"above 0 to {MOST_NOISE:g} N m")
    unit = keys.take("unit", str, None)
    rated = keys.quantity("rated", SI[role]) if role in ("speed", "torque", "dc_current") else None
    if unit is not None:
        to_si_of(unit, role, rated, file=keys.file, key=f"{keys.path}unit")
    sign, scale, offset = _numbers(keys)
    hold = keys.quantity("hold", "s")
    if hold is not None and hold <= 0:
        raise keys.wrong("hold", "has to be longer than nothing", 'for example "0.5 s"')
    if end:
        keys.end()
    usual = HOLD.get(role, USUAL_HOLD)
    held = usual if hold is None else hold
    return Mapped(channel, unit, sign, scale, offset, rated, held, constant, noise or 0.0)


def _referenced(keys: Keys) -> Referenced:
    position = keys.quantity("position", "m")
    edge = keys.choice("edge", {name: name for name in EDGES}, "rising")
    mapped = _mapped(keys, "reference", end=False)
    keys.end()
    return Referenced(mapped, position, str(edge))


def _form(keys: Keys) -> CsvForm:
    line = keys.take("header_line", int, 1)
    if not 1 <= line <= 1000:
        raise keys.wrong("header_line", "is no line of a header", "1 to 1000")
    separator = keys.take("separator", str, None)
    if separator is not None and separator not in SEPARATORS:
        raise keys.wrong("separator", "is not known", "',', ';' or '\\t'")
    encoding = keys.take("encoding", str, "utf-8")
    try:
        "°".encode(encoding)
    except (LookupError, ValueError):
        raise keys.wrong("encoding", "is not known", "utf-8, cp1252, latin-1, ...") from None
    first = keys.take("first_row", int, None)
    if first is not None and not line < first <= line + 1000:
        raise keys.wrong("first_row", "is no line under the header", f"{line + 1} to {line + 1000}")
    decimal = keys.take("decimal", str, None)
    if decimal is not None and decimal not in (",", "."):
        raise keys.wrong("decimal", "is not known", "',' or '.'")
    keys.end()
    return CsvForm(line, separator, encoding, first, decimal)


def _addresses(keys: Keys, key: str) -> tuple[int, ...]:
    given = keys.take(key, (int, list), [])
    listed = given if isinstance(given, list) else [given]
    if not all(isinstance(one, int) and 0 <= one <= LARGEST_ADDRESS for one in listed):
        raise keys.wrong(key, "is no J1939 address", f"0 to {LARGEST_ADDRESS}, or a list of them; 0x27 is one")
    return tuple(listed)


def _pdo(keys: Keys) -> Pdo:
    cob_id = keys.take("cob_id", int, None)
    if cob_id is None or not 0 < cob_id <= 0x1FFFFFFF:
        raise keys.wrong("cob_id", "is no identifier", "0x181 and such")
    objects = keys.take("objects", list, [])
    if not objects or not all(isinstance(one, str) for one in objects):
        raise keys.wrong("objects", "are the mapped objects, in order", '["606Ch", "6077h"] and such')
    keys.end()
    return Pdo(cob_id, tuple(objects))
