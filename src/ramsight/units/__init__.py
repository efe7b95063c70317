"""Text with a unit, such as "250 bar", as SI numbers: read once, at the border.

`conversion` reads and writes quantities, `algebra` knows the units.
"""

from ramsight.units.conversion import (
    FREEZING,
    RPM,
    argument,
    as_float,
    format_si,
    is_real,
    name_of,
    parse,
    parse_option,
    si_unit,
    to_si,
)

__all__ = [
    "FREEZING", "RPM", "argument", "as_float", "format_si", "is_real", "name_of", "parse", "parse_option",
    "si_unit", "to_si",
]  # fmt: skip
