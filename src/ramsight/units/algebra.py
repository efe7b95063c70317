"""Units as products of a few: factors are exact fractions until the end, dimensions are powers of base units.

The definitions are written as Pint writes its own, and a test compares what becomes of them with what Pint says.
Loading Pint itself takes as long as all the rest of a short command.
"""

from __future__ import annotations

import re
from fractions import Fraction
from functools import cache
from typing import NamedTuple

NANOSECONDS = 1e9  # in a second, as recorders count time

DEFINITIONS = """
tera- = 1e12 = T-
giga- = 1e9 = G-
mega- = 1e6 = M-
kilo- = 1e3 = k-
hecto- = 1e2 = h-
deci- = 1e-1 = d-
centi- = 1e-2 = c-
milli- = 1e-3 = m-
micro- = 1e-6 = µ- = u-
nano- = 1e-9 = n-
pico- = 1e-12 = p-
metre = [length] = m = meter
second = [time] = s = sec
kilogram = [mass] = kg
radian = [angle] = rad
kelvin = [temperature]; offset: 0 = K
ampere = [current] = A
gram = 1e-3 * kilogram = g
tonne = 1000 * kilogram = t = ton
pound = 0.45359237 * kilogram = lb
minute = 60 * second = min
hour = 3600 * second = h
day = 24 * hour = d
inch = 0.0254 * metre = in
foot = 0.3048 * metre = ft
turn = 6.283185307179586 * radian = rev = revolution
degree = 0.017453292519943295 * radian = deg
rpm = 0.10471975511965977 * radian / second
hertz = 1 / second = Hz
litre = 1e-3 * metre ** 3 = l = L = liter
cc = 1e-6 * metre ** 3
gallon = 3.785411784e-3 * metre ** 3 = gal
gpm = 6.30901964e-5 * metre ** 3 / second
lpm = 1.6666666666666667e-5 * metre ** 3 / second
newton = kilogram * metre / second ** 2 = N
lbf = 4.4482216152605 * newton
pascal = newton / metre ** 2 = Pa
bar = 1e5 * pascal
psi = 6894.757293168361 * pascal
atm = 101325 * pascal
joule = newton * metre = J
watt = joule / second = W
volt = watt / ampere = V
stokes = 1e-4 * metre ** 2 / second = St
poise = 0.1 * pascal * second
degC = kelvin; offset: 273.15
degF = 5 / 9 * kelvin; offset: 255.3722222222222
percent = 0.01
permille = 0.001
"""
"""Prefixes end in a dash; base units are a dimension in brackets; further names follow behind equals signs."""

_DIGITS = frozenset("0123456789")  # str.isdigit knows those of other scripts, too
_TOKEN = re.compile(
    r"\s*(?:(?P<number>[0-9]+\.?[0-9]*(?:e[+-]?[0-9]+)?)|(?P<name>[A-Za-zµ]+)|(?P<sign>\*\*\s*-?|[*/()]))"
)


class Known(NamedTuple):
    """A unit: ``si = number * factor + offset``."""

    factor: Fraction
    offset: Fraction  # of a temperature [K]; zero for all others
    dimension: tuple[tuple[str, Fraction], ...]  # base units and their powers, by name


def product(text: str) -> Known:
    """The unit that a product of units is, ``"kN mm**2 /s"``; what stands side by side is multiplied.

    Raises:
        ValueError: A name is no unit, or the text is no product.

    Example:
        >>> known = product("cm**3 /rev")
        >>> f"{float(known.factor):.6g}", [(name, int(power)) for name, power in known.dimension]
        ('1.59155e-07', [('[angle]', -1), ('[length]', 3)])
    """
    tokens = _tokens(text)
    found = _terms(tokens)
    if tokens:
        raise ValueError(f"not a product: {text!r}")
    return found


def _tokens(text: str) -> list[str]:
    """The text's tokens, last first; ValueError for what is none."""
    found, place = [], 0
    while place < len(text.rstrip()):
        match = _TOKEN.match(text, place)
        if match is None:
            raise ValueError(f"not a product: {text!r}")
        found.append(re.sub(r"\s", "", match[0]))
        place = match.end()
    return found[::-1]


def _terms(tokens: list[str]) -> Known:
    """What is multiplied and divided, from left to right, up to a closing bracket or the end."""
    found = _factor(tokens)
    while tokens and tokens[-1] != ")":
        divides = tokens[-1] == "/"
        if tokens[-1] in "*/":
            tokens.pop()
        found = _times(found, _factor(tokens), -1 if divides else 1)
    return found


def _factor(tokens: list[str]) -> Known:
    """A number, a unit or a bracket, and its power."""
    token = tokens.pop() if tokens else ""
    if token == "(":
        found = _terms(tokens)
        if not tokens or tokens.pop() != ")":
            raise ValueError("a bracket is open")
    elif token[:1] in _DIGITS:
        found = Known(Fraction(token), Fraction(0), ())
    else:
        found = named(token)
    if tokens and tokens[-1].startswith("**"):
        sign = -1 if tokens.pop().endswith("-") else 1
        if not tokens or tokens[-1][:1] not in _DIGITS:
            raise ValueError("a power is missing")
        found = _times(Known(Fraction(1), Fraction(0), ()), found, sign * Fraction(tokens.pop()))
    return found


def _times(one: Known, other: Known, power: Fraction | int) -> Known:
    """One times a power of another; a temperature that is multiplied is a difference of two."""
    raised = other.factor**power  # a float if the power is none of a whole number
    powers = dict(one.dimension)
    for name, of_it in other.dimension:
        powers[name] = powers.get(name, Fraction(0)) + of_it * power
    dimension = tuple(sorted((name, of_it) for name, of_it in powers.items() if of_it))
    return Known(one.factor * Fraction(raised), Fraction(0), dimension)


_PREFIXES: dict[str, Fraction] = {}
_UNITS: dict[str, Known] = {}


@cache
def named(name: str) -> Known:
    """The unit of a name, which may have a prefix, or an s behind it.

    Raises:
        ValueError: There is none.
    """
    for whole in (name, name.removesuffix("s") if len(name) > 2 else name):
        if whole in _UNITS:
            return _UNITS[whole]
        for prefix, factor in _PREFIXES.items():
            unit = _UNITS.get(whole.removeprefix(prefix)) if whole.startswith(prefix) else None
            if unit is not None and not unit.offset:
                return Known(factor * unit.factor, unit.offset, unit.dimension)
    raise ValueError(f"{name!r} is not a unit")


def _learn() -> None:
    """Take in the definitions, each of which uses those before it."""
    for line in DEFINITIONS.strip().splitlines():
        equation, _, offset = line.partition(";")
        name, value, *others = (part.strip() for part in equation.split("="))
        _, _, further = offset.rpartition(":")
        if name.endswith("-"):
            _PREFIXES.update({one.removesuffix("-"): Fraction(value) for one in (name, *others)})
            continue
        base = Known(Fraction(1), Fraction(0), ((value, Fraction(1)),))
        unit = base if value.startswith("[") else product(value)
        first, *more = further.split("=") if further else ["0"]
        unit = unit._replace(offset=Fraction(first.strip()))
        _UNITS.update(dict.fromkeys((name, *others, *(one.strip() for one in more)), unit))


_learn()
