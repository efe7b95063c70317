"""Quantities as people write them."""

import math
import re
from fractions import Fraction
from pathlib import Path

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ramsight import units
from ramsight.errors import DescriptionError
from ramsight.units import algebra, conversion

WRITTEN = [
    ("250 bar", "Pa", 25e6), ("1 MPa", "bar", 1e6), ("-3 bar", "Pa", -3e5),
    ("31.6 cm3/rev", "m3/rad", 31.6e-6 / (2 * math.pi)), ("31.6 cm³/rev", "m3/rad", 31.6e-6 / (2 * math.pi)),
    ("1450 rpm", "rad/s", 1450 * math.pi / 30), ("1450 1/min", "rad/s", 1450 * math.pi / 30),
    ("46 mm2/s", "m2/s", 46e-6), ("46 cSt", "m2/s", 46e-6), ("40 degC", "K", 313.15), ("40 °C", "K", 313.15),
    ("104 degF", "K", 313.15), ("313.15 K", "degC", 313.15), ("5 K", "delta_K", 5.0), ("5 degC", "delta_K", 5.0),
    ("9 degF", "delta_degC", 5.0), ("28/41", "1", 28 / 41), ("8.5 kN/(m/s)", "N s/m", 8500.0),
    ("5 l/min", "m3/s", 5e-3 / 60), ("0.5 N m", "N m", 0.5), ("0.5 Nm", "N m", 0.5), ("3 kNm", "N m", 3000.0),
    ("90 %", "1", 0.9), ("127 mm", "m", 0.127), ("5 in", "m", 0.127), ("20e-9 1/Pa", "1/Pa", 20e-9),
    ("0.9 %/sqrt(h)", "1/sqrt(s)", 1.5e-4), ("1.5e-4 1/sqrt(s)", "%/sqrt(h)", 1.5e-4),
    ("0.2 mm/sqrt(m)", "m/sqrt(m)", 2e-4), ("8e-5 1/bar", "1/Pa", 8e-10), ("2 l", "m3", 2e-3),
    ("1.2 GPa", "Pa", 1.2e9), ("0.008 kg·m²", "kg m2", 0.008), ("129kN", "N", 129e3), ("1E3 m^2", "m2", 1000.0),
    (".5 m", "m", 0.5), ("−2 mm", "m", -0.002), (0.9, "1", 0.9), ("0.9", "1", 0.9), (2, "1", 2.0),
    ("5 bara", "Pa", 5e5), ("5 bar(a)", "Pa", 5e5), ("100 psia", "Pa", 689475.7293168361),
]  # fmt: skip


@pytest.mark.parametrize(("text", "unit", "si"), WRITTEN)
def test_what_engineers_write_becomes_si(text, unit, si):
    assert units.parse(text, unit) == pytest.approx(si, rel=1e-14, abs=0.0)


@pytest.mark.parametrize(
    ("text", "si"), [("127 mm", 0.127), ("0.3 l", 0.0003), ("250 bar", 25e6), ("4 bar", 4e5), ("79.4 mm", 0.0794)]
)
def test_usual_values_are_exact_to_the_last_digit(text, si):
    assert units.parse(text, {"mm": "m", "l": "m3", "bar": "Pa"}[text.split()[1]]) == si


REFUSED = [
    ("250", "Pa", "a unit is missing; expected a pressure such as '210 bar'"),
    (250, "Pa", "a unit is missing; expected a pressure such as '210 bar'"),
    ("50 cm3", "m3/rad", "expected a displacement per revolution such as '31.6 cm3/rev'"),
    ("10 Hz", "rad/s", "expected an angular speed such as '1450 rpm'"),
    ("3 bar", "m", "'bar' does not fit; expected a length such as '127 mm'"),
    ("3 bar", "1", "expected a plain number"),
    ("1,5 mm", "m", "the decimal mark is a point"),
    ("2.500,0 mm", "m", "the decimal mark is a point, and nothing parts thousands"),
    ("3 foo", "m", "'foo' is not a unit"),
    ("abc", "Pa", "expected a pressure"),
    ("", "Pa", "expected a pressure"),
    ("nan bar", "Pa", "expected a pressure"),
    ("1e999 m", "m", "not finite"),
    (math.inf, "1", "not finite"),
    (10**400, "1", "not finite"),
    (True, "1", "expected a plain number"),
    (None, "m", "expected a length"),
    (["3 m"], "m", "expected a length"),
    ("1/0", "1", "over zero"),
    ("1.2.3 m", "m", "expected a length"),
    ("2 m**9**9**9", "m", "is not a unit"),
    ("2 (((((m", "m", "is not a unit"),
    ("2 %/h", "%/sqrt(h)", "'%/h' does not fit; expected a random walk such as '1 %/sqrt(h)'"),
    ("2 1/sqrt(sqrt(s))", "%/sqrt(h)", "is not a unit"),
    ("2 1/sqrt(s", "%/sqrt(h)", "is not a unit"),
    ("5 m; import os", "m", "is not a unit"),
    ("5 " + "m" * 200, "m", "is not a unit"),
]


