"""A channel map: which channels of a file are motor speed, motor torque, oil temperature and references.

It is a small TOML file; docs/logs.md shows one for each kind of log. `ramsight logs inspect FILE --out map.toml`
writes a first one.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ramsight.errors import DescriptionError
from ramsight.logs.channels import MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE, REFERENCE, TIME
from ramsight.logs.header import SEPARATORS, CsvForm
from ramsight.logs.lines import file_name
from ramsight.units import parse

ROLES = {"speed": MOTOR_SPEED, "torque": MOTOR_TORQUE, "temperature": OIL_TEMPERATURE}
"""Tables of a map, and what each becomes in the log."""

SI = {"time": "s", "speed": "rad/s", "torque": "N m", "temperature": "K", "reference": "m"}
HOLD = {"speed": 0.5, "torque": 0.5, "temperature": 60.0, "reference": 0.5}
"""How long a value holds without a new one [s], unless the map says otherwise: a drive reports every few
milliseconds, and oil does not change its temperature within a minute."""

EDGES = ("rising", "falling", "both")


@dataclass(frozen=True)
class Mapped:
    """One source channel and what its numbers mean: ``sign * (scale * number + offset)`` in ``unit``.

    Args:
        channel: its name in the file, "" for a constant.
        unit: of the number after scale and offset; None takes the file's.
        sign: 1 or -1.
        scale: factor.
        offset: in `unit`.
        rated: what 100 % is, in SI, where `unit` is percent or permille.
        hold: how long a value holds [s].
        constant: the value in SI where there is no channel.
    """

    channel: str
    unit: str | None = None
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0
    rated: float | None = None
    hold: float = 0.5
    constant: float | None = None


@dataclass(frozen=True)
class Referenced:
    """A channel that says where the piston is.

    Args:
        mapped: the channel: positions in its unit, or a switch if `position` is given.
        position: where the piston is when the switch changes [m].
        edge: which change it is: ``rising``, ``falling`` or ``both``.
    """

    mapped: Mapped
    position: float | None = None
    edge: str = "rising"


@dataclass(frozen=True)
class Pdo:
    """A CANopen process data object.

    Args:
        cob_id: identifier of its frames.
        objects: what is mapped into it, end to end: ``606Ch``, ``4602h:0Ch``, ``2010h:01 INT16``.
    """

    cob_id: int
    objects: tuple[str, ...]


@dataclass(frozen=True)
class ChannelMap:
    """Everything that a map says; made by `load_map` or `standard_map`.

    Args:
        file: where it was read, None for one made by the program.
        time: clock column of a table.
        roles: ``speed``, ``torque`` and ``temperature``.
        references: none or some.
        base: the role whose samples are the log's: ``speed`` or ``torque``; None takes the slower.
        sparse: whether an empty cell of a table is no sample, rather than a missing value.
        form: layout of a CSV file.
        dbc: files that say what CAN frames mean.
        pdos: CANopen mappings that do.
        bus: the CAN channel to read; None reads all.
        date: column of dates beside a clock column that is a time of day.
    """

    file: str | None = None
    time: Mapped | None = None
    roles: Mapping[str, Mapped] = field(default_factory=dict)
    references: tuple[Referenced, ...] = ()
    base: str | None = None
    sparse: bool = False
    form: CsvForm = field(default_factory=CsvForm)
    dbc: tuple[Path, ...] = ()
    pdos: tuple[Pdo, ...] = ()
    bus: int | None = None
    date: str | None = None

    @property
    def is_can(self) -> bool:
        """Whether it says what CAN frames mean."""
        return bool(self.dbc or self.pdos)

    def channels(self) -> list[str]:
        """The source channels that are needed, the clock not among them, each once."""
        mapped = [*self.roles.values(), *(reference.mapped for reference in self.references)]
        return list(dict.fromkeys(one.channel for one in mapped if one.channel))


def standard_map(names: list[str]) -> ChannelMap:
    """The map of a log whose channels have ramsight's own names.

    Args:
        names: the file's channels; a reference is mapped if it is among them.
    """
    roles = {
        "speed": Mapped(MOTOR_SPEED.column, "rpm", hold=HOLD["speed"]),
        "torque": Mapped(MOTOR_TORQUE.column, "N m", hold=HOLD["torque"]),
        "temperature": Mapped(OIL_TEMPERATURE.column, "degC", hold=HOLD["temperature"]),
    }
    references = (Referenced(Mapped(REFERENCE.column, "m")),) if REFERENCE.column in names else ()
    return ChannelMap(time=Mapped(TIME, "s"), roles=roles, references=references)


def load_map(path: str | Path) -> ChannelMap:
    r"""A channel map from its TOML file.

    Args:
        path: the file.

    Raises:
        DescriptionError: it cannot be read, or says what cannot be; names file, key, value and what is allowed.

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
        table = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        text = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        said = text if isinstance(error, OSError) else f"is no TOML file: {text}"
        raise DescriptionError(said, file=file) from None
    return _read_map(_Keys(table, file), Path(path).parent, file)


