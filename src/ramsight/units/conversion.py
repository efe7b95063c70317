"""Units, once, at the border: `"250 bar"` becomes `25e6` and back.

Inside ramsight every number is an SI float. A number with a unit exists only in files, on the command line
and in printed results. `algebra` knows the units; it is asked once per distinct unit. Angles are a dimension of their
own here, so that a pump's ``cm3/rev`` cannot be mistaken for a volume, nor a speed in rpm for a frequency.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction
from functools import cache
from numbers import Real
from typing import NamedTuple

from ramsight.errors import DescriptionError, short
from ramsight.units import algebra

__all__ = ["FREEZING", "RPM", "argument", "format_si", "name_of", "parse", "to_si"]

#: one revolution per minute [rad/s]
RPM = 2.0 * math.pi / 60.0
#: the freezing point of water, 0 °C [K]
FREEZING = 273.15

#: what a quantity is called and how one is written, by its SI unit
_KNOWN = {
    "1": ("plain number", "0.9"),
    "1/sqrt(s)": ("random walk", "1 %/sqrt(h)"),
    "N m/sqrt(s)": ("random walk of a torque", "0.01 N m/sqrt(h)"),
    "m/sqrt(m)": ("random walk over a way", "0.2 mm/sqrt(m)"),
    "1/Pa": ("compressibility", "8e-10 1/Pa"),
    "K": ("temperature", "40 degC"),
    "delta_K": ("temperature difference", "5 K"),
    "N": ("force", "129 kN"),
    "N/m": ("stiffness", "250 kN/mm"),
    "N m": ("torque", "0.5 N m"),
    "N s/m": ("viscous friction", "8.5 kN/(m/s)"),
    "Pa": ("pressure", "210 bar"),
    "W": ("power", "12 kW"),
    "J/K": ("heat capacity", "4 kJ/K"),
    "W/K": ("thermal conductance", "300 W/K"),
    "kg": ("mass", "4000 kg"),
    "kg m2": ("moment of inertia", "0.008 kg m2"),
    "kg/m3": ("density", "872 kg/m3"),
    "m": ("length", "127 mm"),
    "m/s": ("velocity", "50 mm/s"),
    "m/s2": ("acceleration", "9.81 m/s2"),
    "m2": ("area", "12668 mm2"),
    "m2/s": ("kinematic viscosity", "46 mm2/s"),
    "m3": ("volume", "0.3 l"),
    "m3/rad": ("displacement per revolution", "31.6 cm3/rev"),
    "m3/s": ("volume flow", "100 l/min"),
    "m/rad": ("travel per revolution", "0.85 mm/rev"),
    "rad": ("angle", "30 deg"),
    "rad/sqrt(s)": ("random walk of an angle", "0.05 deg/sqrt(h)"),
    "rad/s": ("angular speed", "1450 rpm"),
    "rad/s2": ("angular acceleration", "200 rad/s2"),
    "s": ("time", "20 ms"),
}

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_QUANTITY = re.compile(rf"({_NUMBER})(?![.0-9])\s*(.*)", re.DOTALL)
_RATIO = re.compile(rf"({_NUMBER})\s*[/:]\s*({_NUMBER})")
_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")
_PER_MINUTE = frozenset(
    {"1/min", "min-1", "min^-1", "1/minute", "r/min", "U/min", "RPM", "tr/min", "giri/min", "Umdr/min"}
)
# "barg", "bar(g)", "bar_g", "psig", "kPa gauge"; and the same with an a, which is what pressures are here.
_GAUGE = re.compile(r"(?P<unit>bar|mbar|psi|k?Pa|MPa)[ _]?\(?(?P<kind>[ga])(?:auge|bs|bsolute)?\)?")
_TIDY = str.maketrans(
    {"−": "-", "·": " ", "⋅": " ", "²": "2", "³": "3", "⁻": "-", "¹": "1", "μ": "µ", "\u00a0": " ", "\u202f": " "}
)
_TIDY_NUMBER = {letter: plain for letter, plain in _TIDY.items() if chr(letter) not in "¹²³"}  # no digits of a number
_UNIT = re.compile(r"(?:1\s*+/)?(?:[\s*/()]|(?:[A-Za-zµ]++(?:\s*+(?:\^|\*\*))?-?[1-9]?))*+")
_LONGEST_UNIT = 40
_LONGEST_TEXT = 1000  # letters of a quantity; a double has up to 309 digits before its point
_ROUNDED = 1e-9  # share by which a number may pass the end of a range, which was written in another unit
_ROOT = re.compile(r"\bsqrt\s*\(([^()]*)\)")
_TOKEN = re.compile(r"([A-Za-zµ]+)\s*(?:\^|\*\*)?\s*(-?[0-9]+)?")


class _Unit(NamedTuple):
    """A unit as an affine map to SI, ``si = number * factor + offset``.

    Decimals, so that a value that is written exactly is rounded once: ``"79.4 mm"`` is 0.0794.
    """

    factor: Decimal
    offset: Decimal
    dimension: tuple[tuple[str, Fraction], ...]


def _spell(unit: str) -> str:
    """Turn an engineer's spelling (``cm3/rev``, ``Nm``, ``°C``, ``%``) into a product of units."""
    text = unit.translate(_TIDY).strip().replace("°C", "degC").replace("°F", "degF").replace("°", "deg")
    text = text.replace("%", "percent").replace("‰", "permille")
    text = re.sub(r"\b([kM]?N)[.-]?m\b", r"\1 m", text)
    return _TOKEN.sub(lambda m: f"{m[1]}**{m[2]} " if m[2] else m[0], text).strip()