@pytest.mark.parametrize(("text", "unit", "words"), REFUSED)
def test_what_cannot_be_used_is_refused_with_an_example(text, unit, words):
    with pytest.raises(DescriptionError) as caught:
        units.parse(text, unit)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


SHOWN = [
    "Pa", "bar", "mm", "cm3/rev", "rpm", "degC", "l/min", "kN/(m/s)", "mm2/s", "N m", "GPa", "1", "%", "%/sqrt(h)",
    "mm/sqrt(m)", "1/Pa",
]  # fmt: skip


@given(unit=st.sampled_from(SHOWN), number=st.floats(-1e6, 1e6, allow_nan=False))
def test_a_value_survives_being_written_and_read(unit, number):
    si = units.to_si(number, unit)
    assert units.parse(units.format_si(si, unit), unit) == pytest.approx(si, rel=1e-11, abs=units.to_si(1e-9, unit))


@given(st.text(max_size=30))
def test_any_text_is_read_or_refused_in_words(text):
    try:
        assert math.isfinite(units.parse(text, "Pa"))
    except DescriptionError as error:
        said = str(error)
    else:
        return
    assert "expected a pressure such as '210 bar'" in said


@pytest.mark.parametrize("unit", list(conversion._KNOWN))
def test_every_example_in_an_error_is_itself_right(unit):
    assert units.parse(conversion._KNOWN[unit][1], unit) > 0


def test_formats():
    assert units.format_si(25e6, "bar") == "250 bar"
    assert units.format_si(123456789.0, "N", 3) == "1.23e+08 N"
    assert units.format_si(536e3, "kN", 2) == "540 kN"
    assert units.format_si(0.0, "degC", 5) == "-273.15 degC"
    assert units.format_si(-0.0, "bar") == "0 bar"
    assert units.format_si(5.0, "delta_K") == "5 K"


def test_an_unknown_unit_in_the_program_is_its_mistake():
    with pytest.raises(ValueError, match="parsec"):
        units.to_si(1.0, "parsec")


PREFIXES = (
    "", "tera", "giga", "mega", "kilo", "hecto", "deci", "centi", "milli", "micro", "nano", "pico", "k", "M", "µ",
    "u",
)  # fmt: skip
OTHERWISE = re.compile(
    "kilog|kgram|k(ilo)?kg"
)  # Pint takes kilo and gram for a new kilogram, and knows no unit after that


@pytest.fixture(scope="module")
def pints():
    """A unit's factor, offset and dimension as Pint has them, of the same definitions."""
    registry = pint.UnitRegistry(None, autoconvert_offset_to_baseunit=True)
    registry.load_definitions(algebra.DEFINITIONS.strip().splitlines())

    def of(text):
        unit = registry.parse_units(text)
        two, one = (registry.Quantity(number, unit).to_root_units().magnitude for number in (2.0, 1.0))
        offset = 2.0 * one - two
        powers = registry.Quantity(1.0, unit).dimensionality
        return two - one, offset, {name: Fraction(str(power)) for name, power in powers.items()}

    return of


def same(found, expected):
    factor, offset, dimension = expected
    assert float(found.factor) == pytest.approx(factor, rel=1e-12, abs=0.0)
    assert float(found.offset) == pytest.approx(offset, rel=1e-12, abs=1e-9 * factor)
    assert dict(found.dimension) == dimension


NAMES = sorted(algebra._UNITS)


@pytest.mark.parametrize("prefix", PREFIXES)
def test_units_with_a_prefix_are_what_pint_says(pints, prefix):
    asked = [f"{prefix}{name}" for name in NAMES if not name.startswith("deg") or name[3:] not in ("C", "F")]
    for text in asked:
        if not OTHERWISE.search(text):
            same(algebra.product(text), pints(text))