def _read_map(keys: _Keys, folder: Path, file: str) -> ChannelMap:
    if keys.take("format", int, 1) != 1:
        raise keys.wrong("format", "is of a later ramsight", "1")
    time = keys.table("time")
    date = None if time is None else time.take("date", str, None)
    roles = {}
    for role in ROLES:
        part = keys.table(role)
        if part is None:
            raise DescriptionError(f"has no [{role}]; 'ramsight logs inspect' proposes one", file=file)
        roles[role] = _mapped(part, role)
    if not (roles["speed"].channel and roles["torque"].channel):
        raise DescriptionError("speed and torque need a channel, a constant is none", file=file)
    references = tuple(_referenced(part) for part in keys.tables("reference"))
    align = keys.table("align") or _Keys({}, file)
    base = align.choice("base", {"speed": "speed", "torque": "torque"}, None)
    empty = align.choice("empty", {"missing": False, "no sample": True}, False)
    align.end()
    form = _form(keys.table("csv") or _Keys({}, file))
    can = keys.table("can") or _Keys({}, file)
    named = can.take("dbc", (str, list), [])
    dbc = tuple(folder / str(name) for name in ([named] if isinstance(named, str) else named))
    pdos = tuple(_pdo(part) for part in can.tables("pdo"))
    bus = can.take("bus", int, None)
    can.end()
    keys.end()
    clock = None if time is None else _mapped(time, "time")
    return ChannelMap(file, clock, roles, references, base, bool(empty), form, dbc, pdos, bus, date)


def _mapped(keys: _Keys, role: str, *, end: bool = True) -> Mapped:
    constant = keys.quantity("constant", SI[role]) if role == "temperature" else None
    channel = keys.take("channel", str, "")
    if bool(channel) == (constant is not None):
        other = " or a constant, one of the two" if role == "temperature" else ""
        raise keys.wrong("channel", f"a channel is needed{other}", None)
    unit = keys.take("unit", str, None)
    rated = keys.quantity("rated", SI[role]) if role in ("speed", "torque") else None
    if unit is not None:
        to_si_of(unit, role, rated, file=keys.file, key=f"{keys.path}unit")
    sign = keys.take("sign", (int, float), 1)
    if sign not in (1, -1):
        raise keys.wrong("sign", "is no sign", "1 or -1")
    scale, offset = keys.take("scale", (int, float), 1.0), keys.take("offset", (int, float), 0.0)
    if scale == 0:
        raise keys.wrong("scale", "makes everything 0", "a number other than 0")
    hold = keys.quantity("hold", "s")
    if hold is not None and hold <= 0:
        raise keys.wrong("hold", "has to be longer than nothing", 'for example "0.5 s"')
    if end:
        keys.end()
    usual = HOLD.get(role, 0.5)
    held = usual if hold is None else hold
    return Mapped(channel, unit, float(sign), float(scale), float(offset), rated, held, constant)


def _referenced(keys: _Keys) -> Referenced:
    position = keys.quantity("position", "m")
    edge = keys.choice("edge", {name: name for name in EDGES}, "rising")
    mapped = _mapped(keys, "reference", end=False)
    keys.end()
    return Referenced(mapped, position, str(edge))


def _form(keys: _Keys) -> CsvForm:
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