@cache
def _unit(unit: str) -> _Unit | None:
    """What a unit is; `None` if there is none of that name."""
    difference = unit.startswith("delta_")
    spelt = _spell(unit.removeprefix("delta_"))
    if spelt in ("", "1"):
        return _Unit(Decimal(1), Decimal(0), ())
    if len(spelt) > _LONGEST_UNIT or not _UNIT.fullmatch(spelt):
        return None
    try:
        found = algebra.product(_ROOT.sub(r"(\1)**0.5", spelt))
        factor, offset = float(found.factor), 0.0 if difference else float(found.offset)
    except (ValueError, OverflowError):
        return None
    return _Unit(Decimal(repr(factor)), Decimal(repr(offset)), found.dimension)


def _known(unit: str) -> _Unit:
    found = _unit(unit)
    if found is None:
        raise ValueError(f"{unit!r} is not a unit")
    return found


@cache
def name_of(unit: str) -> str:
    """Say what a unit measures, with an example: the tail of every error about units.

    Args:
        unit: any unit, for example ``"Pa"`` or ``"bar"``.

    Example:
        >>> name_of("bar")
        "a pressure such as '210 bar'"
    """
    if (si := si_unit(unit)) not in _KNOWN:
        return f"a quantity in {unit}"
    words, example = _KNOWN[si]
    article = "an" if words[0] in "aeiou" else "a"
    return f"{article} {words} such as {example!r}"


@cache
def si_unit(unit: str) -> str:
    """The SI unit of the same dimension, as values in it are named; the unit itself where it has no name here.

    Args:
        unit: any unit, for example ``"bar"``.

    Example:
        >>> si_unit("bar"), si_unit("mm2/s"), si_unit("%")
        ('Pa', 'm2/s', '1')
    """
    wanted, difference = _known(unit).dimension, unit.startswith("delta_")
    same = (si for si in _KNOWN if _known(si).dimension == wanted and si.startswith("delta_") == difference)
    return next(same, unit)


def to_si(number: float, unit: str) -> float:
    """Convert a number in a unit to SI.

    Args:
        number: the number, in `unit`.
        unit: a unit such as ``"bar"``; ``"degC"`` is a temperature, ``"delta_degC"`` a difference of two.

    Raises:
        ValueError: the unit is unknown (a mistake of the program, never of a file).

    Example:
        >>> to_si(210, "bar"), to_si(40, "degC"), to_si(5, "delta_degC")
        (21000000.0, 313.15, 5.0)
    """
    known = _known(unit)
    return float(Decimal(repr(float(number))) * known.factor + known.offset)