@pytest.mark.parametrize("text", ["degC", "degF", "kelvin", "K", "seconds", "bars", "litres", "ms", "min", "cc"])
def test_temperatures_and_plurals_are_what_pint_says(pints, text):
    same(algebra.product(text), pints(text))


PIECES = st.tuples(
    st.sampled_from([" ", "*", "/", " / "]),
    st.sampled_from([name for name in NAMES if not name.startswith(("deg", "kilog", "kg"))]),
    st.sampled_from(["", "", "**2", "**-1", "**0.5"]),
)


@given(pieces=st.lists(PIECES, min_size=1, max_size=4), bracket=st.booleans())
def test_products_are_what_pint_says(pints, pieces, bracket):
    text = "m"
    for sign, name, power in pieces:
        text += f"{sign}({name}{power})" if bracket else f"{sign}{name}{power}"
    same(algebra.product(text), pints(text))


@pytest.mark.parametrize(
    "text", ["", "m/", "/m", "()", "(m", "m)", "m**", "m**s", "x", "m x", "m!", "sms", "mm m k", "kdegC"]
)
def test_what_is_no_product_is_refused(text):
    with pytest.raises(ValueError, match=r"unit|product|bracket|power"):
        algebra.product(text)


def test_a_temperature_under_a_line_is_a_difference():
    assert units.parse("2 1/degC", "1/K") == 2.0
    assert units.parse("0.1 bar/degC", "Pa/K") == 1e4


@pytest.mark.parametrize(
    ("text", "absolute", "plain"),
    [
        ("4 barg", "5.01325 bar", "4 bar"), ("4 bar(g)", "5.01325 bar", "4 bar"),
        ("4 bar_g", "5.01325 bar", "4 bar"), ("4 bar gauge", "5.01325 bar", "4 bar"),
        ("0 psig", "14.6959 psi", "0 psi"), ("250 kPag", "351.325 kPa", "250 kPa"),
        ("1.5 MPa(g)", "1.60133 MPa", "1.5 MPa"),
    ],
)  # fmt: skip
def test_a_gauge_pressure_is_refused_with_what_to_write(text, absolute, plain):
    with pytest.raises(DescriptionError) as error:
        units.parse(text, "Pa")
    assert f"write the absolute one, {absolute!r}, or {plain!r} where it is a difference" in str(error.value)
    units.parse(absolute, "Pa")


@pytest.mark.parametrize(
    ("number", "shown", "text", "value"),
    [
        (r"pi / 30|30(\.0)? / (math\.|np\.)?pi|pi / 60|60(\.0)? / \(?2|0\.1047", ">>>", "rpm", units.RPM),
        (r"273\.15", r"^\s*(>>>|\(|\d)", "degC", units.FREEZING),
    ],
)
def test_a_revolution_per_minute_and_the_freezing_point_stand_in_one_place(number, shown, text, value):
    """Its other place is the table of units, where it is a definition of its own; a docstring may show it."""
    source = Path(units.__file__).parents[1]
    lines = ((file, line) for file in source.rglob("*.py") for line in file.read_text(encoding="utf-8").splitlines())
    places = {file.name for file, line in lines if re.search(number, line) and not re.search(shown, line)}
    assert places == {"algebra.py", "conversion.py"}
    assert units.to_si(1.0 if text == "rpm" else 0.0, text) == value


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("1 lb", "kg", 0.45359237), ("1 in", "m", 0.0254), ("1 psi", "Pa", 0.45359237 * 9.80665 / 0.0254**2),
        ("1 t", "kg", 1000.0), ("1 rpm", "rad/s", 2.0 * math.pi / 60.0),
    ],
)  # fmt: skip
def test_factors_are_the_defined_ones_and_not_rounded(text, unit, value):
    assert units.parse(text, unit) == pytest.approx(value, rel=1e-12)


def test_a_range_ends_where_it_ends():
    assert units.argument("10 mm", "m", "x", least="0 mm", most="10 mm") == pytest.approx(0.01)
    assert units.argument(0.01 * (1.0 + 1e-12), "m", "x", least="0 mm", most="10 mm") == pytest.approx(0.01)
    for value in ("10.01 mm", "-0.01 mm", 0.01001, -1e-5):
        with pytest.raises(DescriptionError):
            units.argument(value, "m", "x", least="0 mm", most="10 mm")