def _pdo(keys: _Keys) -> Pdo:
    cob_id = keys.take("cob_id", int, None)
    if cob_id is None or not 0 < cob_id <= 0x1FFFFFFF:
        raise keys.wrong("cob_id", "is no identifier", "0x181 and such")
    objects = keys.take("objects", list, [])
    if not objects or not all(isinstance(one, str) for one in objects):
        raise keys.wrong("objects", "are the mapped objects, in order", '["606Ch", "6077h"] and such')
    keys.end()
    return Pdo(cob_id, tuple(objects))


def to_si_of(
    unit: str, role: str, rated: float | None, *, file: str | None = None, key: str | None = None
) -> tuple[float, float]:
    """Factor and offset from a unit to SI.

    Args:
        unit: for example ``1/min``, ``degC``, ``percent``.
        role: ``time``, ``speed``, ``torque``, ``temperature`` or ``reference``.
        rated: what 100 % is [SI], for a share.
        file: where the unit stands, for the message.
        key: its key there.

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
        if role == "temperature":
            offset = parse(f"0 {unit}", "K")
            return round(parse(f"1000 {unit}", "K") - offset, 9) / 1000.0, offset
        return parse(f"1 {unit}", SI[role]), 0.0
    except DescriptionError as error:
        hint = ""
        if rated is None and role in ("speed", "torque") and _is_share(unit):
            hint = "; a share needs what 100 % is: rated = ..."
        raise DescriptionError(f"{error.message}{hint}", file=file, key=key, value=unit) from None


def _is_share(unit: str) -> bool:
    try:
        parse(f"1 {unit}", "1")
    except DescriptionError:
        return False
    return True


class _Keys:
    """A table of TOML whose keys are taken one by one; what is left over at the end is refused."""

    def __init__(self, table: Mapping[str, Any], file: str, path: str = "") -> None:
        self.file, self.path = file, path
        self._left, self._known, self._given = dict(table), list[str](), dict(table)

    def take(self, key: str, kind: type | tuple[type, ...], default: Any) -> Any:
        """The value of a key, of this type."""
        self._known.append(key)
        value = self._left.pop(key, default)
        if key in self._given and (not isinstance(value, kind) or isinstance(value, bool)):
            kinds = kind if isinstance(kind, tuple) else (kind,)
            words = {int: "a whole number", float: "a number", str: "a text", list: "a list", dict: "a table"}
            raise self.wrong(key, "is of another kind", " or ".join(words[one] for one in kinds))
        return value

    def quantity(self, key: str, unit: str) -> float | None:
        """The value of a key in SI, written with its unit."""
        value = self.take(key, (str, int, float), None)
        if value is None:
            return None
        try:
            return parse(value, unit)
        except DescriptionError as error:
            raise self.wrong(key, error.message, None) from None

    def choice(self, key: str, choices: Mapping[str, Any], default: Any) -> Any:
        """What one of some words stands for."""
        value = self.take(key, str, None)
        if value is None:
            return default
        if value not in choices:
            raise self.wrong(key, "is none of the choices", ", ".join(choices))
        return choices[value]

    def table(self, key: str) -> _Keys | None:
        """A table under this one."""
        value = self.take(key, dict, None)
        return None if value is None else _Keys(value, self.file, f"{self.path}{key}.")

    def tables(self, key: str) -> list[_Keys]:
        """An array of tables under this one; one table is as good."""
        value = self.take(key, (dict, list), [])
        listed = [value] if isinstance(value, dict) else value
        if not all(isinstance(one, dict) for one in listed):
            raise self.wrong(key, "is of another kind", f"tables [[{key}]]")
        return [_Keys(one, self.file, f"{self.path}{key}[{k}].") for k, one in enumerate(listed)]

    def wrong(self, key: str, message: str, allowed: str | None) -> DescriptionError:
        """The error for a key."""
        return DescriptionError(
            message, file=self.file, key=f"{self.path}{key}", value=self._given.get(key), allowed=allowed
        )

    def end(self) -> None:
        """Refuse keys that nobody took."""
        for key in self._left:
            close = get_close_matches(key, self._known, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            raise DescriptionError(
                f"is not a key of a channel map{hint}",
                file=self.file,
                key=f"{self.path}{key}",
                allowed=", ".join(self._known),
            )