def parse(text: str | float, unit: str) -> float:
    """Read a quantity written by a person.

    Args:
        text: for example ``"250 bar"``, ``"31.6 cm3/rev"``, ``"28/41"``, or a number where no unit is needed.
        unit: any unit of the expected dimension, for example ``"Pa"``; ``"1"`` for a plain number.
            ``"K"`` expects a temperature (``"40 degC"``), ``"delta_K"`` a difference of two (``"5 K"``).

    Returns:
        The value in SI units (Pa, m3/rad, rad/s, K, …).

    Raises:
        DescriptionError: the text is no quantity, has no unit, or has the unit of something else; it names
            what is expected, with an example. File and key are added by whoever knows them.

    Example:
        >>> parse("250 bar", "Pa")
        25000000.0
        >>> round(parse("31.6 cm3/rev", "m3/rad"), 10)
        5.0293e-06
        >>> parse("40 degC", "K")
        313.15
    """
    wanted = _known(unit)
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise DescriptionError(f"expected {name_of(unit)}", value=text)
    if not isinstance(text, str):
        if wanted.dimension:
            raise DescriptionError(f"a unit is missing; expected {name_of(unit)}", value=text)
        return _finite(text, text, unit)
    if len(text) > _LONGEST_TEXT:
        raise DescriptionError(f"expected {name_of(unit)}", value=text)
    tidy = text.translate(_TIDY_NUMBER).strip()
    if not wanted.dimension and (ratio := _RATIO.fullmatch(tidy)):
        if float(ratio[2]) == 0:
            raise DescriptionError("a ratio cannot be over zero", value=text)
        return _finite(float(ratio[1]) / float(ratio[2]), text, unit)
    match = _QUANTITY.fullmatch(tidy)
    if match is None or _COMMA.match(tidy):
        comma = "; the decimal mark is a point" if _COMMA.match(tidy) else ""
        raise DescriptionError(f"expected {name_of(unit)}{comma}", value=text)
    passed = match[2].strip()
    if not passed and wanted.dimension:
        raise DescriptionError(f"a unit is missing; expected {name_of(unit)}", value=text)
    if passed in _PER_MINUTE and wanted.dimension == _known("rpm").dimension:
        passed = "rpm"
    if wanted.dimension == _known("Pa").dimension and (said := _of_gauge(passed)) is not None:
        passed = said[0]
        if said[1]:
            _refuse_gauge(text, match[1], passed)
    found = _unit(f"delta_{passed}" if unit.startswith("delta_") else passed)
    if found is None:
        what = f"{short(repr(passed))} is not a unit; expected {name_of(unit)}"
        if passed.startswith(","):
            what = f"expected {name_of(unit)}; the decimal mark is a point, and nothing parts thousands"
        raise DescriptionError(what, value=text)
    if found.dimension != wanted.dimension:
        raise DescriptionError(f"{short(repr(passed or 'no unit'))} does not fit; expected {name_of(unit)}", value=text)
    number = Decimal(
        match[1] if _finite(float(match[1]), text, unit) else "0"
    )  # decimals have no 1e-99999999999999999999
    return _finite(float(number * found.factor + found.offset), text, unit)


def _of_gauge(passed: str) -> tuple[str, bool] | None:
    """The unit of a pressure with "gauge" or "absolute", and whether it is gauge; None without either word."""
    match = _GAUGE.fullmatch(passed)
    return None if match is None else (match["unit"], match["kind"] == "g")


def _refuse_gauge(text: str, number: str, bar: str) -> None:
    """Say what to write in place of a gauge pressure.

    Raises:
        DescriptionError: always.
    """
    absolute = format_si(parse(f"{number} {bar}", "Pa") + to_si(1.0, "atm"), bar, 6)
    plain = f"{number} {bar}"
    raise DescriptionError(
        f"is a gauge pressure; write the absolute one, {absolute!r}, or {plain!r} where it is a difference: a setting "
        "above the tank's pressure, a pressure drop",
        value=text,
    )


def _finite(number: float, text: object, unit: str) -> float:
    try:
        value = float(number)  # a file may hold a whole number of four hundred digits
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise DescriptionError(f"is not finite; expected {name_of(unit)}", value=text)
    return value


def format_si(value: float, unit: str, digits: int | None = None) -> str:
    """Write an SI value in a unit that people read.

    Args:
        value: the value in SI units.
        unit: the unit to write it in, for example ``"bar"``; ``"1"`` for a plain number.
        digits: how many significant digits; without it, as many as the value has, up to twelve.

    Raises:
        ValueError: the unit is unknown (a mistake of the program, never of a file).

    Example:
        >>> format_si(25e6, "bar"), format_si(313.15, "degC"), format_si(5.0293e-6, "cm3/rev", 3)
        ('250 bar', '40 degC', '31.6 cm3/rev')
    """
    known = _known(unit)
    number = float((Decimal(repr(float(value))) - known.offset) / known.factor)
    text = f"{number:.{digits or 12}g}"
    if "e" in text and 1e-4 <= abs(number) < 1e7:
        text = f"{float(text):.0f}"
    if text in ("-0", "-0.0"):
        text = "0"
    label = unit.removeprefix("delta_")
    return text if label in ("", "1") else f"{text} {label}"


def parse_option(text: str, unit: str, option: str, *, least: str, most: str) -> float:
    """Read a quantity of the command line and hold it against its range.

    Args:
        text: the option, for example ``"441 kN"``.
        least: lowest value allowed, for example ``"0 kN"``.
        most: highest value allowed, for example ``"2000 kN"``.

    Returns:
        The value in SI units.

    Raises:
        DescriptionError: the text is no such quantity or lies outside; it names option, value and range.

    Example:
        >>> parse_option("441 kN", "N", "--load", least="-100 MN", most="100 MN")
        441000.0
    """
    allowed = f"{least} to {most}"
    try:
        value = parse(text, unit)
    except DescriptionError as error:
        raise DescriptionError(error.message, key=option, value=text, allowed=allowed) from None
    if not parse(least, unit) <= value <= parse(most, unit):
        raise DescriptionError("is out of range", key=option, value=text, allowed=allowed)
    return value


def is_real(value: object) -> bool:
    """Whether an argument is a real number; NumPy calls a duration a whole one, Python calls truth one.

    Example:
        >>> is_real(1.0), is_real(True), is_real("1")
        (True, False, False)
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    return getattr(getattr(value, "dtype", None), "kind", "") != "m"


def as_float(value: float) -> float:
    """A number as a float; infinite where no float is so large.

    Example:
        >>> as_float(10**400), as_float(3)
        (inf, 3.0)
    """
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def argument(value: str | float, unit: str, name: str, *, least: str, most: str) -> float:
    """Read an argument of a function, and hold it against its range.

    Args:
        value: an SI number, or text with a unit: ``441e3`` or ``"441 kN"``.
        least: lowest value allowed, for example ``"0 kN"``.
        most: highest value allowed, for example ``"2000 kN"``.

    Returns:
        The value in SI units.

    Raises:
        DescriptionError: it is no such quantity, or out of range; the text names argument, value and range.

    Example:
        >>> argument("120 mm", "m", "start", least="0 mm", most="790 mm"), argument(0.12, "m", "start", least="0 mm",
        ...     most="790 mm")
        (0.12, 0.12)
    """
    if isinstance(value, str):
        return parse_option(value, unit, name, least=least, most=most)
    allowed = f"{least} to {most}"
    if not is_real(value):
        wanted = name_of(unit)
        raise DescriptionError(f"expected {wanted}, or a number in {unit}", key=name, value=value, allowed=allowed)
    number = as_float(value)
    low, high = parse(least, unit), parse(most, unit)
    slack = _ROUNDED * max(abs(low), abs(high))
    if not low - slack <= number <= high + slack:  # false for NaN
        shown = f"{number:g}" if unit == "1" else f"{number:g} {unit}"
        raise DescriptionError("is out of range", key=name, value=shown, allowed=allowed)
    return number
